//! Scan of an effect that has a place and a width on the sensor: a grid of places for each width, each tested for its
//! linear parameter, then finer grids about the best.
//!
//! A score is a sum over residuals, which need not be told apart within half a width: it is taken of every place from
//! residuals summed over cells. What the base leaves of a shape is dear, and changes little from a place to the next,
//! but much from a width to the next: it is computed for the best places of each width alone.

mod cells;
mod elsewhere;
mod grid;
mod shape;

use super::candidate::{Addition, Candidate};
use super::select::Searched;
use crate::effects::{Domain, Role};
use crate::math::statistics::chi_square_ln_sf;
use crate::model::EffectRef;
use crate::null_model::NullModel;
use crate::problem::Problem;
use crate::run::RunError;
use crate::run::fit::Fit;
use grid::Grid;
use rayon::prelude::*;
use shape::{List, Shape};

/// Shares of these steps in the finer grids, each of which reaches beyond half a step of the grid before to either
/// side, about each shape of it: all are tested in one pass. The refit finds the rest of the way: the last is within a
/// twentieth of a width, where a flaw has lost less than a hundredth of its statistic.
const REFINEMENTS: [f64; 2] = [0.35, 0.12];
/// Family-wise significance above which a place is not worth refining: the coarse grid finds four fifths of the
/// statistic or more.
const WORTH_REFINING: f64 = 0.05;
/// Least share of a shape that the base must leave for a place to count.
const KEPT_SHARE: f64 = 1e-3;

/// What is scanned: an effect in each variant that its options give it (a sharp flaw, a smooth one), since variants can
/// only be told apart each at its own place.
struct Scan<'a> {
    problem: &'a Problem,
    effect: EffectRef,
    variants: Vec<Candidate>,
    /// Position of the linear parameter, of place x, place y and width.
    parameters: [usize; 4],
    /// Camera that each variant acts on; all of them where there is one alone.
    cameras: Vec<u32>,
    /// Parameters of each variant.
    values: Vec<Vec<f64>>,
    sensor: [f64; 2],
    /// Least and largest width, px.
    widths: (f64, f64),
}

/// A shape and its statistic.
type Found = (f64, Shape);

/// Puts every candidate that has a place on the sensor where it fits best; one that no place can be found for lists
/// what it needs.
pub fn place(
    fit: &Fit,
    tested: &mut Vec<(Candidate, Searched)>,
    untested: &mut Vec<Candidate>,
    threads: usize,
) -> Result<(), RunError> {
    let (scanned, others): (Vec<_>, Vec<_>) = tested.drain(..).partition(|(candidate, _)| candidate.scanned());
    *tested = others;
    if scanned.is_empty() {
        return Ok(());
    }
    let Fit { problem, solution, null_base, .. } = fit;
    let null = NullModel::sharing(null_base, problem.clone(), solution.state.clone(), Vec::new(), threads)?;
    for (mut candidate, _) in scanned {
        let best = match Scan::new(problem, &candidate) {
            Some(search) => best_places(&search, &null)?,
            None => Vec::new(),
        };
        if best.is_empty() {
            candidate.needs.push("measurements on more of the sensor".into());
            untested.push(candidate);
        }
        tested.extend(best);
    }
    Ok(())
}

/// Puts every candidate that has a place into the middle of the sensor, with a middle one of its widths: before
/// anything is measured no place fits best.
pub fn place_in_the_middle(
    fit: &Fit,
    tested: &mut Vec<(Candidate, Searched)>,
    untested: &mut Vec<Candidate>,
    threads: usize,
) -> Result<(), RunError> {
    let (scanned, others): (Vec<_>, Vec<_>) = tested.drain(..).partition(|(candidate, _)| candidate.scanned());
    *tested = others;
    let Fit { problem, solution, null_base, .. } = fit;
    for (candidate, _) in scanned {
        let Some(search) = Scan::new(problem, &candidate) else {
            untested.push(candidate);
            continue;
        };
        let null = NullModel::sharing(null_base, problem.clone(), solution.state.clone(), Vec::new(), threads)?;
        let (count, _) = Grid::new(&search, &null)?.promising(&null);
        let (least, most) = search.widths;
        let shape = Shape { variant: 0, place: search.sensor.map(|length| 0.5 * length), width: (least * most).sqrt() };
        tested.push((search.candidate(shape), Searched::Places { count, drop: 0.0, elsewhere: 1.0 }));
    }
    Ok(())
}

