//! COLMAP's camera models: which are a Fraser camera in other units, and the formulas of those that are not.
//!
//! A ray is `(u, v) = (X / Z, Y / Z)`; what COLMAP's coefficients multiply is normalised by the focal length, where
//! ours are in pixels. Its `p1` and `p2` are OpenCV's, ours the other way round. Source: COLMAP,
//! `src/colmap/sensor/models.h`.

use super::super::fit::{Fit, Formula, fit_fraser, fit_to_fraser};
use crate::camera::{Camera, Interior};

/// A model of COLMAP.
#[derive(Debug)]
pub struct CameraModel {
    /// In binary files.
    pub id: i32,
    /// In text files.
    pub name: &'static str,
    /// Number of parameters.
    pub parameters: usize,
    /// Does it begin with one focal length, and not with two?
    one_focal_length: bool,
    /// Distorts a normalised point by the parameters that follow the principal point; `None` outside the domain.
    distort: fn(&[f64], [f64; 2]) -> Option<[f64; 2]>,
}

/// Every model that sees what is in front of the camera, by id.
pub const MODELS: [CameraModel; 17] = [
    model(0, "SIMPLE_PINHOLE", 3, true, |_, uv| Some(uv)),
    model(1, "PINHOLE", 4, false, |_, uv| Some(uv)),
    model(2, "SIMPLE_RADIAL", 4, true, |k, uv| brown([k[0], 0.0], [0.0; 2], uv)),
    model(3, "RADIAL", 5, true, |k, uv| brown([k[0], k[1]], [0.0; 2], uv)),
    model(4, "OPENCV", 8, false, |k, uv| brown([k[0], k[1]], [k[2], k[3]], uv)),
    model(5, "OPENCV_FISHEYE", 8, false, |k, uv| Some(fisheye(k, uv))),
    model(6, "FULL_OPENCV", 12, false, rational),
    model(7, "FOV", 5, false, field_of_view),
    model(8, "SIMPLE_RADIAL_FISHEYE", 4, true, |k, uv| Some(fisheye(k, uv))),
    model(9, "RADIAL_FISHEYE", 5, true, |k, uv| Some(fisheye(k, uv))),
    model(10, "THIN_PRISM_FISHEYE", 12, false, thin_prism_fisheye),
    model(11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, false, rad_tan_thin_prism_fisheye),
    model(12, "SIMPLE_DIVISION", 4, true, division),
    model(13, "DIVISION", 5, false, division),
    model(14, "SIMPLE_FISHEYE", 3, true, |_, uv| Some(fisheye(&[], uv))),
    model(15, "FISHEYE", 4, false, |_, uv| Some(fisheye(&[], uv))),
    model(16, "EUCM", 6, false, unified),
];

const fn model(
    id: i32,
    name: &'static str,
    parameters: usize,
    one_focal_length: bool,
    distort: fn(&[f64], [f64; 2]) -> Option<[f64; 2]>,
) -> CameraModel {
    CameraModel { id, name, parameters, one_focal_length, distort }
}

/// A model and its parameters, as many as the model has.
#[derive(Debug, Clone)]
pub struct ModelCamera {
    /// The model.
    pub model: &'static CameraModel,
    /// Its parameters.
    pub parameters: Vec<f64>,
}

impl ModelCamera {
    /// `fx, fy, cx, cy` and what follows.
    fn split(&self) -> ([f64; 4], &[f64]) {
        match (self.model.one_focal_length, &self.parameters[..]) {
            (true, [f, cx, cy, rest @ ..]) | (false, [f, _, cx, cy, rest @ ..]) => {
                let fy = if self.model.one_focal_length { *f } else { self.parameters[1] };
                ([*f, fy, *cx, *cy], rest)
            }
            _ => ([f64::NAN; 4], &[]),
        }
    }

    /// Are the focal lengths such as a camera has?
    pub fn is_plausible(&self) -> bool {
        let ([fx, fy, ..], _) = self.split();
        fx > 0.0 && fy > 0.0
    }

    /// Image point (px) of a ray.
    pub fn project(&self, ray: [f64; 2]) -> Option<[f64; 2]> {
        let ([fx, fy, cx, cy], rest) = self.split();
        let [u, v] = (self.model.distort)(rest, ray)?;
        Some([fx * u + cx, fy * v + cy])
    }

