//! A fit as a small system: every candidate, and every effect that the diagnosis took in, as columns of one null model.
//!
//! Effects of the user's own model belong to the base and are taken for granted. An effect that was taken in later is a column like every
//! candidate, with a value: whatever is asked of it, it is asked by the same rule.

use super::candidate::{Addition, Candidate};
use super::catalogue;
use super::fit::{DiagnoseError, Fit};
use super::improve::Settings;
use super::scan::{self, Places};
use super::select::{Nature, Searched, Set, Situation, Taken};
use super::test::design_effect::{ClusterOfValues, Clusters, of_values};
use super::test::{System, random};
use crate::adjust::native::null_model::{
    Columns, GROUPINGS, ImageCell, ImageCells, NoColumns, NullModel, Parts, ScoreSystem,
};
use crate::block::Block;
use crate::effects::Role;
use crate::model::EffectTerm;
use crate::problem::{Problem, State};
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What the diagnosis took into a model, beside the user's own effects.
#[derive(Debug, Clone, Default)]
pub struct Added {
    /// Effects that are the user's own: the first so many of the model.
    pub own: usize,
    /// Groups of camera parameters that were set free, with the values that they were held at, by camera.
    pub freed: BTreeMap<String, Vec<(usize, Vec<f64>)>>,
    /// Effects that were searched over the sensor, with the number of places.
    pub placed: BTreeMap<String, f64>,
}

/// A fit with everything that is asked of it.
pub struct Linearised {
    /// The null model: base, candidates, and what was taken in.
    pub null: NullModel,
    /// Its score and information, as they come.
    pub scores: ScoreSystem,
    /// The same at zero.
    pub system: System,
    /// Sets of columns.
    pub sets: Vec<Set>,
    /// Candidate of each set; `None` for what is in.
    pub candidates: Vec<Option<Candidate>>,
    /// Candidates that the block cannot test, with what they need.
    pub untested: Vec<Candidate>,
    /// Values of the columns in the fit.
    pub values: Vec<f64>,
    /// What is in.
    pub taken: Vec<Taken>,
    plausible: Vec<Option<[f64; 2]>>,
    clusters: Clusters,
    clustered: Vec<Option<usize>>,
    design_effects: Vec<f64>,
    /// Effects of the null model's problem whose values are those of the fit or of a set: first and last of what is in.
    in_effects: std::ops::Range<usize>,
    /// Further columns, behind those of the sets.
    pub extra_columns: std::ops::Range<usize>,
    elsewhere: usize,
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
    /// Candidates of the same family that are asked elsewhere.
    pub elsewhere: usize,
}

impl Questions<'_> {
    /// Nothing.
    pub fn nothing() -> Self {
        Self { tested: Vec::new(), untested: Vec::new(), extra: &NoColumns, clustered: false, elsewhere: 0 }
    }
}

/// Linearises a fit with every candidate of the catalogue beside it; `fields`: empirical fields, too, which may not enter; `known`: candidates
/// whose place on the sensor need not be searched.
pub fn linearise(
    block: &Block,
    fit: &Fit,
    added: &Added,
    fields: bool,
    known: &Places,
    settings: &Settings<'_>,
) -> Result<Linearised, DiagnoseError> {
    let (mut tested, mut untested) = catalogue::candidates(block, fit, added, settings.plugins);
    let all = tested.len();
    tested.retain(|(candidate, _)| fields || candidate.physical);
    let elsewhere = all - tested.len();
    scan::place(fit, &mut tested, &mut untested, known, settings.options.threads)?;
    let asked = Questions { tested, untested, clustered: true, elsewhere, ..Questions::nothing() };
    with_candidates(block, fit, added, asked, settings)
}

/// Linearises a fit with what was taken in alone.
pub fn without_candidates(
    block: &Block,
    fit: &Fit,
    added: &Added,
    settings: &Settings<'_>,
) -> Result<Linearised, DiagnoseError> {
    with_candidates(block, fit, added, Questions::nothing(), settings)
}

