//! What is left in the residuals of a converged base model, whatever its cause: against the place on the sensor, the image, the flight, time,
//! temperature, the row, the radius, the depth, the viewing direction, among neighbours, along and across the track.
//!
//! # Which statistics, and why
//! Residuals of an adjustment are not independent: each point and each camera took its share. Sums of squares of cell means, taken as
//! if they were independent, are wrong in both directions: too small where the fit absorbs a pattern, too large where a point passes the
//! same two places again and again. So every test is one of columns that say what a unit of the pattern would move each measurement by, against
//! the null model: under independent normal noise its F statistic is F distributed, however small the block. One thing that the weights do not
//! know is guarded against by the object points as independent units: the variance of each score is also taken from its parts point by point,
//! and where that is larger than the information says (measurements of one point that err together), the statistic is divided by the ratio (the
//! first-order correction of Rao and Scott 1984). Errors that *different* points share, as neighbours in one image do, show in the test
//! `autocorrelation`; its sums are normalised by pairs of points, the sign flip of whole points being the null.
//!
//! Check points decide nothing: their tests are marked as descriptive.

mod autocorrelation;
mod check;
mod columns;
mod covariates;
mod describe;
mod gnss;
mod image;
mod pictures;
mod place;
mod sensor;
mod spectrum;

pub use pictures::{Cell, ImageValue, Peak, Pictures, Profile, ProfileBin, SensorGrid, SpectrumGrid};

use super::test::system::KEPT_SHARE;
use super::test::{System, is_noise, variance_factor};
use crate::adjust::AdjustError;
use crate::adjust::native::null_model::{Columns, Coordinate, Local, NullModel, ScoreSystem};
use crate::evaluate::Comparison;
use crate::math::statistics::f_ln_sf;
use crate::measure::Predictor;
use crate::problem::{Problem, State};
use columns::{Families, Family};
use covariates::Covariate;
use nalgebra::{DVector, Matrix2, Matrix6, Vector2, Vector3};
use place::Place;
use std::ops::Range;

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
    /// Columns of each test that decides, in the system that it was judged in.
    pub columns: Vec<(&'static str, Vec<usize>)>,
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

/// Result of a test that columns are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tested {
    /// F.
    pub statistic: f64,
    /// Degrees of freedom of the numerator: columns that the base model leaves.
    pub dof: usize,
    /// p-value.
    pub p_value: f64,
    /// Its natural logarithm, which does not underflow.
    pub ln_p_value: f64,
}

impl Tested {
    /// The largest of `count` such tests: Bonferroni.
    fn of_many(self, count: usize) -> Self {
        let ln_p_value = (self.ln_p_value + (count.max(1) as f64).ln()).min(0.0);
        Self { ln_p_value, p_value: ln_p_value.exp(), ..self }
    }
}

/// What a group of residuals has without the columns that are tested.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Noise {
    sum_of_squares: f64,
    degrees: f64,
}

/// What the tests share.
struct Context<'a> {
    problem: &'a Problem,
    state: &'a State,
    measurements: &'a [Local],
    noise: Noise,
    antenna_residuals: Vec<Vector3<f64>>,
    /// Normal matrix of each image's pose (rotation `w`, projection centre) from its antenna alone.
    antenna_normals: Vec<Matrix6<f64>>,
    gnss_noise: Noise,
}

