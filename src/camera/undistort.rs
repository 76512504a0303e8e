//! The inverse of the distortion, with a stated domain.
//!
//! The distortion of [`fraser`] maps the ideal point `q` (px from the centre of distortion, `r = |q|`) to
//! `F(q)`. The symmetric part of its derivative has no eigenvalue below
//!
//! ```text
//! m(r) = min(1 + 3 k1 r^2 + 5 k2 r^4 + 7 k3 r^6, 1 + k1 r^2 + k2 r^4 + k3 r^6) - 6 |p| r + (b1 - |b|) / 2
//! ```
//!
//! (radial and tangential eigenvalue of the radial terms; the decentring derivative is `2 [(p.q) I + p q' + q p']`; the
//! affine one has the eigenvalues `(b1 +- |b|) / 2`). Where `m > 0` on a whole disc the model is strictly monotonic
//! there, hence one to one: `(F(q) - F(s)) . (q - s) > 0` for any two of its points.

use super::{DCX, DCY, F, Interior, PPX, PPY, fraser};
use nalgebra::{Matrix2, Vector2, Vector3};

/// Least `m(r)` inside the domain: an error in the image grows at most thousandfold in the inverse.
pub const MIN_MONOTONICITY: f64 = 1e-3;

/// Newton steps from one start; inside the domain four or five are needed.
const MAX_STEPS: usize = 30;
/// A step below this (px) is followed by one more, which is exact to rounding because the convergence is quadratic.
const LAST_STEP_PX: f64 = 1e-6;
/// Intermediate targets between the centre of distortion and the point, when the direct way fails.
const CONTINUATION_STEPS: usize = 64;
/// Parts into which [`monotonic_radius`] divides the range for its bounds on the slope, at first.
const PARTS: f64 = 64.0;
/// Share of the range that is no longer worth a step of [`monotonic_radius`]: some 1e-8 px of a sensor.
const LEAST_STEP: f64 = 1e-12;

/// Distance (px, of the ideal point from the centre of distortion) up to which the model is monotonic, at most
/// `max_radius_px`: the first radius where `m(r)` (see the module) falls to [`MIN_MONOTONICITY`]. Zero when it is
/// nowhere so, or when a value is not finite.
pub fn monotonic_radius(interior: &Interior, max_radius_px: f64) -> f64 {
    let [_, _, _, _, _, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let decentring = 6.0 * p1.hypot(p2);
    let affine = 0.5 * (b1 - b1.hypot(b2));
    let excess = |r: f64| {
        let r2 = r * r;
        let along = r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3));
        let across = r2 * (k1 + r2 * (k2 + r2 * k3));
        1.0 + along.min(across) - decentring * r + affine - MIN_MONOTONICITY
    };
    // No larger slope of m anywhere up to r.
    let slope = |r: f64| {
        let r2 = r * r;
        r * (6.0 * k1.abs() + r2 * (20.0 * k2.abs() + r2 * 42.0 * k3.abs())) + decentring
    };
    let usable = max_radius_px.is_finite() && excess(max_radius_px).is_finite() && slope(max_radius_px).is_finite();
    if !usable || excess(0.0) <= 0.0 {
        return 0.0;
    }
    if slope(max_radius_px) * max_radius_px < excess(0.0) {
        return max_radius_px;
    }
    // March by steps that cannot pass a zero of m; they shrink geometrically towards the first one. The bound is of the
    // step itself: over a wider range it may be larger by any power of ten.
    let mut r = 0.0;
    while r < max_radius_px {
        let mut step = max_radius_px / PARTS;
        while excess(r) < slope(r + step) * step {
            step *= 0.5;
            if step <= LEAST_STEP * max_radius_px {
                return r;
            }
        }
        r += step;
    }
    max_radius_px
}

