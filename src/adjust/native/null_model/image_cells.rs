//! Score and information of values per image by cell of the sensor: measurements of a cell may err together, those of different cells of an
//! image less so, and neither can be told from a value of the image as a whole.

use super::{NullModel, Place};
use crate::adjust::native::null_model::rows::EffectEntry;
use crate::effects::Scope;
use crate::measure::{self, Prediction};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, Vector2};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Cells along the longer side of a sensor: wide enough to hold what errs together (windows of matching, tiles of blur), and enough of them
/// (some 48 an image) that their spread is known.
const CELLS: f64 = 4.0;

/// What the cells of one image say of its own values.
#[derive(Debug, Clone)]
pub struct ImageCells {
    /// Columns of effects, in the order of the null model.
    pub columns: Vec<usize>,
    /// Per cell: score and information over these columns, the image's pose and the points taken out.
    pub parts: Vec<(DVector<f64>, DMatrix<f64>)>,
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
            if let (Place::Local(k), Scope::Image) = (place, instance.slots[entry.parameter as usize].0) {
                column_of.insert(*k as u32, column);
            }
        }
        if column_of.is_empty() {
            return Vec::new();
        }
        let measured = self.measurements();
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
            (!entries.is_empty()).then(|| ImageCells { columns, parts: self.cells_of(image, &entries, own, &measured) })
        };
        self.pool.install(|| of_image.par_iter().enumerate().filter_map(cells).collect())
    }

    fn cells_of(
        &self,
        image: usize,
        entries: &[EffectEntry],
        own: &[(usize, usize)],
        measured: &[super::Local],
    ) -> Vec<(DVector<f64>, DMatrix<f64>)> {
        let Self { problem, state, structure, frames, .. } = self;
        let context = &problem.image_contexts[image];
        let side = context.width_px.max(context.height_px) / CELLS;
        let count = entries.len();
        let mut prediction = Prediction::default();
        // Each measurement's derivatives by the values, standardised; and the pose that follows them.
        let mut rows: Vec<DMatrix<f64>> = Vec::with_capacity(own.len());
        let mut normal = Matrix6::zeros();
        let mut mixed = DMatrix::zeros(6, count);
        for (j, number) in own {
            let observation = &problem.observations[*number];
            let object = &state.points[*j];
            let known =
                measure::predict(problem, &structure.stages, &frames[image], observation, object, &mut prediction);
            let weight = observation.inverse_sigma;
            let derivative = |i: usize, entry: &EffectEntry| match entry.source as usize {
                k if k < 12 => prediction.d_camera[i][k],
                k => prediction.d_theta[i][k - 12],
            };
            let row = DMatrix::from_fn(2, count, |i, c| match known {
                Some(()) => derivative(i, &entries[c]) * entries[c].scale * weight,
                None => 0.0,
            });
            let local = &measured[*number];
            let left: ByPose = local.redundancy * local.by_pose;
            normal += local.by_pose.transpose() * left;
            mixed += left.transpose() * &row;
            rows.push(row);
        }
        let follows = normal.try_inverse().map(|inverse| inverse * mixed);
        let mut cells: BTreeMap<[i64; 2], (DVector<f64>, DMatrix<f64>)> = BTreeMap::new();
        for ((_, number), mut row) in own.iter().zip(rows) {
            let local = &measured[*number];
            if let Some(follows) = &follows {
                row -= local.by_pose * follows;
            }
            let weight = problem.observations[*number].inverse_sigma;
            let cell = local.predicted.map(|at| (at / side).floor() as i64);
            let part = cells.entry(cell).or_insert_with(|| (DVector::zeros(count), DMatrix::zeros(count, count)));
            part.0 += row.transpose() * Vector2::from(local.residual) * weight;
            part.1 += row.transpose() * local.redundancy * &row;
        }
        cells.into_values().collect()
    }
}
