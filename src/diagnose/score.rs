//! The score test of every candidate at the converged base model, without refitting: one profile serves them all.

use super::augmented::{augmented, in_domain};
use super::candidate::Candidate;
use super::design_effect::design_effect;
use super::power::noncentrality;
use super::random;
use crate::adjust::AdjustError;
use crate::adjust::native::EFFECT_DOMAIN;
use crate::adjust::native::score::{Column, Profile, profile};
use crate::block::Block;
use crate::effects::Stage;
use crate::math::statistics::f_ln_sf;
use crate::model::{EffectTerm, Model, PRIOR_KEY};
use crate::problem::{Problem, ProblemError, State};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use std::collections::BTreeMap;

/// Directions of which the base model leaves less than this share (squared length) are rounding and nonlinearity of the base: dropped. Found
/// where score and refit part (see the catalogue's notes).
const KEPT_SHARE: f64 = 1e-5;

/// The same for a candidate of a single column, which would otherwise not be tested at all: its rows are projected one by one, so that rounding
/// is far below, and a size that the score misses by nonlinearity the refit corrects.
const KEPT_SHARE_ALONE: f64 = 1e-7;

/// Squared correlation of two candidates' columns above which this block cannot tell them apart: correlation 0.9.
pub const INSEPARABLE: f64 = 0.9;

/// Standard deviation, in typical sizes, of the prior that holds directions of an effect that the base absorbs: no effect of this size is met,
/// and what the measurements determine to a typical size moves by a thousandth.
const WEAK_PRIOR: f64 = 30.0;

/// Estimated size of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Value, in `unit`.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// Unit.
    pub unit: String,
}

/// What the score test says of one candidate.
#[derive(Debug, Clone)]
pub struct Score {
    /// The candidate; searched parameters at the best place.
    pub candidate: Candidate,
    /// `s' M^-1 s` over the kept directions, for unit weight.
    pub drop: f64,
    /// The predicted drop of `v'Pv` in a refit: `drop`, less what the refit's weak prior keeps back ([`Score::start_term`]).
    pub predicted: f64,
    /// Test statistic: `drop / dof` over the estimated variance factor, and over the design effect.
    pub statistic: f64,
    /// Directions that the base leaves.
    pub dof: f64,
    /// Natural logarithm of the p-value, corrected for a scan.
    pub ln_p: f64,
    /// Factor by which measurements of an image that err together inflate the variance of the score; 1 where there is no sign of it.
    pub design_effect: f64,
    /// Estimated parameters by name.
    pub estimates: BTreeMap<String, Estimate>,
    /// Smallest size that this block shows with 80 % power, for candidates of one parameter, in its unit.
    pub detectable: Option<f64>,
    /// Share of the columns that the base leaves (the largest direction).
    pub kept_share: f64,
    /// Columns in the profile, and their estimated values there (scaled).
    columns: Vec<usize>,
    values: DVector<f64>,
    /// Basis of the kept directions times the inverse roots of their eigenvalues: whitens this candidate's scores.
    whitening: DMatrix<f64>,
}

impl Score {
    /// The p-value; zero below the smallest double.
    pub fn p_value(&self) -> f64 {
        self.ln_p.exp()
    }

    /// The term that a refit starts from: the candidate's, at the estimated values.
    pub fn start_term(&self) -> Option<EffectTerm> {
        let mut term = self.candidate.term()?.clone();
        if self.dof < self.columns.len() as f64 && !self.candidate.random() {
            // Directions that the block does not determine would leave the refit singular.
            term.values.insert(PRIOR_KEY.to_string(), WEAK_PRIOR);
        }
        for (name, estimate) in &self.estimates {
            term.values.entry(name.clone()).or_insert(estimate.value);
        }
        Some(term)
    }
}