    /// The Fraser camera without distortion of the same focal lengths.
    fn pinhole(&self) -> Interior {
        let ([fx, fy, cx, cy], _) = self.split();
        [fy, cx, cy, cx, cy, 0.0, 0.0, 0.0, 0.0, 0.0, fx / fy - 1.0, 0.0]
    }

    /// The Fraser camera that is this one in other units, where there is one. Of two focal lengths ours is that of y,
    /// and `b1 = fx / fy - 1`; it stretches the ideal point, and theirs the distorted one, so that with a distortion
    /// the two are different.
    pub fn exact(&self) -> Option<Interior> {
        let ([fx, fy, cx, cy], rest) = self.split();
        let [k1, k2, p1, p2, k3] = match (self.model.name, rest) {
            ("SIMPLE_PINHOLE" | "PINHOLE", _) => [0.0; 5],
            ("SIMPLE_RADIAL", [k1]) => [*k1, 0.0, 0.0, 0.0, 0.0],
            ("RADIAL", [k1, k2]) => [*k1, *k2, 0.0, 0.0, 0.0],
            ("OPENCV", [k1, k2, p1, p2]) => [*k1, *k2, *p1, *p2, 0.0],
            ("FULL_OPENCV", [k1, k2, p1, p2, k3, rest @ ..]) if rest.iter().all(|k| *k == 0.0) => {
                [*k1, *k2, *p1, *p2, *k3]
            }
            _ => return None,
        };
        let distorts = [k1, k2, p1, p2, k3].iter().any(|k| *k != 0.0);
        if distorts && fx != fy {
            return None;
        }
        let f = fy;
        let radial = [k1 / f.powi(2), k2 / f.powi(4), k3 / f.powi(6)];
        Some([f, cx, cy, cx, cy, radial[0], radial[1], radial[2], p2 / f, p1 / f, fx / fy - 1.0, 0.0])
    }

    /// The Fraser camera that comes nearest; `None` where none comes near.
    pub fn nearest(&self, size: [u32; 2]) -> Option<Fit<Interior>> {
        let project = |ray| self.project(ray);
        fit_fraser(&Formula::Forward(&project), size, &self.pinhole(), true)
    }
}

/// The simplest model that is a Fraser camera in other units, where there is one.
pub fn of_fraser(interior: &Interior) -> Option<ModelCamera> {
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let camera = |id: usize, parameters: Vec<f64>| Some(ModelCamera { model: &MODELS[id], parameters });
    let distorts = [k1, k2, k3, p1, p2].iter().any(|k| *k != 0.0);
    if b2 != 0.0 || (distorts && b1 != 0.0) {
        return None;
    }
    if !distorts {
        // b1 stretches about the centre of distortion.
        let (fx, cx) = (f * (1.0 + b1), ppx + b1 * (ppx - dcx));
        return if b1 == 0.0 { camera(0, vec![f, ppx, ppy]) } else { camera(1, vec![fx, f, cx, ppy]) };
    }
    if (dcx, dcy) != (ppx, ppy) {
        return None;
    }
    let [k1, k2, k3] = [k1 * f.powi(2), k2 * f.powi(4), k3 * f.powi(6)];
    let [p1, p2] = [p2 * f, p1 * f];
    match [k2, k3, p1, p2].map(|k| k != 0.0) {
        [false, false, false, false] => camera(2, vec![f, ppx, ppy, k1]),
        [true, false, false, false] => camera(3, vec![f, ppx, ppy, k1, k2]),
        [_, false, _, _] => camera(4, vec![f, f, ppx, ppy, k1, k2, p1, p2]),
        _ => camera(6, vec![f, f, ppx, ppy, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]),
    }
}

