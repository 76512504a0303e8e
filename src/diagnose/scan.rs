//! Scan of an effect that has a place and a width on the sensor: a grid of places for each width, each tested for its linear parameter, then
//! finer grids about the best.
//!
//! A score is a sum over residuals, which need not be told apart within half a width: it is taken of every place from residuals summed over
//! cells. What the base leaves of a shape is dear, and is computed for the best places of each width alone.

use super::candidate::{Addition, Candidate};
use super::cells::{Cells, Residual};
use super::fit::{DiagnoseError, Fit};
use super::select::Searched;
use crate::adjust::native::null_model::{Columns, Entries, Measured, NullModel};
use crate::effects::{Context, Domain, Role};
use crate::math::statistics::chi_square_ln_sf;
use crate::measure::Predictor;
use crate::model::EffectRef;
use crate::problem::{ImageObservation, Problem};
use rayon::prelude::*;

/// Ratio of neighbouring widths: shapes of widths 1 and 1.5 correlate by 0.9.
const WIDTH_STEP: f64 = 1.5;
/// Distance of neighbouring places, in widths: at half of it from the next place a flaw keeps four fifths of its statistic.
const PLACE_STEP: f64 = 0.8;
/// Shares of these steps in the finer grids, each of which reaches beyond half a step of the grid before to either side. The refit finds the
/// rest of the way: the last is within a twentieth of a width, where a flaw has lost less than a hundredth of its statistic.
const REFINEMENTS: [f64; 2] = [0.35, 0.12];
/// Family-wise significance above which a place is not worth refining: the coarse grid finds four fifths of the statistic or more.
const WORTH_REFINING: f64 = 0.05;
/// Steps of a finer grid to either side: the best is surrounded, and the next grid goes on from there.
const FINE_STEPS: i32 = 1;
/// Beyond this many widths a shape is cut off, for speed: what is left correlates with the whole by 0.998 or more, sharp or smooth.
const REACH: f64 = 2.0;
/// Least share of a shape that the base must leave for a place to count.
const KEPT_SHARE: f64 = 1e-3;
/// Places of each width that are tested to the last digit: the best and all about it.
const TESTED: usize = 9;

/// What is scanned: an effect in each variant that its options give it (a sharp flaw, a smooth one), since variants can only be told apart each
/// at its own place.
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

/// A variant at a place and a width, px.
#[derive(Debug, Clone, Copy)]
struct Shape {
    variant: usize,
    place: [f64; 2],
    width: f64,
}

/// A shape and its statistic.
type Found = (f64, Shape);

/// Candidates at places that were found on the sensor, each in its variants.
pub type Places = Vec<(Candidate, Searched)>;

