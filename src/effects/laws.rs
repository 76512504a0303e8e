//! Test kit: the laws that every effect must keep, checked at random places. Built-in effects and plug-ins alike.
//!
//! [`check`] runs them all: descriptor, null law, purity, derivatives, finiteness, needs. Each is also callable alone. The random
//! places ([`Sample`]) are those of a small aerial block: 40 to 120 m above ground, nadir and oblique, a 20 megapixel camera.

use super::{BlockContext, Context, Descriptor, Domain, Effect, ImageContext, Need, OutsideDomain, Role, Stage};
use crate::math::rotation::{exp, left_jacobian, log};
use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;

/// Largest error of a derivative beside the doubt of the differences, relative to the largest of its column: far above the rounding of
/// the formula, far below any slip of a sign, a factor or a term.
pub const DERIVATIVE_TOLERANCE: f64 = 1e-6;

/// Number of random places of every law.
pub const SAMPLES: usize = 200;

/// Sensor of the samples, px.
const SENSOR: [f64; 2] = [5120.0, 3840.0];

/// Step of the first difference, as a fraction of the variable's size.
const FIRST_STEP: f64 = 0.1;

/// A law that an effect breaks, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{effect}: {law}: {detail}")]
pub struct Violation {
    /// Id of the effect.
    pub effect: String,
    /// Name of the law.
    pub law: &'static str,
    /// What was found.
    pub detail: String,
}

/// A place at which an effect is evaluated.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Constants of the block.
    pub block: BlockContext,
    /// Constants of the image.
    pub image: ImageContext,
    /// Observed image point, px.
    pub observed: [f64; 2],
    /// Input of the stage.
    pub input: Vec<f64>,
    /// Parameters: estimated and random ones within twice their typical size, searched ones in their domain, given ones at a
    /// named value or their default.
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
            survey_mean: Vector3::new(between(-5.0, 5.0), between(-5.0, 5.0), between(0.0, 2.0)),
            counts: [40, 3, 1],
            mean_temperature_c: mean,
            temperature_history: temperature_history.clone(),
        };
        let index = between(0.0, 40.0) as usize;
        let [time_s, temperature_c] = temperature_history[index];
        let observed = [between(0.0, SENSOR[0]), between(0.0, SENSOR[1])];
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
            angular_velocity: Vector3::new(between(-0.5, 0.5), between(-0.5, 0.5), between(-0.5, 0.5)),
            exposure_s: between(1e-4, 1e-2),
            focus_m: between(10.0, 100.0),
        };
        // A camera that looks at a ground point, up to 50 degrees from the nadir, turned at random about its axis.
        let point = Vector3::new(between(-50.0, 50.0), between(-50.0, 50.0), between(-2.0, 10.0));
        let height = between(40.0, 120.0);
        let centre = point + Vector3::new(between(-0.8, 0.8) * height, between(-0.8, 0.8) * height, height);
        let aim = point + Vector3::new(between(-15.0, 15.0), between(-15.0, 15.0), between(-2.0, 2.0));
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
        let input = match descriptor.stage {
            Stage::Exposure | Stage::Position => [r.as_slice(), centre.as_slice()].concat(),
            Stage::Ray => [r.as_slice(), centre.as_slice(), point.as_slice()].concat(),
            Stage::Interior => [&interior, r.as_slice()].concat(),
            Stage::Image => [&observed.map(|value| value + between(-2.0, 2.0)), &interior[..]].concat(),
            Stage::Control => point.as_slice().to_vec(),
        };
        let theta = draw_theta(descriptor, |parameter, u| parameter.typical * (4.0 * u - 2.0), random);
        Self { block, image, observed, input, theta }
    }

    fn context(&self) -> Context<'_> {
        Context { block: &self.block, image: &self.image, column_px: self.observed[0], row_px: self.observed[1] }
    }
}

/// Parameters at random; `estimated` gives those that are estimated or random from a uniform number.
fn draw_theta(
    descriptor: &Descriptor,
    estimated: impl Fn(&super::Parameter, f64) -> f64,
    random: &mut impl Rng,
) -> Vec<f64> {
    let half_diagonal = 0.5 * SENSOR[0].hypot(SENSOR[1]);
    let draw = |parameter: &super::Parameter| {
        let u: f64 = random.random_range(0.0..1.0);
        match &parameter.role {
            Role::Estimated | Role::Random(_) => estimated(parameter, u),
            Role::Searched(Domain::SensorX) => u * SENSOR[0],
            Role::Searched(Domain::SensorY) => u * SENSOR[1],
            Role::Searched(Domain::SensorFraction(low, high)) => (low + u * (high - low)) * half_diagonal,
            Role::Searched(Domain::Range(low, high)) => low + u * (high - low),
            Role::Given(named) if named.is_empty() => parameter.nominal,
            Role::Given(named) => named[((u * named.len() as f64) as usize).min(named.len() - 1)].1,
        }
    };
    descriptor.parameters.iter().map(draw).collect()
}

