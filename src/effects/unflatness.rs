//! `unflatness`: the sensor is not plane. Where it lies z behind the image plane, a ray meets it farther out by z
//! times its slope.
//!
//! ```text
//! (x', y') = (x, y) + ((x, y) - (ppx, ppy)) / f * z(x, y)
//! z = sum c_jk P_j(2 x / w - 1) P_k(2 y / h - 1),  2 <= j + k <= 4,  P_j Legendre's polynomials
//! ```
//!
//! `c_jk` in pixels out of the sensor plane; positive: away from the lens, so that points move outwards. `j + k <= 1`
//! is left out: a shift of the plane is f, a tilt is nearly a shift of the principal point. Domain: `f` not zero.
//!
//! Source: Fraser (1997), digital camera self-calibration, section on unflatness.
//!
//! Worked numbers, f = 5000, pp (2500, 1900), sensor 5000 x 4000: c_20 = 0.5 moves (5000, 2000) to (5000.25, 2000.01);
//! c_11 = 2 moves (5000, 4000) to (5001, 4000.84).

use super::common::{estimated, known};
use super::formula::{Formula, Given, OBSERVED, Sum};
use super::{Context, Descriptor, IMAGE_INTERIOR, Kind, OutsideDomain, Picture, Scope, Stage, Words};
use crate::camera::{F, PPX, PPY};
use crate::math::{Number, Several};
use std::sync::LazyLock;

/// Orders `(j, k)` of the parameters, in their order.
const ORDERS: [(usize, usize); 12] =
    [(0, 2), (0, 3), (0, 4), (1, 1), (1, 2), (1, 3), (2, 0), (2, 1), (2, 2), (3, 0), (3, 1), (4, 0)];

/// See the [module](self).
pub struct Unflatness;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "unflatness".into(),
    stage: Stage::Image,
    kind: Kind::Physical,
    summary: "The sensor is not plane: a ray meets it nearer or farther than its focal length, and is displaced \
                    radially."
        .into(),
    formula: "(x, y) += ((x, y) - pp)/f sum c_jk P_j(2x/w-1) P_k(2y/h-1), Legendre, 2 <= j+k <= 4".into(),
    parameters: ORDERS
        .map(|(j, k)| {
            estimated(format!("c_{j}{k}"), "px", Scope::Global, 0.5)
                .up_to(20.0, "bow of a chip, 80 um at 4 um (Fraser 1997)")
        })
        .to_vec(),
    needs: vec![],
    confused_with:
        "decentring-high and radial-high (similar columns where the whole sensor is flown with flat ground), \
                    image-grid and image-fourier (empirical)"
            .into(),
    source: "Fraser 1997".into(),
    picture: Picture::Sensor,
    words: Some(Words {
        what: "The sensor is not flat, by some hundredths of a millimetre. Where it bulges, points are imaged too far \
               out or too far in."
            .into(),
        remedy: "Model it; it belongs to this camera and comes again with every flight.".into(),
        tell: "oblique images: their rays meet the sensor at another angle".into(),
    }),
});

impl Formula for Unflatness {
    const STAGE: Stage = Stage::Image;

