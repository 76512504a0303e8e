//! One variance factor per group of observations: a wrong `tie_px` must not mis-scale what GNSS positions say.
//!
//! The factor of images is that of their residuals. Those of control and GNSS are variance components of their
//! coordinates, estimated from the null model conditional on the model as it stands: weights and causes take turns on
//! one likelihood, and a cause that a loosened group had hidden still lowers the objective. A group is let go as far as
//! its residuals ask: errors of positions that a limit leaves over look like focal lengths and principal points that
//! vary by image. Beyond [`FINDING`] times the stated standard deviation it is no question of precision any more but a
//! finding.
//!
//! Marks have a factor of their own beside that of the images (`marks.rs`): a person measures them, and their stated
//! precision seldom stands to that of tie points as it is stated. It is a variance component like those of the survey.
//!
//! Where the model has factors of single flights, those of images and GNSS are estimated by flight.
//!
//! Source: Förstner and Wrobel, Photogrammetric Computer Vision (2016), sec. 4.2.4.

mod flights;
mod groups;
mod marks;
#[cfg(test)]
mod tests;

use super::added::Added;
use super::linearised::{Linearised, Questions, with_candidates};
use super::settings::Settings;
use crate::block::Block;
use crate::math::statistics::chi_square_quantile;
use crate::model::{Model, SigmaFactors};
use crate::null_model::{Columns, Coordinate, Entries, Measured};
use crate::problem::Problem;
use crate::run::RunError;
use crate::run::fit::Fit;
use flights::{Flights, Share};
use groups::{Change, Groups, price_of_group};
use marks::Marks;

/// A group's stated precision is believed unless its variance factor is improbable at this level.
const BELIEVED: f64 = 0.01;
/// Rounds of the weights at the most: up to three for the images', whose flights spoil each other's residuals, then the
/// survey's, and what these change in both. Two or three are usual.
pub const ROUNDS: usize = 6;
/// Factor on a standard deviation beyond which it is a finding: three times what was stated is beyond any doubt about a
/// precision.
pub const FINDING: f64 = 3.0;
/// Largest factor on a standard deviation of the survey, as far above the stated value as the smallest is below it.
pub const MOST: f64 = 30.0;
/// Relative change of a factor below which the weights stand: it changes statistics by twice that.
const CHANGE: f64 = 0.02;
/// Change of the images' factor beyond which the survey's wait for the next round: how likely residuals of the survey
/// are is computed beside images of the present precision.
const IMAGES_FIRST: f64 = 0.05;
/// Smallest factor on a stated standard deviation: no receiver is thirty times better than its maker says. An exact
/// (simulated) survey would otherwise make every rounding of a formula significant.
const LEAST: f64 = 1.0 / 30.0;
/// Least factor on the standard deviation of image measurements: none is a hundred times better than stated. The
/// weights of an error-free block would leave nothing to control and GNSS.
const LEAST_IMAGE: f64 = 0.01;
/// Coordinates that take part in an estimate; of more, an even sample.
const SAMPLE: usize = 900;

/// Every observed coordinate as a column of its own: what a change of it would do.
struct Coordinates {
    control: usize,
    gnss: usize,
    stride: [usize; 2],
}

impl Coordinates {
    fn new(problem: &Problem) -> Self {
        let (control, gnss) = (problem.control.len(), problem.gnss.len());
        let stride = [control, gnss].map(|count| (3 * count).div_ceil(SAMPLE).max(1));
        Self { control: control.div_ceil(stride[0]), gnss: gnss.div_ceil(stride[1]), stride }
    }

    /// Coordinates of control and GNSS for each column.
    fn coordinates_per_column(&self, problem: &Problem) -> [f64; 2] {
        let of = |all: usize, taken: usize| all as f64 / taken.max(1) as f64;
        [of(problem.control.len(), self.control), of(problem.gnss.len(), self.gnss)]
    }

    /// Number of columns of control coordinates, which come first.
    fn of_control(&self) -> usize {
        3 * self.control
    }

    /// Columns of control coordinates: axes 0 and 1, or 2.
    fn control(&self, height: bool) -> Vec<usize> {
        (0..self.control).flat_map(|k| axes(height).map(move |axis| 3 * k + axis)).collect()
    }