/// Output and derivatives at a place; the derivatives are pre-filled with NaN, so that entries left out show.
struct Evaluation {
    out: Vec<f64>,
    d_input: Vec<f64>,
    d_theta: Vec<f64>,
}

fn evaluate(effect: &dyn Effect, sample: &Sample) -> Result<Evaluation, OutsideDomain> {
    let (stage, p) = (effect.descriptor().stage, sample.theta.len());
    let mut out = vec![f64::NAN; stage.outputs()];
    let mut d_input = vec![f64::NAN; stage.outputs() * stage.inputs()];
    let mut d_theta = vec![f64::NAN; stage.outputs() * p];
    let context = sample.context();
    effect.eval(&context, &sample.input, &sample.theta, &mut out, Some(&mut d_input), Some(&mut d_theta))?;
    Ok(Evaluation { out, d_input, d_theta })
}

fn output(effect: &dyn Effect, sample: &Sample) -> Result<Vec<f64>, OutsideDomain> {
    let mut out = vec![f64::NAN; effect.descriptor().stage.outputs()];
    effect.eval(&sample.context(), &sample.input, &sample.theta, &mut out, None, None)?;
    Ok(out)
}

/// Output of an effect at one place of a block of which nothing is known; row and column observed are the input's first two values
/// at the image stage, else the sensor's centre when the image's size is known.
///
/// # Panics
/// Outside the effect's domain: for tests with worked numbers.
pub fn value(effect: &dyn Effect, image: &ImageContext, input: &[f64], theta: &[f64]) -> Vec<f64> {
    let observed = match effect.descriptor().stage {
        Stage::Image => [input[0], input[1]],
        _ => [0.5 * image.width_px, 0.5 * image.height_px],
    };
    let sample = Sample {
        block: BlockContext::default(),
        image: *image,
        observed,
        input: input.to_vec(),
        theta: theta.to_vec(),
    };
    output(effect, &sample).expect("inside the effect's domain")
}

fn samples(effect: &dyn Effect, seed: u64) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..SAMPLES).map(|_| Sample::draw(effect.descriptor(), &mut random)).collect()
}

fn violation(effect: &dyn Effect, law: &'static str, detail: String) -> Violation {
    Violation { effect: effect.descriptor().id.to_string(), law, detail }
}

/// Every law; all violations that were found, at most one per law.
pub fn check(effect: &dyn Effect, seed: u64) -> Vec<Violation> {
    let laws = [null_law, purity, derivatives, finiteness, needs];
    let found = laws.into_iter().filter_map(|law| law(effect, seed).err());
    description(effect).err().into_iter().chain(found).collect()
}

/// Ids unique over a list of effects.
pub fn unique_ids(effects: &[&dyn Effect]) -> Result<(), Violation> {
    let mut seen = BTreeSet::new();
    match effects.iter().find(|effect| !seen.insert(effect.descriptor().id.clone())) {
        Some(effect) => Err(violation(*effect, "unique id", "the id stands for two effects".into())),
        None => Ok(()),
    }
}

