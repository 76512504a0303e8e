//! Formulas of effects for certificates: a third derivation, of any number type, beside the native one and that of C++.
//! Derivatives come by automatic differentiation; nothing is taken from either solver.
//!
//! Not every effect of the catalogue has one: of each stage those that the suite's problems use ([`Law::of`]). (No
//! effect of the catalogue acts at the control stage; what a survey does to control points stands at the frame stage.)

use crate::camera::{B2, DCX, DCY, F, P1, PARAMETER_COUNT, PPX};
use crate::effects::{Context, SurveyedKind};
use crate::math::jet::Real;

/// A vector of object space or of the camera frame.
pub type Vec3<T> = [T; 3];
/// A rotation, by rows.
pub type Mat3<T> = [[T; 3]; 3];

/// Radius of the Earth of `earth-curvature`, m.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// An effect that certificates know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // the names of the catalogue
pub enum Law {
    RollingShutter,
    ForwardMotion,
    Refraction,
    FlatPort,
    FocalTime,
    FocalFlight,
    FocalImage,
    PpTime,
    GravitySag,
    RadialHigh,
    DecentringHigh,
    LocalFlaw,
    GnssLeverArm,
    GnssDelay,
    GnssShift,
    GnssDrift,
    MapScale,
    EarthCurvature,
}

