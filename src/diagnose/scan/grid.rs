//! Places and widths on a grid, ranked by a score that is summed over cells.

use super::Scan;
use super::cells::{Cells, Residual};
use super::elsewhere;
use super::shape::{Moves, Shape, Sums};
use crate::adjust::AdjustError;
use crate::null_model::{Local, NullModel};
use crate::problem::ImageObservation;
use rayon::prelude::*;

/// Ratio of neighbouring widths: shapes of widths 1 and 1.5 correlate by 0.9.
const WIDTH_STEP: f64 = 1.5;
/// Distance of neighbouring places, in widths: at half of it from the next place a flaw keeps four fifths of its
/// statistic.
const PLACE_STEP: f64 = 0.8;
/// Steps of the width in a finer grid.
const WIDTH_STEPS: [f64; 3] = [-1.0, 0.0, 1.0];
/// Places of each width that are tested to the last digit: the highest peaks, of which the base may leave more or less.
const PEAKS: usize = 3;

/// Widths of a search, each with the residuals in cells for shapes of it.
pub(super) struct Grid<'a> {
    search: &'a Scan<'a>,
    levels: Vec<Level>,
}

/// A shape at its best place among those about it.
pub(super) struct Peak {
    pub shape: Shape,
    /// [`elsewhere::factor`] of the places that it does not reach.
    pub elsewhere: f64,
}

/// A width, px, and its cells.
struct Level {
    width: f64,
    cells: Cells,
}

impl<'a> Grid<'a> {
    /// Residuals of a fit in cells for every width.
    ///
    /// # Errors
    /// A measurement that cannot be predicted.
    pub fn new(search: &'a Scan<'a>, null: &NullModel) -> Result<Self, AdjustError> {
        let (least, most) = search.widths;
        let widths = std::iter::successors(Some(least), |width| Some(width * WIDTH_STEP));
        let widths: Vec<f64> = widths.take_while(|width| *width <= most).collect();
        let residuals = residuals(null, &null.measurements()?);
        let cells = |width| Cells::new(search.problem, &residuals, &search.effect, width);
        let level = |width| Level { width, cells: cells(width) };
        Ok(Self { search, levels: null.pool().install(|| widths.into_par_iter().map(level).collect()) })
    }

    /// Number of places that measurements reach, and the highest peaks of `s^2 / B'PB` of every variant and width.
    pub fn promising(&self, null: &NullModel) -> (f64, Vec<Peak>) {
        let of_variant = |variant: usize| self.levels.iter().map(move |level| (variant, level));
        let each: Vec<(usize, &Level)> = (0..self.search.variants.len()).flat_map(of_variant).collect();
        let peaks: Vec<(usize, Vec<Peak>)> =
            null.pool().install(|| each.par_iter().map(|(variant, level)| self.peaks(*variant, level)).collect());
        let places = peaks.iter().map(|(places, _)| *places as f64).sum();
        (places, peaks.into_iter().flat_map(|(_, peaks)| peaks).collect())
    }

    /// Number of places of one width that measurements reach, and its highest peaks.
    fn peaks(&self, variant: usize, level: &Level) -> (usize, Vec<Peak>) {
        let width = level.width;
        let sensor = self.search.sensor;
        let [columns, rows] = sensor.map(|length| (length / (PLACE_STEP * width)).ceil().max(1.0) as usize);
        let step = [sensor[0] / columns as f64, sensor[1] / rows as f64];
        let shape = |i: usize, j: usize| Shape {
            variant,
            place: [(i as f64 + 0.5) * step[0], (j as f64 + 0.5) * step[1]],
            width,
        };
        let mut sums = vec![Sums::default(); columns * rows];
        let mut moves = Moves::new(self.search);
        for cell in level.cells.iter() {
            let reached = |k: usize, count: usize| {
                let reach = Shape::reach(width);
                let first = ((cell.predicted[k] - reach) / step[k] - 0.5).ceil().max(0.0) as usize;
                let last = ((cell.predicted[k] + reach) / step[k] - 0.5).floor();
                first..if last < 0.0 { first } else { (last as usize + 1).min(count) }
            };
            let of_row = |j: usize| reached(0, columns).map(move |i| (j * columns + i, shape(i, j)));
            moves.add(&cell, reached(1, rows).flat_map(of_row), &mut sums);
        }
        let ratios: Vec<f64> = sums.iter().map(Sums::ratio).collect();
        let about = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
        let is_peak = |i: usize, j: usize| {
            let own = ratios[j * columns + i];
            own > 0.0 && about(j, rows).all(|j| about(i, columns).all(|i| ratios[j * columns + i] <= own))
        };
        let places = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        let mut peaks: Vec<(usize, usize)> = places.filter(|(i, j)| is_peak(*i, *j)).collect();
        peaks.sort_by(|a, b| ratios[b.1 * columns + b.0].total_cmp(&ratios[a.1 * columns + a.0]));
        let reached: Vec<(Shape, f64)> = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .filter(|(i, j)| sums[j * columns + i].length > 0.0)
            .map(|(i, j)| (shape(i, j), ratios[j * columns + i]))
            .collect();
        let peak = |(i, j): (usize, usize)| {
            let shape = shape(i, j);
            let others = reached.iter().filter(|(other, _)| !shape.reaches(other));
            Peak { shape, elsewhere: elsewhere::factor(others.map(|(_, ratio)| *ratio).collect()) }
        };
        (reached.len(), peaks.into_iter().take(PEAKS).map(peak).collect())
    }

    /// Of finer places and widths about a shape, the place of each width with the highest `s^2 / B'PB`.
    pub fn finer(&self, shape: Shape, refinement: f64) -> Vec<Shape> {
        let apart = |level: &Level| (level.width / shape.width).ln().abs();
        let Some(level) = self.levels.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { return Vec::new() };
        let best_of_width = |shapes: Vec<Shape>| {
            let mut sums = vec![Sums::default(); shapes.len()];
            let mut moves = Moves::new(self.search);
            for cell in level.cells.iter() {
                moves.add(&cell, shapes.iter().copied().enumerate(), &mut sums);
            }
            let ranked = shapes.into_iter().zip(&sums);
            ranked.max_by(|(_, a), (_, b)| a.ratio().total_cmp(&b.ratio())).map(|(shape, _)| shape)
        };
        let widths = WIDTH_STEPS.map(|k| shape.width * WIDTH_STEP.powf(k * refinement));
        widths.into_iter().filter_map(|width| best_of_width(shape.about(PLACE_STEP * refinement, width))).collect()
    }
}

/// Every image measurement at the fit.
fn residuals<'a>(null: &'a NullModel, measured: &[Local]) -> Vec<Residual<'a>> {
    let residual = |(observation, local): (&'a ImageObservation, &Local)| {
        let weight = observation.inverse_sigma.powi(2);
        let pull = local.residual.map(|residual| residual * weight);
        let interior = null.interior(observation.image as usize);
        Residual { observation, predicted: local.predicted, interior, pull, weight }
    };
    null.problem().observations.iter().zip(measured).map(residual).collect()
}
