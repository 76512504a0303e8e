//! Which values per image are columns in a block of many images: those of a sample.
//!
//! Every image's own value is a column against every pose and every other value: memory grows with the square of the
//! images, and the eigenvalues of the information with their cube. The variance of such values is known from a sample:
//! from `n` well-determined ones with a relative standard deviation of `sqrt(2 / n)`. What a sample loses is power: the
//! smallest standard deviation that is found grows with the fourth root of all images per image of the sample.
//!
//! Where the effect is a candidate, the null model holds the values outside the sample at zero. Where the model has the
//! effect, they are free parameters of the base with their prior.

use crate::effects::Scope;
use crate::problem::{Problem, ThetaEntry};

/// Images whose own values are columns: their variance is then known to 4.5 %, and their information takes 8 MB.
pub const MOST_IMAGES: usize = 1000;
/// `2^64` over the golden ratio. Its multiples modulo `2^64` spread evenly (Weyl sequence), and have no common period
/// with the strips of a flight.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Is a value a column? All values are that are no image's own.
pub fn is_column(problem: &Problem, entry: &ThetaEntry) -> bool {
    let scope = problem.effects[entry.effect as usize].slots[entry.parameter as usize].0;
    scope != Scope::Image || is_in_sample(entry.instance as usize, problem.image_contexts.len())
}

/// Is one of `images` in the sample?
fn is_in_sample(image: usize, images: usize) -> bool {
    let place = u128::from((image as u64).wrapping_mul(GOLDEN));
    images <= MOST_IMAGES || (place * images as u128) >> 64 < MOST_IMAGES as u128
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_has_its_size_and_spreads_evenly() {
        for images in [1001, 1500, 5089, 20_222, 100_000] {
            let sample: Vec<usize> = (0..images).filter(|image| is_in_sample(*image, images)).collect();
            assert!(sample.len().abs_diff(MOST_IMAGES) <= 3, "{images}: {}", sample.len());
            // The sample has images at every position within a strip: at most half the expected number more or less,
            // and three for rounding. Every fifth image would give a position five times that number, or none.
            for strip in [40, 50, 60] {
                let share = MOST_IMAGES as f64 / images as f64;
                for place in 0..strip {
                    let there = sample.iter().filter(|image| *image % strip == place).count() as f64;
                    let expected = share * (images as f64 / strip as f64);
                    assert!((there - expected).abs() < 0.5 * expected + 3.0, "{images} {strip} {place}: {there}");
                }
            }
            let widest = sample.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
            assert!(widest < 3 * images.div_ceil(MOST_IMAGES) + 3, "{images}: {widest}");
        }
        assert!((0..1000).all(|image| is_in_sample(image, 1000)));
    }
}
