//! A fit as a small system: every candidate, and every effect that the diagnosis took in, as columns of one null model.
//!
//! Effects of the user's own model belong to the base and are taken for granted. An effect that was taken in later is a
//! column like every candidate, with a value: whatever is asked of it, it is asked by the same rule.

mod design_effects;
mod limits;
mod sets;

use super::added::Added;
use super::candidate::Candidate;
use super::catalogue;
use super::scan;
use super::select::{Known, Nature, Searched, Set, Situation, Taken};
use super::settings::Settings;
use crate::block::Block;
use crate::camera;
use crate::effects::{Role, Stage};
use crate::model::EffectTerm;
use crate::null_model::{Columns, NoColumns, NullModel, ScoreSystem, is_column};
use crate::problem::{State, ThetaEntry};
use crate::run::RunError;
use crate::run::fit::Fit;
use crate::run::squares::Surveyed;
use crate::score::design_effect::Clusters;
use crate::score::{System, random, variance_factor};
pub use limits::{WEAK_PRIOR, prior_information};
use limits::{least_information, plausible_values, prior_in_fit};
use nalgebra::{DMatrix, DVector};
use sets::Laid;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

/// A fit with everything that is asked of it.
pub struct Linearised {
    /// The null model: base, candidates, and what was taken in.
    pub null: NullModel,
    /// Its score and information, as they come.
    pub scores: ScoreSystem,
    /// The same at zero.
    pub system: System,
    zero: Zero,
    known: Known,
    /// Sets of columns.
    pub sets: Vec<Set>,
    /// Candidate of each set; `None` for what is in.
    pub candidates: Vec<Option<Candidate>>,
    /// Candidates that the block cannot test, with what they need.
    pub untested: Vec<Candidate>,
    /// What surveyed coordinates have of `v'Pv` in the fit.
    pub survey: Surveyed,
    /// Values of the columns in the fit.
    pub values: Vec<f64>,
    /// What is in.
    pub taken: Vec<Taken>,
    /// Least and largest plausible value of each column, in scaled units.
    pub plausible: Vec<Option<[f64; 2]>>,
    clusters: Clusters,
    clustered: Vec<Option<usize>>,
    design_effects: Vec<f64>,
    /// Effects of the null model's problem whose values are those of the fit or of a set: first and last of what is in.
    in_effects: Range<usize>,
    /// Further columns, behind those of the sets.
    pub extra_columns: Range<usize>,
}

/// What is asked of a fit.
pub struct Questions<'a> {
    /// Candidates, each in the variants that are tested.
    pub tested: Vec<(Candidate, Searched)>,
    /// Candidates that the block cannot test.
    pub untested: Vec<Candidate>,
    /// Further columns, behind those of all sets.
    pub extra: &'a dyn Columns,
    /// Are design effects of laws wanted? They need every image's own part of each column.
    pub clustered: bool,
}

impl Questions<'_> {
    /// Nothing.
    pub fn nothing() -> Self {
        Self { tested: Vec::new(), untested: Vec::new(), extra: &NoColumns, clustered: false }
    }
}

/// Linearises a fit with every candidate of the catalogue beside it.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn linearise(block: &Block, fit: &Fit, added: &Added, settings: &Settings<'_>) -> Result<Linearised, RunError> {
    let (mut tested, mut untested) = catalogue::candidates(block, fit, added, settings.plugins, |_| true);
    scan::place(fit, &mut tested, &mut untested, settings.options.threads)?;
    let asked = Questions { tested, untested, clustered: true, ..Questions::nothing() };
    with_candidates(block, fit, added, asked, settings)
}

/// Linearises a fit of error-free measurements, as measurements that err as stated are expected to be: nothing is left
/// over but a variance of unit weight of one.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn linearise_expected(
    block: &Block,
    fit: &Fit,
    added: &Added,
    settings: &Settings<'_>,
) -> Result<Linearised, RunError> {
    let (mut tested, mut untested) = catalogue::candidates(block, fit, added, settings.plugins, |_| true);
    scan::place_in_the_middle(fit, &mut tested, &mut untested, settings.options.threads)?;
    let asked = Questions { tested, untested, clustered: false, ..Questions::nothing() };
    let mut linearised = with_candidates(block, fit, added, asked, settings)?;
    linearised.system.score.fill(0.0);
    linearised.system.chi_square = linearised.system.redundancy;
    linearised.design_effects.fill(1.0);
    linearised.known = Known::default();
    Ok(linearised)
}

