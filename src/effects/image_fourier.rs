//! `image-fourier`: a displacement of image points over the sensor as a short Fourier series, whatever its cause.
//!
//! ```text
//! u = pi (x / w - 1/2)        v = pi (y / h - 1/2)
//! x' = x + sum_mn ax_m_n cos(m u + n v) + bx_m_n sin(m u + n v)        y' likewise with ay, by
//! (m, n) = (0, 1), (0, 2), then m = 1, 2 with n = -2 .. 2
//! ```
//!
//! Coefficients in pixels (the paper carries a factor 1e-6), u and v over half a turn each; order: for x, then for y,
//! the pairs (m, n) as above, each with its a and its b: 48 parameters.
//!
//! Empirical: it takes the shape away and names no cause, and it contains much of what the camera already has.
//!
//! Source: Tang, Fritsch, Cramer (2012), new rigorous and flexible Fourier self-calibration models for airborne camera
//! calibration.
//!
//! Worked numbers, sensor 5000 x 3000: ax_1_0 = 0.5 moves the centre (2500, 1500) by (0.5, 0); by_0_1 = 0.25 moves
//! (100, 3000) by (0, 0.25).

use super::common::{estimated, known};
use super::formula::{Formula, Given, OBSERVED, Sum};
use super::{Context, Descriptor, Kind, OutsideDomain, Picture, Scope, Stage};
use crate::math::Several;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Orders `(m, n)`, in the order of the parameters.
const ORDERS: [(i32, i32); 12] =
    [(0, 1), (0, 2), (1, -2), (1, -1), (1, 0), (1, 1), (1, 2), (2, -2), (2, -1), (2, 0), (2, 1), (2, 2)];
/// A cosine and a sine each.
const PER_COMPONENT: usize = 2 * ORDERS.len();

/// See the [module](self).
pub struct ImageFourier;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "image-fourier".into(),
    stage: Stage::Image,
    kind: Kind::Empirical,
    summary: "A displacement field over the sensor as a Fourier series of order two, without a named cause.".into(),
    formula: "(x, y) += sum_mn (ax, ay)_mn cos(m u + n v) + (bx, by)_mn sin(m u + n v), u = pi (x/w - 1/2), v = pi \
                    (y/h - 1/2)"
        .into(),
    parameters: ["x", "y"]
        .into_iter()
        .flat_map(|component| ORDERS.map(|(m, n)| [format!("a{component}_{m}_{n}"), format!("b{component}_{m}_{n}")]))
        .flatten()
        .map(|name| estimated(name, "px", Scope::Global, 0.2))
        .collect(),
    needs: vec![],
    confused_with: "every image-stage effect: it covers their long waves and explains none; finer structure it misses"
        .into(),
    source: "Tang, Fritsch, Cramer 2012".into(),
    picture: Picture::Sensor,
    words: None,
});

impl Formula for ImageFourier {
    const STAGE: Stage = Stage::Image;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    #[inline(always)]
    fn observe(context: &Context<'_>) -> Result<[f64; OBSERVED], OutsideDomain> {
        Ok([known(context.image.width_px)?, known(context.image.height_px)?, 0.0, 0.0, 0.0])
    }

    /// Holds on every sensor.
    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let (half, pi) = (given.constant(0.5), given.constant(PI));
        let slope = [pi / given.observed(0), pi / given.observed(1)];
        let u = multiples(pi * (given.input(0) / given.observed(0) - half));
        let v = multiples(pi * (given.input(1) / given.observed(1) - half));
        let nothing = given.constant(0.0);
        let (mut moved, mut slopes) = ([nothing; 2], [[nothing; 2]; 2]);
        for (i, (m, n)) in ORDERS.into_iter().enumerate() {
            let ((sin_u, cos_u), (sin_v, cos_v)) = (u[m as usize], v[n.unsigned_abs() as usize]);
            let sin_v = if n < 0 { -sin_v } else { sin_v };
            let (sin, cos) = (sin_u * cos_v + cos_u * sin_v, cos_u * cos_v - sin_u * sin_v);
            for axis in 0..2 {
                let first = axis * PER_COMPONENT + 2 * i;
                let (a, b) = (given.theta(first), given.theta(first + 1));
                moved[axis] = moved[axis] + a * cos + b * sin;
                let by_phase = b * cos - a * sin;
                slopes[axis][0] = slopes[axis][0] + by_phase * f64::from(m);
                slopes[axis][1] = slopes[axis][1] + by_phase * f64::from(n);
                answer.by_theta(axis, first, cos);
                answer.by_theta(axis, first + 1, sin);
            }
        }
        for axis in 0..2 {
            answer.out(axis, moved[axis]);
            if answer.wants_input() {
                answer.by_input(axis, 0, slopes[axis][0] * slope[0]);
                answer.by_input(axis, 1, slopes[axis][1] * slope[1]);
            }
        }
        given.constant(1.0)
    }
}

/// Sine and cosine of nothing, of an angle, and of twice it.
#[inline(always)]
fn multiples<T: Several>(angle: T) -> [(T, T); 3] {
    let (sin, cos) = angle.sin_cos();
    [(angle.like(0.0), angle.like(1.0)), (sin, cos), (sin * cos * 2.0, cos * cos - sin * sin)]
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    fn moved(name: &str, value: f64, x: f64, y: f64) -> Vec<f64> {
        let image = ImageContext { width_px: 5000.0, height_px: 3000.0, ..Default::default() };
        let mut theta = [0.0; 48];
        theta[DESCRIPTOR.parameters.iter().position(|p| p.name == name).unwrap()] = value;
        let mut input = [0.0; 14];
        (input[0], input[1]) = (x, y);
        laws::value(&ImageFourier, &image, &input, &theta)
    }

    #[test]
    fn worked_numbers() {
        assert_relative_eq!(moved("ax_1_0", 0.5, 2500.0, 1500.0)[..], [2500.5, 1500.0], epsilon = 1e-11);
        assert_relative_eq!(moved("by_0_1", 0.25, 100.0, 3000.0)[..], [100.0, 3000.25], epsilon = 1e-11);
    }

    #[test]
    fn order_of_the_names() {
        let names: Vec<_> = DESCRIPTOR.parameters.iter().map(|parameter| parameter.name.as_ref()).collect();
        assert_eq!((names.len(), names[1], names[4], names[24]), (48, "bx_0_1", "ax_1_-2", "ay_0_1"));
    }
}
