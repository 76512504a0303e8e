//! Refraction in the air: a ray traced through horizontal layers.
//!
//! The refractive index falls with height, `n(h) = 1 + N exp(-h / H)`. At every boundary between layers Snell's law
//! keeps `n sin z`. The launch angle at the camera is found for which the broken ray meets the point. `N` and `H` are
//! those of the standard atmosphere at sea level: N = 2.77e-4 (visible light, 15 degrees Celsius, 1013.25 hPa), and
//! density there falls as with a scale height of 10.4 km (Edlén 1966; ISO 2533).

use super::*;
use crate::block::Pose;
use nalgebra::Vector3;

pub(super) static CAUSE: Cause = Cause {
    id: "refraction",
    summary: "light bent by the atmosphere, traced through horizontal layers",
    parameters: &[
        parameter("strength", "1", DefaultValue::Number(1.0), "n - 1 in units of the standard atmosphere's"),
        parameter("height", "m", DefaultValue::Number(0.0), "height above sea level of z = 0"),
        parameter("scale_height", "m", DefaultValue::Number(10_400.0), "height over which n - 1 falls by 1/e"),
    ],
    prepare,
};

/// `n - 1` of the standard atmosphere at sea level.
const REFRACTIVITY: f64 = 2.77e-4;
/// Layers between camera and ground. The error of the bending falls with its square: 1e-4 of it for the thickest air
/// that is sensible here, far less in a real one.
const LAYERS: usize = 32;
/// Newton's steps double the digits; the first guess is the straight line.
const STEPS: usize = 20;
/// Miss on the ground, in units of the distance, at which the ray counts as found.
const TOLERANCE: f64 = 1e-14;

struct Refraction {
    refractivity: f64,
    height: f64,
    scale_height: f64,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let values = setting.values;
    let refractivity = values.size("strength")? * REFRACTIVITY;
    let (height, scale_height) = (values.number("height"), values.positive("scale_height")?);
    unless(refractivity == 0.0, Refraction { refractivity, height, scale_height })
}

impl Refraction {
    fn index(&self, z: f64) -> f64 {
        1.0 + self.refractivity * (-(z + self.height) / self.scale_height).exp()
    }
}

impl Action for Refraction {
    fn medium(&self, pose: &Pose, point: Vector3<f64>) -> Option<Vector3<f64>> {
        let away = point - pose.centre;
        let distance = away.xy().norm();
        let fall = away.z;
        if distance == 0.0 {
            return Some(point);
        }
        if fall == 0.0 {
            // Along one layer: the ray cannot be traced through layers.
            return None;
        }
        let thickness = fall.abs() / LAYERS as f64;
        let mut layers = [0.0; LAYERS];
        for (k, n) in layers.iter_mut().enumerate() {
            *n = self.index(pose.centre.z + fall * (k as f64 + 0.5) / LAYERS as f64);
        }
        let at_camera = self.index(pose.centre.z);
        // Snell's invariant n sin z of the ray, first that of the straight line.
        let straight = distance / distance.hypot(fall);
        let mut invariant = at_camera * straight;
        let mut found = false;
        for _ in 0..STEPS {
            let (mut reached, mut slope) = (0.0, 0.0);
            for n in layers {
                let cos2 = n * n - invariant * invariant;
                if cos2 <= 0.0 {
                    return None;
                }
                reached += thickness * invariant / cos2.sqrt();
                slope += thickness * n * n / (cos2 * cos2.sqrt());
            }
            let miss = distance - reached;
            if miss.abs() <= TOLERANCE * distance {
                found = true;
                break;
            }
            invariant += miss / slope;
        }
        let cos2 = at_camera * at_camera - invariant * invariant;
        if !found || cos2 <= 0.0 {
            return None;
        }
        let stretch = fall.abs() * invariant / cos2.sqrt() / distance;
        Some(pose.centre + Vector3::new(away.x * stretch, away.y * stretch, fall))
    }
}