/// Ideal image point (px) of a distorted one `(x, y)` (px), by Newton; its [`fraser::distort`] is `xy` to rounding.
///
/// `None` when no ideal point is found or when it lies beyond the [`monotonic_radius`], where another could be as good.
pub fn undistort(interior: &Interior, xy: [f64; 2]) -> Option<[f64; 2]> {
    let target = Vector2::from(xy);
    if let Some(ideal) = newton(interior, target, target).filter(|ideal| is_inside(interior, ideal)) {
        return Some(ideal.into());
    }
    // The start was too far: follow the solution from the centre of distortion outwards.
    let centre = Vector2::new(interior[DCX], interior[DCY]);
    let mut ideal = centre;
    for step in 1..=CONTINUATION_STEPS {
        let part = step as f64 / CONTINUATION_STEPS as f64;
        ideal = newton(interior, centre + (target - centre) * part, ideal)?;
    }
    is_inside(interior, &ideal).then(|| ideal.into())
}

/// Viewing ray of a measured image point (px): a unit vector in the camera frame. `None` where [`undistort`] finds no
/// ideal point.
pub fn viewing_ray(interior: &Interior, xy: [f64; 2]) -> Option<Vector3<f64>> {
    let [u, v] = undistort(interior, xy)?;
    Some(Vector3::new((u - interior[PPX]) / interior[F], (v - interior[PPY]) / interior[F], 1.0).normalize())
}

fn is_inside(interior: &Interior, ideal: &Vector2<f64>) -> bool {
    let radius = (ideal.x - interior[DCX]).hypot(ideal.y - interior[DCY]);
    monotonic_radius(interior, radius) >= radius
}

fn newton(interior: &Interior, target: Vector2<f64>, start: Vector2<f64>) -> Option<Vector2<f64>> {
    let mut ideal = start;
    let mut last = false;
    for _ in 0..MAX_STEPS {
        let miss = target - Vector2::from(fraser::distort(interior, ideal.x, ideal.y));
        let step = derivative(interior, ideal).try_inverse()? * miss;
        ideal += step;
        if last {
            return Some(ideal);
        }
        // False for NaN too: it never ends in success.
        last = step.norm() < LAST_STEP_PX;
    }
    None
}

