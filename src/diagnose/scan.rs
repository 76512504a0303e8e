//! Scan of an effect that has a place and a width on the sensor: a grid of places for each width, each tested for its linear parameter, then
//! finer grids about the best.

use super::candidate::{Addition, Candidate};
use super::score::{Base, Scan, ScreenError};
use crate::adjust::native::scan::{Shapes, scan};
use crate::effects::{Context, Domain, Role};
use crate::math::statistics::chi_square_ln_sf;
use crate::model::EffectRef;
use crate::problem::{ImageObservation, Problem};

/// Ratio of neighbouring widths: shapes of widths 1 and 1.5 correlate by 0.9.
const WIDTH_STEP: f64 = 1.5;
/// Distance of neighbouring places, in widths: at half of it from the next place a flaw keeps four fifths of its statistic.
const PLACE_STEP: f64 = 0.8;
/// Shares of these steps in the finer grids, which reach half a step of the grid before to either side.
const REFINEMENTS: [f64; 2] = [0.25, 0.0625];
/// Family-wise significance above which a place is not worth refining: the coarse grid finds four fifths of the statistic or more.
const WORTH_REFINING: f64 = 0.05;
/// Steps of a finer grid to either side.
const FINE_STEPS: i32 = 2;
/// Beyond this many widths a shape is cut off, for speed: what is left correlates with the whole by 0.998 or more, sharp or smooth.
const REACH: f64 = 2.0;
/// Least share of a shape that the base must leave for a place to count.
const KEPT_SHARE: f64 = 1e-3;

/// Grid of places and widths.
struct Grid<'a> {
    problem: &'a Problem,
    effect: EffectRef,
    /// Position of the linear parameter, of place x, place y and width.
    parameters: [usize; 4],
    defaults: Vec<f64>,
    levels: Vec<Level>,
}

/// Places of one width.
struct Level {
    width: f64,
    /// The first place.
    origin: [f64; 2],
    step: [f64; 2],
    columns: usize,
    rows: usize,
    /// Number of the first place.
    first: usize,
}

/// A place and a width, px.
#[derive(Clone, Copy)]
struct Shape {
    place: [f64; 2],
    width: f64,
}

impl Level {
    fn place(&self, i: usize, j: usize) -> [f64; 2] {
        [self.origin[0] + i as f64 * self.step[0], self.origin[1] + j as f64 * self.step[1]]
    }
}

impl Grid<'_> {
    fn shape(&self, column: usize) -> Shape {
        let level = self.levels.iter().rev().find(|level| level.first <= column).unwrap_or(&self.levels[0]);
        let k = column - level.first;
        Shape { place: level.place(k % level.columns, k / level.columns), width: level.width }
    }

    /// The candidate at a place.
    fn at(&self, shape: Shape, candidate: &Candidate) -> Candidate {
        let mut candidate = candidate.clone();
        if let Addition::Effect(term) = &mut candidate.addition {
            let parameters = &self.effect.descriptor().parameters;
            let named = |k: usize| parameters[k].name.to_string();
            let [_, px, py, pw] = self.parameters;
            let [x, y] = shape.place;
            term.values.extend([(named(px), x), (named(py), y), (named(pw), shape.width)]);
        }
        candidate
    }
}

impl Shapes for Grid<'_> {
    fn count(&self) -> usize {
        self.levels.last().map_or(0, |level| level.first + level.columns * level.rows)
    }

    fn touch(
        &self,
        observation: &ImageObservation,
        predicted: [f64; 2],
        interior: &[f64; 12],
        out: &mut Vec<(u32, f64, f64)>,
    ) {
        let context = Context {
            block: &self.problem.block_context,
            image: &self.problem.image_contexts[observation.image as usize],
            column_px: observation.x,
            row_px: observation.y,
        };
        let mut input = [0.0; 14];
        input[..2].copy_from_slice(&predicted);
        input[2..].copy_from_slice(interior);
        let mut theta = self.defaults.clone();
        let [linear, px, py, pw] = self.parameters;
        let mut d_theta = vec![0.0; 2 * theta.len()];
        let mut moved = [0.0; 2];
        for level in &self.levels {
            let reach = REACH * level.width;
            let range = |k: usize, count: usize| {
                let first = ((predicted[k] - reach - level.origin[k]) / level.step[k]).ceil().max(0.0) as usize;
                let last = ((predicted[k] + reach - level.origin[k]) / level.step[k]).floor();
                first..if last < 0.0 { first } else { (last as usize + 1).min(count) }
            };
            for j in range(1, level.rows) {
                for i in range(0, level.columns) {
                    let [x, y] = level.place(i, j);
                    if (x - predicted[0]).hypot(y - predicted[1]) > reach {
                        continue;
                    }
                    (theta[px], theta[py], theta[pw]) = (x, y, level.width);
                    let ok = self.effect.eval(&context, &input, &theta, &mut moved, None, Some(&mut d_theta)).is_ok();
                    let (dx, dy) = (d_theta[linear], d_theta[theta.len() + linear]);
                    if ok && (dx != 0.0 || dy != 0.0) {
                        out.push(((level.first + j * level.columns + i) as u32, dx, dy));
                    }
                }
            }
        }
    }
}

