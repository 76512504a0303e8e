//! The law of the place: an effect answers the same wherever a measurement lies, unless it says that it reads column or
//! row, and then its derivatives by these are those of its values.

use super::derivatives::DERIVATIVE_TOLERANCE;
use super::sample::{SENSOR, output};
use super::{SAMPLES, Sample, Violation, samples, violation};
use crate::effects::{Descriptor, Effect, Stage, numeric};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Seed of the places.
const SEED: u64 = 1;

/// Which of column and row the values of an effect follow at any of the random places. `values` answers there, or says
/// that it does not. Of an effect whose table does not tell, this is how it is known.
pub fn reads_place(descriptor: &Descriptor, values: impl Fn(&Sample, &mut [f64]) -> bool) -> [bool; 2] {
    let mut reads = [false; 2];
    // The other stages have no place.
    if !matches!(descriptor.stage, Stage::Exposure | Stage::Ray | Stage::Image) {
        return reads;
    }
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let bits = |sample: &Sample| {
        let mut out = vec![f64::NAN; descriptor.stage.outputs()];
        let answers = values(sample, &mut out);
        answers.then(|| out.into_iter().map(f64::to_bits).collect::<Vec<u64>>())
    };
    for _ in 0..SAMPLES {
        let sample = Sample::draw(descriptor, &mut random);
        let here = bits(&sample);
        for (axis, reads) in reads.iter_mut().enumerate() {
            let mut moved = sample.clone();
            moved.place[axis] = random.random_range(0.0..SENSOR[axis]);
            *reads |= bits(&moved) != here;
        }
    }
    reads
}

/// See the module.
///
/// # Errors
/// A place where the law does not hold.
pub fn place(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let fail = |detail: String| Err(violation(effect, "place", detail));
    let descriptor = effect.descriptor();
    let said = effect.reads_place();
    let reads = reads_place(descriptor, |sample, out| match output(effect, sample) {
        Ok(values) => {
            out.copy_from_slice(&values);
            true
        }
        Err(_) => false,
    });
    if said != reads {
        return fail(format!(
            "says that it reads column {} and row {}, but reads {} and {}",
            said[0], said[1], reads[0], reads[1]
        ));
    }
    for axis in (0..2).filter(|axis| said[*axis]) {
        for sample in samples(effect, seed) {
            let m = descriptor.stage.outputs();
            let (mut told, mut by_differences) = (vec![f64::NAN; m], vec![f64::NAN; m]);
            let at = |place: &[f64], out: &mut [f64]| {
                let moved = Sample { place: [place[0], place[1]], ..sample.clone() };
                output(effect, &moved).map(|values| out.copy_from_slice(&values))
            };
            let answers = effect.by_place(&sample.context(), &sample.input, &sample.theta, axis, &mut told).is_ok()
                && numeric::by_place(descriptor, &at, sample.place, axis, &mut by_differences).is_ok();
            let largest = told.iter().chain(&by_differences).fold(0.0_f64, |most, value| most.max(value.abs()));
            // Turns and shifts have units of their own, and the rounding of a centre hides a small turn beside it.
            let differs = |(a, b): (&f64, &f64)| (a - b).is_nan() || (a - b).abs() > DERIVATIVE_TOLERANCE * largest;
            if !answers || told.iter().zip(&by_differences).any(differs) {
                let axis = ["column", "row"][axis];
                return fail(format!("by {axis}: {told:?}, {by_differences:?} by differences, at {sample}"));
            }
        }
    }
    Ok(())
}
