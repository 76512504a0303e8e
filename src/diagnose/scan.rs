//! Scan of an effect that has a place and a width on the sensor: a grid of places for each width, each tested for its linear parameter.

use super::candidate::{Addition, Candidate};
use super::score::{Base, ScreenError};
use crate::adjust::native::scan::{Shapes, scan};
use crate::effects::{Context, Domain, Role};
use crate::model::EffectRef;
use crate::problem::{ImageObservation, Problem};

/// Ratio of neighbouring widths: shapes of widths 1 and 1.5 correlate by 0.9.
const WIDTH_STEP: f64 = 1.5;
/// Distance of neighbouring places, in widths: at half of it from the next place a flaw keeps four fifths of its statistic.
const PLACE_STEP: f64 = 0.8;
/// Beyond this many widths a shape is below a thousandth of its height (`exp(-2.7^2)`).
const REACH: f64 = 2.7;
/// Least share of a shape that the base must leave for a place to count.
const KEPT_SHARE: f64 = 1e-3;

/// Grid of places and widths.
struct Grid<'a> {
    problem: &'a Problem,
    effect: EffectRef,
    /// Position of the linear parameter, of place x, place y and width.
    parameters: [usize; 4],
    defaults: Vec<f64>,
    /// `(width, step, columns, rows, first column)` per width.
    levels: Vec<Level>,
}

struct Level {
    width: f64,
    step: [f64; 2],
    columns: usize,
    rows: usize,
    first: usize,
}

impl Grid<'_> {
    fn place(&self, level: &Level, i: usize, j: usize) -> [f64; 2] {
        [(i as f64 + 0.5) * level.step[0], (j as f64 + 0.5) * level.step[1]]
    }

    /// Place and width of a column.
    fn shape(&self, column: usize) -> ([f64; 2], f64) {
        let level = self.levels.iter().rev().find(|level| level.first <= column).unwrap_or(&self.levels[0]);
        let k = column - level.first;
        (self.place(level, k % level.columns, k / level.columns), level.width)
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
            let range = |centre: f64, step: f64, count: usize| {
                let first = ((centre - reach) / step - 0.5).ceil().max(0.0) as usize;
                let last = ((centre + reach) / step - 0.5).floor();
                first..if last < 0.0 { first } else { (last as usize + 1).min(count) }
            };
            for j in range(predicted[1], level.step[1], level.rows) {
                for i in range(predicted[0], level.step[0], level.columns) {
                    let [x, y] = self.place(level, i, j);
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

/// The scanned candidate at its best place, and the number of places that were tried.
pub struct Best {
    /// The candidate with its searched parameters at the best place.
    pub candidate: Candidate,
    /// Places tried.
    pub places: f64,
}

/// Scans a candidate. `None` where it has no grid or no place can be tested.
pub fn best_place(base: &Base<'_>, candidate: &Candidate) -> Result<Option<Best>, ScreenError> {
    let Some(grid) = grid(base.problem, candidate) else { return Ok(None) };
    let scanned = scan(base.problem, base.state, base.threads, &grid)?;
    let tested = scanned.iter().enumerate().filter(|(_, s)| s.length > 0.0 && s.information > KEPT_SHARE * s.length);
    let statistic = |column: usize| scanned[column].score.powi(2) / scanned[column].information;
    let tested: Vec<usize> = tested.map(|(column, _)| column).collect();
    let Some(best) = tested.iter().copied().max_by(|a, b| statistic(*a).total_cmp(&statistic(*b))) else {
        return Ok(None);
    };
    let ([x, y], width) = grid.shape(best);
    let mut candidate = candidate.clone();
    if let Addition::Effect(term) = &mut candidate.addition {
        let parameters = &term.effect.descriptor().parameters;
        let named = |k: usize| parameters[k].name.to_string();
        let [_, px, py, pw] = grid.parameters;
        let values = [(named(px), x), (named(py), y), (named(pw), width)];
        term.values.extend(values);
    }
    Ok(Some(Best { candidate, places: tested.len() as f64 }))
}

fn grid<'a>(problem: &'a Problem, candidate: &Candidate) -> Option<Grid<'a>> {
    let effect = candidate.term()?.effect.clone();
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
        levels.push(Level { width: size, step: [w / columns as f64, h / rows as f64], columns, rows, first });
        first += columns * rows;
        size *= WIDTH_STEP;
    }
    let defaults = parameters.iter().map(|p| p.nominal).collect();
    Some(Grid { problem, effect, parameters: [linear, x, y, width], defaults, levels })
}