/// The descriptor is complete and consistent: names, units, sizes, domains, needs of the stage.
pub fn description(effect: &dyn Effect) -> Result<(), Violation> {
    let d = effect.descriptor();
    let fail = |detail: String| Err(violation(effect, "descriptor", detail));
    for (what, text) in [("summary", &d.summary), ("formula", &d.formula), ("source", &d.source)] {
        if text.trim().is_empty() {
            return fail(format!("no {what}"));
        }
    }
    if d.id.is_empty() || !d.id.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-') {
        return fail("an id is lower case with hyphens".into());
    }
    let mut names = BTreeSet::new();
    for parameter in &d.parameters {
        let name = &parameter.name;
        if name.is_empty() || name.contains(|c: char| c.is_whitespace() || "[]=,:".contains(c)) {
            return fail(format!("parameter name {name:?}"));
        }
        if !names.insert(name.clone()) {
            return fail(format!("two parameters {name}"));
        }
        if parameter.unit.is_empty() {
            return fail(format!("{name} has no unit"));
        }
        if !(parameter.typical.is_finite() && parameter.typical != 0.0 && parameter.nominal.is_finite()) {
            return fail(format!("{name}: typical size and nominal value must be finite, the size not zero"));
        }
        match &parameter.role {
            Role::Searched(Domain::Range(low, high) | Domain::SensorFraction(low, high)) if low >= high => {
                return fail(format!("{name}: empty search domain"));
            }
            Role::Given(named) if !named.is_empty() && !named.iter().any(|row| row.1 == parameter.nominal) => {
                return fail(format!("{name}: the default has no name"));
            }
            _ => {}
        }
    }
    if !d.parameters.iter().any(|parameter| matches!(parameter.role, Role::Estimated | Role::Random(_))) {
        return fail("nothing to estimate".into());
    }
    let required = match d.stage {
        Stage::Position => Some(Need::Gnss),
        Stage::Control => Some(Need::Control),
        _ => None,
    };
    if required.is_some_and(|need| !d.needs.contains(&need)) {
        return fail(format!("the {} stage needs {required:?}", d.stage.name()));
    }
    if d.needs.iter().collect::<BTreeSet<_>>().len() != d.needs.len() {
        return fail("a need stands twice".into());
    }
    Ok(())
}

/// Null law: at the nominal values of what is estimated, whatever the searched and given values, the output is exactly that of
/// the stage's identity, and so is its derivative.
pub fn null_law(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let descriptor = effect.descriptor();
    let stage = descriptor.stage;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut identity = vec![0.0; stage.outputs() * stage.inputs()];
    super::fill_identity(stage, &mut identity);
    for _ in 0..SAMPLES {
        let mut sample = Sample::draw(descriptor, &mut random);
        sample.theta = draw_theta(descriptor, |parameter, _| parameter.nominal, &mut random);
        let fail = |detail: String| Err(violation(effect, "null law", format!("{detail} at {sample:?}")));
        let offset = stage.identity_offset();
        match evaluate(effect, &sample) {
            Err(error) => return fail(error.to_string()),
            Ok(found) if found.out != sample.input[offset..offset + stage.outputs()] => {
                return fail(format!("{:?} is not the identity", found.out));
            }
            Ok(found) if found.d_input != identity => return fail("the derivative is not the identity".into()),
            Ok(_) => {}
        }
    }
    Ok(())
}

/// Purity: the same call gives the same bits, with and without derivatives.
pub fn purity(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    for sample in samples(effect, seed) {
        let (first, second) = (evaluate(effect, &sample).map(|found| found.out), output(effect, &sample));
        let same = match (&first, &second) {
            (Ok(first), Ok(second)) => bits(first) == bits(second),
            (first, second) => first == second,
        };
        if !same {
            return Err(violation(effect, "purity", format!("{first:?} then {second:?} at {sample:?}")));
        }
    }
    Ok(())
}

/// Finiteness: wherever the effect says that it is in its domain, output and derivatives are finite and complete; this also for
/// predicted image points a fifth outside the sensor, and parameters a hundred times their typical size.
pub fn finiteness(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for (index, mut sample) in samples(effect, seed).into_iter().enumerate() {
        let ordinary = index % 2 == 0;
        if !ordinary {
            let factor = random.random_range(-100.0..100.0);
            sample.theta = draw_theta(effect.descriptor(), |parameter, _| factor * parameter.typical, &mut random);
            if effect.descriptor().stage == Stage::Image {
                for axis in 0..2 {
                    sample.input[axis] = random.random_range(-0.2..1.2) * SENSOR[axis];
                }
            }
        }
        let detail = match evaluate(effect, &sample) {
            Err(OutsideDomain) if ordinary => "an ordinary place is outside the domain",
            Err(OutsideDomain) => continue,
            Ok(found) if !found.out.iter().all(|value| value.is_finite()) => "the output is not finite",
            Ok(found) if !found.d_input.iter().all(|value| value.is_finite()) => "d_input is not finite or not filled",
            Ok(found) if !found.d_theta.iter().all(|value| value.is_finite()) => "d_theta is not finite or not filled",
            Ok(_) => continue,
        };
        return Err(violation(effect, "finiteness", format!("{detail} at {sample:?}")));
    }
    Ok(())
}