impl<'a> Context<'a> {
    fn new(problem: &'a Problem, state: &'a State, measurements: &'a [Local]) -> Result<Self, AdjustError> {
        let squares = problem.observations.iter().zip(measurements).map(|(observation, local)| {
            (local.residual[0].powi(2) + local.residual[1].powi(2)) * observation.inverse_sigma.powi(2)
        });
        let layout = problem.layout();
        let cameras = problem.free().iter().take(layout.point(0, 0)).filter(|free| **free).count();
        // GNSS and control determine a part of the cameras, so this is a little too small: on the safe side.
        let degrees = (2 * problem.observations.len()) as f64 - (3 * layout.points + cameras) as f64;
        let predictor = Predictor::new(problem, state)?;
        let antenna_residuals = problem.gnss.iter().map(|observation| {
            let computed = predictor.antenna(observation.index as usize);
            computed.map_or_else(Vector3::zeros, |computed| observation.position - computed)
        });
        let antenna_residuals: Vec<Vector3<f64>> = antenna_residuals.collect();
        let mut antenna_normals = vec![Matrix6::zeros(); problem.image_contexts.len()];
        for observation in &problem.gnss {
            let image = observation.index as usize;
            let Some(mut by_pose) = predictor.antenna_by_pose(image) else { continue };
            for (k, mut column) in by_pose.column_iter_mut().enumerate() {
                let free = if problem.pose_free[image][k] { 1.0 } else { 0.0 };
                column.component_mul_assign(&observation.sigma.map(|sigma| free / sigma));
            }
            antenna_normals[image] += by_pose.transpose() * by_pose;
        }
        let of_gnss = problem.gnss.iter().zip(&antenna_residuals);
        let sum_of_squares = of_gnss.map(|(observation, d)| d.component_div(&observation.sigma).norm_squared()).sum();
        Ok(Self {
            problem,
            state,
            measurements,
            noise: Noise { sum_of_squares: squares.sum(), degrees },
            antenna_residuals,
            antenna_normals,
            gnss_noise: Noise { sum_of_squares, degrees: f64::NAN },
        })
    }

    /// Variance factor of the image measurements.
    fn variance(&self) -> f64 {
        variance_factor(self.noise.sum_of_squares, self.noise.degrees)
    }

    /// Places of every measurement, in the order of the problem.
    fn places(&self) -> impl Iterator<Item = Place> + '_ {
        let starts = &self.problem.point_start;
        let of_point = move |(j, point): (usize, &'a Vector3<f64>)| {
            (starts[j]..starts[j + 1]).map(move |k| {
                let predicted = self.measurements[k].predicted;
                Place::new(self.problem, self.state, &self.problem.observations[k], predicted, point)
            })
        };
        self.state.points.iter().enumerate().flat_map(of_point)
    }
}

/// What tells how much scores vary from point to point.
pub struct Spread {
    length: Vec<f64>,
    squares: Vec<f64>,
    held: Vec<f64>,
}

impl Spread {
    /// Of the scores of a null model.
    pub fn of(scores: &ScoreSystem) -> Self {
        Self { length: scores.length.clone(), squares: scores.squares.clone(), held: scores.held.clone() }
    }
}

/// The columns of one test in a system.
struct Asked<'a> {
    system: &'a System,
    spread: &'a Spread,
    range: Range<usize>,
    noise: Noise,
}

