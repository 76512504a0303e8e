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
//! Source: Fraser (1997), with a centre of distortion of its own as in MicMac; the distortion acts from object to image.

use super::{F, Interior, PARAMETER_COUNT, PPX, PPY};

/// Image point (px) and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Image point `(x, y)`, px.
    pub point: [f64; 2],
    /// 2x3, by the point in the camera frame, px/m.
    pub d_camera_point: [[f64; 3]; 2],
    /// 2x12, by the interior orientation.
    pub d_interior: [[f64; PARAMETER_COUNT]; 2],
}

/// Distorts the ideal image point `(u, v)` (px): the last three lines of the formula.
pub fn distort(interior: &Interior, u: f64, v: f64) -> [f64; 2] {
    let [_, _, _, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    [
        u + du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv,
        v + dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv,
    ]
}

/// Image point (px) of a point in the camera frame; `None` behind the camera (`Z <= 0`).
pub fn project(interior: &Interior, camera_point: [f64; 3]) -> Option<[f64; 2]> {
    let [x, y, z] = camera_point;
    if z <= 0.0 {
        return None;
    }
    Some(distort(interior, interior[PPX] + interior[F] * x / z, interior[PPY] + interior[F] * y / z))
}

/// [`project`] with its derivatives, derived by hand.
pub fn project_with_derivatives(interior: &Interior, camera_point: [f64; 3]) -> Option<Projection> {
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let [cx, cy, cz] = camera_point;
    if cz <= 0.0 {
        return None;
    }
    let inverse_depth = 1.0 / cz;
    let (tx, ty) = (cx * inverse_depth, cy * inverse_depth);
    let (u, v) = (ppx + f * tx, ppy + f * ty);
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = r2 * (k1 + r2 * (k2 + r2 * k3));
    // d radial / d r2, doubled: d r2 = 2 du d(du) + 2 dv d(dv).
    let slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3));
    let cross = slope * du * dv + 2.0 * p1 * dv + 2.0 * p2 * du;
    // Derivatives of the distortion alone by (du, dv).
    let dx_du = radial + slope * du * du + 6.0 * p1 * du + 2.0 * p2 * dv + b1;
    let dx_dv = cross + b2;
    let dy_du = cross;
    let dy_dv = radial + slope * dv * dv + 6.0 * p2 * dv + 2.0 * p1 * du;
    // By the ideal point (u, v): the identity is added.
    let a = [[1.0 + dx_du, dx_dv], [dy_du, 1.0 + dy_dv]];
    let fz = f * inverse_depth;
    let row = |i: usize| [a[i][0] * fz, a[i][1] * fz, -(a[i][0] * tx + a[i][1] * ty) * fz];
    let r4 = r2 * r2;
    let r6 = r4 * r2;
    Some(Projection {
        point: [
            u + du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv,
            v + dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv,
        ],
        d_camera_point: [row(0), row(1)],
        d_interior: [
            [
                a[0][0] * tx + a[0][1] * ty,
                a[0][0],
                a[0][1],
                -dx_du,
                -dx_dv,
                du * r2,
                du * r4,
                du * r6,
                r2 + 2.0 * du * du,
                2.0 * du * dv,
                du,
                dv,
            ],
            [
                a[1][0] * tx + a[1][1] * ty,
                a[1][0],
                a[1][1],
                -dy_du,
                -dy_dv,
                dv * r2,
                dv * r4,
                dv * r6,
                2.0 * du * dv,
                r2 + 2.0 * dv * dv,
                0.0,
                0.0,
            ],
        ],
    })
}
