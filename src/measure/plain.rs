//! The measurement that no effect touches: pose and Fraser camera, for one measurement or for several side by side.

use crate::camera::{PARAMETER_COUNT, fraser};
use crate::math::Number;

/// An image and a point in it, as the plain camera sees them.
#[derive(Debug, Clone, Copy)]
pub struct PlainView<T> {
    /// `R`, world to camera, by rows.
    pub rotation: [[T; 3]; 3],
    /// Projection centre, m.
    pub centre: [T; 3],
    /// Object point, m.
    pub object: [T; 3],
    /// Interior orientation.
    pub interior: [T; PARAMETER_COUNT],
}

/// Image point (px) and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct PlainPrediction<T> {
    /// Image point.
    pub point: [T; 2],
    /// By the interior orientation.
    pub d_camera: [[T; PARAMETER_COUNT]; 2],
    /// By the rotation `w`.
    pub d_rotation: [[T; 3]; 2],
    /// By the object point; by the projection centre it is the same with the other sign.
    pub d_point: [[T; 3]; 2],
}

impl<T: Number> PlainView<T> {
    /// The point in the camera frame, m. What lies behind the camera (third coordinate not positive) has no image.
    #[inline(always)]
    pub fn camera_point(&self) -> [T; 3] {
        let Self { rotation: r, centre: c, object: p, .. } = self;
        let d = [p[0] - c[0], p[1] - c[1], p[2] - c[2]];
        [dot(r[0], d), dot(r[1], d), dot(r[2], d)]
    }

    /// Predicts a point in front of the camera.
    #[inline(always)]
    pub fn predict(&self, camera_point: [T; 3]) -> PlainPrediction<T> {
        let projection = fraser::linearise_in_front(&self.interior, camera_point);
        let [of_x, of_y] = projection.d_camera_point;
        PlainPrediction {
            point: projection.point,
            d_camera: projection.d_interior,
            // d(camera point)/dw = -[p]x: the row a' (-[p]x) = (p x a)'.
            d_rotation: [cross(camera_point, of_x), cross(camera_point, of_y)],
            d_point: [self.turned(of_x), self.turned(of_y)],
        }
    }

    /// `a' R`.
    #[inline(always)]
    fn turned(&self, a: [T; 3]) -> [T; 3] {
        let r = &self.rotation;
        [dot(a, [r[0][0], r[1][0], r[2][0]]), dot(a, [r[0][1], r[1][1], r[2][1]]), dot(a, [r[0][2], r[1][2], r[2][2]])]
    }
}

#[inline(always)]
fn dot<T: Number>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<T: Number>(p: [T; 3], a: [T; 3]) -> [T; 3] {
    [p[1] * a[2] - p[2] * a[1], p[2] * a[0] - p[0] * a[2], p[0] * a[1] - p[1] * a[0]]
}