/// Linearises a fit with what was taken in alone.
pub fn without_candidates(
    block: &Block,
    fit: &Fit,
    added: &Added,
    settings: &Settings<'_>,
) -> Result<Linearised, RunError> {
    with_candidates(block, fit, added, Questions::nothing(), settings)
}

/// Linearises a fit with what is asked of it.
pub fn with_candidates(
    block: &Block,
    fit: &Fit,
    added: &Added,
    asked: Questions<'_>,
    settings: &Settings<'_>,
) -> Result<Linearised, RunError> {
    let Questions { tested, untested, extra, clustered } = asked;
    let Fit { model, problem, solution, null_base } = fit;
    let threads = settings.options.threads;
    let terms: Vec<EffectTerm> = tested.iter().filter_map(|(candidate, _)| candidate.term().cloned()).collect();
    let (mut problem, state) = problem.with_effects(block, model.datum, &terms, &solution.state)?;
    let layout = problem.layout();
    let mut laid = Laid::default();
    laid.take_in(&problem, &state, model, added);
    let taken = laid.taken();
    laid.ask(&problem, tested, model.effects.len());
    let Laid { sets, candidates, columns, mut values, .. } = laid;
    let count = columns.len() + extra.dense() + extra.local();
    let laws_in = sets[..taken.len()].iter().filter(|set| set.nature == Nature::Law);
    let columns_in = laws_in.flat_map(|set| &set.columns);
    let in_fit = columns_in.map(|column| (*column, prior_in_fit(&problem, columns[*column]))).collect::<Vec<_>>();
    for unknown in columns.iter().filter(|unknown| **unknown < layout.theta(0)) {
        problem.camera_free[unknown / 12][unknown % 12] = false;
    }
    // The base has none of them, neither as unknowns nor by their priors.
    let free = problem.camera_free.clone();
    problem.camera_priors.retain(|prior| free[prior.camera as usize][prior.parameter as usize]);
    // Errors of velocities stay unknowns of a model that has the effect which multiplies them, and so do values of
    // images that are not in the sample.
    let in_model = model.effects.len();
    let is_other = |entry: &ThetaEntry| {
        problem.effects[entry.effect as usize].role(entry) == &Role::VelocityError || !is_column(&problem, entry)
    };
    let others: Vec<bool> = problem.theta.iter().map(is_other).collect();
    for (entry, is_other) in
        problem.theta.iter_mut().zip(others).filter(|(entry, _)| entry.effect as usize >= added.own)
    {
        if is_other && (entry.effect as usize) < in_model {
            continue;
        }
        entry.free = false;
        entry.prior_sigma = None;
    }
    let mut least: Vec<f64> = columns.iter().map(|unknown| least_information(&problem, *unknown)).collect();
    let mut plausible: Vec<Option<[f64; 2]>> =
        columns.iter().map(|unknown| plausible_values(&problem, *unknown)).collect();
    plausible.resize(count, None);
    least.resize(count, 0.0);
    in_fit.iter().for_each(|(column, _)| least[*column] = 0.0);
    values.resize(count, 0.0);
    let redundancy = problem.redundancy().2 as f64;
    let null = NullModel::sharing(null_base, problem, state, columns, threads)?;
    let apart = if extra.families().is_empty() { Vec::new() } else { apart(&sets[taken.len()..]) };
    let scores = null.test_apart(extra, &apart)?;
    let zero = Zero { least, in_fit, chi_square: null.chi_square(), redundancy };
    let system = zero.of(&scores, &values);
    let extra_columns = count - (extra.dense() + extra.local())..count;
    let mut linearised = Linearised {
        clusters: Clusters { groupings: Vec::new() },
        clustered: vec![None; values.len()],
        design_effects: vec![1.0; sets.len()],
        in_effects: added.own..model.effects.len(),
        null,
        scores,
        system,
        zero,
        known: Known::default(),
        sets,
        candidates,
        untested,
        survey: Surveyed::at(&fit.problem, &fit.solution.state)?,
        values,
        plausible,
        taken,
        extra_columns,
    };
    linearised.widen(clustered, settings)?;
    Ok(linearised)
}