impl Law {
    /// The effects that certificates know, by their ids.
    pub const ALL: [(&'static str, Law); 18] = [
        ("rolling-shutter", Law::RollingShutter),
        ("forward-motion", Law::ForwardMotion),
        ("refraction", Law::Refraction),
        ("flat-port", Law::FlatPort),
        ("focal-time", Law::FocalTime),
        ("focal-flight", Law::FocalFlight),
        ("focal-image", Law::FocalImage),
        ("pp-time", Law::PpTime),
        ("gravity-sag", Law::GravitySag),
        ("radial-high", Law::RadialHigh),
        ("decentring-high", Law::DecentringHigh),
        ("local-flaw", Law::LocalFlaw),
        ("gnss-lever-arm", Law::GnssLeverArm),
        ("gnss-delay", Law::GnssDelay),
        ("gnss-shift", Law::GnssShift),
        ("gnss-drift", Law::GnssDrift),
        ("map-scale", Law::MapScale),
        ("earth-curvature", Law::EarthCurvature),
    ];

    /// The law of an effect's id; `None` where certificates do not know it.
    pub fn of(id: &str) -> Option<Law> {
        Self::ALL.iter().find(|(name, _)| *name == id).map(|(_, law)| *law)
    }
}

/// A matrix times a vector.
pub fn times<T: Real>(m: &Mat3<T>, v: &Vec3<T>) -> Vec3<T> {
    std::array::from_fn(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

/// The transpose of a matrix times a vector.
pub fn transpose_times<T: Real>(m: &Mat3<T>, v: &Vec3<T>) -> Vec3<T> {
    std::array::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
}

/// `a - b`.
pub fn minus<T: Real>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    std::array::from_fn(|i| a[i] - b[i])
}

fn dot<T: Real>(a: &Vec3<T>, b: &Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<T: Real>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `exp([w]x) R` of a small turn (below a radian): the series of the sine and the cosine in the square of the angle,
/// smooth at zero.
pub fn turned<T: Real>(w: &Vec3<T>, rotation: &Mat3<T>) -> Mat3<T> {
    const TERMS: usize = 14;
    let angle2 = dot(w, w);
    let (mut sine, mut cosine) = (angle2.like(0.0), angle2.like(0.0));
    for k in (0..TERMS).rev() {
        // sin a / a = sum (-a^2)^k / (2k + 1)!, (1 - cos a) / a^2 = sum (-a^2)^k / (2k + 2)!, by Horner.
        let n = 2.0 * k as f64;
        let one = angle2.like(1.0);
        sine = one - angle2 * sine / angle2.like((n + 2.0) * (n + 3.0));
        cosine = one - angle2 * cosine / angle2.like((n + 3.0) * (n + 4.0));
    }
    let half = cosine * 0.5;
    let columns: [Vec3<T>; 3] = std::array::from_fn(|j| {
        let column = [rotation[0][j], rotation[1][j], rotation[2][j]];
        let once = cross(w, &column);
        let twice = cross(w, &once);
        std::array::from_fn(|i| column[i] + sine * once[i] + half * twice[i])
    });
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

/// Exposure stage: the pose at which a point in a row was taken. `None`: what it needs is not known.
pub fn exposure<T: Real>(
    law: Law,
    context: &Context<'_>,
    row: T,
    theta: &[T],
    rotation: &mut Mat3<T>,
    centre: &mut Vec3<T>,
) -> Option<()> {
    let image = context.image;
    let (dt, turns) = match law {
        Law::RollingShutter => {
            // The quotient in extended precision: a double's rounding would be part of the model.
            let place = row / theta[0].like(image.height_px) - theta[0].like(0.5);
            (theta[0] * place, image.angular_velocity != nalgebra::Vector3::zeros())
        }
        Law::ForwardMotion => (theta[0] * 0.5, false),
        _ => return None,
    };
    for axis in 0..3 {
        centre[axis] = centre[axis] + dt * image.velocity[axis];
    }
    if turns {
        let turn = std::array::from_fn(|axis| dt * -image.angular_velocity[axis]);
        *rotation = turned(&turn, rotation);
    }
    Some(())
}

/// Ray stage: where the straight ray sees a point. `None`: outside the law's domain.
pub fn ray<T: Real>(law: Law, theta: &[T], rotation: &Mat3<T>, centre: &Vec3<T>, point: &Vec3<T>) -> Option<Vec3<T>> {
    let w = minus(point, centre);
    match law {
        Law::Refraction => {
            let height = -w[2];
            if height.double() <= 0.0 {
                return None;
            }
            let share = theta[0] * (height + (w[0] * w[0] + w[1] * w[1]) / height);
            Some([point[0] + share * w[0], point[1] + share * w[1], point[2]])
        }
        Law::FlatPort => {
            let (thickness, n) = (theta[0], theta[1]);
            let axis = rotation[2];
            let length = dot(&w, &w).root();
            let direction = w.map(|part| part / length);
            let cosine = dot(&direction, &axis);
            if cosine.double() <= 0.0 {
                return None;
            }
            let g = cosine.like(1.0) - cosine / (n * n - n.like(1.0) + cosine * cosine).root();
            let shift = thickness * g;
            Some(std::array::from_fn(|k| point[k] + shift * (cosine * direction[k] - axis[k])))
        }
        _ => None,
    }
}

/// Interior stage: the interior orientation of an image.
pub fn interior<T: Real>(
    law: Law,
    context: &Context<'_>,
    theta: &[T],
    rotation: &Mat3<T>,
    values: &mut [T; PARAMETER_COUNT],
) -> Option<()> {
    let image = context.image;
    let shift = match law {
        Law::FocalTime => {
            let tau = if theta[1].double() == 1.0 { image.tau_order } else { image.tau };
            values[F] = values[F] + theta[0] * tau;
            return Some(());
        }
        Law::FocalFlight | Law::FocalImage => {
            values[F] = values[F] + theta[0];
            return Some(());
        }
        Law::PpTime => [theta[0] * image.tau, theta[1] * image.tau],
        Law::GravitySag => {
            // Gravity in the camera frame: R (0, 0, -1).
            let gravity: Vec3<T> = std::array::from_fn(|i| -rotation[i][2]);
            [0, 3].map(|row| theta[row] * gravity[0] + theta[row + 1] * gravity[1] + theta[row + 2] * gravity[2])
        }
        _ => return None,
    };
    for axis in 0..2 {
        values[PPX + axis] = values[PPX + axis] + shift[axis];
        values[DCX + axis] = values[DCX + axis] + shift[axis];
    }
    Some(())
}

/// Image stage: what sensor and lens do to the image point.
pub fn image<T: Real>(law: Law, theta: &[T], values: &[T; PARAMETER_COUNT], [x, y]: [T; 2]) -> Option<[T; 2]> {
    let d = [x - values[DCX], y - values[DCY]];
    let r2 = d[0] * d[0] + d[1] * d[1];
    Some(match law {
        Law::RadialHigh => {
            let share = theta[0] * (r2 * r2) * (r2 * r2);
            [x + share * d[0], y + share * d[1]]
        }
        Law::DecentringHigh => {
            let (q1, q2) = (theta[0], theta[1]);
            let both = d[0] * d[1] * 2.0;
            [x + r2 * (q1 * (r2 + d[0] * d[0] * 2.0) + q2 * both), y + r2 * (q2 * (r2 + d[1] * d[1] * 2.0) + q1 * both)]
        }
        Law::LocalFlaw => {
            let (lambda, sigma) = (theta[0], theta[3]);
            let q = [x - theta[1], y - theta[2]];
            let s2 = q[0] * q[0] + q[1] * q[1];
            let length = if theta[4].double() == 0.0 { s2.root() } else { sigma };
            if length.double() <= 0.0 {
                return None;
            }
            let share = lambda * (-(s2 / (sigma * sigma))).exponential() / length;
            [x + share * q[0], y + share * q[1]]
        }
        _ => return None,
    })
}

/// Position stage: where the antenna stands.
pub fn position<T: Real>(
    law: Law,
    context: &Context<'_>,
    theta: &[T],
    rotation: &Mat3<T>,
    antenna: &Vec3<T>,
) -> Option<Vec3<T>> {
    let image = context.image;
    let shift: Vec3<T> = match law {
        Law::GnssLeverArm => transpose_times(rotation, &[theta[0], theta[1], theta[2]]),
        Law::GnssDelay => std::array::from_fn(|k| theta[0] * image.velocity[k]),
        Law::GnssShift => [theta[0], theta[1], theta[2]],
        Law::GnssDrift => std::array::from_fn(|k| theta[k] + theta[3 + k] * image.flight_time_s),
        _ => return None,
    };
    Some(std::array::from_fn(|k| antenna[k] + shift[k]))
}

/// Frame stage: what the survey's system says of a Cartesian coordinate.
pub fn frame<T: Real>(law: Law, context: &Context<'_>, theta: &[T], coordinate: &Vec3<T>) -> Option<Vec3<T>> {
    // `in`: both, control, gnss.
    let acts = match context.surveyed? {
        SurveyedKind::Point => theta[1].double() != 2.0,
        SurveyedKind::Antenna => theta[1].double() != 1.0,
    };
    if !acts {
        return Some(*coordinate);
    }
    let centre = context.block.survey_centre;
    let [x, y, z] = std::array::from_fn(|k| coordinate[k] - coordinate[k].like(centre[k]));
    let size = theta[0];
    let shift = match law {
        Law::MapScale => [size * x, size * y, size.like(0.0)],
        Law::EarthCurvature => {
            let q = size / size.like(EARTH_RADIUS_M);
            [-(q * x * z), -(q * y * z), q * (x * x + y * y) * 0.5]
        }
        _ => return None,
    };
    Some(std::array::from_fn(|k| coordinate[k] + shift[k]))
}

/// The plain camera; `None` behind it.
pub fn camera<T: Real>(values: &[T; PARAMETER_COUNT], q: &Vec3<T>) -> Option<[T; 2]> {
    if q[2].double() <= 0.0 {
        return None;
    }
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, ..] = *values;
    let [p1, p2, b1, b2] = [P1, P1 + 1, B2 - 1, B2].map(|k| values[k]);
    let (u, v) = (ppx + f * q[0] / q[2], ppy + f * q[1] / q[2]);
    let (du, dv) = (u - dcx, v - dcy);
    let (uu, uv, vv) = (du * du, du * dv, dv * dv);
    let r2 = uu + vv;
    let radial = k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
    let x = u + du * radial + p1 * (uu * 3.0 + vv) + p2 * uv * 2.0 + b1 * du + b2 * dv;
    let y = v + dv * radial + p2 * (vv * 3.0 + uu) + p1 * uv * 2.0;
    Some([x, y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects;
    use crate::math::DoubleDouble;

    /// A turn by a quarter about z takes x to y.
    #[test]
    fn a_turn_is_the_exponential() {
        let (zero, one) = (DoubleDouble::ZERO, DoubleDouble::ONE);
        let identity = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        let third = DoubleDouble::from(std::f64::consts::FRAC_PI_6);
        let mut rotation = identity;
        for _ in 0..3 {
            rotation = turned(&[zero, zero, third], &rotation);
        }
        let x = times(&rotation, &[one, zero, zero]);
        assert!(x[0].hi.abs() < 1e-15 && (x[1].hi - 1.0).abs() < 1e-15 && x[2] == zero, "{x:?}");
        // Orthogonal to all digits.
        let square = dot(&rotation[0], &rotation[0]) - one;
        assert!(square.hi.abs() < 1e-30, "{square:?}");
    }

    #[test]
    fn every_law_is_of_the_catalogue() {
        for (id, law) in Law::ALL {
            assert!(effects::find(id).is_some(), "{id}");
            assert_eq!(Law::of(id), Some(law));
        }
        assert_eq!(Law::of("no-such-effect"), None);
    }
}
