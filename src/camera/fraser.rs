//! The twelve-parameter Fraser camera, from object to image, with its derivatives by hand.
//!
//! ```text
//! (X, Y, Z) = point in the camera frame, x right, y down, z forward, Z > 0
//! u = ppx + f X / Z          du = u - dcx
//! v = ppy + f Y / Z          dv = v - dcy          r2 = du^2 + dv^2
//! radial = k1 r2 + k2 r2^2 + k3 r2^3
//! x = u + du radial + p1 (r2 + 2 du^2) + 2 p2 du dv + b1 du + b2 dv
//! y = v + dv radial + p2 (r2 + 2 dv^2) + 2 p1 du dv
//! ```
//!
//! Source: Fraser (1997), with a centre of distortion of its own as in MicMac; the distortion acts from object to
//! image.

use super::{F, Interior, PARAMETER_COUNT, PPX, PPY};
use crate::math::Number;

/// Image point (px) and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection<T = f64> {
    /// Image point `(x, y)`, px.
    pub point: [T; 2],
    /// 2x3, by the point in the camera frame, px/m.
    pub d_camera_point: [[T; 3]; 2],
    /// 2x12, by the interior orientation.
    pub d_interior: [[T; PARAMETER_COUNT]; 2],
}

/// Distorts the ideal image point `(u, v)` (px): the last three lines of the formula.
#[inline(always)]
pub fn distort<T: Number>(interior: &[T; PARAMETER_COUNT], u: T, v: T) -> [T; 2] {
    let [_, _, _, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    [
        u + du * radial + p1 * (r2 + du * du * 2.0) + p2 * du * dv * 2.0 + b1 * du + b2 * dv,
        v + dv * radial + p2 * (r2 + dv * dv * 2.0) + p1 * du * dv * 2.0,
    ]
}

/// Image point (px) of a point in the camera frame; `None` behind the camera (`Z <= 0`).
pub fn project(interior: &Interior, camera_point: [f64; 3]) -> Option<[f64; 2]> {
    if camera_point[2] <= 0.0 {
        return None;
    }
    Some(project_in_front(interior, camera_point))
}

/// [`project`] of points that are known to lie in front of the camera.
#[inline(always)]
pub fn project_in_front<T: Number>(interior: &[T; PARAMETER_COUNT], [x, y, z]: [T; 3]) -> [T; 2] {
    distort(interior, interior[PPX] + interior[F] * x / z, interior[PPY] + interior[F] * y / z)
}

/// [`project`] with its derivatives, derived by hand.
pub fn project_with_derivatives(interior: &Interior, camera_point: [f64; 3]) -> Option<Projection> {
    if camera_point[2] <= 0.0 {
        return None;
    }
    Some(linearise_in_front(interior, camera_point))
}

/// [`project_with_derivatives`] of points that are known to lie in front of the camera.
#[inline(always)]
pub fn linearise_in_front<T: Number>(interior: &[T; PARAMETER_COUNT], [cx, cy, cz]: [T; 3]) -> Projection<T> {
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let (zero, one) = (cz.like(0.0), cz.like(1.0));
    let inverse_depth = one / cz;
    let (tx, ty) = (cx * inverse_depth, cy * inverse_depth);
    let (u, v) = (ppx + f * tx, ppy + f * ty);
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    // d radial / d r2, doubled: d r2 = 2 du d(du) + 2 dv d(dv).
    let slope = (k1 + r2 * (k2 * 2.0 + r2 * k3 * 3.0)) * 2.0;
    let cross = slope * du * dv + p1 * dv * 2.0 + p2 * du * 2.0;
    // Derivatives of the distortion alone by (du, dv).
    let dx_du = radial + slope * du * du + p1 * du * 6.0 + p2 * dv * 2.0 + b1;
    let dx_dv = cross + b2;
    let dy_du = cross;
    let dy_dv = radial + slope * dv * dv + p2 * dv * 6.0 + p1 * du * 2.0;
    // By the ideal point (u, v): the identity is added.
    let a = [[one + dx_du, dx_dv], [dy_du, one + dy_dv]];
    let fz = f * inverse_depth;
    let along = [a[0][0] * tx + a[0][1] * ty, a[1][0] * tx + a[1][1] * ty];
    let r4 = r2 * r2;
    let r6 = r4 * r2;
    let (p_x, p_y, p_both) = (r2 + du * du * 2.0, r2 + dv * dv * 2.0, du * dv * 2.0);
    Projection {
        point: [u + du * radial + p1 * p_x + p2 * p_both + b1 * du + b2 * dv, v + dv * radial + p2 * p_y + p1 * p_both],
        d_camera_point: [[a[0][0] * fz, a[0][1] * fz, -along[0] * fz], [a[1][0] * fz, a[1][1] * fz, -along[1] * fz]],
        d_interior: [
            [along[0], a[0][0], a[0][1], -dx_du, -dx_dv, du * r2, du * r4, du * r6, p_x, p_both, du, dv],
            [along[1], a[1][0], a[1][1], -dy_du, -dy_dv, dv * r2, dv * r4, dv * r6, p_both, p_y, zero, zero],
        ],
    }
}