impl Asked<'_> {
    /// Columns of the system.
    fn columns(&self, own: &[usize]) -> Vec<usize> {
        own.iter().map(|column| self.range.start + column).collect()
    }

    fn variance(&self) -> f64 {
        variance_factor(self.noise.sum_of_squares, self.noise.degrees)
    }

    /// How much more the scores vary from point to point than the weights say, at least 1.
    fn design_effect(&self, own: &[usize]) -> f64 {
        let Spread { squares, held, length } = self.spread;
        let ratios = self.columns(own).into_iter().filter(|c| held[*c] > KEPT_SHARE * length[*c]);
        let (sum, n) =
            ratios.fold((0.0, 0usize), |(sum, n), c| (sum + squares[c] / (self.variance() * held[c]), n + 1));
        if n == 0 { 1.0 } else { (sum / n as f64).max(1.0) }
    }

    /// Are the columns zero? `None` where the base model leaves none of them.
    fn test(&self, own: &[usize]) -> Option<Tested> {
        self.tested(own, self.noise, self.design_effect(own))
    }

    /// The same against the noise of another group.
    fn test_among(&self, own: &[usize], noise: Noise) -> Option<Tested> {
        self.tested(own, noise, 1.0)
    }

    fn tested(&self, own: &[usize], noise: Noise, inflation: f64) -> Option<Tested> {
        let pivoted = self.system.pivoted(&self.columns(own));
        let (drop, dof) = (pivoted.drop(), pivoted.kept.len());
        let left = noise.degrees - dof as f64;
        if dof == 0 || left <= 0.0 || left.is_nan() {
            return None;
        }
        let remaining = variance_factor(noise.sum_of_squares - drop, left);
        let statistic = drop / (dof as f64 * remaining * inflation);
        let ln_p_value = f_ln_sf(statistic, dof as f64, left).min(0.0);
        Some(Tested { statistic, dof, p_value: ln_p_value.exp(), ln_p_value })
    }

    /// Estimate of a column alone and its standard deviation for unit weight; `None` where it is absorbed.
    fn alone(&self, own: usize) -> Option<(f64, f64)> {
        let c = self.range.start + own;
        let m = self.system.information[(c, c)];
        (m > KEPT_SHARE * self.system.length[c] && m > 0.0).then(|| (self.system.score[c] / m, m.sqrt().recip()))
    }

    /// Estimates of two columns together and their chi-square for unit weight.
    fn pair(&self, a: usize, b: usize) -> Option<([f64; 2], f64)> {
        let (a, b) = (self.range.start + a, self.range.start + b);
        let System { information, score, length, .. } = self.system;
        let m = Matrix2::new(information[(a, a)], information[(a, b)], information[(a, b)], information[(b, b)]);
        if m.determinant() <= KEPT_SHARE.powi(2) * length[a] * length[b] {
            return None;
        }
        let s = Vector2::new(score[a], score[b]);
        let x = m.try_inverse()? * s;
        Some(([x.x, x.y], s.dot(&x)))
    }

    /// Joint estimates of columns, `None` where the base model leaves too little of one.
    fn estimates(&self, own: &[usize]) -> Option<DVector<f64>> {
        let columns = self.columns(own);
        let pivoted = self.system.pivoted(&columns);
        if pivoted.kept.len() < own.len() {
            return None;
        }
        let estimate = pivoted.estimate();
        let of = |c: &usize| pivoted.kept.iter().position(|kept| kept == c).map(|k| estimate[k]);
        Some(DVector::from_iterator(own.len(), columns.iter().filter_map(of)))
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
    /// Columns that stand for a test where they are not all of its own.
    shapes: Vec<(&'static str, Vec<usize>)>,
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

/// Coordinates of antennas whose redundancy is taken; of more, an even sample.
const REDUNDANCY_SAMPLE: usize = 300;
/// Name of the columns that tell the redundancy of the positions; no test.
const REDUNDANCY: &str = "(redundancy)";

/// The tests of a fit, laid out as columns.
pub struct Layout<'a> {
    context: Context<'a>,
    cells: sensor::Cells,
    spectrum: Option<spectrum::Spectrum>,
    covariates: Vec<Covariate<'a>>,
    found: Found,
}

impl<'a> Layout<'a> {
    /// Of a fit and its `measurements`.
    ///
    /// # Errors
    /// A state that cannot be evaluated.
    pub fn new(problem: &'a Problem, state: &'a State, measurements: &'a [Local]) -> Result<Self, AdjustError> {
        let context = Context::new(problem, state, measurements)?;
        let mut found = Found::default();
        let cells = sensor::Cells::new(&context);
        let spectrum = spectrum::Spectrum::new(&context, &mut found);
        let covariates = covariates::all(&context, &mut found);
        Ok(Self { context, cells, spectrum, covariates, found })
    }

    /// Calls `with` with the columns of all tests.
    fn families(&self) -> Families<'_> {
        let problem = self.context.problem;
        let mut list = vec![self.cells.family()];
        list.extend(self.spectrum.as_ref().map(spectrum::Spectrum::family));
        if problem.image_contexts.len() <= image::MOST_IMAGES {
            list.push(image::family(problem.image_contexts.len()));
        }
        for covariate in &self.covariates {
            let Family { against, count, local, fill, .. } = &covariate.family;
            let fill = move |place: &Place, to: &mut columns::Writer<'_>| fill(place, to);
            let (against, count, local) = (*against, *count, *local);
            list.push(Family { against, count, local, fill: Box::new(fill), coordinates: None });
        }
        list.extend(gnss::DIRECTIONS.iter().filter_map(|(name, _)| gnss::family(problem, name)));
        list.push(redundancy(problem));
        Families::new(problem, self.context.state, list)
    }

    /// Hands the columns of all tests to `test`, and judges what comes back: a system in which they are the last columns, and their spread.
    pub fn analyse<T, E>(
        mut self,
        comparison: Option<&Comparison>,
        significance: f64,
        test: impl FnOnce(&dyn Columns) -> Result<(T, System, Spread), E>,
    ) -> Result<(T, Structure), E> {
        let mut found = std::mem::take(&mut self.found);
        let families = self.families();
        let (tested, system, spread) = test(&families)?;
        let first = system.len() - families.dense() - families.local();
        let names: Vec<&'static str> = families.list.iter().map(|family| family.against).collect();
        let ranges: Vec<Range<usize>> =
            families.ranges().into_iter().map(|range| first + range.start..first + range.end).collect();
        drop(families);
        let asked = |name: &str| {
            let position = names.iter().position(|other| *other == name)?;
            Some(Asked { system: &system, spread: &spread, range: ranges[position].clone(), noise: self.context.noise })
        };
        if let Some(rows) = asked(REDUNDANCY).filter(|rows| !rows.range.is_empty()) {
            let share = rows.range.clone().map(|c| system.information[(c, c)]).sum::<f64>() / rows.range.len() as f64;
            self.context.gnss_noise.degrees = share * (3 * self.context.problem.gnss.len()) as f64;
        }
        let context = &self.context;
        if context.noise.degrees > 0.0 {
            asked("sensor").iter().for_each(|asked| self.cells.judge(asked, &mut found));
            if let (Some(spectrum), Some(asked)) = (&self.spectrum, asked("spectrum")) {
                spectrum.judge(&asked, &mut found);
            }
            let mut values = image::values(context);
            match asked("image") {
                Some(asked) => image::judge(context, &mut values, &asked, &mut found),
                None => found.skip("image", "too many images to test each"),
            }
            found.pictures.images = values.into_iter().filter(|value| value.n > 0).collect();
            for covariate in &self.covariates {
                let name = covariate.family.against;
                let Some(asked) = asked(name) else { continue };
                let all: Vec<usize> = (0..covariate.family.count).collect();
                found.push(name, asked.test(&all), covariate.description.clone());
            }
            covariates::draw(context, &self.covariates, &mut found);
            match is_noise(context.noise.sum_of_squares, context.noise.degrees) {
                true => autocorrelation::test(context, &mut found),
                false => found.skip("autocorrelation", "the residuals are much smaller than stated"),
            }
            for (name, _) in gnss::DIRECTIONS {
                match asked(name) {
                    Some(asked) => gnss::judge(context, name, &asked, &mut found),
                    None if context.problem.gnss.is_empty() => {}
                    None => found.skip(name, "no velocities, or too many flights"),
                }
            }
        } else {
            found.skip("sensor", "no redundancy");
        }
        check::test(comparison, &mut found);
        holm(&mut found.tests);
        let of_name = |name: &'static str| {
            let shape = found.shapes.iter().find(|(other, _)| *other == name).map(|(_, columns)| columns.clone());
            let position = names.iter().position(|other| *other == name)?;
            Some((name, shape.unwrap_or_else(|| ranges[position].clone().collect())))
        };
        let columns = found.tests.iter().filter(|test| test.decides).filter_map(|test| of_name(test.against)).collect();
        let Found { tests, skipped, pictures, .. } = found;
        Ok((tested, Structure { tests, skipped, pictures, significance, columns }))
    }
}

/// Coordinates of antennas as columns: what is left of each is its redundancy.
fn redundancy(problem: &Problem) -> Family<'_> {
    let stride = (3 * problem.gnss.len()).div_ceil(REDUNDANCY_SAMPLE).max(1);
    let count = 3 * problem.gnss.len().div_ceil(stride);
    let coordinates = move |coordinate: Coordinate, to: &mut dyn FnMut(usize, f64)| {
        let Coordinate::Gnss(g, axis) = coordinate else { return };
        if g.is_multiple_of(stride) {
            to(3 * (g / stride) + axis, problem.gnss[g].sigma[axis]);
        }
    };
    let coordinates: Option<columns::FillCoordinate<'_>> = Some(Box::new(coordinates));
    Family { against: REDUNDANCY, count, local: true, fill: Box::new(|_, _| {}), coordinates }
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
    threads: usize,
) -> Result<Structure, AdjustError> {
    let null = NullModel::new(problem.clone(), state.clone(), Vec::new(), threads)?;
    let measurements = null.measurements();
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
    let ((), structure) = Layout::new(problem, state, &measurements)?.analyse(comparison, significance, test)?;
    Ok(structure)
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
