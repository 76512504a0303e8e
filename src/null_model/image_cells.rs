//! Score and information of values per image by cell of the sensor, by band of its rows and by band of its columns:
//! measurements of a cell may err together, and those of a band too (a camera that shakes while the rows are read moves
//! whole rows), and neither can be told from a value of the image as a whole.

use super::source::EffectEntry;
use super::{ColumnPlace, Local, NullModel};
use crate::adjust::AdjustError;
use crate::effects::Scope;
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, Vector2, Vector6};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Cells along the longer side of a sensor: wide enough to hold what errs together (windows of matching, tiles of
/// blur), and enough of them (some 27 an image) that their spread is known.
const CELLS: f64 = 6.0;

/// What the cells of one image say of its own values.
#[derive(Debug, Clone)]
pub struct ImageCells {
    /// Columns of effects, in the order of the null model.
    pub columns: Vec<usize>,
    /// Its cells; the same for bands of rows, and of columns.
    pub groupings: [Vec<ImageCell>; GROUPINGS],
}

/// Cells, bands of rows, bands of columns.
pub const GROUPINGS: usize = 3;

/// A cell, over the columns of its image, the image's pose and the points taken out; unit weight.
#[derive(Debug, Clone)]
pub struct ImageCell {
    /// Score.
    pub score: DVector<f64>,
    /// Information.
    pub information: DMatrix<f64>,
    /// Covariance that its score has if measurements are independent: the pose, fitted to all cells, takes a part of
    /// each.
    pub covariance: DMatrix<f64>,
}

/// By the pose of an image.
type ByPose = SMatrix<f64, 2, 6>;

impl NullModel {
    /// Cells of every image that has columns of its own.
    ///
    /// # Errors
    /// A measurement that cannot be predicted.
    pub fn image_cells(&self) -> Result<Vec<ImageCells>, AdjustError> {
        let layout = self.problem.layout();
        let mut column_of = BTreeMap::new();
        for (column, (place, unknown)) in self.places.iter().zip(&self.columns).enumerate() {
            let Some(t) = unknown.checked_sub(layout.theta(0)) else { continue };
            let entry = &self.problem.theta[t];
            let instance = &self.problem.effects[entry.effect as usize];
            if let (ColumnPlace::Local(k), Scope::Image) = (place, instance.slots[entry.parameter as usize].0) {
                column_of.insert(*k as u32, column);
            }
        }
        if column_of.is_empty() {
            return Ok(Vec::new());
        }
        let stages =
            self.stages_of(|place| matches!(place, ColumnPlace::Local(k) if column_of.contains_key(&(*k as u32))));
        let of_values = |entry: &&EffectEntry| entry.local && column_of.contains_key(&entry.column);
        let entries: Vec<Vec<EffectEntry>> =
            self.entries.iter().map(|of| of.iter().filter(of_values).copied().collect()).collect();
        let parts = self.measurements_by(&stages, &entries)?;
        let mut of_image: Vec<Vec<OfValues<'_>>> = vec![Vec::new(); entries.len()];
        let mut observations = self.problem.observations.iter();
        for (locals, rows) in &parts {
            let mut rest = &rows[..];
            for (local, observation) in locals.iter().zip(observations.by_ref()) {
                let image = observation.image as usize;
                let (rows, others) = rest.split_at(entries[image].len());
                rest = others;
                of_image[image].push(OfValues { local, rows, inverse_sigma: observation.inverse_sigma });
            }
        }
        let cells = |(image, own): (usize, &Vec<OfValues<'_>>)| {
            let columns: Vec<usize> = entries[image].iter().map(|entry| column_of[&entry.column]).collect();
            (!columns.is_empty()).then(|| ImageCells { groupings: self.cells_of(image, columns.len(), own), columns })
        };
        Ok(self.pool.install(|| of_image.par_iter().enumerate().filter_map(cells).collect()))
    }

    fn cells_of(&self, image: usize, count: usize, own: &[OfValues<'_>]) -> [Vec<ImageCell>; GROUPINGS] {
        let context = &self.problem.image_contexts[image];
        let side = context.width_px.max(context.height_px) / CELLS;
        // The pose that follows the values.
        let mut normal = Matrix6::zeros();
        let mut mixed = vec![Vector6::zeros(); count];
        for OfValues { local, rows, .. } in own {
            let left: ByPose = local.redundancy * local.by_pose;
            normal += local.by_pose.transpose() * left;
            rows.iter().zip(&mut mixed).for_each(|(row, mixed)| *mixed += left.transpose() * row);
        }
        let inverse = normal.try_inverse().unwrap_or_else(Matrix6::zeros);
        let follows: Vec<Vector6<f64>> = mixed.iter().map(|mixed| inverse * mixed).collect();
        let mut cells: BTreeMap<[i64; 2], CellSums> = BTreeMap::new();
        let mut moved = vec![Vector2::zeros(); count];
        for OfValues { local, rows, inverse_sigma } in own {
            for ((moved, row), follows) in moved.iter_mut().zip(*rows).zip(&follows) {
                *moved = row - local.by_pose * follows;
            }
            let residual = Vector2::from(local.residual) * *inverse_sigma;
            let cell = local.predicted.map(|at| (at / side).floor() as i64);
            let sums = cells.entry(cell).or_insert_with(|| CellSums::zeros(count));
            for (a, row) in moved.iter().enumerate() {
                sums.score[a] += row.dot(&residual);
                let left = local.redundancy * row;
                moved.iter().enumerate().for_each(|(b, other)| sums.information[(b, a)] += other.dot(&left));
                sums.mixed[a] += local.by_pose.transpose() * left;
            }
        }
        let mut bands = [(); 2].map(|()| BTreeMap::new());
        for ([x, y], sums) in &cells {
            for (bands, band) in bands.iter_mut().zip([y, x]) {
                bands.entry(*band).or_insert_with(|| CellSums::zeros(count)).add(sums);
            }
        }
        let finished = |CellSums { score, information, mixed }: CellSums| {
            let taken = DMatrix::from_fn(count, count, |a, b| mixed[a].dot(&(inverse * mixed[b])));
            ImageCell { score, covariance: &information - taken, information }
        };
        let [of_rows, of_columns] = bands.map(|bands| bands.into_values().map(finished).collect());
        [cells.into_values().map(finished).collect(), of_rows, of_columns]
    }
}

/// A measurement, and its derivatives by the values of its image, standardised.
#[derive(Clone, Copy)]
struct OfValues<'a> {
    local: &'a Local,
    rows: &'a [Vector2<f64>],
    inverse_sigma: f64,
}

/// Sums over the measurements of a cell.
struct CellSums {
    score: DVector<f64>,
    information: DMatrix<f64>,
    /// With the pose.
    mixed: Vec<Vector6<f64>>,
}

impl CellSums {
    fn zeros(count: usize) -> Self {
        Self {
            score: DVector::zeros(count),
            information: DMatrix::zeros(count, count),
            mixed: vec![Vector6::zeros(); count],
        }
    }

    fn add(&mut self, other: &Self) {
        self.score += &other.score;
        self.information += &other.information;
        self.mixed.iter_mut().zip(&other.mixed).for_each(|(sum, other)| *sum += other);
    }
}