/// Scores of all testable candidates of one base model, and what they share.
pub struct Screening {
    /// One per testable candidate, by rising `ln_p`.
    pub scores: Vec<Score>,
    /// Candidates that the block cannot test.
    pub untested: Vec<Candidate>,
    /// Correlation of scores: `correlation[i][j]` of `scores[i]`'s estimated effect as `scores[j]` sees it.
    pub correlation: Vec<Vec<f64>>,
    /// State of the base with each score's effect taken in to first order.
    pub moved: Vec<State>,
    /// Problem with every candidate in it, for predictions at `moved`.
    pub problem: Problem,
    /// Drop and degrees of freedom of all candidates that bear on GNSS positions, together.
    pub explained_positions: (f64, f64),
    /// The same for control coordinates.
    pub explained_control: (f64, f64),
}

/// What a screening needs besides candidates.
pub struct Base<'a> {
    /// The block, outliers left out.
    pub block: &'a Block,
    /// The base model.
    pub model: &'a Model,
    /// Its problem.
    pub problem: &'a Problem,
    /// Its solution.
    pub state: &'a State,
    /// Threads.
    pub threads: usize,
    /// Family-wise significance level.
    pub significance: f64,
}

/// Why a screening failed.
#[derive(Debug, thiserror::Error)]
pub enum ScreenError {
    /// The base cannot be linearised.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
    /// A candidate does not fit the block.
    #[error(transparent)]
    Problem(#[from] ProblemError),
}

/// What a scan did to find the place of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scan {
    /// Places of its grid, each a test.
    pub places: f64,
    /// The largest of their statistics: what is tested. Finer grids about the best place find a larger one, and that without counted tests.
    pub drop: f64,
}

/// Tests every candidate; `scans` by id of the scanned ones.
pub fn screen(
    base: &Base<'_>,
    candidates: Vec<Candidate>,
    scans: &BTreeMap<String, Scan>,
) -> Result<Screening, ScreenError> {
    let mut candidates = candidates;
    for candidate in candidates.iter_mut().filter(|candidate| candidate.testable() && !in_domain(base, candidate)) {
        candidate.needs.push("every measured point inside the effect's domain".into());
    }
    let (tested, untested): (Vec<_>, Vec<_>) = candidates.into_iter().partition(Candidate::testable);
    let (problem, state, owner) = augmented(base, &tested)?;
    let column_of = |unknown: usize| match owner.get(&unknown) {
        Some(c) if tested[*c].random() || !tested[*c].physical => Column::Coarse,
        Some(_) => Column::Refined,
        None => Column::Base,
    };
    let profile = profile(&problem, &state, base.threads, &column_of)?;
    let redundancy = base.problem.redundancy().2 as f64;
    let mut columns = vec![Vec::new(); tested.len()];
    for (column, unknown) in profile.unknowns.iter().enumerate() {
        if let Some(owner) = owner.get(unknown) {
            columns[*owner].push(column);
        }
    }
    let tests = tested.len() as f64;
    let mut scores: Vec<Score> = Vec::with_capacity(tested.len());
    for (candidate, columns) in tested.into_iter().zip(columns) {
        let scan = scans.get(&candidate.id).copied();
        let at = At { base, problem: &problem, profile: &profile, redundancy, tests, scan };
        scores.push(if candidate.random() {
            random::score(&at, candidate, columns)
        } else {
            linear(&at, candidate, columns)
        });
    }
    scores.sort_by(|a, b| a.ln_p.total_cmp(&b.ln_p).then_with(|| b.drop.total_cmp(&a.drop)));
    let of_stages = |stages: &[Stage]| {
        let own = |score: &&Score| {
            score.candidate.term().is_some_and(|term| stages.contains(&term.effect.descriptor().stage))
        };
        let columns: Vec<usize> = scores.iter().filter(own).flat_map(|score| score.columns.iter().copied()).collect();
        joint_drop(&profile, &columns)
    };
    let explained_positions = of_stages(&[Stage::Position, Stage::Exposure, Stage::Control]);
    let explained_control = of_stages(&[Stage::Control]);
    let correlation = scores.iter().map(|a| scores.iter().map(|b| seen_by(&profile, a, b)).collect()).collect();
    let moved = scores.iter().map(|score| profile.moved(&state, &score.columns, &score.values)).collect();
    Ok(Screening { scores, untested, correlation, moved, problem, explained_positions, explained_control })
}

