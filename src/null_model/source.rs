//! What the rows of the design matrix are made from: a fit, the effects that are looked at, and further columns.

use super::cells::SensorCells;
use super::columns::Columns;
use super::products::LANES;
use crate::adjust::native::for_null_model::Structure;
use crate::measure::{Frame, Stages};
use crate::problem::{Problem, State};

/// A column of an effect or of a held camera parameter in the measurements of one image.
#[derive(Debug, Clone, Copy)]
pub(super) struct EffectEntry {
    /// Derivative to take: camera parameter (below 12), or 12 + position in the image's local list of effect
    /// parameters.
    pub source: u32,
    /// Dense column, or local one.
    pub column: u32,
    /// Is it a local one?
    pub local: bool,
    /// Raw unit per scaled unit.
    pub scale: f64,
}

/// What every batch needs.
pub(super) struct Source<'a> {
    pub problem: &'a Problem,
    pub state: &'a State,
    pub structure: &'a Structure,
    /// Effects that are looked at.
    pub stages: &'a Stages,
    pub frames: &'a [Frame],
    /// Columns of effects, by image.
    pub effects: &'a [Vec<EffectEntry>],
    /// Number of dense and of local columns of effects.
    pub effect_columns: [usize; 2],
    /// Further columns.
    pub extra: &'a dyn Columns,
    /// Moves of the base that take it out of the dense columns, too.
    pub carry: Option<&'a Carry>,
    /// Cells of the sensor, where rows are summed by them.
    pub cells: Option<&'a SensorCells>,
}

/// Moves of the base's unknowns (scaled units) that go with one unit of each dense column behind the base's own.
pub(super) struct Carry {
    /// Number of columns.
    pub columns: usize,
    /// Unknown of the images (by rank) or of the border, column fastest.
    pub moves: Vec<f64>,
}

impl Source<'_> {
    /// Number of dense columns: the base's border, effects, further ones; then zeros up to whole registers, so that
    /// rows are never empty.
    pub fn dense(&self) -> usize {
        (self.structure.border.len() + self.effect_columns[0] + self.extra.dense()).max(1).next_multiple_of(LANES)
    }

    /// Number of local columns: of effects, further ones.
    pub fn local(&self) -> usize {
        self.effect_columns[1] + self.extra.local()
    }
}
