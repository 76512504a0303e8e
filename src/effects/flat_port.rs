//! `flat-port`: the camera looks through a plane window square to its axis, which shifts rays sideways.
//!
//! ```text
//! w = P - C        d = w / |w|        k = R^T (0, 0, 1), the optical axis        cos a = d . k
//! shift = D sin a (1 - cos a / (n cos b))        sin a = n sin b
//! P' = P + shift e        e = (cos a d - k) / sin a: square to the ray, in the plane of ray and axis, away from the axis
//! ```
//!
//! Inside the window the ray runs nearer to the axis' direction (b < a). Followed from the camera outwards it leaves
//! the window nearer to the axis than the straight ray would, and parallel to it. So the true point lies nearer to the
//! axis than where the straight ray sees it: for positive D the point moves away from the axis. Multiplied out, `sin
//! a` cancels and everything is smooth at the axis:
//!
//! ```text
//! P' = P + D g (cos a d - k)        g = 1 - cos a / sqrt(n^2 - 1 + cos^2 a)
//! ```
//!
//! `a` is taken at the straight ray to P: an error of the second order in D / |w|. `D` thickness in m, `n` refractive
//! index of the window against the medium on both sides, given. Domain: `n >= 1`, the point before the camera and not
//! in its centre.
//!
//! Source: plane-parallel plate, e.g. Born and Wolf, Principles of Optics.
//!
//! Worked numbers, R = 1, C = 0, D = 0.01, n = 1.33: P = (10, 0, 10) (a = 45 degrees, shift 2.632363 mm) is seen at
//! (10.001861361, 0, 9.998138639); P = (0, 0, 10), on the axis, stays.

use super::common::{add_block, add_column, estimated, given, hand_on, vector};
use super::{Context, Descriptor, Effect, Kind, OutsideDomain, Picture, Scope, Stage, Words, fill_identity};
use crate::math::rotation::{exp, left_jacobian, skew};
use nalgebra::{Matrix3, Vector3};
use std::sync::LazyLock;

/// See the [module](self).
pub struct FlatPort;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "flat-port".into(),
    stage: Stage::Ray,
    kind: Kind::Physical,
    summary: "A plane window before the lens, square to the optical axis, shifts rays sideways.".into(),
    formula: "P += D sin a (1 - cos a/(n cos b)) e, sin a = n sin b, e square to the ray, away from the axis".into(),
    parameters: vec![
        estimated("D", "m", Scope::Global, 0.005).within(0.0, 0.2, "windows of aircraft and of deep housings"),
        given("n", "1", 1.33, &[]),
    ],
    needs: vec![],
    confused_with: "radial distortion (all of it at one object distance: a close and a distant object tell)".into(),
    source: "Plane-parallel plate, Born and Wolf".into(),
    picture: Picture::Radius,
    words: Some(Words {
        what: "The camera looks through a flat pane, and rays are bent on entering the air or water behind it. The \
               bend grows with the angle and depends on the distance."
            .into(),
        remedy: "Model the port with its thickness and distance, or use a dome port.".into(),
        tell: "images at different distances".into(),
    }),
});

impl Effect for FlatPort {
    fn descriptor(&self) -> &Descriptor {
        &DESCRIPTOR
    }

    fn eval(
        &self,
        _: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        mut d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let &[thickness, n] = theta else { return Err(OutsideDomain) };
        let r = vector(input, 0);
        let to_camera = exp(&r);
        let axis = to_camera.transpose() * Vector3::z();
        let ray = vector(input, 6) - vector(input, 3);
        let distance = ray.norm();
        let d = ray / distance;
        let c = d.dot(&axis);
        // A NaN fails here too.
        if !(distance > 0.0 && c > 0.0 && n >= 1.0) {
            return Err(OutsideDomain);
        }
        let root = (n * n - 1.0 + c * c).sqrt();
        let g = 1.0 - c / root;
        let outwards = d * c - axis;
        hand_on(Stage::Ray, input, out);
        for k in 0..3 {
            out[k] += thickness * g * outwards[k];
        }
        if let Some(matrix) = &mut d_input {
            fill_identity(Stage::Ray, matrix);
        }
        // Without a thickness, as candidates are tested, the input is handed on.
        if let Some(matrix) = d_input.filter(|_| thickness != 0.0) {
            let g_by_c = (1.0 - n * n) / (root * root * root);
            // d c = -outwards . dw / |w|;  d d = (1 - d d^T) dw / |w|.
            let c_by_point = outwards.transpose() * (-1.0 / distance);
            let across = Matrix3::identity() - d * d.transpose();
            let by_point =
                (outwards * c_by_point * g_by_c + (d * c_by_point + across * (c / distance)) * g) * thickness;
            add_block(matrix, 9, 0, 3, &-by_point);
            add_block(matrix, 9, 0, 6, &by_point);
            // The axis R^T e turns by R^T [e]x J dr.
            let axis_by_r = to_camera.transpose() * skew(&Vector3::z()) * left_jacobian(&r);
            let by_axis = (outwards * d.transpose() * g_by_c - across * g) * thickness;
            add_block(matrix, 9, 0, 0, &(by_axis * axis_by_r));
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            add_column(matrix, 2, 0, 0, &(outwards * g));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    fn seen(point: [f64; 3], thickness: f64) -> Vec<f64> {
        let mut input = [0.0; 9];
        input[6..].copy_from_slice(&point);
        laws::value(&FlatPort, &ImageContext::default(), &input, &[thickness, 1.33])
    }

    #[test]
    fn worked_numbers() {
        let found = seen([10.0, 0.0, 10.0], 0.01);
        assert_relative_eq!(found[..], [10.001_861_361, 0.0, 9.998_138_639], epsilon = 1e-9);
        assert_eq!(seen([0.0, 0.0, 10.0], 0.01), [0.0, 0.0, 10.0]);
    }

    /// A ray traced by Snell's law from the camera through the window to depth 10: its end must be seen in the ray's
    /// direction.
    #[test]
    fn a_traced_ray_is_seen_where_it_left() {
        let (thickness, depth) = (0.01, 10.0);
        for a in [0.1_f64, 0.5, 0.9] {
            let b = (a.sin() / 1.33).asin();
            let off_axis = (depth - thickness) * a.tan() + thickness * b.tan();
            let found = seen([0.0, off_axis, depth], thickness);
            let shift = depth * a.tan() - off_axis;
            let missed = found[1] / found[2] * depth - depth * a.tan();
            // Second order: the angle at the straight ray is off by less than thickness / depth.
            assert!(missed.abs() < shift * thickness / depth, "{a}: {missed:e} of {shift:e}");
        }
    }
}
