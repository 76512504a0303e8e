//! Score and information of values per image by cell of the sensor, by band of its rows and by band of its columns: measurements of a cell may
//! err together, and those of a band too (a camera that shakes while the rows are read moves whole rows), and neither can be told from a
//! value of the image as a whole.

use super::{ColumnPlace, NullModel};
use crate::adjust::native::null_model::source::EffectEntry;
use crate::effects::Scope;
use crate::measure::{self, Prediction, Stages};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, Vector2, Vector6};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Cells along the longer side of a sensor: wide enough to hold what errs together (windows of matching, tiles of blur), and enough of them
/// (some 27 an image) that their spread is known.
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
    /// Covariance that its score has if measurements are independent: the pose, fitted to all cells, takes a part of each.
    pub covariance: DMatrix<f64>,
}

/// By the pose of an image.
type ByPose = SMatrix<f64, 2, 6>;

impl NullModel {
    /// Cells of every image that has columns of its own.
    pub fn image_cells(&self) -> Vec<ImageCells> {
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
            return Vec::new();
        }
        let measured = self.measurements();
        let stages =
            self.stages_of(|place| matches!(place, ColumnPlace::Local(k) if column_of.contains_key(&(*k as u32))));
        let mut of_image = vec![Vec::new(); self.entries.len()];
        for j in 0..self.problem.point_sources.len() {
            for number in self.problem.point_start[j]..self.problem.point_start[j + 1] {
                of_image[self.problem.observations[number].image as usize].push((j, number));
            }
        }
        let cells = |(image, own): (usize, &Vec<(usize, usize)>)| {
            let entries: Vec<EffectEntry> = self.entries[image]
                .iter()
                .filter(|entry| entry.local && column_of.contains_key(&entry.column))
                .copied()
                .collect();
            let columns = entries.iter().map(|entry| column_of[&entry.column]).collect();
            (!entries.is_empty())
                .then(|| ImageCells { columns, groupings: self.cells_of(image, &stages, &entries, own, &measured) })
        };
        self.pool.install(|| of_image.par_iter().enumerate().filter_map(cells).collect())
    }

    fn cells_of(
        &self,
        image: usize,
        stages: &Stages,
        entries: &[EffectEntry],
        own: &[(usize, usize)],
        measured: &[super::Local],
    ) -> [Vec<ImageCell>; GROUPINGS] {
        let Self { problem, state, frames, .. } = self;
        let context = &problem.image_contexts[image];
        let side = context.width_px.max(context.height_px) / CELLS;
        let count = entries.len();
        let mut prediction = Prediction::default();
        // Each measurement's derivatives by the values, standardised, value by value; and the pose that follows them.
        let mut rows: Vec<Vector2<f64>> = Vec::with_capacity(own.len() * count);
        let mut normal = Matrix6::zeros();
        let mut mixed = vec![Vector6::zeros(); count];
        for (j, number) in own {
            let observation = &problem.observations[*number];
            let object = &state.points[*j];
            let known = measure::predict(problem, stages, &frames[image], observation, object, &mut prediction);
            let weight = observation.inverse_sigma;
            let local = &measured[*number];
            let left: ByPose = local.redundancy * local.by_pose;
            normal += local.by_pose.transpose() * left;
            for (entry, mixed) in entries.iter().zip(&mut mixed) {
                let derivative = |i: usize| match entry.source as usize {
                    k if k < 12 => prediction.d_camera[i][k],
                    k => prediction.d_theta[i][k - 12],
                };
                let unit = if known.is_some() { entry.scale * weight } else { 0.0 };
                let row = Vector2::new(derivative(0), derivative(1)) * unit;
                *mixed += left.transpose() * row;
                rows.push(row);
            }
        }
        let inverse = normal.try_inverse().unwrap_or_else(Matrix6::zeros);
        let follows: Vec<Vector6<f64>> = mixed.iter().map(|mixed| inverse * mixed).collect();
        let mut groupings: [BTreeMap<[i64; 2], CellSums>; GROUPINGS] = Default::default();
        for ((_, number), rows) in own.iter().zip(rows.chunks_exact_mut(count)) {
            let local = &measured[*number];
            rows.iter_mut().zip(&follows).for_each(|(row, follows)| *row -= local.by_pose * follows);
            let residual = Vector2::from(local.residual) * problem.observations[*number].inverse_sigma;
            let [x, y] = local.predicted.map(|at| (at / side).floor() as i64);
            for (cells, cell) in groupings.iter_mut().zip([[x, y], [0, y], [x, 0]]) {
                let sums = cells.entry(cell).or_insert_with(|| CellSums {
                    score: DVector::zeros(count),
                    information: DMatrix::zeros(count, count),
                    mixed: vec![Vector6::zeros(); count],
                });
                for (a, row) in rows.iter().enumerate() {
                    sums.score[a] += row.dot(&residual);
                    let left = local.redundancy * row;
                    rows.iter().enumerate().for_each(|(b, other)| sums.information[(b, a)] += other.dot(&left));
                    sums.mixed[a] += local.by_pose.transpose() * left;
                }
            }
        }
        let finished = |CellSums { score, information, mixed }: CellSums| {
            let taken = DMatrix::from_fn(count, count, |a, b| mixed[a].dot(&(inverse * mixed[b])));
            ImageCell { score, covariance: &information - taken, information }
        };
        groupings.map(|cells| cells.into_values().map(finished).collect())
    }
}

/// Sums over the measurements of a cell.
struct CellSums {
    score: DVector<f64>,
    information: DMatrix<f64>,
    /// With the pose.
    mixed: Vec<Vector6<f64>>,
}
