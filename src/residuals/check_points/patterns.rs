//! Patterns of height errors: mean and tilt, and a bowl or dome beside them, as linear functions of the errors.

use nalgebra::{DMatrix, Vector3};
use std::ops::Range;

/// Coefficients: mean, tilt to the east, tilt to the north, all three of a plane; and the square of the distance
/// beside a plane.
pub const COEFFICIENTS: usize = 4;
/// Those of the plane.
pub const PLANE: Range<usize> = 0..3;
/// That of the dome.
pub const DOME: usize = 3;

/// A term of which less than this share of its length is left beside the others counts as dependent, as for
/// [`crate::evaluate::bowl`].
const DEPENDENT: f64 = 1e-9;

/// The patterns over given places.
pub struct Patterns {
    /// Row `k`, column `j`: what a height error of point `k` adds to coefficient `j`. By least squares with equal
    /// weights, as one reads a plot.
    pub functions: DMatrix<f64>,
    /// Largest horizontal distance from the middle, m: coefficients are heights there.
    pub reach_m: f64,
}

impl Patterns {
    /// Over the places; `None` where they are too few, or on a line or a circle.
    pub fn new(places: &[Vector3<f64>]) -> Option<Self> {
        let n = places.len();
        let centre = places.iter().map(|place| place.xy()).sum::<nalgebra::Vector2<f64>>() / n as f64;
        let arms: Vec<_> = places.iter().map(|place| place.xy() - centre).collect();
        let reach_m = arms.iter().map(|arm| arm.norm()).fold(0.0, f64::max);
        if n < COEFFICIENTS || reach_m.is_nan() || reach_m <= 0.0 {
            return None;
        }
        let design = DMatrix::from_fn(n, COEFFICIENTS, |k, term| match (arms[k] / reach_m, term) {
            (_, 0) => 1.0,
            (arm, 1) => arm.x,
            (arm, 2) => arm.y,
            (arm, _) => arm.norm_squared(),
        });
        let lengths: Vec<f64> = design.column_iter().map(|term| term.norm()).collect();
        let qr = design.qr();
        let (q, r) = (qr.q(), qr.r());
        if (0..COEFFICIENTS).any(|term| r[(term, term)].abs() <= DEPENDENT * lengths[term]) {
            return None;
        }
        // `A (A'A)^-1 = Q R^-T`. The first three columns are those of the plane by itself; the last one is beside it
        // anyway.
        let of_plane = PLANE.end;
        let plane = r.view((0, 0), (of_plane, of_plane)).into_owned().try_inverse()?.transpose();
        let mut functions = DMatrix::zeros(n, COEFFICIENTS);
        functions.columns_mut(0, of_plane).copy_from(&(q.columns(0, of_plane) * plane));
        functions.set_column(DOME, &(q.column(DOME) / r[(DOME, DOME)]));
        Some(Self { functions, reach_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn places() -> Vec<Vector3<f64>> {
        (0..12).map(|k| Vector3::new(10.0 * f64::from(k % 4), 7.0 * f64::from(k / 4), f64::from(k))).collect()
    }

    #[test]
    fn a_pattern_has_its_coefficient() {
        let places = places();
        let patterns = Patterns::new(&places).expect("patterns");
        let (east, north) = (15.0, 7.0);
        let height = |place: &Vector3<f64>| {
            let [x, y] = [place.x - east, place.y - north].map(|arm| arm / patterns.reach_m);
            [0.1 + 0.2 * x - 0.3 * y, 0.4 * (x * x + y * y)]
        };
        let plane = DVector::from_iterator(12, places.iter().map(|place| height(place)[0]));
        let found = patterns.functions.transpose() * &plane;
        assert!((found - DVector::from_vec(vec![0.1, 0.2, -0.3, 0.0])).norm() < 1e-14);
        let dome = DVector::from_iterator(12, places.iter().map(|place| height(place).iter().sum()));
        let found = patterns.functions.transpose() * &dome;
        assert!((found[DOME] - 0.4).abs() < 1e-14);
    }

    #[test]
    fn places_on_a_line_have_no_patterns() {
        let line: Vec<Vector3<f64>> = places().iter().map(|place| Vector3::new(place.x, 2.0 * place.x, 0.0)).collect();
        assert!(Patterns::new(&line).is_none());
        assert!(Patterns::new(&places()[..3]).is_none());
    }
}