/// Needs: with given and searched values at their defaults, the effect answers wherever its needs are met, whatever else is not
/// known, and reports itself outside its domain where they are not.
pub fn needs(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let d = effect.descriptor();
    let unknown = f64::NAN;
    for mut sample in samples(effect, seed) {
        for (value, parameter) in sample.theta.iter_mut().zip(&d.parameters) {
            if matches!(parameter.role, Role::Searched(_) | Role::Given(_)) {
                *value = parameter.nominal;
            }
        }
        for need in [Need::Time, Need::Temperature, Need::Velocity] {
            let mut blind = sample.clone();
            let image = &mut blind.image;
            match need {
                Need::Time => {
                    blind.block.temperature_history.clear();
                    [image.time_s, image.tau, image.flight_time_s, image.flight_span_s] = [unknown; 4];
                }
                Need::Temperature => {
                    blind.block.temperature_history.clear();
                    blind.block.mean_temperature_c = unknown;
                    image.temperature_c = unknown;
                }
                _ => image.velocity = Vector3::repeat(unknown),
            }
            let answers = output(effect, &blind).is_ok();
            if answers == d.needs.contains(&need) {
                let detail = if answers { "is said to be needed, but is not" } else { "is needed, but not said to be" };
                return Err(violation(effect, "needs", format!("{need:?} {detail}")));
            }
        }
    }
    Ok(())
}

/// Derivatives: what the effect adds to the identity's derivatives agrees with extrapolated central differences of what it adds to the
/// identity; columns of given parameters are zero.
pub fn derivatives(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let descriptor = effect.descriptor();
    let stage = descriptor.stage;
    let (n, m) = (stage.inputs(), stage.outputs());
    let turns = rotation_outputs(stage);
    // Whether a variable's column was ever nonzero, and whether the differences ever resolved it.
    let mut seen = vec![(false, false); n + descriptor.parameters.len()];
    for sample in samples(effect, seed) {
        let fail = |detail: String| Err(violation(effect, "derivatives", format!("{detail} at {sample:?}")));
        let Ok(analytic) = evaluate(effect, &sample) else { return fail("outside the domain".into()) };
        for variable in 0..seen.len() {
            let name = variable_name(descriptor, variable);
            let column = analytic_column(stage, &sample, &analytic, variable);
            if variable >= n && matches!(descriptor.parameters[variable - n].role, Role::Given(_)) {
                if column.iter().any(|value| *value != 0.0) {
                    return fail(format!("the column of the given parameter {name} is not zero"));
                }
                continue;
            }
            let size =
                if variable < n { input_size(stage, variable) } else { descriptor.parameters[variable - n].typical };
            let change = |step: f64| {
                let end = |step: f64| {
                    let mut moved = sample.clone();
                    *(if variable < n { &mut moved.input[variable] } else { &mut moved.theta[variable - n] }) += step;
                    output(effect, &moved).map(|out| (moved.input, out))
                };
                Ok::<_, OutsideDomain>(difference(stage, &end(step)?, &end(-step)?))
            };
            let Some((numeric, doubt)) = extrapolate(change, FIRST_STEP * size.abs(), &analytic.out) else {
                return fail(format!("{name}: the neighbourhood is outside the domain"));
            };
            for group in [0..turns, turns..m] {
                let largest = |values: &[f64]| values[group.clone()].iter().fold(0.0_f64, |most, v| most.max(v.abs()));
                let scale = largest(&column).max(largest(&numeric));
                seen[variable].0 |= largest(&column) > 0.0;
                seen[variable].1 |= largest(&doubt) < 1e-3 * scale;
                for row in group.clone() {
                    let (by_hand, by_differences) = (column[row], numeric[row]);
                    if (by_hand - by_differences).abs() > DERIVATIVE_TOLERANCE * scale + doubt[row] {
                        return fail(format!(
                            "output {row} by {name}: {by_hand:e} by hand, {by_differences:e} by differences"
                        ));
                    }
                }
            }
        }
    }
    match seen.iter().position(|(nonzero, resolved)| *nonzero && !*resolved) {
        Some(variable) => {
            let name = variable_name(descriptor, variable);
            Err(violation(effect, "derivatives", format!("{name}: too small beside rounding to be checked")))
        }
        None => Ok(()),
    }
}

fn variable_name(descriptor: &Descriptor, variable: usize) -> String {
    match variable.checked_sub(descriptor.stage.inputs()) {
        Some(parameter) => descriptor.parameters[parameter].name.to_string(),
        None => format!("input {variable}"),
    }
}

