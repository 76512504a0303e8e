//! Where columns come from: what one unit of each would add to the measurements.

use crate::problem::ImageObservation;
use std::ops::Range;

/// What a provider of columns sees of an image measurement.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Its position in [`crate::problem::Problem::observations`].
    pub number: usize,
    /// Position of its point.
    pub point: usize,
    /// The measurement.
    pub observation: &'a ImageObservation,
    /// Predicted point, px; columns at the measured one would correlate with the noise.
    pub predicted: [f64; 2],
    /// Interior orientation of its image.
    pub interior: &'a [f64; 12],
}

/// An observed coordinate that is no image measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinate {
    /// Of [`crate::problem::Problem::control`]: number and axis.
    Control(usize, usize),
    /// Of [`crate::problem::Problem::gnss`]: number and axis.
    Gnss(usize, usize),
}

/// Collects the entries of columns in one row of the design matrix.
#[derive(Debug)]
pub struct Entries<'a> {
    pub(super) dense: &'a mut [f64],
    pub(super) local: &'a mut Vec<(u32, f64)>,
    pub(super) first_local: u32,
    pub(super) weight: f64,
}

impl Entries<'_> {
    /// Entry of a dense column, px (m) per unit.
    pub fn dense(&mut self, column: usize, value: f64) {
        self.dense[column] = value * self.weight;
    }

    /// Entry of a local column, in standard deviations of the row per unit.
    pub fn standardised(&mut self, column: usize, value: f64) {
        self.local.push((self.first_local + column as u32, value));
    }

    /// Entry of a local column, px (m) per unit.
    pub fn local(&mut self, column: usize, value: f64) {
        if value != 0.0 {
            self.local.push((self.first_local + column as u32, value * self.weight));
        }
    }
}

/// A provider of columns. Dense ones touch most measurements, local ones a few each (those of an image, of a cell of
/// the sensor): the sums over dense columns are matrix products, those over local ones skip what is zero. Numbered from
/// 0 each; dense ones come first.
pub trait Columns: Sync {
    /// Number of dense columns.
    fn dense(&self) -> usize;
    /// Number of local columns.
    fn local(&self) -> usize;
    /// Families of them, of which no two are asked about together: the system then has no products of columns of two
    /// families. Ranges of columns, the local ones behind the dense ones; what is in none goes with all.
    fn families(&self) -> Vec<Range<usize>> {
        Vec::new()
    }
    /// Entries of an image measurement: of its x and of its y.
    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>);
    /// Entries of an observed coordinate.
    fn coordinate(&self, _coordinate: Coordinate, _entries: &mut Entries<'_>) {}
}

/// No columns.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoColumns;

impl Columns for NoColumns {
    fn dense(&self) -> usize {
        0
    }
    fn local(&self) -> usize {
        0
    }
    fn image(&self, _: &Measured<'_>, _: &mut Entries<'_>, _: &mut Entries<'_>) {}
}
