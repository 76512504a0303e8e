//! Random numbers: one stream per cause, so that adding a cause does not change what another one draws.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A stream of random numbers, the same on every machine.
#[derive(Clone)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// The stream of a cause: `occurrence` counts earlier injections of the same id.
    pub fn new(seed: u64, id: &str, occurrence: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(fnv1a(id).wrapping_add(occurrence));
        Self(generator)
    }

    /// Normal distribution, mean 0, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// Three independent normal numbers.
    pub fn normal3(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// Uniform in `[low, high)`; `low` when the two are equal.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Uniform in `0..n`.
    ///
    /// # Panics
    /// When `n` is zero.
    pub fn index(&mut self, n: usize) -> usize {
        self.0.random_range(0..n)
    }

    /// `count` different elements of `items` (all of them when there are fewer), in random order.
    pub fn choose(&mut self, mut items: Vec<usize>, count: usize) -> Vec<usize> {
        let count = count.min(items.len());
        for place in 0..count {
            let other = place + self.index(items.len() - place);
            items.swap(place, other);
        }
        items.truncate(count);
        items
    }

    /// Uniform direction in space.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let vector = self.normal3();
            if let Some(direction) = vector.try_normalize(1e-6) {
                return direction;
            }
        }
    }
}

/// FNV-1a hash: a stream number that depends on the cause's name alone, not on its place in the registry.
fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
