//! What is asked of an effect from elsewhere before it is used: a description that the program can work with, an id of
//! its own, and the null law, on the values alone. Its derivatives are not judged here: a wrong one shows as a
//! difference between the solvers.

use super::sample::draw_theta;
use super::{SAMPLES, Sample, description};
use crate::effects::{Effect, abi::CEffect, abi::EvalFault, find};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Seed of the places.
const SEED: u64 = 1;

/// Refuses what no model can have, in words. `effect` is what the program would use, `table` where its values come
/// from.
pub fn admission(effect: &dyn Effect, table: &CEffect) -> Result<(), String> {
    description(effect).map_err(|violation| violation.detail)?;
    let descriptor = effect.descriptor();
    if find(&descriptor.id).is_some() {
        return Err("an effect of this id is built in: give it another".into());
    }
    let (first, outputs) = (descriptor.stage.identity_offset(), descriptor.stage.outputs());
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut outside = 0;
    for _ in 0..SAMPLES {
        let mut sample = Sample::draw(descriptor, &mut random);
        sample.theta = draw_theta(descriptor, |parameter, _| parameter.nominal, &mut random);
        let mut out = vec![f64::NAN; outputs];
        match table.evaluate(&sample.context(), &sample.input, &sample.theta, &mut out, None, None) {
            Ok(()) => {}
            // An effect may know nothing of some places, but not of all.
            Err(EvalFault::Outside) if outside + 1 < SAMPLES => outside += 1,
            Err(fault) => return Err(format!("at the nominal values of its parameters it {fault}")),
        }
        let moved = out.iter().zip(&sample.input[first..]).position(|(out, input)| out.is_finite() && out != input);
        if let Some(k) = moved {
            return Err(format!(
                "breaks the null law: at the nominal values of its parameters it must change nothing. It makes {} of \
                 {} (output {k} of its stage, {})",
                out[k],
                sample.input[first + k],
                descriptor.stage.name()
            ));
        }
    }
    Ok(())
}