/// Linearises a fit with what is asked of it.
pub fn with_candidates(
    block: &Block,
    fit: &Fit,
    added: &Added,
    asked: Questions<'_>,
    settings: &Settings<'_>,
) -> Result<Linearised, DiagnoseError> {
    let Questions { tested, untested, extra, clustered, elsewhere } = asked;
    let Fit { model, problem, solution } = fit;
    let threads = settings.options.threads;
    let terms: Vec<EffectTerm> = tested.iter().filter_map(|(candidate, _)| candidate.term().cloned()).collect();
    let (mut problem, state) = problem.with_effects(block, model.datum, &terms, &solution.state)?;
    let layout = problem.layout();
    let mut sets = Vec::new();
    let mut candidates = Vec::new();
    let mut columns: Vec<usize> = Vec::new();
    let mut values: Vec<f64> = Vec::new();
    let mut variances = Vec::new();
    let first_candidate = model.effects.len();
    let of_effect = |problem: &Problem, effect: usize, held_searched: bool| -> Vec<usize> {
        let column = |(_, entry): &(usize, &crate::problem::ThetaEntry)| {
            let parameters = &problem.effects[entry.effect as usize].effect.descriptor().parameters;
            let searched = matches!(parameters[entry.parameter as usize].role, Role::Searched(_));
            entry.effect as usize == effect && entry.free && !(held_searched && searched)
        };
        problem.theta.iter().enumerate().filter(column).map(|(t, _)| t).collect()
    };
    let nature_of = |term: &EffectTerm| {
        let random = |p: &crate::effects::Parameter| matches!(p.role, Role::Random(_));
        if term.effect.descriptor().parameters.iter().any(random) { Nature::Chance } else { Nature::Law }
    };
    // What is in, first.
    for (effect, term) in model.effects.iter().enumerate().skip(added.own) {
        let thetas = of_effect(&problem, effect, false);
        let nature = nature_of(term);
        let own = columns.len()..columns.len() + thetas.len();
        for t in thetas {
            let entry = &problem.theta[t];
            let role = &term.effect.descriptor().parameters[entry.parameter as usize].role;
            let nominal = if matches!(role, Role::Searched(_)) { state.theta[t] } else { entry.prior_mean };
            values.push((state.theta[t] - nominal) / entry.scale);
            variances.push((entry.prior_sigma.unwrap_or(0.0) / entry.scale).powi(2));
            columns.push(layout.theta(t));
        }
        let id = term.effect.descriptor().id.to_string();
        let physical = term.effect.descriptor().kind == crate::effects::Kind::Physical;
        let search = added.placed.get(&id).map_or(Searched::None, |count| Searched::Placed { count: *count });
        sets.push(Set { id, columns: own.collect(), nature, physical, search });
        candidates.push(None);
    }
    for (id, held) in &added.freed {
        let first = columns.len();
        for (k, at) in held {
            for (camera, at) in at.iter().enumerate() {
                if problem.camera_free[camera][*k] {
                    columns.push(layout.camera(camera, *k));
                    values.push((state.interiors[camera][*k] - at) / problem.camera_scales[camera][*k]);
                    variances.push(0.0);
                }
            }
        }
        let columns = (first..columns.len()).collect();
        sets.push(Set { id: id.clone(), columns, nature: Nature::Law, physical: true, search: Searched::None });
        candidates.push(None);
    }
    let taken: Vec<Taken> = sets
        .iter()
        .enumerate()
        .map(|(set, own)| {
            let variance = own.columns.first().map_or(0.0, |c| variances[*c]);
            Taken { set, variance, removable: true }
        })
        .collect();
    let mut effect = first_candidate;
    for (candidate, search) in tested {
        let first = columns.len();
        let nature = match &candidate.addition {
            Addition::Effect(term) => {
                columns.extend(of_effect(&problem, effect, true).into_iter().map(|t| layout.theta(t)));
                effect += 1;
                nature_of(term)
            }
            Addition::Free(indices) => {
                let cameras = 0..problem.camera_free.len();
                let used = |camera: &usize| {
                    let context = |image: usize| problem.image_contexts[image].camera as usize == *camera;
                    (0..problem.pose_free.len()).any(|i| context(i) && problem.pose_free[i] != [false; 6])
                };
                columns.extend(cameras.filter(used).flat_map(|c| indices.iter().map(move |k| layout.camera(c, *k))));
                Nature::Law
            }
        };
        values.resize(columns.len(), 0.0);
        sets.push(Set {
            id: candidate.id.clone(),
            columns: (first..columns.len()).collect(),
            nature,
            physical: candidate.physical,
            search,
        });
        candidates.push(Some(candidate));
    }
    for unknown in columns.iter().filter(|unknown| **unknown < layout.theta(0)) {
        problem.camera_free[unknown / 12][unknown % 12] = false;
    }
    // The base has none of them, neither as unknowns nor by their priors.
    for entry in problem.theta.iter_mut().filter(|entry| entry.effect as usize >= added.own) {
        entry.free = false;
        entry.prior_sigma = None;
    }
    let mut least: Vec<f64> = columns.iter().map(|unknown| least_information(&problem, *unknown)).collect();
    let count = columns.len() + extra.dense() + extra.local();
    let mut plausible: Vec<Option<[f64; 2]>> =
        columns.iter().map(|unknown| plausible_values(&problem, *unknown)).collect();
    plausible.resize(count, None);
    least.resize(count, 0.0);
    values.resize(count, 0.0);
    let redundancy = problem.redundancy().2 as f64;
    let null = NullModel::new(problem, state, columns, threads)?;
    let scores = null.test(extra)?;
    let system = at_zero(&scores, &values, &least, null.chi_square(), redundancy);
    let extra_columns = count - (extra.dense() + extra.local())..count;
    let mut linearised = Linearised {
        clusters: Clusters { parts: Vec::new() },
        clustered: vec![None; values.len()],
        design_effects: vec![1.0; sets.len()],
        in_effects: added.own..first_candidate,
        null,
        scores,
        system,
        sets,
        candidates,
        untested,
        values,
        plausible,
        taken,
        extra_columns,
        elsewhere,
    };
    linearised.widen(clustered, settings)?;
    Ok(linearised)
}

