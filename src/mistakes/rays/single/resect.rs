//! One image alone: its pose from points that other images know, with a loss that wrong measurements cannot bend
//! (Gauss-Newton, damped, Cauchy's loss).

use crate::block::Pose;
use crate::camera::fraser::project_with_derivatives;
use crate::camera::{Camera, fraser};
use crate::math::rotation::skew;
use crate::math::statistics::median;
use nalgebra::{Matrix2, Matrix2x3, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

/// Rotation, centre, and shift of the image.
const UNKNOWNS: usize = 8;
/// Iterations: the loss narrows with the residuals; from ten degrees away twenty are needed.
const ITERATIONS: usize = 40;
/// Trials with ten times the damping each.
const TRIALS: usize = 6;
/// Damping of the first trial, as a share of the diagonal: none to speak of.
const DAMPING: f64 = 1e-7;
/// A step that lowers the cost by less than this share ends the search.
const LEAST_GAIN: f64 = 1e-6;

/// A point that other images know, and where the image shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// In the network.
    pub place: Vector3<f64>,
    /// Measured, px.
    pub xy: [f64; 2],
}

/// An image in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resected {
    /// Its pose.
    pub pose: Pose,
    /// Shift that is added to measurements, px.
    pub offset: [f64; 2],
}

impl Resected {
    /// Distance between a measurement and its point, px; infinite behind the camera.
    pub fn error(&self, camera: &Camera, row: &Row) -> f64 {
        let projected = fraser::project(&camera.interior, self.pose.cam_from_world(&row.place).into());
        let [dx, dy] = self.offset;
        projected.map_or(f64::INFINITY, |[x, y]| (row.xy[0] + dx - x).hypot(row.xy[1] + dy - y))
    }

    /// Covariance of the offset, px^2, from the rows that fit to within `limit`: their own residuals and redundancy, as
    /// the loss weights them (Huber 1981, sec. 7.6); `None` where they do not determine it.
    pub fn offset_covariance(&self, camera: &Camera, rows: &[Row], usual: f64, limit: f64) -> Option<Matrix2<f64>> {
        let width = self.width(camera, rows, usual)?;
        let fitting: Vec<Row> = rows.iter().filter(|row| self.error(camera, row) < limit).copied().collect();
        let redundancy = (2 * fitting.len()).checked_sub(UNKNOWNS).filter(|own| *own > 0)? as f64;
        // Squares of the influence of each row, and its slope, the mean along and across the residual.
        let (mut squares, mut slope) = (0.0, 0.0);
        for row in &fitting {
            let error = self.error(camera, row);
            let ratio = (error / width).powi(2);
            let weight = 1.0 / (1.0 + ratio);
            squares += (error * weight).powi(2);
            slope += weight - ratio * weight * weight;
        }
        let variance = squares / redundancy / (slope / fitting.len() as f64).powi(2);
        // Beside an infinite width all weights are one.
        let (matrix, _) = self.normal(camera, &fitting, f64::INFINITY, true);
        let covariance = matrix.cholesky()?.inverse().fixed_view::<2, 2>(6, 6) * variance;
        covariance.iter().all(|own| own.is_finite()).then_some(covariance)
    }

    /// Width of the loss; `None` where most points lie behind the camera.
    fn width(&self, camera: &Camera, rows: &[Row], usual: f64) -> Option<f64> {
        let middle = median(&rows.iter().map(|row| self.error(camera, row)).collect::<Vec<_>>());
        middle.is_finite().then_some(middle.max(usual))
    }

    fn moved(&self, step: &SVector<f64, UNKNOWNS>) -> Self {
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        let centre = self.pose.centre + step.fixed_rows::<3>(3);
        let offset = [self.offset[0] + step[6], self.offset[1] + step[7]];
        Self { pose: Pose { rotation: turn * self.pose.rotation, centre }, offset }
    }

    /// Cauchy's loss at a width, px^2; a point that is not seen costs as one that is off by the whole sensor.
    fn cost(&self, camera: &Camera, rows: &[Row], width: f64) -> f64 {
        let lost = 2.0 * camera.half_diagonal_px();
        rows.iter().map(|row| (self.error(camera, row).min(lost) / width).powi(2).ln_1p()).sum()
    }

    /// Normal equations at a width.
    fn normal(&self, camera: &Camera, rows: &[Row], width: f64, shifts: bool) -> Normal {
        let mut normal = (SMatrix::zeros(), SVector::zeros());
        for row in rows {
            let point = self.pose.cam_from_world(&row.place);
            let Some(projection) = project_with_derivatives(&camera.interior, point.into()) else { continue };
            let [dx, dy] = projection.d_camera_point;
            let by_point = Matrix2x3::new(dx[0], dx[1], dx[2], dy[0], dy[1], dy[2]);
            let mut jacobian = SMatrix::<f64, 2, UNKNOWNS>::zeros();
            jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&(-by_point * skew(&point)));
            let by_centre = -by_point * self.pose.rotation.to_rotation_matrix().matrix();
            jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(&by_centre);
            if shifts {
                (jacobian[(0, 6)], jacobian[(1, 7)]) = (-1.0, -1.0);
            }
            let residual = Vector2::from(row.xy) + Vector2::from(self.offset) - Vector2::from(projection.point);
            let weight = 1.0 / (1.0 + residual.norm_squared() / (width * width));
            normal.0 += jacobian.transpose() * jacobian * weight;
            normal.1 += jacobian.transpose() * residual * weight;
        }
        normal
    }
}

