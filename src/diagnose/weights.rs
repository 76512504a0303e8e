//! One variance factor per group of observations: a wrong `tie_px` must not mis-scale what GNSS positions say.
//!
//! The factor of images is that of their residuals. Those of control and GNSS are variance components of their coordinates, estimated from
//! the null model beside everything that the candidates of their stages could explain: a missing lever arm does not pass for noise. A group is
//! never let go: beyond [`MOST`] times the stated standard deviation it is no question of precision any more but a finding, and the block
//! would bend freely.
//!
//! Source: Förstner and Wrobel, Photogrammetric Computer Vision (2016), sec. 4.2.4.

use super::catalogue;
use super::fit::{DiagnoseError, Fit};
use super::improve::Settings;
use super::linearised::{Added, Linearised, Questions, with_candidates};
use super::select::Nature;
use super::test::random;
use crate::adjust::native::null_model::{Columns, Coordinate, Entries, Measured};
use crate::block::Block;
use crate::effects::Stage;
use crate::math::statistics::chi_square_quantile;
use crate::model::SigmaFactors;
use crate::problem::Problem;

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

    /// Columns of a group: axes 0 and 1, or 2.
    fn group(&self, gnss: bool, height: bool) -> Vec<usize> {
        let (first, count) = if gnss { (3 * self.control, self.gnss) } else { (0, self.control) };
        let axes = if height { 2..3 } else { 0..2 };
        (0..count).flat_map(|k| axes.clone().map(move |axis| first + 3 * k + axis)).collect()
    }
}

impl Columns for Coordinates {
    fn dense(&self) -> usize {
        0
    }

    fn local(&self) -> usize {
        3 * (self.control + self.gnss)
    }

    fn image(&self, _: &Measured<'_>, _: &mut Entries<'_>, _: &mut Entries<'_>) {}

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

/// The factors that the residuals of a fit ask for; `None` where they are those that it has.
pub fn factors(
    block: &Block,
    fit: &Fit,
    added: &Added,
    settings: &Settings<'_>,
) -> Result<Option<SigmaFactors>, DiagnoseError> {
    let coordinates = Coordinates::new(&fit.problem);
    let (mut tested, untested) = catalogue::candidates(block, fit, added, settings.plugins);
    tested.retain(|(candidate, _)| {
        let stage = candidate.term().map(|term| term.effect.descriptor().stage);
        let bears = [Stage::Position, Stage::Exposure, Stage::Control, Stage::Frame];
        stage.is_some_and(|stage| bears.contains(&stage))
    });
    let linearised = with_candidates(
        block,
        fit,
        added,
        Questions { tested, untested, extra: &coordinates, ..Questions::nothing() },
        settings,
    )?;
    let now = fit.model.sigma_factors;
    let groups = Groups { coordinates: &coordinates, linearised: &linearised, settings };
    let control = groups.factor(false, false, now.control);
    let control_z = groups.factor(false, true, now.control_z);
    let gnss = groups.factor(true, false, now.gnss);
    let gnss_z = groups.factor(true, true, now.gnss_z);
    // What is left of the redundancy and of v'Pv is the images'.
    let (mut chi_square, mut redundancy) = (linearised.null.chi_square(), fit.problem.redundancy().2 as f64);
    for column in linearised.extra_columns.clone() {
        redundancy -= linearised.system.information[(column, column)];
        chi_square -= residual(&linearised, column).powi(2);
    }
    let variance = chi_square / redundancy;
    let spread = chi_square_quantile(1.0 - 0.5 * BELIEVED, redundancy) / redundancy - 1.0;
    let image = if (variance - 1.0).abs() > spread { variance.sqrt() } else { 1.0 };
    let image = (now.image * image).max(LEAST_IMAGE);
    let next = SigmaFactors { image, control, control_z, gnss, gnss_z };
    Ok((!same(next, now)).then_some(next))
}

/// Standardised residual of an observed coordinate: its column has nothing but its own row.
fn residual(linearised: &Linearised, column: usize) -> f64 {
    linearised.scores.score[column]
}

/// Do factors differ by less than statistics see?
fn same(a: SigmaFactors, b: SigmaFactors) -> bool {
    let pairs = [
        (a.image, b.image),
        (a.control, b.control),
        (a.control_z, b.control_z),
        (a.gnss, b.gnss),
        (a.gnss_z, b.gnss_z),
    ];
    pairs.into_iter().all(|(a, b)| (a / b - 1.0).abs() < CHANGE)
}

struct Groups<'a> {
    coordinates: &'a Coordinates,
    linearised: &'a Linearised,
    settings: &'a Settings<'a>,
}

impl Groups<'_> {
    /// Factor on the stated standard deviations of a group, which were multiplied by `now` in the fit. What is stated stands unless it is
    /// improbable, whatever an effect that was missing before has made of it.
    fn factor(&self, gnss: bool, height: bool, now: f64) -> f64 {
        let Self { coordinates, linearised, settings } = self;
        let first = linearised.extra_columns.start;
        let own: Vec<usize> = coordinates.group(gnss, height).into_iter().map(|c| first + c).collect();
        if own.is_empty() {
            return now;
        }
        let situation = linearised.situation(settings, &Default::default());
        let (mut fixed, random) = situation.parts_in();
        for (s, set) in linearised.sets.iter().enumerate() {
            if set.nature == Nature::Law && !situation.taken.iter().any(|taken| taken.set == s) {
                fixed.extend(&set.columns);
            }
        }
        let beside = linearised.system.beside(&fixed, &random);
        let variance = 1.0;
        let size = random::estimate(&beside, &own, variance, LEAST_SHARE - 1.0);
        let likelihood = |size: f64| random::likelihood_ratio(&beside, &own, variance, size);
        let as_stated = now.powi(-2) - 1.0;
        let improbable = likelihood(size) - likelihood(as_stated) > chi_square_quantile(1.0 - BELIEVED, 1.0);
        if improbable { (now * (1.0 + size).sqrt()).min(MOST) } else { 1.0 }
    }
}