/// The candidate at the best place of each of its variants.
fn best_places(search: &Scan<'_>, null: &NullModel) -> Result<Vec<(Candidate, Searched)>, RunError> {
    let grid = Grid::new(search, null)?;
    let (count, peaks) = grid.promising(null);
    let shapes = peaks.iter().map(|peak| peak.shape).collect();
    let mut best = search.test(null, shapes, vec![None; search.variants.len()])?;
    let elsewhere = |shape: &Shape| peaks.iter().find(|peak| peak.shape == *shape).map_or(1.0, |peak| peak.elsewhere);
    let on_grid = |(drop, shape): &Found| Searched::Places { count, drop: *drop, elsewhere: elsewhere(shape) };
    let on_grid: Vec<Option<Searched>> = best.iter().map(|found| found.as_ref().map(on_grid)).collect();
    let worth_refining = |(statistic, _): &&Found| chi_square_ln_sf(*statistic, 1.0) + count.ln() < WORTH_REFINING.ln();
    let worth_it = best.iter().flatten().filter(worth_refining).map(|(_, shape)| *shape);
    let (mut shapes, mut about) = (Vec::new(), worth_it.collect::<Vec<Shape>>());
    for refinement in REFINEMENTS {
        about =
            null.pool().install(|| about.par_iter().flat_map_iter(|shape| grid.finer(*shape, refinement)).collect());
        shapes.extend_from_slice(&about);
    }
    if !shapes.is_empty() {
        best = search.test(null, shapes, best)?;
    }
    let found = best.into_iter().zip(on_grid).filter_map(|(found, on_grid)| Some((found?.1, on_grid?)));
    Ok(found.map(|(shape, searched)| (search.candidate(shape), searched)).collect())
}

impl<'a> Scan<'a> {
    fn new(problem: &'a Problem, candidate: &Candidate) -> Option<Self> {
        let effect = candidate.term()?.effect.clone();
        let parameters = &effect.descriptor().parameters;
        let position = |wanted: &dyn Fn(&Role) -> bool| parameters.iter().position(|p| wanted(&p.role));
        let linear = position(&|role| *role == Role::Estimated)?;
        let x = position(&|role| *role == Role::Searched(Domain::SensorX))?;
        let y = position(&|role| *role == Role::Searched(Domain::SensorY))?;
        let width = position(&|role| matches!(role, Role::Searched(Domain::SensorFraction(..))))?;
        let Role::Searched(of_width) = &parameters[width].role else { return None };
        let sensor = problem
            .image_contexts
            .iter()
            .fold([0.0f64; 2], |[w, h], image| [w.max(image.width_px), h.max(image.height_px)]);
        let count = problem.camera_names.len();
        let on_cameras = |variant: Candidate| (0..count as u32).map(move |camera| (variant.clone(), camera));
        let (variants, cameras): (Vec<Candidate>, Vec<u32>) =
            variants(candidate).into_iter().flat_map(on_cameras).unzip();
        let values_of = |variant: &Candidate| {
            let given = |name: &str| variant.term().and_then(|term| term.values.get(name).copied());
            parameters.iter().map(|p| given(p.name.as_ref()).unwrap_or(p.nominal)).collect()
        };
        let values = variants.iter().map(values_of).collect();
        let widths = of_width.bounds(sensor[0], sensor[1]);
        Some(Self {
            problem,
            variants,
            cameras,
            parameters: [linear, x, y, width],
            values,
            sensor,
            widths,
            effect: effect.clone(),
        })
    }

    /// The candidate at a place; of several cameras on one.
    fn candidate(&self, shape: Shape) -> Candidate {
        let mut candidate = self.variants[shape.variant].clone();
        let Addition::Effect(term) = &mut candidate.addition else { return candidate };
        let parameters = &self.effect.descriptor().parameters;
        let [x, y] = shape.place;
        let names = &self.problem.camera_names;
        let own = self.cameras[shape.variant] as usize;
        for (camera, of) in names.iter().enumerate() {
            let named = |k: usize| match names.len() {
                1 => parameters[k].name.to_string(),
                _ => format!("{}[{of}]", parameters[k].name),
            };
            let [linear, px, py, pw] = self.parameters;
            if camera == own {
                term.values.extend([(named(px), x), (named(py), y), (named(pw), shape.width)]);
            } else {
                term.held.extend([linear, px, py, pw].map(named));
            }
        }
        candidate
    }

    /// Tests shapes to the last digit: the best of each variant, if it is better than `best`.
    fn test(
        &self,
        null: &NullModel,
        shapes: Vec<Shape>,
        mut best: Vec<Option<Found>>,
    ) -> Result<Vec<Option<Found>>, RunError> {
        let tested = null.test_each(&List { search: self, shapes: &shapes })?;
        for (c, shape) in shapes.iter().enumerate() {
            let (information, length) = (tested.information[c], tested.length[c]);
            let statistic = tested.score[c].powi(2) / information;
            let best = &mut best[shape.variant];
            if information > KEPT_SHARE * length && best.is_none_or(|(other, _)| statistic > other) {
                *best = Some((statistic, *shape));
            }
        }
        Ok(best)
    }
}

/// The candidate with every choice of its options, the defaults first.
fn variants(candidate: &Candidate) -> Vec<Candidate> {
    let mut variants = vec![candidate.clone()];
    let Some(term) = candidate.term() else { return variants };
    for parameter in &term.effect.descriptor().parameters {
        let Role::Given(options) = &parameter.role else { continue };
        let defaults = variants.clone();
        for (_, value) in options.iter().filter(|(_, value)| *value != parameter.nominal) {
            variants.extend(defaults.iter().cloned().map(|mut variant| {
                if let Addition::Effect(term) = &mut variant.addition {
                    term.values.insert(parameter.name.to_string(), *value);
                }
                variant
            }));
        }
    }
    variants
}
