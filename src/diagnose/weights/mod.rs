//! One variance factor per group of observations: a wrong `tie_px` must not mis-scale what GNSS positions say.
//!
//! The factor of images is that of their residuals. Those of control and GNSS are variance components of their coordinates, estimated from
//! the null model beside everything that the candidates of their stages could explain: a missing lever arm does not pass for noise. Where a
//! group looks less precise than stated, what the camera could explain is asked, too: seen from the air, a focal length that varies by image is
//! nearly a height that does, and of the two that one stands which is likelier. A group is never let go: beyond [`MOST`] times the stated
//! standard deviation it is no question of precision any more but a finding, and the block would bend freely.
//!
//! Where the model has factors of single flights, those of images and GNSS are estimated by flight.
//!
//! Source: Förstner and Wrobel, Photogrammetric Computer Vision (2016), sec. 4.2.4.

mod flights;
#[cfg(test)]
mod tests;

use super::added::Added;
use super::candidate::Candidate;
use super::catalogue;
use super::fit::{DiagnoseError, Fit};
use super::linearised::{Linearised, Questions, with_candidates};
use super::select::Nature;
use super::settings::Settings;
use super::test::{System, random};
use crate::adjust::native::null_model::{Columns, Coordinate, Entries, Measured};
use crate::block::Block;
use crate::effects::Stage;
use crate::math::statistics::chi_square_quantile;
use crate::model::{Model, SigmaFactors};
use crate::problem::Problem;
use flights::{Flights, Share};

/// A group's stated precision is believed unless its variance factor is improbable at this level.
const BELIEVED: f64 = 0.01;
/// Largest factor that a standard deviation is multiplied by: three times what was stated is beyond any doubt about a precision.
pub const MOST: f64 = 3.0;
/// Relative change of a factor below which the weights stand: it changes statistics by twice that.
const CHANGE: f64 = 0.02;
/// Least variance that is left of a group, as a share of the stated one: no receiver is ten times better than its maker says.
const LEAST_SHARE: f64 = 0.01;
/// Least factor on the standard deviation of image measurements: none is a hundred times better than stated. The weights of an error-free block
/// would leave nothing to control and GNSS.
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

    /// Columns of control coordinates: axes 0 and 1, or 2.
    fn control(&self, height: bool) -> Vec<usize> {
        (0..self.control).flat_map(|k| axes(height).map(move |axis| 3 * k + axis)).collect()
    }

    /// Columns of the antenna positions that are `of` what is asked for, by their number in the problem.
    fn gnss(&self, height: bool, of: impl Fn(usize) -> bool) -> Vec<usize> {
        let (first, stride) = (3 * self.control, self.stride[1]);
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
            Coordinate::Gnss(number, axis) => (number, axis, 3 * self.control, self.stride[1]),
        };
        if number.is_multiple_of(stride) {
            entries.standardised(first + 3 * (number / stride) + axis, 1.0);
        }
    }
}

/// What is asked beside the candidates.
struct Extra<'a> {
    coordinates: Coordinates,
    flights: Option<&'a Flights>,
}

impl Columns for Extra<'_> {
    fn dense(&self) -> usize {
        self.flights.map_or(0, Flights::columns)
    }

    fn local(&self) -> usize {
        self.coordinates.local()
    }

    fn image(&self, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        if let Some(flights) = self.flights {
            flights.image(measured, x, y);
        }
    }

    fn coordinate(&self, coordinate: Coordinate, entries: &mut Entries<'_>) {
        self.coordinates.coordinate(coordinate, entries);
    }
}

/// Stages whose effects move observed coordinates.
const OF_COORDINATES: [Stage; 4] = [Stage::Position, Stage::Exposure, Stage::Control, Stage::Frame];

/// A model with the weights that the residuals of its fit ask for; `None` where they are those that it has.
pub fn reweighted(
    block: &Block,
    fit: &Fit,
    added: &Added,
    settings: &Settings<'_>,
) -> Result<Option<Model>, DiagnoseError> {
    let by_flight = !fit.model.flight_factors.is_empty();
    let flights = by_flight.then(|| Flights::new(&fit.problem, block.flights.len()));
    let extra = Extra { coordinates: Coordinates::new(&fit.problem), flights: flights.as_ref() };
    let beside = |stages: &[Stage]| -> Result<Model, DiagnoseError> {
        let wanted = |candidate: &Candidate| {
            candidate.physical && candidate.term().is_some_and(|term| stages.contains(&term.effect.descriptor().stage))
        };
        let (tested, untested) = catalogue::candidates(block, fit, added, settings.plugins, wanted);
        let asked = Questions { tested, untested, extra: &extra, ..Questions::nothing() };
        let linearised = with_candidates(block, fit, added, asked, settings)?;
        weighed(block, fit, &linearised, &extra, settings)
    };
    let mut next = beside(&OF_COORDINATES)?;
    if less_precise(&fit.model, &next) {
        let [position, exposure, control, frame] = OF_COORDINATES;
        next = beside(&[position, exposure, control, frame, Stage::Interior])?;
    }
    Ok((!same(&next, &fit.model)).then_some(next))
}