/// The camera of the model FULL_OPENCV, its denominator left out, that comes nearest to a Fraser camera; `None` where
/// none comes near.
pub fn nearest_to_fraser(camera: &Camera) -> Option<Fit<ModelCamera>> {
    let model = &MODELS[6];
    let full = |values: &[f64]| ModelCamera { model, parameters: [values, &[0.0; 3]].concat() };
    let [f, ppx, ppy, _, _, k1, k2, k3, p1, p2, b1, _] = camera.interior;
    let start = vec![f * (1.0 + b1), f, ppx, ppy, k1 * f.powi(2), k2 * f.powi(4), p2 * f, p1 * f, k3 * f.powi(6)];
    // Changes that move a point at half the diagonal by a pixel.
    let h = camera.half_diagonal_px();
    let (edge, radial) = (h / f, |order: i32| (h / f).powi(-2 * order) / h);
    let scales = [edge.recip(), edge.recip(), 1.0, 1.0, radial(1), radial(2), f / (h * h), f / (h * h), radial(3)];
    let Fit { parameters, rms_px, max_px } =
        fit_to_fraser(camera, start, &scales, &|values, ray| full(values).project(ray))?;
    Some(Fit { parameters: full(&parameters), rms_px, max_px })
}

/// Radial and tangential terms as in OpenCV.
fn brown([k1, k2]: [f64; 2], p: [f64; 2], uv: [f64; 2]) -> Option<[f64; 2]> {
    rational(&[k1, k2, p[0], p[1], 0.0, 0.0, 0.0, 0.0], uv)
}

fn rational(k: &[f64], [u, v]: [f64; 2]) -> Option<[f64; 2]> {
    let r2 = u * u + v * v;
    let above = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    let below = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
    let (radial, p1, p2) = (above / below, k[2], k[3]);
    let x = u * radial + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u);
    let y = v * radial + 2.0 * p2 * u * v + p1 * (r2 + 2.0 * v * v);
    (below > 0.0).then_some([x, y])
}

/// The angle to the axis in place of its tangent, times `1 + k1 angle^2 + ...`.
fn fisheye(k: &[f64], [u, v]: [f64; 2]) -> [f64; 2] {
    let r = u.hypot(v);
    let angle = r.atan();
    let polynomial = k.iter().rev().fold(0.0, |sum, k| angle * angle * (k + sum));
    // Towards the axis the angle is its tangent.
    let scale = if r > f64::EPSILON { angle / r } else { 1.0 } * (1.0 + polynomial);
    [u * scale, v * scale]
}

fn field_of_view(k: &[f64], [u, v]: [f64; 2]) -> Option<[f64; 2]> {
    let (omega, r) = (k[0], u.hypot(v));
    let scale = if r * omega.abs() > f64::EPSILON {
        (2.0 * r * (0.5 * omega).tan()).atan() / (r * omega)
    } else if omega != 0.0 {
        2.0 * (0.5 * omega).tan() / omega
    } else {
        1.0
    };
    Some([u * scale, v * scale])
}

fn thin_prism_fisheye(k: &[f64], uv: [f64; 2]) -> Option<[f64; 2]> {
    let &[k1, k2, p1, p2, k3, k4, sx, sy] = k else { return None };
    let [u, v] = fisheye(&[], uv);
    let r2 = u * u + v * v;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)));
    Some([
        u * radial + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u) + sx * r2,
        v * radial + 2.0 * p2 * u * v + p1 * (r2 + 2.0 * v * v) + sy * r2,
    ])
}

fn rad_tan_thin_prism_fisheye(k: &[f64], uv: [f64; 2]) -> Option<[f64; 2]> {
    let &[.., p0, p1, s0, s1, s2, s3] = k else { return None };
    let [u, v] = fisheye(&k[..6], uv);
    let r2 = u * u + v * v;
    Some([
        u + p0 * (r2 + 2.0 * u * u) + 2.0 * p1 * u * v + s0 * r2 + s1 * r2 * r2,
        v + p1 * (r2 + 2.0 * v * v) + 2.0 * p0 * u * v + s2 * r2 + s3 * r2 * r2,
    ])
}

/// `ideal = distorted / (1 + k |distorted|^2)`, solved for the distorted point.
fn division(k: &[f64], [u, v]: [f64; 2]) -> Option<[f64; 2]> {
    let discriminant = 1.0 - 4.0 * k[0] * (u * u + v * v);
    let scale = 2.0 / (1.0 + discriminant.max(0.0).sqrt());
    (discriminant >= 0.0).then_some([u * scale, v * scale])
}