/// Candidates by their columns, the variants of one together: nothing is asked of two of them at once.
fn apart(asked: &[Set]) -> Vec<Range<usize>> {
    let columns = |sets: &[Set]| {
        let all = sets.iter().flat_map(|set| set.columns.iter().copied());
        let (first, last) = (all.clone().min()?, all.max()?);
        Some(first..last + 1)
    };
    asked.chunk_by(|a, b| a.id == b.id).filter_map(columns).collect()
}

/// What the system at zero is made of beside the scores.
struct Zero {
    /// See [`System::least`].
    least: Vec<f64>,
    /// Columns of the laws that are in, and the information that their priors have in the fit.
    in_fit: Vec<(usize, f64)>,
    /// `v'Pv` of the fit.
    chi_square: f64,
    /// See [`System::redundancy`].
    redundancy: f64,
}

impl Zero {
    /// Score, information and `v'Pv` where all columns are zero. What is in the fit is in, however little is known of
    /// it: with its prior, and without a limit below which it would be left out. Left out, its value would be left
    /// over.
    fn of(&self, scores: &ScoreSystem, values: &[f64]) -> System {
        let moved = times(&scores.information, values);
        let (mut information, mut length) = (scores.information.clone(), scores.length.clone());
        let by_values = DVector::from_column_slice(values);
        let score = &scores.score + &moved;
        for (column, prior) in &self.in_fit {
            let own = Arc::make_mut(&mut information);
            own[(*column, *column)] += prior;
            length[*column] = own[(*column, *column)];
        }
        System {
            chi_square: self.chi_square + 2.0 * scores.score.dot(&by_values) + by_values.dot(&moved),
            score,
            information,
            length,
            least: self.least.clone(),
            redundancy: self.redundancy,
        }
    }
}

/// `M x`. Of columns of two families there is no product: where `x` is zero none is read.
fn times(information: &DMatrix<f64>, values: &[f64]) -> DVector<f64> {
    let mut product = DVector::zeros(values.len());
    for (column, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
        product.axpy(*value, &information.column(column), 1.0);
    }
    product
}

impl Linearised {
    /// Information that the prior of each column adds beside what the fit has of it already; zero where nothing is
    /// known of it.
    pub fn prior_of_columns(&self) -> Vec<f64> {
        let mut prior = self.prior_of_refit();
        for column in self.sets.iter().filter(|set| set.nature == Nature::Law).flat_map(|set| &set.columns) {
            prior[*column] += prior_information(self.null.problem(), self.null.unknown(*column));
        }
        for (column, own) in &self.zero.in_fit {
            prior[*column] = (prior[*column] - own).max(0.0);
        }
        prior
    }

    /// Information that the prior of each column has in a refit with its set: that of effects of several coefficients
    /// is weak, one coefficient has none.
    pub fn prior_of_refit(&self) -> Vec<f64> {
        let mut prior = vec![0.0; self.values.len()];
        let first_effect = self.null.problem().layout().theta(0);
        for set in self.sets.iter().filter(|set| set.nature == Nature::Law && set.columns.len() > 1) {
            let of_effect = set.columns.iter().filter(|column| self.null.unknown(**column) >= first_effect);
            of_effect.for_each(|column| prior[*column] = WEAK_PRIOR.powi(-2));
        }
        prior
    }

    /// Stage of a set's effect; `None` for parameters of the camera.
    pub fn stage(&self, set: usize) -> Option<Stage> {
        let problem = self.null.problem();
        let unknown = self.null.unknown(*self.sets[set].columns.first()?);
        let entry = &problem.theta[unknown.checked_sub(problem.layout().theta(0))?];
        Some(problem.effects[entry.effect as usize].effect.descriptor().stage)
    }

    /// Values that each column of a set stands for, where they are a sample of the values per image.
    pub fn values_per_column(&self, set: usize) -> f64 {
        let problem = self.null.problem();
        let first = self.sets[set].columns.first().map(|column| self.null.unknown(*column));
        let Some(t) = first.and_then(|unknown| unknown.checked_sub(problem.layout().theta(0))) else { return 1.0 };
        let entry = &problem.theta[t];
        let same = |other: &&ThetaEntry| (other.effect, other.parameter) == (entry.effect, entry.parameter);
        let values = problem.theta.iter().filter(same);
        values.clone().count() as f64 / values.filter(|value| is_column(problem, value)).count() as f64
    }

