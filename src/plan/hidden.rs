//! Effects and parameters that a block cannot show, and what they may do to its points all the same.

use super::Visible;
use crate::block::Block;
use crate::diagnose::impact;
use crate::diagnose::linearised::Linearised;
use crate::diagnose::select::Nature;
use serde::Serialize;

/// What a block lacks whose other unknowns take an effect up.
const ABSORBED: &str = "a block whose other unknowns do not take it up";

/// An effect that a block cannot show, whatever its size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hidden {
    /// Its id.
    pub effect: String,
    /// What the block lacks.
    pub needs: Vec<String>,
    /// What each of its parameters does at a size that is met in practice. Not known where the block lacks what the
    /// effect acts by (times, temperatures, positions of GNSS), and of values that are random by image.
    pub typical: Vec<Typical>,
}

/// A parameter at its typical size, which other unknowns of the block take up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Typical {
    /// Parameter, the others of its effect zero.
    pub parameter: String,
    /// Its typical size by the catalogue of effects, in `unit`.
    pub size: f64,
    /// Unit.
    pub unit: String,
    /// What it does to check points (without any, to tie points): 3D RMS, m.
    pub moves_m: f64,
    /// The same in height alone, m.
    pub moves_height_m: f64,
}

impl Typical {
    /// The one that moves points most.
    pub fn worst(all: &[Self]) -> Option<&Self> {
        all.iter().max_by(|a, b| a.moves_m.total_cmp(&b.moves_m))
    }
}

/// Physical candidates that are not shown.
pub(super) fn of_effects(block: &Block, linearised: &Linearised, shown: &[Visible]) -> Vec<Hidden> {
    let mut all: Vec<Hidden> = Vec::new();
    let mut add = |effect: &str, needs: Vec<String>, columns: &[usize]| {
        let known = |own: &Hidden| own.effect == effect;
        if !shown.iter().any(|own| own.effect == effect) && !all.iter().any(known) {
            all.push(Hidden { effect: effect.to_owned(), needs, typical: typical(block, linearised, columns) });
        }
    };
    for set in linearised.sets.iter().filter(|set| set.physical) {
        let columns: &[usize] = if set.nature == Nature::Law { &set.columns } else { &[] };
        add(&set.id, vec![ABSORBED.into()], columns);
    }
    for candidate in linearised.untested.iter().filter(|candidate| candidate.physical) {
        add(&candidate.id, candidate.needs.clone(), &[]);
    }
    all
}

/// What columns that are not seen do at their typical size, which is their scale.
pub(super) fn typical(block: &Block, linearised: &Linearised, columns: &[usize]) -> Vec<Typical> {
    if columns.is_empty() {
        return Vec::new();
    }
    let alone = |column: &usize| {
        let mut values = vec![0.0; linearised.values.len()];
        values[*column] = 1.0;
        values
    };
    let impacts = impact::of_values(block, linearised, &columns.iter().map(alone).collect::<Vec<_>>());
    let moved = columns.iter().zip(impacts).filter_map(|(column, impact)| Some((column, impact?)));
    let of = |(column, impact): (&usize, impact::Impact)| {
        let ((parameter, unit), size) = (linearised.parameter(*column), linearised.unit(*column));
        Typical { parameter, size, unit, moves_m: impact.rms_m, moves_height_m: impact.height_m }
    };
    moved.map(of).collect()
}
