//! `local-flaw`: a spot of the sensor displaces image points away from its centre, and only near it.
//!
//! ```text
//! q = (x, y) - (centre_x, centre_y)        s = |q|        g = exp(-s^2 / sigma^2)
//! smooth=off:  (x', y') = (x, y) + lambda g q / s        the identity at s = 0
//! smooth=on:   (x', y') = (x, y) + lambda g q / sigma
//! ```
//!
//! All in pixels; positive lambda pushes outwards. The sharp variant is that of Zhou et al. (2019; equation 3 with the
//! sign that decays): it jumps at the centre, where it is defined as the identity with zero derivative. `centre` and
//! `sigma` are searched: the effect is nonlinear in them. Domain: `sigma > 0`.
//!
//! Source: Zhou et al. (2019), equation 3.
//!
//! Worked numbers, centre (1000, 1400), sigma 350, lambda 2: the point (1350, 1400) goes to (1350 + 2/e, 1400) =
//! (1350.7357588823, 1400), sharp or smooth; the point (1000, 1300) goes to (1000, 1298.1567791054) sharp.

use super::common::{estimated, given, searched};
use super::formula::{Formula, Given, Sum};
use super::{Descriptor, Domain, Kind, Picture, Scope, Stage, Words};
use crate::math::Several;
use std::sync::LazyLock;

/// See the [module](self).
pub struct LocalFlaw;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "local-flaw".into(),
    stage: Stage::Image,
    kind: Kind::Physical,
    summary: "A spot of the sensor, or of the glass before it, displaces image points radially around its centre."
        .into(),
    formula: "(x, y) += lambda exp(-s^2/sigma^2) q/s, q = (x, y) - centre, s = |q| (smooth=on: q/sigma)".into(),
    parameters: vec![
        estimated("lambda", "px", Scope::Global, 1.0)
            .up_to(50.0, "five times the study's; more is seen in the picture"),
        searched("centre_x", "px", 0.0, 1000.0, Domain::SensorX),
        searched("centre_y", "px", 0.0, 1000.0, Domain::SensorY),
        searched("sigma", "px", 200.0, 200.0, Domain::SensorFraction(0.03, 0.5)),
        given("smooth", "1", 0.0, &[("off", 0.0), ("on", 1.0)]),
    ],
    needs: vec![],
    confused_with: "unflatness (smooth over the whole sensor), image-grid and image-fourier (empirical; they take the \
                    shape away but do not place it)"
        .into(),
    source: "Zhou et al. 2019, equation 3 with the sign that decays".into(),
    picture: Picture::Sensor,
    words: Some(Words {
        what: "A spot of the sensor, of its cover glass or of the filter before the lens moves image points that fall \
               on it. All images have it at the same place."
            .into(),
        remedy: "Clean lens and filter where the spot is small. One as wide as a fifth of the sensor is in the glass \
                 itself: model it, or leave its measurements out."
            .into(),
        tell: "images with another filter or lens, or turned ones".into(),
    }),
});

impl Formula for LocalFlaw {
    const STAGE: Stage = Stage::Image;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// Holds where sigma is above zero.
    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let (lambda, sigma, one) = (given.theta(0), given.theta(3), given.constant(1.0));
        let q = [given.input(0) - given.theta(1), given.input(1) - given.theta(2)];
        // Of pixels, no square overflows: `hypot` would cost more than all the rest.
        let s = (q[0] * q[0] + q[1] * q[1]).sqrt();
        let smooth = given.theta(4).not_zero();
        let sharp = one - smooth;
        // Nothing at the centre of a sharp one, whose direction is not defined there.
        let acts = smooth + sharp * s.not_zero();
        let length = smooth * sigma + sharp * (s + one - s.not_zero());
        let t = s / sigma;
        let g = acts * (-(t * t)).exp();
        let n = [q[0] / length, q[1] / length];
        // Displacement per lambda is g n; its derivative by q is `isotropic I + outer n n^T`, by sigma `by_sigma n`.
        let isotropic = g / length;
        let twice = t * t * 2.0;
        let outer = -(isotropic * (sharp * (one + twice) + smooth * 2.0));
        let by_sigma = g * (twice - smooth) / sigma;
        for i in 0..2 {
            answer.out(i, lambda * g * n[i]);
            for j in 0..2 {
                let mut slope = lambda * outer * n[i] * n[j];
                if i == j {
                    slope = slope + lambda * isotropic;
                }
                answer.by_input(i, j, slope);
                answer.by_theta(i, 1 + j, -slope);
            }
            answer.by_theta(i, 0, g * n[i]);
            answer.by_theta(i, 3, lambda * by_sigma * n[i]);
        }
        sigma
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    fn at(x: f64, y: f64, smooth: f64) -> Vec<f64> {
        let mut input = [0.0; 14];
        (input[0], input[1]) = (x, y);
        laws::value(&LocalFlaw, &ImageContext::default(), &input, &[2.0, 1000.0, 1400.0, 350.0, smooth])
    }

    #[test]
    fn worked_numbers() {
        for smooth in [0.0, 1.0] {
            let point = at(1350.0, 1400.0, smooth);
            assert_relative_eq!(point[0], 1_350.735_758_882_3, epsilon = 1e-9);
            assert_eq!(point[1], 1400.0);
        }
        let point = at(1000.0, 1300.0, 0.0);
        assert_eq!(point[0], 1000.0);
        assert_relative_eq!(point[1], 1_298.156_779_105_4, epsilon = 1e-9);
    }

    #[test]
    fn the_centre_stays() {
        assert_eq!(at(1000.0, 1400.0, 0.0), [1000.0, 1400.0]);
        assert_eq!(at(1000.0, 1400.0, 1.0), [1000.0, 1400.0]);
    }
}