    /// Name and unit of the parameter that a column changes.
    pub fn parameter(&self, column: usize) -> (String, String) {
        let problem = self.null.problem();
        let unknown = self.null.unknown(column);
        let Some(t) = unknown.checked_sub(problem.layout().theta(0)) else {
            return (problem.unknown_name(unknown), camera::UNITS[unknown % camera::PARAMETER_COUNT].to_string());
        };
        let entry = &problem.theta[t];
        let descriptor = problem.effects[entry.effect as usize].effect.descriptor();
        let name = entry.name.strip_prefix(&format!("{}.", descriptor.id)).unwrap_or(&entry.name);
        (name.to_string(), descriptor.parameters[entry.parameter as usize].unit.to_string())
    }

    /// What the tests see.
    pub fn situation(&self, settings: &Settings<'_>) -> Situation<'_> {
        Situation {
            system: &self.system,
            known: &self.known,
            sets: &self.sets,
            values: &self.values,
            plausible: &self.plausible,
            clusters: &self.clusters,
            clustered: &self.clustered,
            design_effects: &self.design_effects,
            taken: self.taken.clone(),
            ln_level: self.ln_level(settings.significance),
        }
    }

    /// Number of candidates of the catalogue, in or not: so many tests are made together.
    pub fn family(&self) -> usize {
        let ids: BTreeSet<&str> = self.sets.iter().map(|set| set.id.as_str()).collect();
        ids.len().max(1)
    }

    /// Logarithm of the level of a single test: family-wise over the candidates of the catalogue.
    pub fn ln_level(&self, significance: f64) -> f64 {
        (significance / self.family() as f64).ln()
    }

    /// Values of all columns when the sets of `situation` are fitted together.
    pub fn solution(&self, situation: &Situation<'_>) -> Vec<f64> {
        let (fixed, random) = situation.parts_in();
        let system = self.system.beside::<Vec<usize>>(&[], &random);
        let laws = system.pivoted_in_turn(&fixed);
        let mut values = vec![0.0; self.values.len()];
        for (column, value) in laws.kept.iter().zip(laws.estimate().iter()) {
            values[*column] = *value;
        }
        let chance: Vec<(usize, f64)> = random
            .iter()
            .filter(|set| set.variance > 0.0)
            .flat_map(|set| set.columns.iter().map(|column| (*column, 1.0 / set.variance)))
            .collect();
        let n = chance.len();
        let mut own = DMatrix::from_fn(n, n, |i, j| self.system.information[(chance[i].0, chance[j].0)]);
        (0..n).for_each(|i| own[(i, i)] += chance[i].1);
        let laws = times(&self.system.information, &values);
        let right = DVector::from_fn(n, |i, _| self.system.score[chance[i].0] - laws[chance[i].0]);
        if let Some(factor) = own.cholesky() {
            for ((column, _), value) in chance.iter().zip(factor.solve(&right).iter()) {
                values[*column] = *value;
            }
        }
        values
    }

    /// Where everything goes when the columns take these values. Places and lags stay: far from where they are, what
    /// they do is not linear.
    pub fn moved(&self, values: &[f64]) -> State {
        let problem = self.null.problem();
        let theta = problem.layout().theta(0);
        let searched = |column: usize| {
            self.null.unknown(column).checked_sub(theta).is_some_and(|t| {
                let entry = &problem.theta[t];
                let parameters = &problem.effects[entry.effect as usize].effect.descriptor().parameters;
                matches!(parameters[entry.parameter as usize].role, Role::Searched(_))
            })
        };
        let of_effects = 0..self.extra_columns.start;
        let change = of_effects.map(|c| if searched(c) { 0.0 } else { values[c] - self.values[c] });
        self.null.moved(&self.scores, &change.collect::<Vec<f64>>())
    }

    /// Variance of chance values of largest likelihood beside what else is in, in units of the variance of unit
    /// weight and of their columns squared.
    pub fn variance(&self, situation: &Situation<'_>, set: usize) -> f64 {
        let with = situation.beside();
        let phi = variance_factor(with.chi_square, with.redundancy);
        let beside = situation.without(&self.sets[set].id).beside();
        let values = random::values(&beside, &self.sets[set].columns);
        values.and_then(|values| values.likeliest_ratio(phi)).unwrap_or(0.0)
    }

    /// Raw value of a column per scaled unit.
    pub fn unit(&self, column: usize) -> f64 {
        self.null.units()[column]
    }

    /// Effects of the null model's problem that are in the fit and were not the user's own.
    pub fn in_effects(&self) -> Range<usize> {
        self.in_effects.clone()
    }
}