impl Linearised {
    /// Design effects, which make a p-value larger and never smaller: of what would be significant without, and of what is in.
    fn widen(&mut self, laws: bool, settings: &Settings<'_>) -> Result<(), DiagnoseError> {
        let situation = self.situation(settings, &BTreeSet::new());
        let beside = situation.beside();
        let asked = |set: usize| {
            situation.has(&self.sets[set].id)
                || situation.judge(set, &beside).is_some_and(|judged| judged.ln_p < situation.ln_level)
        };
        let wanted = |nature: Nature| -> Vec<usize> {
            (0..self.sets.len()).filter(|set| self.sets[*set].nature == nature && asked(*set)).collect()
        };
        let values = (laws || self.extra_columns.is_empty()) && !wanted(Nature::Chance).is_empty();
        let laws = if laws { wanted(Nature::Law) } else { Vec::new() };
        let columns: Vec<usize> = laws.into_iter().flat_map(|set| self.sets[set].columns.iter().copied()).collect();
        if values {
            self.design_effects =
                design_effects(&self.null, &self.sets, self.null.chi_square() / self.system.redundancy);
        }
        if columns.is_empty() {
            return Ok(());
        }
        // Let go, so that what is changed need not be copied.
        self.system.information = Arc::default();
        let Parts { columns, mut parts } = self.null.parts(&mut self.scores, &columns)?;
        columns.iter().enumerate().for_each(|(position, column)| self.clustered[*column] = Some(position));
        // Surveyed coordinates are no cluster: each is a measurement of its own.
        parts.pop();
        self.clusters = Clusters { parts };
        let System { least, redundancy, .. } = &self.system;
        self.system = at_zero(&self.scores, &self.values, least, self.null.chi_square(), *redundancy);
        Ok(())
    }
}

/// Design effect of every set of values per image; one for laws.
fn design_effects(null: &NullModel, sets: &[Set], variance: f64) -> Vec<f64> {
    let images = null.image_cells();
    let of = |set: &Set| {
        if set.nature == Nature::Law {
            return 1.0;
        }
        let own = |image: &ImageCells, grouping: usize| {
            let is_own = |position: &usize| set.columns.binary_search(&image.columns[*position]).is_ok();
            let rows: Vec<usize> = (0..image.columns.len()).filter(is_own).collect();
            let among = |matrix: &DMatrix<f64>| matrix.select_rows(&rows).select_columns(&rows);
            let own = |cell: &ImageCell| ClusterOfValues {
                score: cell.score.select_rows(&rows),
                information: among(&cell.information),
                covariance: among(&cell.covariance),
            };
            if rows.is_empty() { Vec::new() } else { image.groupings[grouping].iter().map(own).collect() }
        };
        let grouped = |grouping| of_values(images.iter().map(|image| own(image, grouping)), variance);
        (0..GROUPINGS).map(grouped).fold(1.0, f64::max)
    };
    sets.iter().map(of).collect()
}

/// Score, information and `v'Pv` where all columns are zero.
fn at_zero(scores: &ScoreSystem, values: &[f64], least: &[f64], chi_square: f64, redundancy: f64) -> System {
    let values = DVector::from_column_slice(values);
    let moved = &*scores.information * &values;
    System {
        chi_square: chi_square + 2.0 * scores.score.dot(&values) + values.dot(&moved),
        score: &scores.score + moved,
        information: scores.information.clone(),
        length: scores.length.clone(),
        least: least.to_vec(),
        redundancy,
    }
}

