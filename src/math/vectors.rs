//! Which vector registers the sums are made in. Every width gives the same numbers: a sum over rows is one of whole
//! vectors, each place for itself, and a product that is added is rounded once (fused) in all of them.

use pulp::{Scalar, Simd, WithSimd};
use std::sync::atomic::{AtomicU8, Ordering};

/// Width of a vector register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Vectors {
    /// One number, on any processor.
    Plain = 1,
    /// Four numbers: AVX2 with fused products.
    Avx2 = 2,
    /// Eight numbers: AVX-512.
    Avx512 = 3,
}

/// [`use_vectors`], or zero.
static FORCED: AtomicU8 = AtomicU8::new(0);

/// Makes the native solver use one width from now on, in the whole program; `None`: the widest that the processor has.
/// For tests of the promise that results do not depend on it.
///
/// # Errors
/// `false` where the processor does not have it; nothing changes then.
pub fn use_vectors(vectors: Option<Vectors>) -> bool {
    if vectors.is_some_and(|vectors| !has(vectors)) {
        return false;
    }
    FORCED.store(vectors.map_or(0, |vectors| vectors as u8), Ordering::Relaxed);
    true
}

#[cfg(target_arch = "x86_64")]
fn has(vectors: Vectors) -> bool {
    match vectors {
        Vectors::Plain => true,
        Vectors::Avx2 => pulp::x86::V3::is_available(),
        Vectors::Avx512 => pulp::x86::V4::is_available(),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn has(vectors: Vectors) -> bool {
    vectors == Vectors::Plain
}

/// Runs `operation` compiled for the width in force.
#[cfg(target_arch = "x86_64")]
pub fn dispatch<O: WithSimd>(operation: O) -> O::Output {
    use pulp::x86::{V3, V4};
    let forced = FORCED.load(Ordering::Relaxed);
    let allowed = |vectors: Vectors| forced == 0 || forced == vectors as u8;
    if let Some(simd) = V4::try_new().filter(|_| allowed(Vectors::Avx512)) {
        return Simd::vectorize(simd, operation);
    }
    if let Some(simd) = V3::try_new().filter(|_| allowed(Vectors::Avx2)) {
        return Simd::vectorize(simd, operation);
    }
    Simd::vectorize(Scalar, operation)
}

/// Runs `operation` compiled for the width in force.
#[cfg(not(target_arch = "x86_64"))]
pub fn dispatch<O: WithSimd>(operation: O) -> O::Output {
    if FORCED.load(Ordering::Relaxed) == Vectors::Plain as u8 {
        return Simd::vectorize(Scalar, operation);
    }
    pulp::Arch::new().dispatch(operation)
}
