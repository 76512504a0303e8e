//! Chosen columns projected row by row, and what each image, and each part of the sensor, has of their score and
//! information.

use super::batch::By;
use super::cells::{GROUPINGS, SensorCells};
use super::dense_columns::{Information, Informations};
use super::products::LANES;
use super::source::{Carry, EffectEntry, Source};
use super::waves::{Task, waves};
use super::{ColumnPlace, NoColumns, NullModel, ScoreSystem};
use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::{Prepared, prior_rows};
use crate::math::vectors::dispatch;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Score and information over some columns.
pub type Part = (DVector<f64>, DMatrix<f64>);

/// Parts of score and information: rows of an image are one unit that may err together, and so are those at one place
/// of the sensor.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Columns of effects, in the order of the null model, that were projected.
    pub columns: Vec<usize>,
    /// Per image; last what belongs to none.
    pub of_images: Vec<Part>,
    /// Per place, per band of rows, and per band of columns of the sensor; each time last what belongs to none.
    pub of_sensor: [Vec<Part>; GROUPINGS],
}

impl NullModel {
    /// Projects those of `columns` that are dense row by row, and puts their scores and information, which have more
    /// digits, into `system`.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn parts(&self, system: &mut ScoreSystem, columns: &[usize]) -> Result<Parts, AdjustError> {
        let is_dense = |c: &usize| matches!(self.places[*c], ColumnPlace::Dense(_));
        let dense: Vec<usize> = columns.iter().copied().filter(is_dense).collect();
        let count = dense.len();
        if count == 0 {
            return Ok(Parts { columns: dense, of_images: Vec::new(), of_sensor: Default::default() });
        }
        let unknowns = system.moves.nrows();
        let mut moves = vec![0.0; unknowns * count];
        for (position, c) in dense.iter().enumerate() {
            for (i, value) in system.moves.col_as_slice(*c).iter().enumerate() {
                moves[i * count + position] = *value;
            }
        }
        let carry = Carry { columns: count, moves };
        // Other columns are not projected: an entry that is looked for would only cost.
        let mut position = vec![None; self.effect_columns[0]];
        for (own, c) in dense.iter().enumerate() {
            if let ColumnPlace::Dense(k) = self.places[*c] {
                position[k] = Some(own as u32);
            }
        }
        let projected = |entry: &EffectEntry| {
            let column = (!entry.local).then(|| position[entry.column as usize])??;
            Some(EffectEntry { column, ..*entry })
        };
        let entries = self.entries.iter().map(|of| of.iter().filter_map(projected).collect());
        let entries: Vec<Vec<_>> = entries.collect();
        let extra = NoColumns;
        let cells = SensorCells::new(&self.problem);
        let stages = self.stages_of(|place| matches!(place, ColumnPlace::Dense(k) if position[*k].is_some()));
        let source = Source {
            stages: &stages,
            effects: &entries,
            effect_columns: [count, 0],
            carry: Some(&carry),
            cells: Some(&cells),
            ..self.source(&extra)
        };
        let border = self.structure.border.len();
        let images = self.structure.images;
        // From the register on that the first column is in.
        let (d, block, skipped) = (source.dense(), border / LANES, border % LANES);
        let width = d - LANES * block;
        let mut by_rank = vec![Information::zeros(width); images + 1];
        let mut by_cell = vec![Information::zeros(width); cells.count + 1];
        let done = self.pool.install(|| {
            let tasks = [(By::Image, &mut by_rank), (By::Cell, &mut by_cell)].into_iter().flat_map(|(by, all)| {
                let groups = all.len() - 1;
                let size = all.len().div_ceil(rayon::current_num_threads()).max(1);
                all.chunks_mut(size).enumerate().map(move |(task, sums)| -> Task<'_> {
                    let first = task * size;
                    Box::new(move |batches| {
                        let sums = &mut *sums;
                        dispatch(Informations { batches, d, block, by, sums, first, groups });
                    })
                })
            });
            waves(&source, tasks.collect())
        });
        done?;
        let part = |Information { score, information }: &Information| -> Part {
            let of = |a: usize, b: usize| information[(skipped + a.min(b)) * width + skipped + a.max(b)];
            (DVector::from_column_slice(&score[skipped..][..count]), DMatrix::from_fn(count, count, of))
        };
        let ranks = self.structure.rank.iter().map(|rank| *rank as usize).chain([images]);
        let mut of_images: Vec<Part> = ranks.map(|rank| part(&by_rank[rank])).collect();
        let nothing = || (DVector::zeros(count), DMatrix::zeros(count, count));
        let mut of_sensor = cells.group_counts.map(|groups| vec![nothing(); groups + 1]);
        for (cell, sums) in by_cell.iter().enumerate() {
            let (score, information) = part(sums);
            for (parts, group) in of_sensor.iter_mut().zip(cells.groups_of(cell)) {
                parts[group].0 += &score;
                parts[group].1 += &information;
            }
        }
        for of_none in of_sensor.iter_mut().chain([&mut of_images]).filter_map(|parts| parts.last_mut()) {
            self.add_priors(of_none, &carry);
        }
        let information = Arc::make_mut(&mut system.information);
        for (a, to) in dense.iter().enumerate() {
            system.score[*to] = of_images.iter().map(|(score, _)| score[a]).sum();
            for (b, other) in dense.iter().enumerate() {
                information[(*to, *other)] = of_images.iter().map(|(_, information)| information[(a, b)]).sum();
            }
        }
        Ok(Parts { columns: dense, of_images, of_sensor })
    }

    /// Adds the priors, rows in which no column has an entry of its own, but the base's unknowns that go with it have
    /// theirs.
    fn add_priors(&self, (score, information): &mut Part, carry: &Carry) {
        let Self { problem, structure, state, frames, .. } = self;
        let of_border = structure.images * structure.dim;
        for row in prior_rows(&Prepared { problem, structure, state, frames }) {
            let of_image = row.image.iter().flat_map(|(rank, values)| {
                values.iter().enumerate().map(move |(k, value)| (rank * structure.dim + k, *value))
            });
            let entries = of_image.chain(row.shared.iter().map(|(k, value)| (of_border + *k as usize, *value)));
            let mut projected = DVector::zeros(carry.columns);
            for (unknown, value) in entries {
                let moves = &carry.moves[unknown * carry.columns..][..carry.columns];
                projected.iter_mut().zip(moves).for_each(|(to, moved)| *to += value * moved);
            }
            score.axpy(row.v, &projected, 1.0);
            information.ger(1.0, &projected, &projected, 1.0);
        }
    }
}
