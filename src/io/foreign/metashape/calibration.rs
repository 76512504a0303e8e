//! Metashape's frame camera.
//!
//! ```text
//! x = X / Z    y = Y / Z    r2 = x^2 + y^2
//! d = 1 + k1 r2 + k2 r2^2 + k3 r2^3 + k4 r2^4    s = 1 + p3 r2 + p4 r2^2
//! x' = x d + (p1 (r2 + 2 x^2) + 2 p2 x y) s
//! y' = y d + (p2 (r2 + 2 y^2) + 2 p1 x y) s
//! column = w/2 + cx + f x' + b1 x' + b2 y'       row = h/2 + cy + f y'
//! ```
//!
//! Source: Agisoft Metashape user manual, appendix on camera models. p1 and p2 are those of the Fraser camera, unlike
//! in OpenCV.

use super::super::fit::{Fit, Formula, fit_fraser, fit_to_fraser};
use super::document::Calibration;
use crate::camera::{Camera, DCX, DCY, F, Interior, PPX, PPY};

impl Calibration {
    /// The image point, px, of the direction `(x, y, 1)`.
    pub(super) fn project(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Self { f, pp, b: [b1, b2], k: [k1, k2, k3, k4], p: [p1, p2, p3, p4] } = *self;
        let r2 = x * x + y * y;
        let d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
        let s = 1.0 + r2 * (p3 + r2 * p4);
        let xd = x * d + (p1 * (r2 + 2.0 * x * x) + 2.0 * p2 * x * y) * s;
        let yd = y * d + (p2 * (r2 + 2.0 * y * y) + 2.0 * p1 * x * y) * s;
        [pp[0] + f * xd + b1 * xd + b2 * yd, pp[1] + f * yd]
    }

    /// The Fraser camera that is the same, but for k4, p3, p4 and what b1, b2 do to the distortion.
    fn linear(&self) -> Interior {
        let Self { f, pp: [ppx, ppy], b: [b1, b2], k: [k1, k2, k3, _], p: [p1, p2, ..] } = *self;
        let f2 = f * f;
        let radial = [k1 / f2, k2 / (f2 * f2), k3 / (f2 * f2 * f2)];
        [f, ppx, ppy, ppx, ppy, radial[0], radial[1], radial[2], p1 / f, p2 / f, b1 / f, b2 / f]
    }

    /// Is [`Self::linear`] the same camera?
    fn is_exact(&self) -> bool {
        let Self { b, k: [k1, k2, k3, k4], p: [p1, p2, ..], .. } = *self;
        let is_decentred = [p1, p2] != [0.0; 2];
        let is_distorted = [k1, k2, k3] != [0.0; 3] || is_decentred;
        // p3 and p4 multiply what p1 and p2 make.
        k4 == 0.0 && (!is_decentred || self.p[2..] == [0.0; 2]) && (b == [0.0; 2] || !is_distorted)
    }

    /// The nearest Fraser camera over a sensor of `size` px; `None` where there is none near.
    pub(super) fn to_fraser(self, size: [u32; 2]) -> Option<Fit<Interior>> {
        if self.is_exact() {
            return Some(Fit { parameters: self.linear(), rms_px: 0.0, max_px: 0.0 });
        }
        fit_fraser(&Formula::Forward(&|ray| Some(self.project(ray))), size, &self.linear(), true)
    }