/// Puts every candidate that has a place on the sensor where it fits best, or where it is `known` to; one that no place can be found for lists
/// what it needs.
pub fn place(
    fit: &Fit,
    tested: &mut Vec<(Candidate, Searched)>,
    untested: &mut Vec<Candidate>,
    known: &Places,
    threads: usize,
) -> Result<(), DiagnoseError> {
    let is_known = |candidate: &Candidate| known.iter().any(|(known, _)| known.id == candidate.id);
    let (scanned, others): (Vec<_>, Vec<_>) = tested.drain(..).partition(|(candidate, _)| candidate.scanned());
    *tested = others;
    let (at_their_places, scanned): (Vec<_>, Vec<_>) =
        scanned.into_iter().partition(|(candidate, _)| is_known(candidate));
    let wanted = |(known, _): &&(Candidate, Searched)| at_their_places.iter().any(|(own, _)| own.id == known.id);
    tested.extend(known.iter().filter(wanted).cloned());
    if scanned.is_empty() {
        return Ok(());
    }
    let Fit { problem, solution, .. } = fit;
    let null = NullModel::new(problem.clone(), solution.state.clone(), Vec::new(), threads)?;
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

/// The candidate at the best place of each of its variants.
fn best_places(search: &Scan<'_>, null: &NullModel) -> Result<Vec<(Candidate, Searched)>, DiagnoseError> {
    let (places, shapes) = search.promising(null)?;
    let mut best = search.test(null, shapes, vec![None; search.variants.len()])?;
    let on_grid: Vec<Option<f64>> = best.iter().map(|found| found.map(|(statistic, _)| statistic)).collect();
    let worth_refining =
        |(statistic, _): &&Found| chi_square_ln_sf(*statistic, 1.0) + places.ln() < WORTH_REFINING.ln();
    for refinement in REFINEMENTS {
        let shapes: Vec<Shape> =
            best.iter().flatten().filter(worth_refining).flat_map(|(_, shape)| shape.about(refinement)).collect();
        best = search.test(null, shapes, best)?;
    }
    let found = best.into_iter().zip(on_grid).filter_map(|(found, on_grid)| Some((found?.1, on_grid?)));
    Ok(found.map(|(shape, drop)| (search.candidate(shape), Searched::Places { count: places, drop })).collect())
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

    /// Number of places of the grid that measurements reach, and the best of every variant and width by `s^2 / B'PB`.
    fn promising(&self, null: &NullModel) -> Result<(f64, Vec<Shape>), DiagnoseError> {
        let widths = std::iter::successors(Some(self.widths.0), |width| Some(width * WIDTH_STEP));
        let widths: Vec<f64> = widths.take_while(|width| *width <= self.widths.1).collect();
        let (problem, state) = (null.problem(), null.state());
        let predictor = Predictor::new(problem, state).map_err(crate::adjust::AdjustError::from)?;
        let residuals = residuals(problem, state, &predictor);
        let cells = |width: &f64| Cells::new(self.problem, &residuals, &self.effect, *width);
        let cells: Vec<Cells> = null.pool().install(|| widths.par_iter().map(cells).collect());
        let levels: Vec<(usize, usize)> =
            (0..self.variants.len()).flat_map(|variant| (0..widths.len()).map(move |level| (variant, level))).collect();
        let ranked = null.pool().install(|| -> Vec<Vec<Found>> {
            levels.par_iter().map(|(variant, level)| self.rank(*variant, widths[*level], &cells[*level])).collect()
        });
        let places = ranked.iter().map(|level| level.len() as f64).sum();
        let best = ranked.into_iter().flat_map(|mut level| {
            level.sort_by(|(a, _), (b, _)| b.total_cmp(a));
            level.truncate(TESTED);
            level.into_iter().map(|(_, shape)| shape)
        });
        Ok((places, best.collect()))
    }

    /// `s^2 / B'PB` of every place of one width.
    fn rank(&self, variant: usize, width: f64, cells: &Cells) -> Vec<Found> {
        let count = self.sensor.map(|length| (length / (PLACE_STEP * width)).ceil().max(1.0) as usize);
        let step = [0, 1].map(|k| self.sensor[k] / count[k] as f64);
        let reach = REACH * width;
        let mut sums = vec![[0.0; 2]; count[0] * count[1]];
        let mut moves = Moves::new(self);
        for cell in cells.iter() {
            let predicted = cell.predicted;
            let range = |k: usize| {
                let first = ((predicted[k] - reach) / step[k] - 0.5).ceil().max(0.0) as usize;
                let last = ((predicted[k] + reach) / step[k] - 0.5).floor();
                first..if last < 0.0 { first } else { (last as usize + 1).min(count[k]) }
            };
            for j in range(1) {
                for i in range(0) {
                    let place = [(i as f64 + 0.5) * step[0], (j as f64 + 0.5) * step[1]];
                    let shape = Shape { variant, place, width };
                    let Some([x, y]) = moves.of(cell.observation, cell.predicted, cell.interior, &shape) else {
                        continue;
                    };
                    let [score, length] = &mut sums[j * count[0] + i];
                    *score += x * cell.pull[0] + y * cell.pull[1];
                    *length += cell.weight * (x * x + y * y);
                }
            }
        }
        let place = |k: usize| [((k % count[0]) as f64 + 0.5) * step[0], ((k / count[0]) as f64 + 0.5) * step[1]];
        let reached = sums.iter().enumerate().filter(|(_, [_, length])| *length > 0.0);
        reached.map(|(k, [s, length])| (s * s / length, Shape { variant, place: place(k), width })).collect()
    }

    /// Tests shapes to the last digit: the best of each variant, if it is better than `best`.
    fn test(
        &self,
        null: &NullModel,
        shapes: Vec<Shape>,
        mut best: Vec<Option<Found>>,
    ) -> Result<Vec<Option<Found>>, DiagnoseError> {
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

/// Every image measurement that can be predicted; at a state that was linearised that is each.
fn residuals<'p>(
    problem: &'p Problem,
    state: &crate::problem::State,
    predictor: &'p Predictor<'_>,
) -> Vec<Residual<'p>> {
    let mut residuals = Vec::with_capacity(problem.observations.len());
    for (j, point) in state.points.iter().enumerate() {
        for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let (image, observed) = (observation.image as usize, [observation.x, observation.y]);
            let Some((predicted, _)) = predictor.image_point(image, observed, point) else { continue };
            let weight = observation.inverse_sigma.powi(2);
            let pull = [0, 1].map(|k| (observed[k] - predicted[k]) * weight);
            residuals.push(Residual { observation, predicted, interior: predictor.interior(image), pull, weight });
        }
    }
    residuals
}

