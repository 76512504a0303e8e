//! Start values, judged before an adjustment: a camera or a block that begins in another basin ends in a minimum of its
//! own, and nothing in the residuals of that minimum says so.

use crate::block::{Block, ImageId, Measurement};
use crate::camera::{
    Camera, DCX, DCY, Interior, K1, K3, PPX, PPY, undistort::monotonic_radius, undistort::viewing_ray,
};
use crate::math::intersect::intersect_rays;
use nalgebra::Vector3;

/// Tie points judged at most, spread over the block: a share is known to a hundredth from as many.
const MOST_POINTS: usize = 2000;
/// Share of the points behind a camera from which the orientation is in doubt. Blunders and rays that are nearly
/// parallel put single points there: in a block that can be adjusted they are a few in a hundred.
const DOUBTFUL_SHARE: f64 = 0.1;
/// Share from which it is the rule, and the orientation of the block as a whole is another.
const MOST_SHARE: f64 = 0.5;
/// Distance from the centre of distortion, in distances of the farthest corner, beyond which no lens images that
/// corner.
const FARTHEST: f64 = 4.0;

/// What is doubtful.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// A principal point that the sensor does not have.
    #[error(
        "the principal point of camera {camera} lies outside of its sensor: ({x:.0}, {y:.0}) px of {width} x {height}"
    )]
    PrincipalPoint {
        /// Its id.
        camera: String,
        /// px.
        x: f64,
        /// px.
        y: f64,
        /// px.
        width: u32,
        /// px.
        height: u32,
    },
    /// A distortion by which two rays have one image.
    #[error(
        "the radial distortion of camera {camera} is not monotonic over its sensor: it turns back {at:.0} px from its \
         centre. The farthest corner lies at {corner:.0} px"
    )]
    Distortion {
        /// Its id.
        camera: String,
        /// Largest distance (px, in the image) up to which it grows.
        at: f64,
        /// px.
        corner: f64,
    },
    /// A focal length at which rays do not meet.
    #[error(
        "camera {camera} starts with a focal length of {f:.0} px, and its rays meet {times:.1} times better at \
         {better:.0} px"
    )]
    FocalLength {
        /// Its id.
        camera: String,
        /// px.
        f: f64,
        /// px.
        better: f64,
        /// Misfit at `f` by that at `better`, both at the start.
        times: f64,
    },
    /// Tie points that cameras cannot have seen.
    #[error("{:.0} % of the tie points lie behind an image that sees them: orientation or order of the \
             images", 100.0 * share)]
    Behind {
        /// Of the tie points that have coordinates or whose rays meet.
        share: f64,
    },
}

impl Doubt {
    /// Is the orientation of the block as a whole in doubt?
    pub fn turns_block(&self) -> bool {
        matches!(self, Doubt::Behind { share } if *share > MOST_SHARE)
    }
}

/// What is doubtful of a block's start values, its cameras starting at `interiors`. Nothing of a block that is good.
pub fn doubts(block: &Block, interiors: &[Interior]) -> Vec<Doubt> {
    let cameras = || block.cameras.iter().zip(interiors);
    let mut doubts: Vec<Doubt> = cameras().filter_map(|(camera, interior)| principal_point(camera, interior)).collect();
    doubts.extend(cameras().filter_map(|(camera, interior)| distortion(camera, interior)));
    doubts.extend(doubtful_share_behind(block, interiors).map(|share| Doubt::Behind { share }));
    doubts
}

/// Share of the tie points behind images, where it is doubtful.
pub(super) fn doubtful_share_behind(block: &Block, interiors: &[Interior]) -> Option<f64> {
    share_behind(block, interiors).filter(|share| *share > DOUBTFUL_SHARE)
}

fn principal_point(camera: &Camera, interior: &Interior) -> Option<Doubt> {
    let (x, y, width, height) = (interior[PPX], interior[PPY], camera.width_px, camera.height_px);
    let inside = (0.0..=f64::from(width)).contains(&x) && (0.0..=f64::from(height)).contains(&y);
    (!inside).then(|| Doubt::PrincipalPoint { camera: camera.id.clone(), x, y, width, height })
}