    /// The nearest one to a Fraser camera; `None` where there is none near.
    pub(super) fn of_fraser(camera: &Camera) -> Option<Fit<Self>> {
        let [f, ppx, ppy, _, _, k1, k2, k3, p1, p2, b1, b2] = camera.interior;
        let f2 = f * f;
        let k = [k1 * f2, k2 * f2 * f2, k3 * f2 * f2 * f2, 0.0];
        let start = Self { f, pp: [ppx, ppy], b: [b1 * f, b2 * f], k, p: [p1 * f, p2 * f, 0.0, 0.0] };
        let is_tied = [camera.interior[DCX], camera.interior[DCY]] == [camera.interior[PPX], camera.interior[PPY]];
        if is_tied && start.is_exact() {
            return Some(Fit { parameters: start, rms_px: 0.0, max_px: 0.0 });
        }
        let of = |v: &[f64]| Self {
            f: v[0],
            pp: [v[1], v[2]],
            b: [v[3], v[4]],
            k: [v[5], v[6], v[7], v[8]],
            p: [v[9], v[10], 0.0, 0.0],
        };
        let values = [&[start.f], &start.pp[..], &start.b, &start.k, &start.p[..2]].concat();
        // What moves a point at the corner by a pixel.
        let corner = camera.half_diagonal_px() / camera.interior[F];
        let coefficient = |order: i32| 1.0 / (f * corner.powi(order));
        let scales = [
            1.0,
            1.0,
            1.0,
            1.0 / corner,
            1.0 / corner,
            coefficient(3),
            coefficient(5),
            coefficient(7),
            coefficient(9),
            coefficient(2),
            coefficient(2),
        ];
        let fit = fit_to_fraser(camera, values, &scales, &|values, ray| Some(of(values).project(ray)))?;
        Some(Fit { parameters: of(&fit.parameters), rms_px: fit.rms_px, max_px: fit.max_px })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::fraser::project;
    use approx::assert_relative_eq;

    const CALIBRATION: Calibration = Calibration {
        f: 3705.0,
        pp: [2651.0, 1950.0],
        b: [0.0, 0.0],
        k: [-0.09, -0.07, 0.11, 0.0],
        p: [-3e-4, 1.2e-4, 0.0, 0.0],
    };
    const SIZE: [u32; 2] = [5280, 3956];

    fn camera(interior: Interior) -> Camera {
        Camera { id: "cam".into(), width_px: SIZE[0], height_px: SIZE[1], pixel_um: None, interior }
    }

    #[test]
    fn without_affinity_it_is_exactly_a_fraser_camera() {
        let fit = CALIBRATION.to_fraser(SIZE).unwrap();
        for [x, y] in [[0.0, 0.0], [0.6, -0.4], [-0.5, 0.45]] {
            let [theirs, ours] = [CALIBRATION.project([x, y]), project(&fit.parameters, [x, y, 1.0]).unwrap()];
            assert_relative_eq!(theirs[..], ours[..], epsilon = 1e-9);
        }
        assert_eq!(fit.max_px, 0.0);
    }

    /// The fit has nothing to do with the conversion, and finds the same numbers.
    #[test]
    fn the_fit_agrees_with_the_conversion() {
        let exact = CALIBRATION.to_fraser(SIZE).unwrap().parameters;
        let formula = |ray| Some(CALIBRATION.project(ray));
        let start = [3700.0, 2640.0, 1978.0, 2640.0, 1978.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let fit = fit_fraser(&Formula::Forward(&formula), SIZE, &start, true).unwrap();
        assert!(fit.max_px < 1e-6, "{fit:?}");
        // In units that move a point of the image by a pixel.
        for ((found, exact), unit) in fit.parameters.iter().zip(exact).zip(camera(exact).scales()) {
            assert!((found - exact).abs() <= 1e-6 * unit, "{found} {exact}");
        }
    }

    #[test]
    fn affinity_of_the_distorted_point_is_fitted_and_the_difference_told() {
        let affine = Calibration { b: [2.0, -1.0], ..CALIBRATION };
        let fit = affine.to_fraser(SIZE).unwrap();
        // (b1 / f) times the distortion of some hundred px, most of which other terms take up.
        assert!(fit.max_px > 0.0 && fit.max_px < 0.05, "{fit:?}");
        let back = Calibration::of_fraser(&camera(fit.parameters)).unwrap();
        assert!(back.max_px < 0.05, "{} px", back.max_px);
        assert!((back.parameters.b[0] - 2.0).abs() < 0.1 && (back.parameters.f - affine.f).abs() < 0.1);
    }
}
