//! What is left in the residuals of a converged base model, whatever its cause: against the place on the sensor, the image, the flight, time,
//! temperature, the row, the radius, the depth, the viewing direction, among neighbours, along and across the track.
//!
//! # Which statistics, and why
//! Residuals of an adjustment are not independent: each point and each camera took its share. Sums of squares of cell means, taken as
//! if they were independent, are wrong in both directions: too small where the fit absorbs a pattern, too large where a point passes the
//! same two places again and again. So every test is a score test of columns that say what a unit of the pattern would move each
//! measurement by (`base.rs`): `M` is exact, and under independent normal noise `s'M^-1 s / (q s0^2)` is F distributed, however small the
//! block. Two things the weights do not know are guarded against by the object points as independent units: the variance of
//! each score is also taken from its parts point by point, and where that is larger than `M` says (wrong weights, measurements of one point that err
//! together), the statistic is divided by the ratio (the first-order correction of Rao and Scott 1984). A full sandwich matrix over the points would do
//! the same for each direction, but is itself too noisy for some hundred columns. Errors that *different* points share, as neighbours in one image do, show in the
//! test `autocorrelation`; its sums are normalised by pairs of points, the sign flip of whole points being the null.
//!
//! Check points decide nothing: their tests are marked as descriptive.

mod autocorrelation;
mod base;
mod check;
mod columns;
mod covariates;
mod describe;
mod gnss;
mod pictures;
mod place;
mod score;
mod sensor;
mod spectrum;

pub use pictures::{Cell, ImageValue, Peak, Pictures, Profile, ProfileBin, SensorGrid, SpectrumGrid};
pub use score::Tested;

use crate::adjust::AdjustError;
use crate::evaluate::Comparison;
use crate::problem::{Problem, State};
use base::Base;
use columns::Columns;
use place::Place;
use score::{Noise, Score};

/// One test of residual structure.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureTest {
    /// `sensor`, `spectrum`, `image`, ...: the key `against` of `diagnosis.json`.
    pub against: &'static str,
    /// F, or a standard normal for `autocorrelation`.
    pub statistic: f64,
    /// Degrees of freedom: columns that the base model leaves.
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

    /// Sentences that describe what is left, most significant first: where, how large, which wavelength, which images. Empty where nothing is.
    pub fn describe_unexplained(&self) -> Vec<String> {
        describe::unexplained(self)
    }
}

/// What the tests share.
struct Context<'a> {
    base: &'a Base<'a>,
    places: &'a [Place],
}

impl Context<'_> {
    fn noise(&self) -> Noise {
        Noise { sum_of_squares: self.base.sum_of_squares, degrees: self.base.degrees }
    }

    fn columns(&self, count: usize, fill: impl FnMut(usize, &mut Vec<columns::Entry>)) -> Columns {
        Columns::new(count, self.places.len(), fill)
    }

    /// Tests columns of image measurements.
    fn test(&self, score: &Score, columns: &[usize]) -> Option<Tested> {
        score.test(columns, self.noise(), score.design_effect(columns, self.base.variance()))
    }
}

/// Two questions to the same columns: are they zero together, and is the worst of `count` parts zero? Bonferroni over both.
fn joint_or_worst(joint: Option<Tested>, worst: Option<Tested>, count: usize) -> Option<Tested> {
    match (joint, worst.map(|worst| worst.of_many(count))) {
        (Some(joint), Some(worst)) if worst.ln_p_value < joint.ln_p_value => Some(worst.of_many(2)),
        (Some(joint), Some(_)) => Some(joint.of_many(2)),
        (joint, worst) => joint.or(worst),
    }
}

/// What one family of tests found.
#[derive(Default)]
struct Found {
    tests: Vec<StructureTest>,
    skipped: Vec<(&'static str, String)>,
    pictures: Pictures,
}

impl Found {
    fn push(&mut self, against: &'static str, tested: Option<Tested>, description: String) {
        match tested {
            Some(tested) => self.tests.push(StructureTest {
                against,
                statistic: tested.statistic,
                dof: tested.dof,
                p_value: tested.p_value,
                ln_p_value: tested.ln_p_value,
                family_p_value: tested.p_value,
                decides: true,
                description,
            }),
            None => self.skip(against, "the base model leaves nothing of it, or too few measurements"),
        }
    }

    fn skip(&mut self, against: &'static str, why: &str) {
        self.skipped.push((against, why.into()));
    }
}

/// Tests the residuals of `problem` at its solution `state`; `comparison` is of the same solution, for the check points. `significance` is
/// that of the family of tests.
///
/// # Errors
/// A state that cannot be evaluated, or at which the cameras are not determined.
pub fn analyse(
    problem: &Problem,
    state: &State,
    comparison: Option<&Comparison>,
    significance: f64,
) -> Result<Structure, AdjustError> {
    let base = Base::new(problem, state)?;
    let places = place::places(&base);
    let context = Context { base: &base, places: &places };
    let mut found = Found::default();
    if base.degrees > 0.0 {
        sensor::test(&context, &mut found);
        spectrum::test(&context, &mut found);
        covariates::test(&context, &mut found);
        autocorrelation::test(&context, &mut found);
        gnss::test(&context, &mut found);
    } else {
        found.skip("sensor", "no redundancy");
    }
    check::test(comparison, &mut found);
    if !base.exact() {
        let why = format!("more than {} camera unknowns: p-values are upper bounds", base::MAX_CAMERA_UNKNOWNS);
        found.skip("cameras", &why);
    }
    holm(&mut found.tests);
    let Found { tests, skipped, pictures } = found;
    Ok(Structure { tests, skipped, pictures, significance })
}

/// Holm's step-down correction over the tests that decide.
fn holm(tests: &mut [StructureTest]) {
    let mut order: Vec<usize> = (0..tests.len()).filter(|k| tests[*k].decides).collect();
    order.sort_by(|a, b| tests[*a].ln_p_value.total_cmp(&tests[*b].ln_p_value));
    let mut largest: f64 = 0.0;
    for (rank, k) in order.iter().enumerate() {
        largest = largest.max((tests[*k].p_value * (order.len() - rank) as f64).min(1.0));
        tests[*k].family_p_value = largest;
    }
}