/// Moves that shapes of a search make; its buffers are reused.
struct Moves<'a> {
    search: &'a Scan<'a>,
    values: Vec<f64>,
    d_theta: Vec<f64>,
}

impl<'a> Moves<'a> {
    fn new(search: &'a Scan<'a>) -> Self {
        let count = search.effect.descriptor().parameters.len();
        Self { search, values: vec![0.0; count], d_theta: vec![0.0; 2 * count] }
    }

    /// Derivative of the image point by the linear parameter; `None` where the shape does not reach.
    fn of(
        &mut self,
        observation: &ImageObservation,
        predicted: [f64; 2],
        interior: &[f64; 12],
        shape: &Shape,
    ) -> Option<[f64; 2]> {
        let search = self.search;
        let (x, y) = (predicted[0] - shape.place[0], predicted[1] - shape.place[1]);
        let reach = REACH * shape.width;
        let image = &search.problem.image_contexts[observation.image as usize];
        if x * x + y * y > reach * reach || image.camera != search.cameras[shape.variant] {
            return None;
        }
        let context = Context {
            block: &search.problem.block_context,
            image,
            column_px: observation.x,
            row_px: observation.y,
            surveyed: None,
        };
        let mut input = [0.0; 14];
        input[..2].copy_from_slice(&predicted);
        input[2..].copy_from_slice(interior);
        let [linear, px, py, pw] = search.parameters;
        self.values.copy_from_slice(&search.values[shape.variant]);
        (self.values[px], self.values[py], self.values[pw]) = (shape.place[0], shape.place[1], shape.width);
        let mut moved = [0.0; 2];
        search.effect.eval(&context, &input, &self.values, &mut moved, None, Some(&mut self.d_theta)).ok()?;
        let d = [self.d_theta[linear], self.d_theta[self.values.len() + linear]];
        (d != [0.0; 2]).then_some(d)
    }
}

/// Shapes of a search as columns.
struct List<'a> {
    search: &'a Scan<'a>,
    shapes: &'a [Shape],
}

impl Columns for List<'_> {
    fn dense(&self) -> usize {
        0
    }

    fn local(&self) -> usize {
        self.shapes.len()
    }

    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        let mut moves = Moves::new(self.search);
        for (column, shape) in self.shapes.iter().enumerate() {
            if let Some(d) = moves.of(measured.observation, measured.predicted, measured.interior, shape) {
                x.local(column, d[0]);
                y.local(column, d[1]);
            }
        }
    }
}

impl Shape {
    /// Finer places and widths about a shape.
    fn about(self, refinement: f64) -> Vec<Shape> {
        let steps = || -FINE_STEPS..=FINE_STEPS;
        let step = PLACE_STEP * self.width * refinement;
        let mut shapes = Vec::new();
        for k in steps() {
            let width = self.width * WIDTH_STEP.powf(f64::from(k) * refinement);
            for j in steps() {
                for i in steps() {
                    let place = [self.place[0] + f64::from(i) * step, self.place[1] + f64::from(j) * step];
                    shapes.push(Shape { place, width, ..self });
                }
            }
        }
        shapes
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