/// What one test sees.
pub(super) struct At<'a> {
    pub base: &'a Base<'a>,
    pub problem: &'a Problem,
    pub profile: &'a Profile<'a>,
    pub redundancy: f64,
    /// Candidates tested.
    pub tests: f64,
    /// The scan that found its place.
    pub scan: Option<Scan>,
}

/// Rows and columns of a matrix.
pub(super) fn block_of(matrix: &DMatrix<f64>, columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(columns.len(), columns.len(), |i, j| matrix[(columns[i], columns[j])])
}

/// Drop that all these columns together would bring, and its degrees of freedom.
fn joint_drop(profile: &Profile<'_>, columns: &[usize]) -> (f64, f64) {
    if columns.is_empty() {
        return (0.0, 0.0);
    }
    let eigen = SymmetricEigen::new(block_of(&profile.information, columns));
    let score = DVector::from_fn(columns.len(), |i, _| profile.score[columns[i]]);
    let mut joint = (0.0, 0.0);
    for (k, eigenvalue) in eigen.eigenvalues.iter().enumerate().filter(|(_, l)| **l > KEPT_SHARE) {
        joint.0 += eigen.eigenvectors.column(k).dot(&score).powi(2) / eigenvalue;
        joint.1 += 1.0;
    }
    joint
}

fn linear(at: &At<'_>, candidate: Candidate, columns: Vec<usize>) -> Score {
    let information = block_of(&at.profile.information, &columns);
    let score = DVector::from_fn(columns.len(), |i, _| at.profile.score[columns[i]]);
    let eigen = SymmetricEigen::new(information);
    let least = match columns.as_slice() {
        [column] => KEPT_SHARE_ALONE.max(least_of_domain(at, *column)),
        _ => KEPT_SHARE,
    };
    let kept: Vec<usize> = (0..columns.len()).filter(|k| eigen.eigenvalues[*k] > least).collect();
    let kept_share = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let whitening = DMatrix::from_fn(columns.len(), kept.len(), |i, k| {
        eigen.eigenvectors[(i, kept[k])] / eigen.eigenvalues[kept[k]].sqrt()
    });
    let white = whitening.transpose() * &score;
    let drop = white.norm_squared();
    let values = &whitening * &white;
    let covariance = &whitening * whitening.transpose();
    let dof = kept.len() as f64;
    let held_weakly = kept.len() < columns.len() && candidate.term().is_some();
    let predicted = if held_weakly { drop_with_prior(at, &columns, &score).unwrap_or(drop) } else { drop };
    let rest = at.redundancy - dof;
    let factor = (at.profile.chi_square - drop) / rest;
    let design_effect = design_effect(at.profile, &columns, &whitening, &values);
    let Scan { places, drop: found } = at.scan.unwrap_or(Scan { places: 1.0, drop });
    let statistic = if dof > 0.0 { drop.min(found) / dof / factor / design_effect } else { 0.0 };
    let ln_one = if dof > 0.0 { f_ln_sf(statistic, dof, rest) } else { 0.0 };
    let mut estimates = BTreeMap::new();
    let unit_sigma = (factor * design_effect).sqrt();
    for (i, column) in columns.iter().enumerate() {
        let (name, unit) = name_and_unit(at.problem, at.profile.unknowns[*column]);
        let value = values[i] * at.profile.unit[*column];
        let sigma = covariance[(i, i)].sqrt() * at.profile.unit[*column] * unit_sigma;
        estimates.insert(name, Estimate { value, sigma, unit });
    }
    let level = at.base.significance / at.tests / places;
    let detectable = (columns.len() == 1 && kept.len() == 1).then(|| {
        noncentrality(level, 1.0).sqrt() * covariance[(0, 0)].sqrt() * at.profile.unit[columns[0]] * unit_sigma
    });
    Score {
        candidate,
        drop,
        predicted,
        statistic,
        dof,
        ln_p: correct_for_scan(ln_one, places),
        design_effect,
        estimates,
        detectable,
        kept_share,
        columns,
        values,
        whitening,
    }
}

