//! The blocks of a case: one truth, measured with and without its errors.

use crate::block::Block;

/// The blocks of a case.
pub struct Blocks<'a> {
    /// True poses, points and cameras.
    pub truth: &'a Block,
    /// Measurements without error, all flights.
    pub exact: &'a Block,
    /// Measurements with the errors, the flights of the case: what was adjusted.
    pub erroneous: &'a Block,
    /// The same with exact marks of the check points.
    pub exact_check: &'a Block,
    /// The same with exact marks of control and check points.
    pub exact_all: &'a Block,
}