type Normal = (SMatrix<f64, UNKNOWNS, UNKNOWNS>, SVector<f64, UNKNOWNS>);

/// The pose that most rows agree with, near a start; with `shifts` also a shift of the image. `usual`: what
/// measurements are off by, px.
pub fn resect(camera: &Camera, rows: &[Row], start: &Pose, shifts: bool, usual: f64) -> Option<Resected> {
    let mut current = Resected { pose: *start, offset: [0.0; 2] };
    for _ in 0..ITERATIONS {
        let width = current.width(camera, rows, usual)?;
        let cost = current.cost(camera, rows, width);
        let next = better(
            &current,
            cost,
            |current| current.normal(camera, rows, width, shifts),
            |trial| trial.cost(camera, rows, width),
        );
        let Some((next, gained)) = next else { break };
        current = next;
        if gained < LEAST_GAIN * cost && width <= usual {
            break;
        }
    }
    Some(current)
}

/// The next step that lowers the cost, and by how much.
fn better(
    current: &Resected,
    cost: f64,
    normal: impl Fn(&Resected) -> Normal,
    cost_of: impl Fn(&Resected) -> f64,
) -> Option<(Resected, f64)> {
    let (matrix, right) = normal(current);
    let mut damping = DAMPING;
    for _ in 0..TRIALS {
        let mut damped = matrix;
        for k in 0..UNKNOWNS {
            // An unknown that takes no part stays where it is.
            damped[(k, k)] = if matrix[(k, k)] > 0.0 { matrix[(k, k)] * (1.0 + damping) } else { 1.0 };
        }
        if let Some(factor) = damped.cholesky() {
            let trial = current.moved(&factor.solve(&right));
            let lowered = cost - cost_of(&trial);
            if lowered > 0.0 {
                return Some((trial, lowered));
            }
        }
        damping *= 100.0;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::super::made;
    use super::*;

    fn rows(view: usize) -> Vec<Row> {
        let (scene, ground) = (made::scene(), made::ground());
        let pose = scene.views[view].pose;
        let mut rows: Vec<Row> = ground
            .iter()
            .filter_map(|place| {
                let xy = fraser::project(&scene.cameras[0].interior, pose.cam_from_world(place).into())?;
                let seen = (0.0..4000.0).contains(&xy[0]) && (0.0..3000.0).contains(&xy[1]);
                seen.then_some(Row { place: *place, xy })
            })
            .collect();
        // Every fifth measurement is false.
        rows.iter_mut().step_by(5).for_each(|row| row.xy[0] += 300.0);
        rows
    }

    fn off(pose: &Pose) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.08, -0.05, 0.1));
        Pose { rotation: turn * pose.rotation, centre: pose.centre + Vector3::new(3.0, -4.0, 2.0) }
    }

    #[test]
    fn false_measurements_do_not_bend_a_pose() {
        let (camera, views) = (made::camera(), made::views());
        let rows = rows(8);
        let found = resect(&camera, &rows, &off(&views[8].pose), false, 0.5).expect("a pose");
        assert!((found.pose.centre - views[8].pose.centre).norm() < 1e-2, "{found:?}");
        let fits = rows.iter().filter(|row| found.error(&camera, row) < 1.0).count();
        assert_eq!(fits, rows.len() - rows.len().div_ceil(5));
    }

    #[test]
    fn a_shift_of_the_image_is_found() {
        let (camera, views) = (made::camera(), made::views());
        let mut rows = rows(8);
        rows.iter_mut().for_each(|row| row.xy = [row.xy[0] - 120.0, row.xy[1] + 40.0]);
        let found = resect(&camera, &rows, &off(&views[8].pose), true, 0.5).expect("a pose");
        let fits = rows.iter().filter(|row| found.error(&camera, row) < 1.0).count();
        assert_eq!(fits, rows.len() - rows.len().div_ceil(5), "{found:?}");
    }

    #[test]
    fn the_covariance_of_a_shift_is_that_of_repeated_measurements() {
        const REPEATED: usize = 60;
        let (camera, views) = (made::camera(), made::views());
        let right: Vec<Row> = rows(8).into_iter().enumerate().filter(|(k, _)| k % 5 != 0).map(|(_, row)| row).collect();
        let mut state = 1_u64;
        // Three uniform numbers together are nearly normal, here with a standard deviation of half a pixel.
        let mut noise = || {
            let mut uniform = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            };
            uniform() + uniform() + uniform()
        };
        let (mut squares, mut stated) = (0.0, 0.0);
        for _ in 0..REPEATED {
            let noisy = |row: &Row| Row { xy: [row.xy[0] + noise(), row.xy[1] + noise()], ..*row };
            let rows: Vec<Row> = right.iter().map(noisy).collect();
            let found = resect(&camera, &rows, &views[8].pose, true, 0.6).expect("a pose");
            squares += found.offset.iter().map(|own| own * own).sum::<f64>();
            stated += found.offset_covariance(&camera, &rows, 0.6, 3.0).expect("a covariance").trace();
        }
        let ratio = (squares / stated).sqrt();
        assert!((0.75..1.35).contains(&ratio), "{ratio}");
    }

    #[test]
    fn nothing_to_resect_from_is_no_panic() {
        let (camera, views) = (made::camera(), made::views());
        assert!(resect(&camera, &[], &views[0].pose, true, 0.5).is_none());
        let row = Row { place: views[0].pose.centre, xy: [f64::NAN; 2] };
        assert!(resect(&camera, &[row; 3], &views[0].pose, false, 0.5).is_none());
    }
}