    fn descriptor() -> &'static Descriptor {
        &DESCRIPTOR
    }

    #[inline(always)]
    fn observe(context: &Context<'_>) -> Result<[f64; OBSERVED], OutsideDomain> {
        Ok([known(context.image.width_px)?, known(context.image.height_px)?, 0.0, 0.0, 0.0])
    }

    /// Holds where the focal length is not zero.
    #[inline(always)]
    fn add<T: Several>(given: &Given<'_, T>, answer: &mut Sum<'_, T>) -> T {
        let (x, y, f) = (given.input(0), given.input(1), given.input(IMAGE_INTERIOR + F));
        let (width, height) = (given.observed(0), given.observed(1));
        let (px, px_slope) = legendre(x * 2.0 / width - given.constant(1.0));
        let (py, py_slope) = legendre(y * 2.0 / height - given.constant(1.0));
        let nothing = given.constant(0.0);
        let (mut z, mut z_x, mut z_y) = (nothing, nothing, nothing);
        for (p, (j, k)) in ORDERS.into_iter().enumerate() {
            let c = given.theta(p);
            z = z + c * px[j] * py[k];
            z_x = z_x + c * px_slope[j] * py[k];
            z_y = z_y + c * px[j] * py_slope[k];
        }
        let (z_x, z_y, z_per_f) = (z_x * 2.0 / width, z_y * 2.0 / height, z / f);
        // Slopes of the ray against the axis.
        let slope = [(x - given.input(IMAGE_INTERIOR + PPX)) / f, (y - given.input(IMAGE_INTERIOR + PPY)) / f];
        for axis in 0..2 {
            answer.out(axis, slope[axis] * z);
            if answer.wants_input() {
                answer.by_input(axis, 0, slope[axis] * z_x);
                answer.by_input(axis, 1, slope[axis] * z_y);
                answer.by_input(axis, axis, z_per_f);
                answer.by_input(axis, IMAGE_INTERIOR + F, -(slope[axis] * z_per_f));
                answer.by_input(axis, IMAGE_INTERIOR + PPX + axis, -z_per_f);
            }
            for (p, (j, k)) in ORDERS.into_iter().enumerate() {
                answer.by_theta(axis, p, slope[axis] * px[j] * py[k]);
            }
        }
        f * f
    }
}

/// Legendre's polynomials of orders 0 to 4 at `t`, and their derivatives.
#[inline(always)]
fn legendre<T: Number>(t: T) -> ([T; 5], [T; 5]) {
    let (t2, one) = (t * t, t.like(1.0));
    (
        [
            one,
            t,
            t2 * 1.5 - t.like(0.5),
            t * (t2 * 2.5 - t.like(1.5)),
            (t2 * 4.375 - t.like(3.75)) * t2 + t.like(0.375),
        ],
        [t.like(0.0), one, t * 3.0, t2 * 7.5 - t.like(1.5), t * (t2 * 17.5 - t.like(7.5))],
    )
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn worked_numbers() {
        let image = ImageContext { width_px: 5000.0, height_px: 4000.0, ..Default::default() };
        let moved = |name: &str, value: f64, x: f64, y: f64| {
            let mut theta = [0.0; 12];
            theta[DESCRIPTOR.parameters.iter().position(|p| p.name == name).unwrap()] = value;
            let mut input = [0.0; 14];
            input[..5].copy_from_slice(&[x, y, 5000.0, 2500.0, 1900.0]);
            laws::value(&Unflatness, &image, &input, &theta)
        };
        assert_relative_eq!(moved("c_20", 0.5, 5000.0, 2000.0)[..], [5000.25, 2000.01], epsilon = 1e-11);
        assert_relative_eq!(moved("c_11", 2.0, 5000.0, 4000.0)[..], [5001.0, 4000.84], epsilon = 1e-11);
    }

    #[test]
    fn polynomials_are_legendres() {
        // Orthogonal on [-1, 1] with squared norm 2 / (2 j + 1): Simpson's rule in fine steps.
        let steps = 2000;
        for j in 0..5 {
            for k in 0..5 {
                let weight = |i: i32| {
                    f64::from(if i == 0 || i == steps {
                        1
                    } else if i % 2 == 1 {
                        4
                    } else {
                        2
                    })
                };
                let product = |i: i32| {
                    let (p, _) = legendre(2.0 * f64::from(i) / f64::from(steps) - 1.0);
                    weight(i) * p[j] * p[k]
                };
                let integral = (0..=steps).map(product).sum::<f64>() * 2.0 / f64::from(3 * steps);
                let expected = if j == k { 2.0 / (2 * j + 1) as f64 } else { 0.0 };
                assert_relative_eq!(integral, expected, epsilon = 1e-10);
            }
        }
    }
}
