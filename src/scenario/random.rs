//! Random streams: one per object, so that nothing depends on the order of the work.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Kind of object that a stream belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub(super) enum Table {
    Terrain = 1,
    Strip,
    Image,
    Tie,
    Control,
    Check,
    StartPose,
    TieNoise,
    MarkNoise,
    GnssNoise,
    ControlNoise,
    CheckNoise,
}

/// The stream of object `index` of `table`: streams of one seed never overlap.
pub(super) fn stream(seed: u64, table: Table, index: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Fewer than 2^48 objects in any table.
    rng.set_stream(((table as u64) << 48) | index as u64);
    rng
}

/// Standard normal.
pub(super) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Three standard normals.
pub(super) fn normal3(rng: &mut impl Rng) -> Vector3<f64> {
    Vector3::new(normal(rng), normal(rng), normal(rng))
}
