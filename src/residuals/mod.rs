//! What is left in the residuals of a converged base model, whatever its cause: against the place on the sensor, the
//! image, the flight, time, temperature, the row, the radius, the depth, the viewing direction, among neighbours, along
//! and across the track.
//!
//! # Which statistics, and why
//! Residuals of an adjustment are not independent: each point and each camera took its share. Sums of squares of cell
//! means, taken as if they were independent, are wrong in both directions: too small where the fit absorbs a pattern,
//! too large where a point passes the same two places again and again. So every test is one of columns that say what a
//! unit of the pattern would move each measurement by, against the null model: under independent normal noise its F
//! statistic is F distributed, however small the block. One thing that the weights do not know is guarded against by
//! the object points as independent units: the variance of each score is also taken from its parts point by point, and
//! where that is larger than the information says (measurements of one point that err together), the statistic is
//! divided by the ratio (the first-order correction of Rao and Scott 1984). Errors that *different* points share, as
//! neighbours in one image do or rows that are read one after another, show in the tests `autocorrelation`,
//! `row-autocorrelation` and `row-spectrum`, the sign flip of whole points being the null.
//!
//! Check points ([`check_points`]) decide nothing: their tests are marked as descriptive.

mod asked;
mod autocorrelation;
mod check;
pub mod check_points;
mod columns;
mod context;
mod covariates;
mod describe;
mod found;
mod gnss;
mod image;
mod layout;
mod pictures;
mod place;
mod row_spectrum;
mod rows;
mod sensor;
mod spectrum;

pub use asked::Spread;
pub use columns::Families;
pub use layout::Layout;
pub use pictures::{Cell, ImageValue, Peak, Pictures, Profile, ProfileBin, SensorGrid, SpectrumGrid};

use crate::adjust::AdjustError;
use crate::null_model::{Columns, NullModel};
use crate::problem::{Problem, State};
use crate::score::System;
use check_points::Heights;

/// One test of residual structure.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureTest {
    /// `sensor`, `spectrum`, `image`, ...: the key `against` of `diagnosis.json`.
    pub against: &'static str,
    /// F, a standard normal for `autocorrelation` and `row-autocorrelation`, a ratio of powers for `row-spectrum`.
    pub statistic: f64,
    /// Degrees of freedom: columns that the base model leaves; for `row-spectrum` those of the sum of powers.
    pub dof: usize,
    /// p-value of this test alone.
    pub p_value: f64,
    /// Its natural logarithm, which does not underflow.
    pub ln_p_value: f64,
    /// p-value among all tests that decide (Holm); that of the test itself for a descriptive one.
    pub family_p_value: f64,
    /// False for tests at check points, which decide nothing.
    pub decides: bool,
    /// One sentence: what was tested, how large it is.
    pub description: String,
}

/// Residual structure of a converged base model.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// Every test that the block allows.
    pub tests: Vec<StructureTest>,
    /// What the block does not allow, and why.
    pub skipped: Vec<(&'static str, String)>,
    /// Data of the pictures.
    pub pictures: Pictures,
    /// Level of the family of tests.
    pub significance: f64,
    /// Columns that stand for each test that decides, by their numbers among its own.
    pub columns: Vec<(&'static str, Vec<usize>)>,
    /// Check points in a sentence, where there are enough of them.
    pub check_points: Option<String>,
}

impl Structure {
    /// The most significant test that decides, if it is significant among all of them.
    pub fn family_wise(&self) -> Option<&StructureTest> {
        let deciding = self.tests.iter().filter(|test| test.decides);
        deciding
            .min_by(|a, b| a.ln_p_value.total_cmp(&b.ln_p_value))
            .filter(|test| test.family_p_value < self.significance)
    }

    /// A test by its name.
    pub fn test(&self, against: &str) -> Option<&StructureTest> {
        self.tests.iter().find(|test| test.against == against)
    }

    /// Sentences that describe what is left, most significant first: where, how large, which wavelength, which images.
    /// Empty where nothing is.
    pub fn describe_unexplained(&self) -> Vec<String> {
        describe::unexplained(self)
    }
}

/// Tests the residuals of `problem` at its solution `state`; `heights` are those of the check points at the same
/// solution. `significance` is that of the family of tests.
///
/// # Errors
/// A state that cannot be evaluated, or at which the cameras are not determined.
pub fn analyse(
    problem: &Problem,
    state: &State,
    heights: &Result<Heights, &'static str>,
    significance: f64,
    threads: usize,
) -> Result<Structure, AdjustError> {
    let null = NullModel::new(problem.clone(), state.clone(), Vec::new(), threads)?;
    let measurements = null.measurements()?;
    let test = |columns: &dyn Columns| -> Result<((), System, Spread), AdjustError> {
        let scores = null.test(columns)?;
        let spread = Spread::of(&scores);
        let system = System {
            least: vec![0.0; scores.score.len()],
            score: scores.score,
            information: scores.information,
            length: scores.length,
            chi_square: null.chi_square(),
            redundancy: problem.redundancy().2 as f64,
        };
        Ok(((), system, spread))
    };
    let ((), structure) = Layout::new(problem, state, &measurements, threads)?.analyse(heights, significance, test)?;
    Ok(structure)
}
