//! Robust losses, and the curvature that the normal equations take of them.

use crate::problem::{LOSS_SCALE, Loss};

/// `rho(s)` and its derivative; see [`Loss`].
pub fn rho(loss: Loss, s: f64) -> (f64, f64) {
    let a2 = LOSS_SCALE * LOSS_SCALE;
    match loss {
        Loss::None => (s, 1.0),
        Loss::Huber if s <= a2 => (s, 1.0),
        Loss::Huber => (2.0 * LOSS_SCALE * s.sqrt() - a2, LOSS_SCALE / s.sqrt()),
        Loss::Cauchy => (a2 * (s / a2).ln_1p(), 1.0 / (1.0 + s / a2)),
    }
}

/// Which curvature of a robust loss the normal equations have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curvature {
    /// Its weights alone, `J' w J`: that of the covariance.
    Weights,
    /// Its second derivative too: that of a step. With the weights alone an outlier pulls back as if it were a
    /// measurement of low weight, and the iterations creep: each takes the same share of what is left.
    Newton,
}

/// Least curvature of a loss along its residual, as a share of its weight. An outlier of Huber's loss has none; a point
/// of outliers alone would then have nothing that holds it. On a UAV block of 120 000 observations Huber's loss took
/// 131 steps with 1 (the weights alone), 23 with 0.1 and 45 with 0.02: with less, steps that leave the corner behind
/// are refused.
pub const LEAST_CURVATURE: f64 = 0.1;

/// Curvature of a loss along the residual as a share of the weight, `1 + 2 s rho'' / rho'`. Source: Triggs et al.
/// (2000), sec. 4.3.
pub fn curvature_along(loss: Loss, s: f64) -> f64 {
    let a2 = LOSS_SCALE * LOSS_SCALE;
    match loss {
        Loss::Huber if s > a2 => 0.0,
        Loss::None | Loss::Huber => 1.0,
        Loss::Cauchy => (a2 - s) / (a2 + s),
    }
}