    /// Columns of the antenna positions that are `of` what is asked for, by their number in the problem.
    fn gnss(&self, height: bool, of: impl Fn(usize) -> bool) -> Vec<usize> {
        let (first, stride) = (self.of_control(), self.stride[1]);
        let kept = (0..self.gnss).filter(|k| of(k * stride));
        kept.flat_map(|k| axes(height).map(move |axis| first + 3 * k + axis)).collect()
    }
}

/// Axes of a position: plan or height.
fn axes(height: bool) -> std::ops::Range<usize> {
    if height { 2..3 } else { 0..2 }
}

impl Coordinates {
    fn local(&self) -> usize {
        3 * (self.control + self.gnss)
    }

    fn coordinate(&self, coordinate: Coordinate, entries: &mut Entries<'_>) {
        let (number, axis, first, stride) = match coordinate {
            Coordinate::Control(number, axis) => (number, axis, 0, self.stride[0]),
            Coordinate::Gnss(number, axis) => (number, axis, self.of_control(), self.stride[1]),
        };
        if number.is_multiple_of(stride) {
            entries.standardised(first + 3 * (number / stride) + axis, 1.0);
        }
    }
}

/// What is asked beside the candidates.
struct Extra<'a> {
    coordinates: Coordinates,
    marks: Marks,
    flights: Option<&'a Flights>,
}

impl Columns for Extra<'_> {
    fn dense(&self) -> usize {
        self.flights.map_or(0, Flights::columns)
    }

    fn local(&self) -> usize {
        self.coordinates.local() + self.marks.columns()
    }

    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        if let Some(flights) = self.flights {
            flights.image(measured, x, y);
        }
        self.marks.image(self.coordinates.local(), measured, x, y);
    }

    fn coordinate(&self, coordinate: Coordinate, entries: &mut Entries<'_>) {
        self.coordinates.coordinate(coordinate, entries);
    }
}

/// Weights that the residuals of a fit ask for.
pub struct Weights {
    /// The model with them.
    pub model: Model,
    /// What the objective falls by through the groups of the survey: twice the logarithm of the likelihood ratio,
    /// less the price of every group that is not believed as stated.
    pub gain: f64,
    /// The same through the images.
    pub gain_of_images: f64,
}

/// The weights that the residuals of a fit ask for, conditional on its model; `None` where they are those that it has.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn reweighted(
    block: &Block,
    fit: &Fit,
    added: &Added,
    settings: &Settings<'_>,
) -> Result<Option<Weights>, RunError> {
    let mut next = weights(block, fit, added, None, settings)?;
    if !near(&images(&next.model), &images(&fit.model), IMAGES_FIRST) {
        (next.model, next.gain) = (with_survey_of(&next.model, &fit.model).unwrap_or(next.model), 0.0);
    }
    Ok((!same(&next.model, &fit.model)).then_some(next))
}

/// The survey as imprecise as it may be, beside images of the present precision.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn loosest(block: &Block, fit: &Fit, added: &Added, settings: &Settings<'_>) -> Result<Weights, RunError> {
    let Weights { model, gain, .. } = weights(block, fit, added, Some(MOST), settings)?;
    Ok(Weights { model: with_survey_of(&fit.model, &model).unwrap_or(model), gain, gain_of_images: 0.0 })
}

/// The objective of a fit, zero with the survey as precise as stated beside images of the same precision.
///
/// # Errors
/// A fit that cannot be linearised.
pub fn objective(block: &Block, fit: &Fit, added: &Added, settings: &Settings<'_>) -> Result<f64, RunError> {
    Ok(weights(block, fit, added, Some(1.0), settings)?.gain)
}

/// The weights that the residuals of a fit ask for. `survey`: factor on the standard deviations of the survey in place
/// of the estimated ones.
fn weights(
    block: &Block,
    fit: &Fit,
    added: &Added,
    survey: Option<f64>,
    settings: &Settings<'_>,
) -> Result<Weights, RunError> {
    let by_flight = !fit.model.flight_factors.is_empty();
    let flights = by_flight.then(|| Flights::new(&fit.problem, block.flights.len()));
    let (coordinates, marks) = (Coordinates::new(&fit.problem), Marks::new(&fit.problem));
    let extra = Extra { coordinates, marks, flights: flights.as_ref() };
    let asked = Questions { extra: &extra, ..Questions::nothing() };
    let linearised = with_candidates(block, fit, added, asked, settings)?;
    weighed(block, fit, &linearised, &extra, survey, settings)
}

/// Are the residuals of a fit so large that a contradiction in the survey may bend the images?
pub fn may_be_bent(fit: &Fit) -> bool {
    fit.chi_square() / fit.problem.redundancy().2 as f64 > FINDING * FINDING
}

