//! How well rays meet: each point is intersected linearly, takes one Gauss-Newton step, and is projected back.

use super::scene::{Scene, Sight};
use crate::camera::undistort::viewing_ray;
use crate::camera::{F, fraser};
use crate::math::intersect::{PointSystem, intersect_rays};
use crate::math::statistics::median;
use nalgebra::{Matrix2x3, Vector2, Vector3};

/// Points below which a median says nothing.
pub const FEWEST_POINTS: usize = 10;

/// Medians over points of the median over their rays: single false matches do not move them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Distance between measured and projected, px.
    pub px: f64,
    /// The same as an angle, rad.
    pub angle: f64,
    /// The same as a share of how far the measurements spread over the image.
    pub share: f64,
}

impl Misfit {
    /// By how many times `other` is smaller, in each of the three measures: a short focal length makes pixels small, a
    /// long one angles, and measurements near one place make both small.
    pub fn times(&self, other: &Self) -> f64 {
        let [px, angle, share] =
            [(self.px, other.px), (self.angle, other.angle), (self.share, other.share)].map(|(a, b)| quotient(a, b));
        px.min(angle).min(share)
    }

    /// The same by the share alone: of coordinates in another unit pixels and angles say nothing.
    pub fn times_by_share(&self, other: &Self) -> f64 {
        quotient(self.share, other.share)
    }
}

/// Misfits below this are exact, px or share: simulated blocks without noise.
const EXACT: f64 = 1e-9;

fn quotient(own: f64, other: f64) -> f64 {
    let times = own / other.max(EXACT);
    if times.is_finite() { times } else { 0.0 }
}

/// How well the rays of a scene meet; `None` where there are too few points.
pub fn misfit(scene: &Scene) -> Option<Misfit> {
    let points: Vec<(f64, f64)> = scene.points.iter().filter_map(|sights| of_point(scene, sights)).collect();
    if points.len() < FEWEST_POINTS {
        return None;
    }
    let (pixels, angles): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    let px = median(&pixels);
    Some(Misfit { px, angle: median(&angles), share: px / spread(scene).max(f64::MIN_POSITIVE) })
}

/// How far measurements lie from their middle: the median of the larger coordinate, px.
fn spread(scene: &Scene) -> f64 {
    let axis = |axis: usize| -> Vec<f64> { scene.sights().map(|sight| sight.xy[axis]).collect() };
    let (xs, ys) = (axis(0), axis(1));
    let middle = [median(&xs), median(&ys)];
    let away: Vec<f64> = xs.iter().zip(&ys).map(|(x, y)| (x - middle[0]).abs().max((y - middle[1]).abs())).collect();
    median(&away)
}

/// Misfit of a point, px and rad; that of the whole sensor where its rays do not meet in front of the cameras.
fn of_point(scene: &Scene, sights: &[Sight]) -> Option<(f64, f64)> {
    let first = sights.first()?;
    let lost = scene.diagonal(first);
    let px = intersect(scene, sights).map_or(lost, |place| {
        let of =
            |place: &Vector3<f64>| median(&sights.iter().map(|sight| error(scene, sight, place)).collect::<Vec<_>>());
        let linear = of(&place);
        step(scene, sights, &place).map_or(linear, |step| linear.min(of(&(place + step))))
    });
    let f = scene.camera_of(first).interior[F];
    Some((px, px / f.abs().max(f64::MIN_POSITIVE)))
}

/// Direction of a ray in the world; `None` where the distortion has no inverse.
pub fn direction(scene: &Scene, sight: &Sight) -> Option<Vector3<f64>> {
    let ray = viewing_ray(&scene.camera_of(sight).interior, sight.xy)?;
    let direction = scene.views[sight.view].pose.rotation.inverse() * ray;
    direction.iter().all(|value| value.is_finite()).then_some(direction)
}

/// The place with the least sum of squared distances to rays.
pub fn intersect(scene: &Scene, sights: &[Sight]) -> Option<Vector3<f64>> {
    let ray = |sight: &Sight| Some((scene.views[sight.view].pose.centre, direction(scene, sight)?));
    let (centres, directions): (Vec<_>, Vec<_>) = sights.iter().filter_map(ray).unzip();
    intersect_rays(&centres, &directions)
}

/// Distance between measured and projected, px; the whole sensor where a point lies behind the camera.
pub fn error(scene: &Scene, sight: &Sight, place: &Vector3<f64>) -> f64 {
    let lost = scene.diagonal(sight);
    let point = scene.views[sight.view].pose.cam_from_world(place);
    let projected = fraser::project(&scene.camera_of(sight).interior, point.into());
    // `min` takes the other value where one is not a number.
    projected.map_or(lost, |[x, y]| (x - sight.xy[0]).hypot(y - sight.xy[1]).min(lost))
}

/// One Gauss-Newton step of a place towards the least image residuals.
fn step(scene: &Scene, sights: &[Sight], place: &Vector3<f64>) -> Option<Vector3<f64>> {
    let mut system = PointSystem::default();
    for sight in sights {
        let pose = &scene.views[sight.view].pose;
        let interior = &scene.camera_of(sight).interior;
        let projection = fraser::project_with_derivatives(interior, pose.cam_from_world(place).into())?;
        let [dx, dy] = projection.d_camera_point;
        let by_point = Matrix2x3::new(dx[0], dx[1], dx[2], dy[0], dy[1], dy[2]);
        let jacobian = by_point * pose.rotation.to_rotation_matrix().matrix();
        system.add(Vector2::from(sight.xy) - Vector2::from(projection.point), jacobian, 1.0);
    }
    system.step()
}
