//! OpenSfM's cameras.
//!
//! ```text
//! x = X / Z    y = Y / Z    r2 = x^2 + y^2    d = 1 + k1 r2 + k2 r2^2 + k3 r2^3    S the longer side, px
//! perspective, simple_radial, radial, brown:
//! column = w/2 + S (focal_x (x d + 2 p1 x y + p2 (r2 + 2 x^2)) + c_x)
//! row    = h/2 + S (focal_y (y d + 2 p2 x y + p1 (r2 + 2 y^2)) + c_y)
//! ```
//!
//! Source: OpenSfM, `doc/source/geometry`. p1 and p2 are the Fraser camera's p2 and p1.

use super::reconstruction::Camera;
use crate::camera::Interior;

/// The camera's numbers in px; of `focal`, the second is that of y.
#[derive(Clone, Copy)]
pub(super) struct Model {
    focal: [f64; 2],
    pp: [f64; 2],
    k: [f64; 3],
    p: [f64; 2],
}

impl Model {
    /// An error says what was expected.
    pub(super) fn new(camera: &Camera) -> Result<Self, String> {
        let kind = camera.projection_type.as_deref().unwrap_or("perspective");
        if !matches!(kind, "perspective" | "simple_radial" | "radial" | "brown") {
            return Err(format!(
                "projection_type {kind:?} is no Fraser camera; expected perspective, simple_radial, radial or brown"
            ));
        }
        let size = f64::from(camera.width.max(camera.height));
        if camera.width == 0 || camera.height == 0 {
            return Err("expected a width and a height above zero".into());
        }
        let focal_x = camera.focal_x.or(camera.focal).ok_or("has no focal length")?;
        let focal_y = camera.focal_y.or(camera.focal).ok_or("has no focal length")?;
        if focal_x <= 0.0 || focal_y <= 0.0 {
            return Err(format!("expected a focal length above zero, found {focal_x} and {focal_y}"));
        }
        let middle = [camera.width, camera.height].map(|side| 0.5 * f64::from(side));
        Ok(Self {
            focal: [focal_x * size, focal_y * size],
            pp: [middle[0] + camera.c_x * size, middle[1] + camera.c_y * size],
            k: [camera.k1, camera.k2, camera.k3],
            p: [camera.p1, camera.p2],
        })
    }

    /// The Fraser camera that is the same, where there is one: ours stretches the ideal point, OpenSfM's the distorted
    /// one.
    pub(super) fn exact(&self) -> Option<Interior> {
        let is_distorted = self.k != [0.0; 3] || self.p != [0.0; 2];
        (self.focal[0] == self.focal[1] || !is_distorted).then(|| self.start())
    }

    /// A Fraser camera near it.
    pub(super) fn start(&self) -> Interior {
        let ([fx, f], [ppx, ppy], [k1, k2, k3], [p1, p2]) = (self.focal, self.pp, self.k, self.p);
        let f2 = f * f;
        let radial = [k1 / f2, k2 / (f2 * f2), k3 / (f2 * f2 * f2)];
        [f, ppx, ppy, ppx, ppy, radial[0], radial[1], radial[2], p2 / f, p1 / f, fx / f - 1.0, 0.0]
    }

    /// The image point, px, of the direction `(x, y, 1)`.
    pub(super) fn project(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([k1, k2, k3], [p1, p2]) = (self.k, self.p);
        let r2 = x * x + y * y;
        let d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        [
            self.pp[0] + self.focal[0] * (x * d + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)),
            self.pp[1] + self.focal[1] * (y * d + 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::fraser::project;
    use approx::assert_relative_eq;

    fn brown(focal_x: f64) -> Camera {
        Camera {
            projection_type: Some("brown".into()),
            width: 4000,
            height: 3000,
            focal_x: Some(focal_x),
            focal_y: Some(0.9),
            c_x: 0.01,
            c_y: -0.02,
            k1: -0.1,
            k2: 0.05,
            k3: -0.01,
            p1: 2e-3,
            p2: -1e-3,
            ..Camera::default()
        }
    }

    #[test]
    fn one_focal_length_is_exactly_a_fraser_camera() {
        let model = Model::new(&brown(0.9)).unwrap();
        let interior = model.exact().unwrap();
        for [x, y] in [[0.0, 0.0], [0.5, -0.3], [-0.4, 0.35]] {
            let [theirs, ours] = [model.project([x, y]), project(&interior, [x, y, 1.0]).unwrap()];
            assert_relative_eq!(theirs[..], ours[..], epsilon = 1e-9);
        }
        assert!(Model::new(&brown(0.91)).unwrap().exact().is_none());
    }

    #[test]
    fn other_projections_are_refused_by_name() {
        let camera = Camera { projection_type: Some("spherical".into()), ..brown(0.9) };
        let message = Model::new(&camera).err().unwrap();
        assert!(message.starts_with("projection_type \"spherical\" is no Fraser camera"), "{message}");
    }
}
