//! Test kit: the laws that every effect must keep, checked at random places. Built-in effects and plug-ins alike.
//!
//! [`check`] runs them all: descriptor, null law, purity, threads, eights, derivatives, place, finiteness, needs,
//! surveyed. Each is also callable alone. The random places ([`Sample`]) are those of a small aerial block: 40 to 120 m
//! above ground, nadir and oblique, a 20 megapixel camera.

mod admission;
mod derivatives;
mod eights;
mod place;
mod sample;
mod stated;
mod surveyed;
mod threads;

pub use admission::admission;
pub use derivatives::{DERIVATIVE_TOLERANCE, derivatives};
pub use eights::eights;
pub use place::{place, reads_place};
pub use sample::{Sample, value};
pub use surveyed::surveyed;
pub use threads::threads;

use super::{Domain, Effect, Need, OutsideDomain, Role, Stage, fill_identity};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sample::{SENSOR, draw_theta, evaluate, output};
use std::collections::BTreeSet;

/// Number of random places of every law.
pub const SAMPLES: usize = 200;

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

/// The random places of an effect.
pub fn samples(effect: &dyn Effect, seed: u64) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..SAMPLES).map(|_| Sample::draw(effect.descriptor(), &mut random)).collect()
}

fn violation(effect: &dyn Effect, law: &'static str, detail: String) -> Violation {
    Violation { effect: effect.descriptor().id.to_string(), law, detail }
}

/// Every law; all violations that were found, at most one per law.
pub fn check(effect: &dyn Effect, seed: u64) -> Vec<Violation> {
    let laws = [null_law, purity, threads, eights, derivatives, place, finiteness, needs, surveyed];
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

/// The descriptor is complete and consistent: names, units, sizes, domains, ranges, words, picture, needs of the stage.
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
            Role::Searched(Domain::Range(low, high) | Domain::SensorFraction(low, high))
                if !(low < high && (high - low).is_finite()) =>
            {
                return fail(format!("{name}: empty search domain"));
            }
            Role::Given(named) if !named.is_empty() && !named.iter().any(|row| row.1 == parameter.nominal) => {
                return fail(format!("{name}: the default has no name"));
            }
            _ => {}
        }
        if let Err(detail) = stated::range(parameter) {
            return fail(format!("{name}: {detail}"));
        }
    }
    if let Err(detail) = stated::words(d).and_then(|()| stated::picture(d)) {
        return fail(detail);
    }
    if !d.parameters.iter().any(|parameter| matches!(parameter.role, Role::Estimated | Role::Random(_))) {
        return fail("nothing to estimate".into());
    }
    let required = match d.stage {
        Stage::Position => Some(Need::Gnss),
        Stage::Control => Some(Need::Control),
        Stage::Frame => Some(Need::Vertical),
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

/// Null law: at the nominal values of what is estimated, whatever the searched and given values, the output is exactly
/// that of the stage's identity, and so is its derivative.
pub fn null_law(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let descriptor = effect.descriptor();
    let stage = descriptor.stage;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut identity = vec![0.0; stage.outputs() * stage.inputs()];
    fill_identity(stage, &mut identity);
    for _ in 0..SAMPLES {
        let mut sample = Sample::draw(descriptor, &mut random);
        sample.theta = draw_theta(descriptor, |parameter, _| parameter.nominal, &mut random);
        let fail = |detail: String| Err(violation(effect, "null law", format!("{detail} at {sample}")));
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
            return Err(violation(effect, "purity", format!("{first:?} then {second:?} at {sample}")));
        }
    }
    Ok(())
}

/// Finiteness: wherever the effect says that it is in its domain, output and derivatives are finite and complete; this
/// also for predicted image points a fifth outside the sensor, and parameters a hundred times their typical size.
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
        return Err(violation(effect, "finiteness", format!("{detail} at {sample}")));
    }
    Ok(())
}

/// Needs: with given and searched values at their defaults, the effect answers wherever its needs are met, whatever
/// else is not known, and reports itself outside its domain where they are not.
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
