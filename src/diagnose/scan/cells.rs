//! Residuals summed over cells of the sensor: the score of a shape is a sum over residuals, which need not be told
//! apart within a cell.

use crate::model::EffectRef;
use crate::problem::{ImageObservation, Problem};
use std::collections::HashMap;

/// Side of a cell in widths of the shape: a mean over it takes a twenty-fourth off the peak of a smooth flaw.
const SIDE: f64 = 0.5;

/// An image measurement at the solution.
#[derive(Debug, Clone, Copy)]
pub(super) struct Residual<'a> {
    /// The measurement.
    pub observation: &'a ImageObservation,
    /// Predicted point, px.
    pub predicted: [f64; 2],
    /// Interior orientation of its image.
    pub interior: &'a [f64; 12],
    /// `P v`, 1/px.
    pub pull: [f64; 2],
    /// `P`, 1/px^2.
    pub weight: f64,
}

/// Sums of one cell.
struct ScanCell {
    /// The first measurement, for what effects ask of one.
    observation: ImageObservation,
    interior: [f64; 12],
    /// Weighted sum of the predicted points, px.
    place: [f64; 2],
    pull: [f64; 2],
    weight: f64,
}

/// Cells of a sensor that hold measurements.
pub(super) struct Cells {
    cells: Vec<ScanCell>,
}

impl Cells {
    /// For shapes of the width `width`, px. Every camera has cells of its own; every image where the effect looks at
    /// more than the place.
    pub(super) fn new(problem: &Problem, residuals: &[Residual<'_>], effect: &EffectRef, width: f64) -> Self {
        let by_image = !effect.descriptor().needs.is_empty();
        let side = SIDE * width;
        let mut number = HashMap::new();
        let mut cells: Vec<ScanCell> = Vec::new();
        for measured in residuals {
            let image = measured.observation.image;
            let group = if by_image { image } else { problem.image_contexts[image as usize].camera };
            let [i, j] = measured.predicted.map(|at| (at / side).floor() as i64);
            // Numbers follow the order of the measurements, so that sums do not depend on the map's.
            let cell = *number.entry((group, i, j)).or_insert(cells.len());
            if cell == cells.len() {
                let (observation, interior) = (*measured.observation, *measured.interior);
                cells.push(ScanCell { observation, interior, place: [0.0; 2], pull: [0.0; 2], weight: 0.0 });
            }
            let cell = &mut cells[cell];
            cell.weight += measured.weight;
            for k in 0..2 {
                cell.place[k] += measured.weight * measured.predicted[k];
                cell.pull[k] += measured.pull[k];
            }
        }
        Self { cells }
    }

    /// Each cell as one measurement at the mean of its own.
    pub(super) fn iter(&self) -> impl Iterator<Item = Residual<'_>> {
        self.cells.iter().map(|cell| Residual {
            observation: &cell.observation,
            predicted: cell.place.map(|sum| sum / cell.weight),
            interior: &cell.interior,
            pull: cell.pull,
            weight: cell.weight,
        })
    }
}
