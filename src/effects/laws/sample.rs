//! Random places at which the laws are checked, and the calls there.

use crate::effects::{
    BlockContext, Context, Descriptor, Effect, ImageContext, OutsideDomain, Parameter, Role, Stage, SurveyedKind,
};
use crate::math::rotation::log;
use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt};

/// Sensor of the samples, px.
pub(super) const SENSOR: [f64; 2] = [5120.0, 3840.0];

/// A place at which an effect is evaluated.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Constants of the block.
    pub block: BlockContext,
    /// Constants of the image.
    pub image: ImageContext,
    /// Image point at the end of the chain, px.
    pub place: [f64; 2],
    /// Of the frame stage: what the coordinate belongs to.
    pub surveyed: Option<SurveyedKind>,
    /// Input of the stage.
    pub input: Vec<f64>,
    /// Parameters: estimated and random ones within twice their typical size, searched ones in their domain, given
    /// ones at a named value or their default.
    pub theta: Vec<f64>,
}

impl Sample {
    /// Draws one.
    pub fn draw(descriptor: &Descriptor, random: &mut impl Rng) -> Self {
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        // Temperatures of forty images, in order of time, uneven.
        let mut clock = 0.0;
        let temperature_history: Vec<[f64; 2]> = (0..40)
            .map(|_| {
                clock += between(1.0, 20.0);
                [clock, between(15.0, 30.0)]
            })
            .collect();
        let mean = temperature_history.iter().map(|row| row[1]).sum::<f64>() / 40.0;
        let block = BlockContext {
            centre: Vector3::new(between(-5.0, 5.0), between(-5.0, 5.0), between(40.0, 60.0)),
            survey_centre: Vector3::new(between(-5.0, 5.0), between(-5.0, 5.0), between(0.0, 2.0)),
            counts: [40, 3, 1],
            mean_temperature_c: mean,
            temperature_history: temperature_history.clone(),
        };
        let index = between(0.0, 40.0) as usize;
        let [time_s, temperature_c] = temperature_history[index];
        let place = [between(0.0, SENSOR[0]), between(0.0, SENSOR[1])];
        let image = ImageContext {
            image: index as u32,
            flight: (index / 14) as u32,
            camera: 0,
            width_px: SENSOR[0],
            height_px: SENSOR[1],
            time_s,
            tau: between(-0.5, 0.5),
            tau_order: between(-0.5, 0.5),
            flight_time_s: between(0.0, 200.0),
            flight_span_s: 200.0,
            temperature_c,
            velocity: Vector3::new(between(-8.0, 8.0), between(-8.0, 8.0), between(-1.0, 1.0)),
            velocity_sigma: f64::NAN,
            angular_velocity: Vector3::new(between(-0.5, 0.5), between(-0.5, 0.5), between(-0.5, 0.5)),
            exposure_s: between(1e-4, 1e-2),
            focus_m: between(10.0, 100.0),
        };
        // A camera turned at random about its axis that looks past the point, a third of them straight down (half a
        // turn: the rotation vector's length is pi), the others up to 50 degrees from it.
        let point = Vector3::new(between(-50.0, 50.0), between(-50.0, 50.0), between(-2.0, 10.0));
        let aim = point + Vector3::new(between(-15.0, 15.0), between(-15.0, 15.0), between(-2.0, 2.0));
        let (height, lean) = (between(40.0, 120.0), if between(0.0, 3.0) < 1.0 { 0.0 } else { 0.8 });
        let away = [between(-1.0, 1.0), between(-1.0, 1.0)].map(|value| value * lean * height);
        let centre = aim + Vector3::new(away[0], away[1], height);
        let forward = (aim - centre).normalize();
        let heading = between(-3.1, 3.1);
        let right = Vector3::new(heading.cos(), heading.sin(), 0.0).cross(&forward).normalize();
        let rotation = Matrix3::from_rows(&[right.transpose(), forward.cross(&right).transpose(), forward.transpose()]);
        let r = log(&rotation);
        let interior = [
            between(4000.0, 6000.0),
            2560.0 + between(-30.0, 30.0),
            1920.0 + between(-30.0, 30.0),
            2560.0 + between(-60.0, 60.0),
            1920.0 + between(-60.0, 60.0),
            between(-5e-9, 5e-9),
            between(-1e-16, 1e-16),
            between(-3e-24, 3e-24),
            between(-1e-7, 1e-7),
            between(-1e-7, 1e-7),
            between(-1e-3, 1e-3),
            between(-1e-3, 1e-3),
        ];
        let surveyed = (descriptor.stage == Stage::Frame)
            .then(|| if between(0.0, 2.0) < 1.0 { SurveyedKind::Point } else { SurveyedKind::Antenna });
        let input = match descriptor.stage {
            Stage::Exposure | Stage::Position => [r.as_slice(), centre.as_slice()].concat(),
            Stage::Ray => [r.as_slice(), centre.as_slice(), point.as_slice()].concat(),
            Stage::Interior => [&interior, r.as_slice()].concat(),
            Stage::Image => [&place.map(|value| value + between(-2.0, 2.0)), &interior[..]].concat(),
            Stage::Frame if surveyed == Some(SurveyedKind::Antenna) => centre.as_slice().to_vec(),
            Stage::Control | Stage::Frame => point.as_slice().to_vec(),
        };
        let theta = draw_theta(descriptor, |parameter, u| parameter.typical * (4.0 * u - 2.0), random);
        Self { block, image, place, surveyed, input, theta }
    }

