//! Eight measurements side by side: what an effect answers of each is what it answers of that one alone.

use super::sample::{Evaluation, evaluate};
use super::{SAMPLES, Sample, Violation, samples, violation};
use crate::effects::Effect;
use crate::effects::answer::{Answer, Thetas, fill_column};
use crate::math::Wide;
use crate::math::lane::{LANES, Lane};
use nalgebra::Vector3;

/// Bit for bit, places outside the domain included, where the camera turns during the exposure and where it does not,
/// of parameters that are the same for all eight (every other time) and of others.
pub fn eights(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let mut places = samples(effect, seed);
    for place in &mut places[..SAMPLES / 2] {
        place.image.angular_velocity = Vector3::zeros();
    }
    for eight in places.chunks_exact_mut(LANES).step_by(2) {
        let theta = eight[0].theta.clone();
        eight.iter_mut().for_each(|place| place.theta = theta.clone());
    }
    for eight in places.chunks_exact(LANES) {
        let differs = |detail: String| {
            let places: Vec<_> = eight.iter().map(Sample::to_string).collect();
            Err(violation(effect, "eights", format!("{detail}, at {}", places.join("; "))))
        };
        match (together(effect, eight), alone(effect, eight)) {
            (Ok(together), Ok(alone)) => {
                if let Some(lane) = (0..LANES).find(|lane| together[*lane] != alone[*lane]) {
                    return differs(format!("number {lane} of eight has another answer than alone"));
                }
            }
            (together, alone) if together.is_err() == alone.is_err() => {}
            (together, _) => {
                let where_ = if together.is_err() { "together and not alone" } else { "alone and not together" };
                return differs(format!("outside the domain {where_}"));
            }
        }
    }
    Ok(())
}

/// Output and derivatives of each, as bits. Errors: outside the domain.
type Found = Result<Vec<Vec<u64>>, ()>;

fn together(effect: &dyn Effect, eight: &[Sample]) -> Found {
    let (stage, p) = (effect.descriptor().stage, effect.descriptor().parameters.len());
    let (n, m) = (stage.inputs(), stage.outputs());
    let lanes = |count: usize| vec![Lane::splat(f64::NAN); count];
    let (mut input, mut out, mut d_input, mut d_theta) = (lanes(n), lanes(m), lanes(m * n), lanes(m * p));
    for (lane, place) in eight.iter().enumerate() {
        input.iter_mut().zip(&place.input).for_each(|(slot, value)| slot[lane] = *value);
    }
    let contexts = std::array::from_fn(|lane| eight[lane].context());
    let thetas: [&[f64]; LANES] = std::array::from_fn(|lane| &*eight[lane].theta);
    let answer = &mut Answer { out: &mut out, d_input: Some(&mut d_input), d_theta: Some(&mut d_theta) };
    let thetas = match thetas.iter().all(|theta| *theta == thetas[0]) {
        true => Thetas::Alike(thetas[0]),
        false => Thetas::Own(&thetas),
    };
    let inputs = effect.eval_eight(&contexts, &input, &thetas, answer).map_err(|_| ())?;
    for k in (0..n).filter(|k| !inputs.contains(*k)) {
        fill_column::<Wide<pulp::Scalar>>(&mut d_input, n, stage.identity_offset(), k);
    }
    let all = || out.iter().chain(&d_input).chain(&d_theta);
    Ok((0..LANES).map(|lane| all().map(|number| number[lane].to_bits()).collect()).collect())
}

fn alone(effect: &dyn Effect, eight: &[Sample]) -> Found {
    let bits = |found: Evaluation| {
        found.out.iter().chain(&found.d_input).chain(&found.d_theta).map(|value| value.to_bits()).collect()
    };
    eight.iter().map(|place| evaluate(effect, place).map(bits).map_err(|_| ())).collect()
}