fn unified(k: &[f64], [u, v]: [f64; 2]) -> Option<[f64; 2]> {
    let (alpha, beta) = (k[0], k[1]);
    let below = alpha * (beta * (u * u + v * v) + 1.0).sqrt() + 1.0 - alpha;
    (below > 0.0).then_some([u / below, v / below])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::fraser;

    const SIZE: [u32; 2] = [4000, 3000];

    fn camera(id: usize, parameters: &[f64]) -> ModelCamera {
        assert_eq!(MODELS[id].parameters, parameters.len());
        ModelCamera { model: &MODELS[id], parameters: parameters.to_vec() }
    }

    /// What is exact is exact over the sensor, and comes back; a wrong order of p1 and p2 would be 4 px off.
    #[test]
    fn other_units_are_the_same_camera() {
        let cameras = [
            camera(0, &[3600.0, 2010.0, 1490.0]),
            camera(1, &[3610.0, 3600.0, 2010.0, 1490.0]),
            camera(2, &[3600.0, 2010.0, 1490.0, -0.08]),
            camera(3, &[3600.0, 2010.0, 1490.0, -0.08, 0.02]),
            camera(4, &[3600.0, 3600.0, 2010.0, 1490.0, -0.08, 0.02, 1e-3, -5e-4]),
            camera(6, &[3600.0, 3600.0, 2010.0, 1490.0, -0.08, 0.02, 1e-3, -5e-4, 0.01, 0.0, 0.0, 0.0]),
        ];
        for camera in cameras {
            let interior = camera.exact().unwrap();
            for ray in [[0.0, 0.0], [0.5, 0.4], [-0.55, 0.41], [0.3, -0.4]] {
                let [ours, theirs] =
                    [fraser::project(&interior, [ray[0], ray[1], 1.0]).unwrap(), camera.project(ray).unwrap()];
                let miss = (ours[0] - theirs[0]).hypot(ours[1] - theirs[1]);
                assert!(miss < 1e-9, "{}: {miss} px at {ray:?}", camera.model.name);
            }
            let again = of_fraser(&interior).unwrap();
            assert_eq!(again.model.name, camera.model.name);
            for (a, b) in again.parameters.iter().zip(&camera.parameters) {
                assert!((a - b).abs() <= 1e-12 * b.abs(), "{}: {a} {b}", camera.model.name);
            }
        }
    }

    /// Two focal lengths with a distortion have no exact counterpart; what is left is what formats of this kind leave.
    #[test]
    fn two_focal_lengths_with_distortion_are_fitted() {
        let camera = camera(4, &[3601.0, 3600.0, 2010.0, 1490.0, -0.08, 0.02, 1e-3, -5e-4]);
        assert!(camera.exact().is_none());
        let fit = camera.nearest(SIZE).unwrap();
        assert!(fit.max_px > 1e-4 && fit.max_px < 0.05, "{fit:?}");
        let straight = ModelCamera { parameters: [&[3600.0], &camera.parameters[1..]].concat(), ..camera };
        let fit = straight.nearest(SIZE).unwrap();
        assert!(fit.max_px < 1e-8, "{fit:?}");
        let exact = straight.exact().unwrap();
        for (found, exact) in fit.parameters.iter().zip(exact).take(5) {
            assert!((found - exact).abs() < 1e-6, "{found} {exact}");
        }
    }

    #[test]
    fn a_fraser_camera_with_a_centre_of_its_own_is_fitted() {
        let interior = [3600.0, 2010.0, 1490.0, 2011.0, 1489.0, -6e-9, 1e-16, 0.0, 1e-7, -1e-7, 0.0, 0.0];
        assert!(of_fraser(&interior).is_none());
        let camera = Camera { id: "c".into(), width_px: SIZE[0], height_px: SIZE[1], pixel_um: None, interior };
        let fit = nearest_to_fraser(&camera).unwrap();
        // A centre of distortion that is 1.4 px off is decentring, of which p1 and p2 have the part of k1. Of k2 there
        // is left at most the largest derivative of k2 r^5 times that distance.
        let (r, k2) = (2011f64.hypot(1511.0), interior[6]);
        assert!(fit.max_px > 1e-6 && fit.max_px < 5.0 * k2 * r.powi(4) * 2f64.sqrt(), "{fit:?}");
    }
}