/// The model with the weights that a linearisation of its fit asks for.
fn weighed(
    block: &Block,
    fit: &Fit,
    linearised: &Linearised,
    extra: &Extra<'_>,
    settings: &Settings<'_>,
) -> Result<Model, DiagnoseError> {
    let problem = &fit.problem;
    let now = fit.model.sigma_factors;
    let first = linearised.extra_columns.start;
    let of_coordinates = first + extra.dense()..linearised.extra_columns.end;
    let groups = Coordinated::of(linearised, of_coordinates.start, settings);
    let coordinates = &extra.coordinates;
    let mut next = fit.model.clone();
    let in_plan_and_height = |plan: (Vec<usize>, f64), height: (Vec<usize>, f64)| {
        rayon::join(|| groups.factor(&plan.0, plan.1), || groups.factor(&height.0, height.1))
    };
    let factors = &mut next.sigma_factors;
    (factors.control, factors.control_z) =
        in_plan_and_height((coordinates.control(false), now.control), (coordinates.control(true), now.control_z));
    if let Some(flights) = extra.flights {
        let shares = flights.shares(linearised, fit)?;
        for (flight, (name, share)) in block.flights.iter().zip(shares).enumerate() {
            let Some(own) = next.flight_factors.get_mut(name) else { continue };
            let of = |number: usize| flights.of_image(problem.gnss[number].index) == flight;
            own.image = share.factor(own.image);
            (own.gnss, own.gnss_z) =
                in_plan_and_height((coordinates.gnss(false, of), own.gnss), (coordinates.gnss(true, of), own.gnss_z));
        }
    } else {
        // What is left of the redundancy and of v'Pv is the images'.
        let mut images = Share { chi_square: linearised.null.chi_square(), redundancy: problem.redundancy().2 as f64 };
        for column in of_coordinates {
            images.redundancy -= linearised.system.information[(column, column)];
            images.chi_square -= residual(linearised, column).powi(2);
        }
        factors.image = images.factor(now.image);
        let all = |_| true;
        (factors.gnss, factors.gnss_z) =
            in_plan_and_height((coordinates.gnss(false, all), now.gnss), (coordinates.gnss(true, all), now.gnss_z));
    }
    Ok(next)
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
}

/// Standardised residual of an observed coordinate: its column has nothing but its own row.
fn residual(linearised: &Linearised, column: usize) -> f64 {
    linearised.scores.score[column]
}

/// Do the factors of two models differ by less than statistics see?
fn same(a: &Model, b: &Model) -> bool {
    let image = |model: &Model| -> Vec<f64> {
        let flights = model.flight_factors.values().map(|of| of.image);
        std::iter::once(model.sigma_factors.image).chain(flights).collect()
    };
    let near = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < CHANGE);
    near(image(a), image(b)) && near(of_coordinates(a), of_coordinates(b))
}

/// Is a group of coordinates that was believed as stated less precise in the other model?
fn less_precise(now: &Model, next: &Model) -> bool {
    of_coordinates(now).iter().zip(of_coordinates(next)).any(|(now, next)| *now == 1.0 && next > 1.0)
}

/// Factors of the groups of coordinates.
fn of_coordinates(model: &Model) -> Vec<f64> {
    let SigmaFactors { control, control_z, gnss, gnss_z, .. } = model.sigma_factors;
    let flights = model.flight_factors.values().flat_map(|of| [of.gnss, of.gnss_z]);
    [control, control_z, gnss, gnss_z].into_iter().chain(flights).collect()
}

/// Groups of observed coordinates.
struct Coordinated<'a> {
    /// Beside everything that is in or asked for, but for the values per image that are not in.
    beside: System,
    /// Columns of these values.
    chances: Vec<&'a [usize]>,
    /// Column of the first coordinate.
    first: usize,
}

impl<'a> Coordinated<'a> {
    fn of(linearised: &'a Linearised, first: usize, settings: &Settings<'_>) -> Self {
        let situation = linearised.situation(settings, &Default::default());
        let (mut fixed, random) = situation.parts_in();
        let is_in = |s: &usize| situation.taken.iter().any(|taken| taken.set == *s);
        let asked = (0..linearised.sets.len()).filter(|s| !is_in(s)).map(|s| &linearised.sets[s]);
        let (laws, chances): (Vec<_>, Vec<_>) = asked.partition(|set| set.nature == Nature::Law);
        fixed.extend(laws.into_iter().map(|set| set.columns.clone()));
        let beside = linearised.system.beside(&fixed, &random);
        Self { beside, chances: chances.into_iter().map(|set| set.columns.as_slice()).collect(), first }
    }

    /// Factor on the stated standard deviations of a group of coordinates, which were multiplied by `now` in the fit. What is stated stands
    /// unless it is improbable, whatever an effect that was missing before has made of it.
    fn factor(&self, group: &[usize], now: f64) -> f64 {
        let Self { beside, chances, first } = self;
        let own: Vec<usize> = group.iter().map(|column| first + column).collect();
        if own.is_empty() {
            return now;
        }
        let Some(values) = random::values(beside, &own) else { return 1.0 };
        let variance = 1.0;
        let size = values.variance(variance, LEAST_SHARE - 1.0);
        let as_stated = now.powi(-2) - 1.0;
        let gain = values.likelihood_ratio(variance, size) - values.likelihood_ratio(variance, as_stated);
        let improbable = gain > chi_square_quantile(1.0 - BELIEVED, 1.0);
        // Likelihoods of both are of the same weights only where the group has its stated one, and of the same noise only with the same variance:
        // where images are less precise than stated, too, what is likelier is seen when they have their own weight.
        let by_images = || {
            let of = |columns: &&[usize]| random::largest_likelihood_ratio(beside, columns, variance);
            size > 0.0 && now == 1.0 && chances.iter().filter_map(of).any(|by_images| by_images > gain)
        };
        if improbable && !by_images() { (now * (1.0 + size).sqrt()).min(MOST) } else { 1.0 }
    }
}