/// Information (unit weight, scaled units) below which a parameter is known to no better than what is plausible of it, or where nothing is said
/// of that, than its domain.
fn least_information(problem: &Problem, unknown: usize) -> f64 {
    let layout = problem.layout();
    if let Some((camera, k)) = layout.camera_parameter(unknown) {
        return (problem.camera_scales[camera][k] / problem.camera_domains[camera][k]).powi(2);
    }
    let entry = &problem.theta[unknown - layout.theta(0)];
    let parameter = &problem.effects[entry.effect as usize].effect.descriptor().parameters[entry.parameter as usize];
    match (&parameter.role, plausible_values(problem, unknown)) {
        (Role::Estimated, Some([min, max])) => (max - min).recip().powi(2),
        (Role::Estimated, None) => crate::adjust::native::EFFECT_DOMAIN.powi(-2),
        _ => 0.0,
    }
}

/// What is plausible of a parameter, scaled units.
fn plausible_values(problem: &Problem, unknown: usize) -> Option<[f64; 2]> {
    let entry = &problem.theta[unknown.checked_sub(problem.layout().theta(0))?];
    let parameter = &problem.effects[entry.effect as usize].effect.descriptor().parameters[entry.parameter as usize];
    let plausible = parameter.plausible.as_ref()?;
    // Both are stated for the same sensor, and the scale is the typical size on this one.
    let typical = parameter.typical.abs();
    Some([plausible.min / typical, plausible.max / typical])
}

impl Linearised {
    /// Is a set one that was put at a place on the sensor?
    pub fn is_placed(&self, set: usize) -> bool {
        matches!(self.sets[set].search, Searched::Places { .. })
    }

    /// The candidates that were.
    pub fn places(&self) -> Places {
        let placed = (0..self.sets.len()).filter(|set| self.is_placed(*set));
        placed.filter_map(|set| Some((self.candidates[set].clone()?, self.sets[set].search))).collect()
    }

    /// What the rules see.
    pub fn situation(&self, settings: &Settings<'_>, refused: &BTreeSet<String>) -> Situation<'_> {
        Situation {
            system: &self.system,
            sets: &self.sets,
            values: &self.values,
            plausible: &self.plausible,
            clusters: &self.clusters,
            clustered: &self.clustered,
            design_effects: &self.design_effects,
            taken: self.taken.clone(),
            ln_level: self.ln_level(settings.significance),
            refused: refused.clone(),
        }
    }

    /// Logarithm of the level of a single test: family-wise over the candidates of the catalogue, in or not.
    pub fn ln_level(&self, significance: f64) -> f64 {
        let ids: BTreeSet<&str> = self.sets.iter().map(|set| set.id.as_str()).collect();
        (significance / (ids.len() + self.elsewhere).max(1) as f64).ln()
    }

    /// Values of all columns when the sets of `situation` are fitted together.
    pub fn solution(&self, situation: &Situation<'_>) -> Vec<f64> {
        let (fixed, random) = situation.parts_in();
        let system = self.system.beside(&[], &random);
        let laws = system.pivoted(&fixed);
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
        let laws: DVector<f64> = &*self.system.information * DVector::from_column_slice(&values);
        let right = DVector::from_fn(n, |i, _| self.system.score[chance[i].0] - laws[chance[i].0]);
        if let Some(factor) = own.cholesky() {
            for ((column, _), value) in chance.iter().zip(factor.solve(&right).iter()) {
                values[*column] = *value;
            }
        }
        values
    }

    /// Where everything goes when the columns take these values. Places and lags stay: far from where they are, what they do is not linear.
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

    /// Variance of chance values of largest likelihood beside what else is in, in the units of their columns squared.
    pub fn variance(&self, situation: &Situation<'_>, set: usize) -> f64 {
        let without = situation.without(&self.sets[set].id);
        let beside = without.beside();
        let judged = random::test(&beside, &self.sets[set].columns, self.design_effects[set], situation.ln_level);
        let unit = judged.map_or(1.0, |component| component.variance);
        random::estimate(&beside, &self.sets[set].columns, unit, 0.0)
    }

    /// Raw value of a column per scaled unit.
    pub fn unit(&self, column: usize) -> f64 {
        self.null.units()[column]
    }

    /// Effects of the null model's problem that are in the fit and were not the user's own.
    pub fn in_effects(&self) -> std::ops::Range<usize> {
        self.in_effects.clone()
    }
}