/// `model` with the precision of the survey that another model states; `None` where it is the same.
pub fn with_survey_of(model: &Model, stated: &Model) -> Option<Model> {
    let mut other = model.clone();
    let SigmaFactors { image, mark, .. } = model.sigma_factors;
    other.sigma_factors = SigmaFactors { image, mark, ..stated.sigma_factors };
    for (flight, own) in &mut other.flight_factors {
        if let Some(stated) = stated.flight_factors.get(flight) {
            (own.gnss, own.gnss_z) = (stated.gnss, stated.gnss_z);
        }
    }
    (!same(&other, model)).then_some(other)
}

/// Is every group of the survey as precise as stated?
pub fn is_as_stated(model: &Model) -> bool {
    of_coordinates(model).into_iter().all(|factor| factor == 1.0)
}

/// `model` with no group of the survey less precise than `stated`; `None` where none is.
pub fn at_least_as_precise(model: &Model, stated: &Model) -> Option<Model> {
    let mut other = model.clone();
    let (own, stated_factors) = (&mut other.sigma_factors, stated.sigma_factors);
    own.control = own.control.min(stated_factors.control);
    own.control_z = own.control_z.min(stated_factors.control_z);
    own.gnss = own.gnss.min(stated_factors.gnss);
    own.gnss_z = own.gnss_z.min(stated_factors.gnss_z);
    for (flight, own) in &mut other.flight_factors {
        if let Some(stated) = stated.flight_factors.get(flight) {
            (own.gnss, own.gnss_z) = (own.gnss.min(stated.gnss), own.gnss_z.min(stated.gnss_z));
        }
    }
    (!same(&other, model)).then_some(other)
}

/// What the groups of the survey cost, whose precision in `model` is not the stated one, when they compete with causes:
/// each explains something that was not expected, as a cause does, and pays what one pays. (Weights are estimated at
/// the lower price of `BELIEVED`, for wrong ones make every test wrong.)
pub fn dearer_as_causes(model: &Model, stated: &Model, ln_level: f64) -> f64 {
    let price = |level: f64| chi_square_quantile(1.0 - level, 1.0);
    let differ = of_coordinates(model).into_iter().zip(of_coordinates(stated)).filter(|(own, stated)| own != stated);
    differ.count() as f64 * (price(ln_level.exp()) - price_of_group())
}

