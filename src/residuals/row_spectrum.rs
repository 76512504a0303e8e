//! Do measurements swing along the rows of each image, as where a camera shakes while its rows are read?
//!
//! A shaking mount has one frequency, but a phase of its own in every image, so that nothing of it is left on the
//! sensor of all images together. The power at a frequency is summed over images and both components: `sum |sum v exp(i
//! 2 pi f row)|^2 / sum v^2`, one for each where the points are independent. Flipping the signs of whole points changes
//! nothing under that null and leaves what images share by their points: the variance of the sum comes from such flips.
//! What the fit absorbs makes the power smaller: a one-sided test is on the safe side.

use super::asked::Tested;
use super::context::Context;
use super::found::Found;
use crate::math::statistics::chi_square_ln_sf;
use crate::problem::ImageObservation;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use rustfft::num_complex::Complex64;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Name of the test.
pub(super) const TEST: &str = "row-spectrum";

/// Half periods from the first row of an image to the last. Below a period the pose of an image takes them; rotors and
/// engines shake below 300 Hz, and rows are read within 50 ms.
const HALF_PERIODS: RangeInclusive<u32> = 2..=30;
/// Of these the variance is taken, which is the same for all; with a flip for each bit of a number it is known to an
/// eighth.
const OF_VARIANCE: [u32; 4] = [5, 12, 19, 26];
/// Frequencies that are summed on one thread together: few enough for several threads, and enough for what they share.
const TOGETHER: usize = 8;
/// Seed of the flips.
const SEED: u64 = 1;
/// Images that a sum of powers needs.
const LEAST: usize = 10;

pub(super) fn test(context: &Context<'_>, found: &mut Found) {
    let rows = Rows::new(context);
    let count = rows.squares.iter().flatten().filter(|sum| **sum > 0.0).count() as f64;
    if count < (2 * LEAST) as f64 {
        return found.skip(TEST, "too few images");
    }
    let half_periods: Vec<u32> = HALF_PERIODS.collect();
    let of_some = |some: &[u32]| rows.powers(some, 1, |_| 0);
    let all = || half_periods.par_chunks(TOGETHER).flat_map_iter(of_some).collect::<Vec<f64>>();
    let (powers, variance) = rayon::join(all, || rows.variance(count));
    let Some((half, power)) = half_periods.iter().zip(powers).max_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    // Twice a sum of exponential values is a chi-square, of fewer degrees where they hang together.
    let dof = 2.0 * count * count / variance;
    let ln_p_value = chi_square_ln_sf(dof * power / count, dof).min(0.0);
    let tested = Tested { statistic: power / count, dof: dof.round() as usize, p_value: ln_p_value.exp(), ln_p_value };
    let squares: f64 = context.measurements.iter().map(|local| local.residual.map(|v| v * v).iter().sum::<f64>()).sum();
    let of_image = context.measurements.len() as f64 / (0.5 * count);
    let mean_square = squares / (2.0 * context.measurements.len() as f64);
    let amplitude = (4.0 * mean_square * (power / count - 1.0).max(0.0) / of_image).sqrt();
    let description = format!(
        "{} frequencies; strongest: {} periods while the rows of an image are read, amplitude {amplitude:.3} px",
        half_periods.len(),
        0.5 * f64::from(*half)
    );
    found.push(TEST, Some(tested.of_many(half_periods.len())), description);
}

/// Residuals by image and row.
struct Rows<'a> {
    context: &'a Context<'a>,
    /// Sum of squares of each image and component.
    squares: Vec<[f64; 2]>,
    /// `exp(i pi row)` of each measurement, rows from 0 to 1.
    half_period: Vec<Complex64>,
}

impl<'a> Rows<'a> {
    fn new(context: &'a Context<'a>) -> Self {
        let mut squares = vec![[0.0; 2]; context.problem.image_contexts.len()];
        for (k, observation) in context.problem.observations.iter().enumerate() {
            let residual = context.measurements[k].residual.map(|v| v * observation.inverse_sigma);
            (0..2).for_each(|axis| squares[context.image(k)][axis] += residual[axis].powi(2));
        }
        let half_period = |(k, observation): (usize, &ImageObservation)| {
            let height = context.problem.image_contexts[observation.image as usize].height_px;
            Complex64::cis(PI * (context.measurements[k].predicted[1] / height))
        };
        let half_period = context.problem.observations.par_iter().enumerate().map(half_period).collect();
        Self { context, squares, half_period }
    }

    /// Power at each frequency for each of `flips`: where bit `flip` of `signs(j)` is set, the residuals of point `j`
    /// have the other sign.
    fn powers(&self, half_periods: &[u32], flips: usize, signs: impl Fn(usize) -> u32) -> Vec<f64> {
        let Self { context, squares, half_period } = self;
        let problem = context.problem;
        let count = half_periods.len() * flips;
        let mut sums = vec![[Complex64::ZERO; 2]; squares.len() * count];
        for j in 0..problem.point_sources.len() {
            let signs = signs(j);
            for k in problem.point_start[j]..problem.point_start[j + 1] {
                let image = context.image(k);
                let residual = context.measurements[k].residual.map(|v| v * problem.observations[k].inverse_sigma);
                let of_image = &mut sums[image * count..(image + 1) * count];
                for (sums, half) in of_image.chunks_mut(flips).zip(half_periods) {
                    let wave = half_period[k].powu(*half);
                    let moved = residual.map(|residual| wave * residual);
                    for (flip, sum) in sums.iter_mut().enumerate() {
                        let is_flipped = signs >> flip & 1 == 1;
                        (0..2).for_each(|axis| sum[axis] += if is_flipped { -moved[axis] } else { moved[axis] });
                    }
                }
            }
        }
        let power = |c: usize| {
            let of_image = |(image, squares): (usize, &[f64; 2])| -> f64 {
                let sum = sums[image * count + c];
                (0..2).filter(|axis| squares[*axis] > 0.0).map(|axis| sum[axis].norm_sqr() / squares[axis]).sum()
            };
            squares.iter().enumerate().map(of_image).sum()
        };
        (0..count).map(power).collect()
    }

    /// Variance of a power whose expectation is `mean`.
    fn variance(&self, mean: f64) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let signs: Vec<u32> = (0..self.context.problem.point_sources.len()).map(|_| random.next_u32()).collect();
        let of_one = |half: &u32| self.powers(&[*half], u32::BITS as usize, |j| signs[j]);
        let powers: Vec<f64> = OF_VARIANCE.par_iter().flat_map_iter(of_one).collect();
        powers.iter().map(|power| (power - mean).powi(2)).sum::<f64>() / powers.len() as f64
    }
}