/// Information (scaled) of a column whose parameter would be known to no better than its domain: a refit calls it undetermined.
fn least_of_domain(at: &At<'_>, column: usize) -> f64 {
    let first = at.problem.layout().theta(0);
    let entry = at.profile.unknowns[column].checked_sub(first).map(|t| &at.problem.theta[t]);
    entry.map_or(0.0, |entry| (at.profile.unit[column] / (EFFECT_DOMAIN * entry.scale)).powi(2))
}

/// `s' (M + P)^-1 s` with the weak prior `P` of a refit, over all directions: the drop that such a refit brings.
fn drop_with_prior(at: &At<'_>, columns: &[usize], score: &DVector<f64>) -> Option<f64> {
    let mut information = block_of(&at.profile.information, columns);
    let first = at.problem.layout().theta(0);
    for (i, column) in columns.iter().enumerate() {
        let entry = &at.problem.theta[at.profile.unknowns[*column].checked_sub(first)?];
        information[(i, i)] += (at.profile.unit[*column] / (WEAK_PRIOR * entry.scale)).powi(2);
    }
    Some(score.dot(&information.cholesky()?.solve(score)))
}

impl Score {
    /// A score of a variance component.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn of_random(
        candidate: Candidate,
        columns: Vec<usize>,
        values: DVector<f64>,
        drop: f64,
        statistic: f64,
        ln_p: f64,
        estimates: BTreeMap<String, Estimate>,
        detectable: Option<f64>,
    ) -> Self {
        let n = columns.len();
        Self {
            candidate,
            drop,
            predicted: drop,
            statistic,
            dof: 1.0,
            ln_p,
            design_effect: 1.0,
            estimates,
            detectable,
            kept_share: 1.0,
            columns,
            values,
            whitening: DMatrix::identity(n, n),
        }
    }
}

/// p-value of the best of `places` places, by Šidák's formula, in logarithms.
fn correct_for_scan(ln_p: f64, places: f64) -> f64 {
    if places <= 1.0 {
        return ln_p;
    }
    // 1 - (1 - p)^n; for tiny p this is n p to rounding.
    let small = ln_p + places.ln();
    if small < -20.0 { small } else { (-(places * (-ln_p.exp()).ln_1p()).exp_m1()).ln() }
}

/// Name of the parameter (with its instance) of an unknown, and its unit.
pub(super) fn name_and_unit(problem: &Problem, unknown: usize) -> (String, String) {
    let layout = problem.layout();
    if unknown < layout.theta(0) {
        return (problem.unknown_name(unknown), crate::camera::UNITS[unknown % 12].to_string());
    }
    let entry = &problem.theta[unknown - layout.theta(0)];
    let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
    let name = entry.name.strip_prefix(&format!("{}.", descriptor.id)).unwrap_or(&entry.name);
    (name.to_string(), descriptor.parameters[entry.parameter as usize].unit.to_string())
}

/// Correlation between the estimated effect of `a` and what `b` can take of it: the root of the share of `a`'s predicted drop that `b` alone would
/// bring if `a` were the truth.
fn seen_by(profile: &Profile<'_>, a: &Score, b: &Score) -> f64 {
    let truth = &a.values;
    let length: f64 = (truth.transpose() * block_of(&profile.information, &a.columns) * truth)[(0, 0)];
    if length <= 0.0 || b.columns.is_empty() {
        return 0.0;
    }
    let cross =
        DMatrix::from_fn(b.columns.len(), a.columns.len(), |i, j| profile.information[(b.columns[i], a.columns[j])]);
    let seen = (b.whitening.transpose() * cross * truth).norm_squared();
    (seen / length).sqrt().min(1.0)
}