/// The scanned candidate at its best place.
pub struct Best {
    /// The candidate with its searched parameters there.
    pub candidate: Candidate,
    /// What its significance is to be taken from.
    pub scan: Scan,
}

/// Scans a candidate in each variant that its options give it (a sharp flaw, a smooth one), since variants can only be told apart each at its
/// own place. `None` where it has no grid or no place can be tested.
pub fn best_place(base: &Base<'_>, candidate: &Candidate) -> Result<Option<Best>, ScreenError> {
    let mut best: Option<(f64, Candidate)> = None;
    let mut whole = Scan { places: 0.0, drop: 0.0 };
    for variant in variants(candidate) {
        let Some(mut grid) = grid(base.problem, &variant) else { continue };
        let (places, mut place) = best_of(base, &grid)?;
        whole.places += places;
        whole.drop = place.map_or(whole.drop, |(statistic, _)| whole.drop.max(statistic));
        for refinement in REFINEMENTS {
            let Some((statistic, shape)) = place else { break };
            if chi_square_ln_sf(statistic, 1.0) + places.ln() > WORTH_REFINING.ln() {
                break;
            }
            grid.levels = levels_about(shape, refinement);
            place = best_of(base, &grid)?.1.filter(|(finer, _)| *finer > statistic).or(place);
        }
        let Some((statistic, shape)) = place else { continue };
        if best.as_ref().is_none_or(|(other, _)| statistic > *other) {
            best = Some((statistic, grid.at(shape, &variant)));
        }
    }
    Ok(best.map(|(_, candidate)| Best { candidate, scan: whole }))
}

/// Number of places of a grid that can be tested, and the best with its statistic.
fn best_of(base: &Base<'_>, grid: &Grid<'_>) -> Result<(f64, Option<(f64, Shape)>), ScreenError> {
    let scanned = scan(base.problem, base.state, base.threads, grid)?;
    let tested = scanned.iter().enumerate().filter(|(_, s)| s.length > 0.0 && s.information > KEPT_SHARE * s.length);
    let tested: Vec<(f64, usize)> = tested.map(|(k, s)| (s.score.powi(2) / s.information, k)).collect();
    let best = tested.iter().max_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok((tested.len() as f64, best.map(|(statistic, k)| (*statistic, grid.shape(*k)))))
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

/// Finer places and widths about a shape.
fn levels_about(shape: Shape, refinement: f64) -> Vec<Level> {
    let count = (2 * FINE_STEPS + 1) as usize;
    let level = |(number, k): (usize, i32)| {
        let width = shape.width * WIDTH_STEP.powf(f64::from(k) * refinement);
        let step = PLACE_STEP * shape.width * refinement;
        let origin = shape.place.map(|centre| centre - f64::from(FINE_STEPS) * step);
        Level { width, origin, step: [step; 2], columns: count, rows: count, first: number * count * count }
    };
    (-FINE_STEPS..=FINE_STEPS).enumerate().map(level).collect()
}

/// The grid of a candidate over the whole sensor.
fn grid<'a>(problem: &'a Problem, candidate: &Candidate) -> Option<Grid<'a>> {
    let term = candidate.term()?;
    let effect = term.effect.clone();
    let parameters = &effect.descriptor().parameters;
    let position = |wanted: &dyn Fn(&Role) -> bool| parameters.iter().position(|p| wanted(&p.role));
    let linear = position(&|role| *role == Role::Estimated)?;
    let x = position(&|role| *role == Role::Searched(Domain::SensorX))?;
    let y = position(&|role| *role == Role::Searched(Domain::SensorY))?;
    let width = position(&|role| matches!(role, Role::Searched(Domain::SensorFraction(..))))?;
    let Role::Searched(Domain::SensorFraction(least, most)) = parameters[width].role else { return None };
    let (w, h) =
        problem.image_contexts.iter().fold((0.0f64, 0.0f64), |(w, h), c| (w.max(c.width_px), h.max(c.height_px)));
    let half_diagonal = 0.5 * w.hypot(h);
    let mut levels = Vec::new();
    let mut first = 0;
    let mut size = least * half_diagonal;
    while size <= most * half_diagonal {
        let columns = (w / (PLACE_STEP * size)).ceil().max(1.0) as usize;
        let rows = (h / (PLACE_STEP * size)).ceil().max(1.0) as usize;
        let step = [w / columns as f64, h / rows as f64];
        levels.push(Level { width: size, origin: step.map(|step| 0.5 * step), step, columns, rows, first });
        first += columns * rows;
        size *= WIDTH_STEP;
    }
    let defaults = parameters.iter().map(|p| *term.values.get(p.name.as_ref()).unwrap_or(&p.nominal)).collect();
    Some(Grid { problem, effect, parameters: [linear, x, y, width], defaults, levels })
}