/// A size of an input, in the samples' world: the first difference is taken over a tenth of it.
fn input_size(stage: Stage, variable: usize) -> f64 {
    const INTERIOR: [f64; 12] = [1e3, 1e2, 1e2, 1e2, 1e2, 1e-9, 1e-16, 1e-23, 1e-7, 1e-7, 1e-3, 1e-3];
    const ANGLE: f64 = 0.3;
    const LENGTH: f64 = 10.0;
    const PIXELS: f64 = 100.0;
    match (stage, variable) {
        (Stage::Control, _) => LENGTH,
        (Stage::Interior, 12..) => ANGLE,
        (Stage::Interior, _) => INTERIOR[variable],
        (Stage::Image, 0..2) => PIXELS,
        (Stage::Image, _) => INTERIOR[variable - 2],
        (_, 0..3) => ANGLE,
        _ => LENGTH,
    }
}

/// How many outputs, from the first, are a rotation.
fn rotation_outputs(stage: Stage) -> usize {
    if stage == Stage::Exposure { 3 } else { 0 }
}

/// A column of the derivatives without the identity's part; turns of the exposure stage as turns, with the identity's.
fn analytic_column(stage: Stage, sample: &Sample, analytic: &Evaluation, variable: usize) -> Vec<f64> {
    let (n, m, p) = (stage.inputs(), stage.outputs(), sample.theta.len());
    let mut column: Vec<f64> = match variable.checked_sub(n) {
        None => (0..m).map(|row| analytic.d_input[row * n + variable]).collect(),
        Some(parameter) => (0..m).map(|row| analytic.d_theta[row * p + parameter]).collect(),
    };
    let turns = rotation_outputs(stage);
    if let Some(row) = variable.checked_sub(stage.identity_offset())
        && (turns..m).contains(&row)
    {
        column[row] -= 1.0;
    }
    if turns == 3 {
        let turn =
            left_jacobian(&Vector3::from_column_slice(&analytic.out[..3])) * Vector3::from_column_slice(&column[..3]);
        column[..3].copy_from_slice(turn.as_slice());
    }
    column
}

/// What the effect adds at one end less what it adds at the other; each end is input and output. The rotation of the exposure
/// stage as the turn from one output to the other: near half a turn two rotation vectors stand for nearly the same rotation.
fn difference(stage: Stage, plus: &(Vec<f64>, Vec<f64>), minus: &(Vec<f64>, Vec<f64>)) -> Vec<f64> {
    let offset = stage.identity_offset();
    let added = |end: &(Vec<f64>, Vec<f64>), row: usize| end.1[row] - end.0[offset + row];
    let mut change: Vec<f64> = (0..stage.outputs()).map(|row| added(plus, row) - added(minus, row)).collect();
    if rotation_outputs(stage) == 3 {
        let rotation = |end: &(Vec<f64>, Vec<f64>)| exp(&Vector3::from_column_slice(&end.1[..3]));
        change[..3].copy_from_slice(log(&(rotation(plus) * rotation(minus).transpose())).as_slice());
    }
    change
}

/// Derivative from central differences over `first`, `first / 2`, ..., extrapolated to step zero (Ridders 1982), and how far it may be
/// off: ten times the method's own estimate, and the rounding of the outputs. `None` if fewer than four steps stay in the domain.
fn extrapolate(
    change: impl Fn(f64) -> Result<Vec<f64>, OutsideDomain>,
    first: f64,
    out: &[f64],
) -> Option<(Vec<f64>, Vec<f64>)> {
    const STEPS: i32 = 10;
    let m = out.len();
    let steps = (0..STEPS).map(|halvings| first / 2.0_f64.powi(halvings));
    let differences: Vec<(f64, Vec<f64>)> = steps.filter_map(|step| Some((step, change(step).ok()?))).collect();
    if differences.len() < 4 {
        return None;
    }
    let (mut best, mut doubt) = (vec![f64::NAN; m], vec![f64::INFINITY; m]);
    for row in 0..m {
        let mut previous: Vec<f64> = Vec::new();
        for (step, change) in &differences {
            let rounding = 4.0 * f64::EPSILON * out[row].abs().max(1e-3 * step) / step;
            let mut level = vec![change[row] / (2.0 * step)];
            let mut factor = 4.0;
            for column in 0..previous.len() {
                let better = (factor * level[column] - previous[column]) / (factor - 1.0);
                let off = (better - level[column]).abs().max((better - previous[column]).abs());
                if 10.0 * off + rounding < doubt[row] {
                    (best[row], doubt[row]) = (better, 10.0 * off + rounding);
                }
                level.push(better);
                factor *= 4.0;
            }
            previous = level;
        }
    }
    Some((best, doubt))
}