/// The model with the weights that a linearisation of its fit asks for.
fn weighed(
    block: &Block,
    fit: &Fit,
    linearised: &Linearised,
    extra: &Extra<'_>,
    survey: Option<f64>,
    settings: &Settings<'_>,
) -> Result<Weights, RunError> {
    let problem = &fit.problem;
    let now = fit.model.sigma_factors;
    let first = linearised.extra_columns.start;
    let first_coordinate = first + extra.dense();
    let of_coordinates = first_coordinate..first_coordinate + extra.coordinates.local();
    let groups = Groups::of(linearised, of_coordinates.start, settings);
    let coordinates = &extra.coordinates;
    let [of_control, of_gnss] = coordinates.coordinates_per_column(problem);
    let mut next = fit.model.clone();
    let mut gain_of_images = 0.0;
    let in_plan_and_height = |stride: f64, plan: (Vec<usize>, f64), height: (Vec<usize>, f64)| {
        let of = |(columns, now): (Vec<usize>, f64)| {
            let next =
                survey.filter(|_| !columns.is_empty()).unwrap_or_else(|| groups.factor(&columns, now, [LEAST, MOST]));
            Change { columns, stride, now, next }
        };
        rayon::join(|| of(plan), || of(height))
    };
    let mut changes: Vec<Change> = Vec::new();
    let mut noted = |(plan, height): (Change, Change)| {
        let factors = (plan.next, height.next);
        changes.extend([plan, height]);
        factors
    };
    let factors = &mut next.sigma_factors;
    (factors.control, factors.control_z) = noted(in_plan_and_height(
        of_control,
        (coordinates.control(false), now.control),
        (coordinates.control(true), now.control_z),
    ));
    if let Some(flights) = extra.flights {
        let shares = flights.shares(linearised, fit)?;
        for (flight, (name, share)) in block.flights.iter().zip(shares).enumerate() {
            let Some(own) = next.flight_factors.get_mut(name) else { continue };
            let of = |number: usize| flights.of_image(problem.gnss[number].index) == flight;
            let image = share.factor(own.image);
            gain_of_images += share.gain(own.image, image);
            own.image = image;
            (own.gnss, own.gnss_z) = noted(in_plan_and_height(
                of_gnss,
                (coordinates.gnss(false, of), own.gnss),
                (coordinates.gnss(true, of), own.gnss_z),
            ));
        }
    } else {
        // What is left of the redundancy and of v'Pv is that of the tie points.
        let mut images = Share { chi_square: linearised.null.chi_square(), redundancy: problem.redundancy().2 as f64 };
        for column in of_coordinates.clone().take(coordinates.of_control()) {
            images.chi_square -= of_control * residual(linearised, column).powi(2);
        }
        for column in of_coordinates.skip(coordinates.of_control()) {
            images.chi_square -= of_gnss * residual(linearised, column).powi(2);
            images.redundancy -= of_gnss * linearised.system.information[(column, column)];
        }
        let (chi_square, redundancy) = marks::with_control(fit)?;
        images.chi_square -= chi_square;
        images.redundancy -= redundancy;
        factors.image = images.factor(now.image);
        gain_of_images = images.gain(now.image, factors.image);
        let all = |_| true;
        (factors.gnss, factors.gnss_z) = noted(in_plan_and_height(
            of_gnss,
            (coordinates.gnss(false, all), now.gnss),
            (coordinates.gnss(true, all), now.gnss_z),
        ));
    }
    let gain = groups.gain(&changes);
    // Marks are as precise as stated beside the tie points, unless that is improbable.
    if near(&images(&next), &images(&fit.model), IMAGES_FIRST) {
        let groups = marks::beside_unknown_control(&groups, coordinates);
        let columns: Vec<usize> = (0..extra.marks.columns()).map(|k| coordinates.local() + k).collect();
        // Both factors together have the limits of one: marks of an error-free block are no better than its tie points.
        let [least, most] = [LEAST_IMAGE, MOST].map(|limit| limit / next.sigma_factors.image);
        let factor = groups.factor(&columns, now.mark, [least.min(1.0), most.max(1.0)]);
        gain_of_images += groups.gain(&[Change { columns, stride: extra.marks.stride, now: now.mark, next: factor }]);
        next.sigma_factors.mark = factor;
    }
    Ok(Weights { model: next, gain, gain_of_images })
}

impl Share {
    /// Factor on the standard deviations of the group, which were multiplied by `now` in the fit.
    fn factor(self, now: f64) -> f64 {
        let Self { chi_square, redundancy } = self;
        // Without redundancy nothing is known of a precision.
        if redundancy < 1.0 {
            return now;
        }
        let variance = chi_square / redundancy;
        let spread = chi_square_quantile(1.0 - 0.5 * BELIEVED, redundancy) / redundancy - 1.0;
        let factor = if (variance - 1.0).abs() > spread { variance.sqrt() } else { 1.0 };
        (now * factor).max(LEAST_IMAGE)
    }

    /// Twice the logarithm of the likelihood ratio of the factor `next` against `now`.
    fn gain(&self, now: f64, next: f64) -> f64 {
        let ratio = (next / now).powi(2);
        self.chi_square * (1.0 - 1.0 / ratio) - self.redundancy * ratio.ln()
    }
}

/// Standardised residual of an observed coordinate: its column has nothing but its own row.
fn residual(linearised: &Linearised, column: usize) -> f64 {
    linearised.scores.score[column]
}

/// Do the factors of two models differ by less than statistics see?
pub fn same(a: &Model, b: &Model) -> bool {
    near(&images(a), &images(b), CHANGE) && near(&of_coordinates(a), &of_coordinates(b), CHANGE)
}

fn near(a: &[f64], b: &[f64], change: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < change)
}

/// Factors of the images.
fn images(model: &Model) -> Vec<f64> {
    let flights = model.flight_factors.values().map(|of| of.image);
    [model.sigma_factors.image, model.sigma_factors.mark].into_iter().chain(flights).collect()
}

/// Factors of the groups of coordinates.
fn of_coordinates(model: &Model) -> Vec<f64> {
    let SigmaFactors { control, control_z, gnss, gnss_z, .. } = model.sigma_factors;
    let flights = model.flight_factors.values().flat_map(|of| [of.gnss, of.gnss_z]);
    [control, control_z, gnss, gnss_z].into_iter().chain(flights).collect()
}
