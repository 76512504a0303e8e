//! Chosen columns projected row by row, and what each image has of their score and information.

use super::dense_columns::{Information, Informations};
use super::products::LANES;
use super::source::{Carry, EffectEntry, Source};
use super::waves::{Task, waves};
use super::{ColumnPlace, NoColumns, NullModel, ScoreSystem};
use crate::adjust::AdjustError;
use crate::math::vectors::dispatch;
use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Parts of score and information by image: rows of an image are one unit that may err together. Rows of surveyed coordinates are the last
/// part.
#[derive(Debug, Clone)]
pub struct Parts {
    /// Columns of effects, in the order of the null model, that were projected.
    pub columns: Vec<usize>,
    /// Per image, and last what belongs to none: score and information over these columns.
    pub parts: Vec<(DVector<f64>, DMatrix<f64>)>,
}

impl NullModel {
    /// Projects those of `columns` that are dense row by row, and puts their scores and information, which have more digits, into `system`.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn parts(&self, system: &mut ScoreSystem, columns: &[usize]) -> Result<Parts, AdjustError> {
        let is_dense = |c: &usize| matches!(self.places[*c], ColumnPlace::Dense(_));
        let dense: Vec<usize> = columns.iter().copied().filter(is_dense).collect();
        let count = dense.len();
        if count == 0 {
            let nothing = (DVector::zeros(0), DMatrix::zeros(0, 0));
            return Ok(Parts { columns: dense, parts: vec![nothing; self.structure.images + 1] });
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
        let stages = self.stages_of(|place| matches!(place, ColumnPlace::Dense(k) if position[*k].is_some()));
        let source = Source {
            stages: &stages,
            effects: &entries,
            effect_columns: [count, 0],
            carry: Some(&carry),
            ..self.source(&extra)
        };
        let border = self.structure.border.len();
        let images = self.structure.images;
        // From the register on that the first column is in.
        let (d, block, skipped) = (source.dense(), border / LANES, border % LANES);
        let width = d - LANES * block;
        let mut by_rank = vec![Information::zeros(width); images + 1];
        let done = self.pool.install(|| {
            let size = (images + 1).div_ceil(2 * rayon::current_num_threads()).max(1);
            let tasks = by_rank.chunks_mut(size).enumerate().map(|(task, of_images)| -> Task<'_> {
                let first = task * size;
                Box::new(move |batches| {
                    let of_images = &mut *of_images;
                    dispatch(Informations { batches, d, block, of_images, first, no_image: images });
                })
            });
            waves(&source, tasks.collect())
        });
        done?;
        let part = |rank: usize| {
            let Information { score, information } = &by_rank[rank];
            let of = |a: usize, b: usize| information[(skipped + a.min(b)) * width + skipped + a.max(b)];
            (DVector::from_column_slice(&score[skipped..][..count]), DMatrix::from_fn(count, count, of))
        };
        let ranks = self.structure.rank.iter().map(|rank| *rank as usize).chain([images]);
        let parts: Vec<_> = ranks.map(part).collect();
        let information = Arc::make_mut(&mut system.information);
        for (a, to) in dense.iter().enumerate() {
            system.score[*to] = parts.iter().map(|(score, _)| score[a]).sum();
            for (b, other) in dense.iter().enumerate() {
                information[(*to, *other)] = parts.iter().map(|(_, information)| information[(a, b)]).sum();
            }
        }
        Ok(Parts { columns: dense, parts })
    }
}