    /// What the effect sees there.
    pub fn context(&self) -> Context<'_> {
        let Self { block, image, place: [column_px, row_px], surveyed, .. } = self;
        Context { block, image, column_px: *column_px, row_px: *row_px, surveyed: *surveyed }
    }
}

impl std::fmt::Display for Sample {
    /// What decides: the input, the parameters, and where the measurement lies.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, y] = self.place;
        write!(f, "input {:?}, parameters {:?}, at ({x:.1}, {y:.1}) px", self.input, self.theta)
    }
}

/// Parameters at random; `estimated` gives those that are estimated or random from a uniform number.
pub(super) fn draw_theta(
    descriptor: &Descriptor,
    estimated: impl Fn(&Parameter, f64) -> f64,
    random: &mut impl Rng,
) -> Vec<f64> {
    let draw = |parameter: &Parameter| {
        let u: f64 = random.random_range(0.0..1.0);
        match &parameter.role {
            Role::Estimated | Role::Random(_) | Role::VelocityError => estimated(parameter, u),
            Role::Searched(domain) => {
                let (low, high) = domain.bounds(SENSOR[0], SENSOR[1]);
                low + u * (high - low)
            }
            Role::Given(named) if named.is_empty() => parameter.nominal,
            Role::Given(named) => named[((u * named.len() as f64) as usize).min(named.len() - 1)].1,
        }
    };
    descriptor.parameters.iter().map(draw).collect()
}

/// Output and derivatives at a place; the derivatives are pre-filled with NaN, so that entries left out show.
pub(super) struct Evaluation {
    pub(super) out: Vec<f64>,
    pub(super) d_input: Vec<f64>,
    pub(super) d_theta: Vec<f64>,
}

pub(super) fn evaluate(effect: &dyn Effect, sample: &Sample) -> Result<Evaluation, OutsideDomain> {
    let (stage, p) = (effect.descriptor().stage, sample.theta.len());
    let mut out = vec![f64::NAN; stage.outputs()];
    let mut d_input = vec![f64::NAN; stage.outputs() * stage.inputs()];
    let mut d_theta = vec![f64::NAN; stage.outputs() * p];
    let context = sample.context();
    effect.eval(&context, &sample.input, &sample.theta, &mut out, Some(&mut d_input), Some(&mut d_theta))?;
    Ok(Evaluation { out, d_input, d_theta })
}

pub(super) fn output(effect: &dyn Effect, sample: &Sample) -> Result<Vec<f64>, OutsideDomain> {
    let mut out = vec![f64::NAN; effect.descriptor().stage.outputs()];
    effect.eval(&sample.context(), &sample.input, &sample.theta, &mut out, None, None)?;
    Ok(out)
}

/// Output of an effect at one place of a block of which nothing is known; column and row are the input's
/// first two values at the image stage, else the sensor's centre when the image's size is known.
///
/// # Panics
/// Outside the effect's domain: for tests with worked numbers.
pub fn value(effect: &dyn Effect, image: &ImageContext, input: &[f64], theta: &[f64]) -> Vec<f64> {
    let place = match effect.descriptor().stage {
        Stage::Image => [input[0], input[1]],
        _ => [0.5 * image.width_px, 0.5 * image.height_px],
    };
    let sample = Sample {
        block: BlockContext::default(),
        image: *image,
        place,
        surveyed: None,
        input: input.to_vec(),
        theta: theta.to_vec(),
    };
    output(effect, &sample).expect("inside the effect's domain")
}