fn derivative(interior: &Interior, ideal: Vector2<f64>) -> Matrix2<f64> {
    let [_, _, _, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let q = ideal - Vector2::new(dcx, dcy);
    let p = Vector2::new(p1, p2);
    let r2 = q.norm_squared();
    let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
    Matrix2::identity() * (1.0 + radial + 2.0 * p.dot(&q))
        + q * q.transpose() * slope
        + (p * q.transpose() + q * p.transpose()) * 2.0
        + Matrix2::new(b1, b2, 0.0, 0.0)
}

#[cfg(test)]
mod tests {
    use super::super::{B1, B2, K1, K2, P1, P2};
    use super::*;

    /// A 35 mm lens on 5120 x 3840 px with every term.
    const MODERATE: Interior =
        [5510.09, 2539.75, 1945.80, 2537.97, 1955.92, 1.5e-9, -4.5e-17, 1.4e-24, 3e-8, -2e-8, 2e-4, -1e-4];
    /// A wide lens whose barrel distortion folds back at r = sqrt(1 / (3 * 2e-8)) = 4082 px.
    const FOLDING: Interior = [3000.0, 2560.0, 1920.0, 2560.0, 1920.0, -2e-8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    /// The demanded round trip.
    const ROUND_TRIP_PX: f64 = 1e-10;

    fn assert_round_trip(interior: &Interior, ideal: [f64; 2]) {
        let distorted = fraser::distort(interior, ideal[0], ideal[1]);
        let back = undistort(interior, distorted).unwrap_or_else(|| panic!("{ideal:?} is inside the domain"));
        let again = fraser::distort(interior, back[0], back[1]);
        let forward = (again[0] - distorted[0]).hypot(again[1] - distorted[1]);
        assert!(forward < ROUND_TRIP_PX, "{ideal:?}: {forward:e} px");
    }

    #[test]
    fn round_trip_over_and_beyond_the_sensor() {
        for i in -2..=22 {
            for j in -2..=22 {
                let ideal = [f64::from(i) * 256.0, f64::from(j) * 192.0];
                assert_round_trip(&MODERATE, ideal);
                let distorted = fraser::distort(&MODERATE, ideal[0], ideal[1]);
                let back = undistort(&MODERATE, distorted).unwrap();
                assert!((back[0] - ideal[0]).hypot(back[1] - ideal[1]) < ROUND_TRIP_PX);
            }
        }
    }

    #[test]
    fn viewing_ray_meets_its_image_point() {
        let xy = [321.0, 3456.5];
        let ray = viewing_ray(&MODERATE, xy).expect("inside the domain");
        let [x, y] = fraser::project(&MODERATE, (ray * 87.0).into()).expect("in front");
        assert!((x - xy[0]).hypot(y - xy[1]) < 1e-9, "{x} {y}");
        assert!((ray.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn round_trip_up_to_the_fold_and_none_beyond() {
        let limit = monotonic_radius(&FOLDING, 10_000.0);
        // 1 - 3 * 2e-8 r^2 = 1e-3
        assert!((limit - ((1.0 - MIN_MONOTONICITY) / 6e-8).sqrt()).abs() < 1e-6, "{limit}");
        for degree in 0..36 {
            let (sin, cos) = (f64::from(degree) * 10.0).to_radians().sin_cos();
            let at = |r: f64| [2560.0 + r * cos, 1920.0 + r * sin];
            for part in [0.0, 0.3, 0.6, 0.9, 0.99, 0.999] {
                assert_round_trip(&FOLDING, at(part * limit));
            }
            // The fold's image is at 2/3 of its radius: nothing is imaged further out.
            let [x, y] = at(2.0 / 3.0 * limit + 2.0);
            assert_eq!(undistort(&FOLDING, [x, y]), None);
        }
    }

    #[test]
    fn domain_of_a_narrow_dip_is_found() {
        // 1 + 3 k1 r^2 + 5 k2 r^4 = (1 - r^2 / R^2)^2 - 1e-6 touches zero at R = 2000 px only.
        let r2 = 2000.0_f64.powi(2);
        let mut interior = FOLDING;
        interior[K1] = -2.0 / (3.0 * r2);
        interior[K2] = 1.0 / (5.0 * r2 * r2);
        let limit = monotonic_radius(&interior, 1e5);
        let expected = (r2 * (1.0 - MIN_MONOTONICITY.sqrt())).sqrt();
        assert!((limit - expected).abs() < 1e-3, "{limit} {expected}");
    }

    #[test]
    fn domain_of_an_absurd_coefficient_is_found_at_once() {
        let mut interior = FOLDING;
        interior[K1] = 0.0;
        interior[K2] = -47.0;
        let limit = monotonic_radius(&interior, 6400.0);
        let expected = ((1.0 - MIN_MONOTONICITY) / (5.0 * 47.0)).powf(0.25);
        assert!((limit - expected).abs() < 1e-7, "{limit} {expected}");
    }

    #[test]
    fn domain_without_distortion_is_everything_and_of_nonsense_nothing() {
        let mut interior = FOLDING;
        interior[K1] = 0.0;
        assert_eq!(monotonic_radius(&interior, 1e6), 1e6);
        interior[K1] = f64::NAN;
        assert_eq!(monotonic_radius(&interior, 1e6), 0.0);
        assert_eq!(undistort(&interior, [100.0, 100.0]), None);
        interior[K1] = 0.0;
        interior[B1] = -1.5; // mirrors x
        assert_eq!(monotonic_radius(&interior, 1e6), 0.0);
        assert_eq!(undistort(&interior, [100.0, 100.0]), None);
    }

    #[test]
    fn domain_holds_where_two_points_never_share_an_image() {
        // Decentring and affinity far beyond any lens: the disc given is still one to one.
        let mut interior = FOLDING;
        (interior[P1], interior[P2], interior[B1], interior[B2]) = (2e-5, -1e-5, 0.1, 0.2);
        let limit = monotonic_radius(&interior, 1e4);
        assert!(limit > 100.0 && limit < 4000.0, "{limit}");
        for degree in 0..36 {
            let (sin, cos) = (f64::from(degree) * 10.0).to_radians().sin_cos();
            let ideal = [2560.0 + 0.999 * limit * cos, 1920.0 + 0.999 * limit * sin];
            let distorted = fraser::distort(&interior, ideal[0], ideal[1]);
            let back = undistort(&interior, distorted).expect("inside the domain");
            assert!((back[0] - ideal[0]).hypot(back[1] - ideal[1]) < 1e-7);
        }
    }
}