/// `r (1 + k1 r^2 + k2 r^4 + k3 r^6)` grows until it reaches the farthest corner.
fn distortion(camera: &Camera, interior: &Interior) -> Option<Doubt> {
    let farther = |centre: f64, size: u32| centre.abs().max((f64::from(size) - centre).abs());
    let corner = farther(interior[DCX], camera.width_px).hypot(farther(interior[DCY], camera.height_px));
    let mut radial: Interior = [0.0; 12];
    radial[K1..=K3].copy_from_slice(&interior[K1..=K3]);
    let r = monotonic_radius(&radial, FARTHEST * corner);
    let r2 = r * r;
    let at = r * (1.0 + r2 * (radial[K1] + r2 * (radial[K1 + 1] + r2 * radial[K3])));
    // Not the other way round: a coefficient that is no number is doubtful.
    let reaches = at >= corner;
    (!reaches).then(|| Doubt::Distortion { camera: camera.id.clone(), at, corner })
}

/// Share of the tie points that lie behind an image that sees them, where they are given or their rays meet; `None`
/// where none is either.
fn share_behind(block: &Block, interiors: &[Interior]) -> Option<f64> {
    let step = block.tie_points.len().div_ceil(MOST_POINTS).max(1);
    let mut rays: Vec<Vec<&Measurement>> = vec![Vec::new(); block.tie_points.len().div_ceil(step)];
    for row in block.ties.iter().filter(|row| row.point.index() % step == 0) {
        rays[row.point.index() / step].push(row);
    }
    let (mut judged, mut behind) = (0, 0);
    for (k, rows) in rays.iter().enumerate().filter(|(_, rows)| rows.len() > 1) {
        let Some(point) = block.tie_points[k * step].position.or_else(|| meeting(block, interiors, rows)) else {
            continue;
        };
        judged += 1;
        let depth = |image: ImageId| block.images[image.index()].pose.cam_from_world(&point).z;
        behind += usize::from(rows.iter().any(|row| depth(row.image) <= 0.0));
    }
    (judged > 0).then(|| behind as f64 / judged as f64)
}

/// Where the rays meet, in front or behind.
fn meeting(block: &Block, interiors: &[Interior], rows: &[&Measurement]) -> Option<Vector3<f64>> {
    let (mut origins, mut directions) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
    for row in rows {
        let image = &block.images[row.image.index()];
        origins.push(image.pose.centre);
        directions.push(image.pose.rotation.inverse() * viewing_ray(&interiors[image.camera.index()], [row.x, row.y])?);
    }
    intersect_rays(&origins, &directions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{K2, PARAMETERS};

    const BARREL: f64 = -1e-9;

    fn camera(changes: &[(usize, f64)]) -> Camera {
        let mut interior = [0.0; 12];
        interior[..5].copy_from_slice(&[5500.0, 2560.0, 1920.0, 2560.0, 1920.0]);
        for (k, value) in changes {
            interior[*k] = *value;
        }
        Camera { id: "cam".into(), width_px: 5120, height_px: 3840, pixel_um: None, interior }
    }

    fn is_doubtful(changes: &[(usize, f64)]) -> bool {
        let camera = camera(changes);
        principal_point(&camera, &camera.interior).or(distortion(&camera, &camera.interior)).is_some()
    }

    #[test]
    fn a_principal_point_belongs_to_the_sensor() {
        assert!(!is_doubtful(&[(PPX, 0.0), (PPY, 3840.0)]));
        for (k, value) in [(PPX, -1.0), (PPX, 5121.0), (PPY, -0.1), (PPY, 3840.1), (PPY, f64::NAN)] {
            assert!(is_doubtful(&[(k, value)]), "{} {value}", PARAMETERS[k]);
        }
    }

    /// The corner lies at 3200 px. With `k1 < 0` alone the radius grows up to `r = (-3 k1)^(-1/2)`, and is two thirds
    /// of that there.
    #[test]
    fn a_distortion_grows_up_to_the_corner() {
        let limit = -1.0 / (3.0 * (1.5 * 3200.0_f64).powi(2));
        assert!(!is_doubtful(&[(K1, 0.99 * limit)]));
        assert!(is_doubtful(&[(K1, 1.01 * limit)]));
        assert!(!is_doubtful(&[(K1, 1e-8)]), "a pincushion grows");
        assert!(is_doubtful(&[(K1, BARREL), (K2, -1e-14)]) && is_doubtful(&[(K1, f64::NAN)]));
    }
}
