//! How large a single wrong measurement must be to show, and what it does to its point until then.
//!
//! Baarda (1968): of a measurement with standard deviation `sigma` the adjustment leaves the share `r` of an error in
//! its residual, the redundancy number. A test of that residual alone finds an error with the power of the plan from
//!
//! ```text
//! internal reliability:  delta sigma / sqrt(r),    P(chi'^2(1, delta^2) > chi^2(1, 1 - alpha)) = 0.8
//! external reliability:  what an error of this size does to the point that was measured
//! ```
//!
//! on; with `alpha = 0.001` `delta` is 4.13. Redundancy numbers of control points and GNSS positions come from the
//! covariance of the whole fit. Those of image measurements are the ones that the search for blunders uses: cameras
//! and poses are held, which the many other measurements determine.

use super::Spread;
use super::precision::Certainty;
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, Solver};
use crate::math::statistics::chi_square_quantile;
use crate::problem::{PositionObservation, Problem};
use crate::score::power::noncentrality;
use nalgebra::{Matrix2x3, Matrix3, Matrix3x2};
use serde::Serialize;
use std::ops::Range;

/// Image measurements that are evaluated; of more, every n-th point.
const MEASUREMENTS: usize = 200_000;
/// Below this redundancy a measurement is checked by nothing.
const UNCHECKED: f64 = 1e-6;

/// Reliability of a kind of measurement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reliability {
    /// `image x and y`, `control plan`, `control height`, `gnss plan`, `gnss height`.
    pub of: String,
    /// Number of measured coordinates; of many image measurements an even sample.
    pub count: usize,
    /// Coordinates that nothing checks: an error of any size stays in them.
    pub unchecked: usize,
    /// Mean redundancy number.
    pub redundancy: f64,
    /// Smallest error that is found, in `unit`.
    pub internal: Spread,
    /// Unit.
    pub unit: String,
    /// What it does to its point until then, m.
    pub external_m: Spread,
}

/// A coordinate: its redundancy number, the smallest error found and what that does to its point.
type Checked = (f64, f64, f64);

/// Reliability of each kind of measurement that a problem has.
pub(super) fn of(certainty: &Certainty, alpha: f64) -> Result<Vec<Reliability>, AdjustError> {
    let delta = noncentrality(chi_square_quantile(1.0 - alpha, 1.0), 1.0).sqrt();
    let Certainty { problem, covariance } = certainty;
    let mut all = vec![("image x and y", "px", of_images(problem, delta)?)];
    // Of large blocks there is no covariance of each point and pose.
    if let Some(covariance) = covariance.as_ref().filter(|own| !own.points.is_empty() && !own.poses.is_empty()) {
        let control = |index: usize| covariance.points[index];
        let gnss = |index: usize| covariance.poses[index].fixed_view::<3, 3>(3, 3).into_owned();
        all.extend([
            ("control plan", "m", of_positions(&problem.control, control, 0..2, delta)),
            ("control height", "m", of_positions(&problem.control, control, 2..3, delta)),
            ("gnss plan", "m", of_positions(&problem.gnss, gnss, 0..2, delta)),
            ("gnss height", "m", of_positions(&problem.gnss, gnss, 2..3, delta)),
        ]);
    }
    Ok(all.into_iter().filter_map(|(of, unit, checked)| summary(of, unit, checked)).collect())
}

/// Observed positions, by the covariance of what was observed: `r = 1 - C_kk / sigma_k^2`.
fn of_positions(
    observed: &[PositionObservation],
    covariance: impl Fn(usize) -> Matrix3<f64>,
    axes: Range<usize>,
    delta: f64,
) -> Vec<Checked> {
    let of_axis = |own: &PositionObservation, k: usize| {
        let (sigma, covariance) = (own.sigma[k], covariance(own.index as usize));
        let redundancy = 1.0 - covariance[(k, k)] / sigma.powi(2);
        let internal = delta * sigma / redundancy.max(UNCHECKED).sqrt();
        // The point moves by `C P` times the error.
        (redundancy, internal, covariance.column(k).norm() / sigma.powi(2) * internal)
    };
    let mut checked = Vec::with_capacity(axes.len() * observed.len());
    for own in observed {
        checked.extend(axes.clone().map(|k| of_axis(own, k)));
    }
    checked
}

/// Image measurements with cameras and poses held: `R = I - J H^-1 J'` of the whitened rows `J` of a point.
fn of_images(problem: &Problem, delta: f64) -> Result<Vec<Checked>, AdjustError> {
    let (part, state) = problem.thinned(&problem.start, MEASUREMENTS);
    let layout = part.layout();
    let at = Native.evaluate(&part, &state)?;
    let mut normal = vec![Matrix3::zeros(); layout.points];
    for control in &part.control {
        normal[control.index as usize] += Matrix3::from_diagonal(&control.sigma.map(|sigma| sigma.powi(-2)));
    }
    let mut checked = Vec::with_capacity(2 * part.observations.len());
    for (point, normal) in normal.iter_mut().enumerate() {
        let observations = part.point_start[point]..part.point_start[point + 1];
        let first = layout.point(point, 0);
        let by_point = |observation: usize| {
            Matrix2x3::from_fn(|i, k| {
                let mut entries = at.row_start[2 * observation + i]..at.row_start[2 * observation + i + 1];
                entries.find(|e| at.columns[*e] == first + k).map_or(0.0, |e| at.values[e])
            })
        };
        let rows: Vec<Matrix2x3<f64>> = observations.clone().map(by_point).collect();
        *normal += rows.iter().map(|row| row.transpose() * row).sum::<Matrix3<f64>>();
        let Some(inverse) = normal.try_inverse() else { continue };
        for (own, row) in part.observations[observations].iter().zip(&rows) {
            let gain: Matrix3x2<f64> = inverse * row.transpose();
            for i in 0..2 {
                let redundancy = 1.0 - (row.row(i) * gain.column(i))[(0, 0)];
                let whitened = delta / redundancy.max(UNCHECKED).sqrt();
                checked.push((redundancy, whitened / own.inverse_sigma, gain.column(i).norm() * whitened));
            }
        }
    }
    Ok(checked)
}

fn summary(of: &str, unit: &str, mut checked: Vec<Checked>) -> Option<Reliability> {
    let count = checked.len();
    let redundancy = checked.iter().map(|own| own.0).sum::<f64>() / count as f64;
    checked.retain(|own| own.0 > UNCHECKED);
    let internal = Spread::of(checked.iter().map(|own| own.1).collect())?;
    let external_m = Spread::of(checked.iter().map(|own| own.2).collect())?;
    let unchecked = count - checked.len();
    Some(Reliability { of: of.into(), count, unchecked, redundancy, internal, unit: unit.into(), external_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adjust::Covariance;
    use crate::model::Model;
    use crate::scenario::{Scenario, simulate};
    use nalgebra::DMatrix;

    /// With cameras held, a point takes up three of its coordinates whatever its rays are.
    #[test]
    fn points_take_up_three_coordinates_each() {
        let few = [("points".to_string(), 40.0)].into();
        let mut block = simulate(&Scenario::preset("closerange", &few).unwrap(), 1).unwrap().block;
        block.marks.clear();
        block.surveyed.clear();
        let problem = Problem::new(&block, &Model::default()).unwrap();
        let checked = of_images(&problem, 4.13).unwrap();
        assert_eq!(checked.len(), 2 * problem.observations.len());
        let sum: f64 = checked.iter().map(|own| own.0).sum();
        assert!((sum - (checked.len() - 3 * problem.layout().points) as f64).abs() < 1e-6 * sum, "{sum}");
        let own = summary("image x and y", "px", checked).unwrap();
        assert!(own.unchecked == 0 && own.internal.typical > 4.13 * block.sigma.tie_px, "{own:?}");
    }

    #[test]
    fn without_the_covariance_of_each_point_image_measurements_are_judged_alone() {
        let few = [("points".to_string(), 400.0)].into();
        let block = simulate(&Scenario::preset("mapping", &few).unwrap(), 1).unwrap().block;
        let problem = Problem::new(&block, &Model::default()).unwrap();
        let covariance = Covariance {
            shared_unknowns: vec![],
            shared: DMatrix::zeros(0, 0),
            poses: vec![],
            points: vec![],
            theta_variances: vec![],
            point_parts: vec![],
        };
        for covariance in [None, Some(covariance)] {
            let all = of(&Certainty { problem: problem.clone(), covariance }, 1e-3).unwrap();
            assert_eq!(all.iter().map(|own| own.of.as_str()).collect::<Vec<_>>(), ["image x and y"]);
        }
    }

    #[test]
    fn what_nothing_checks_is_counted_and_has_no_size() {
        let own = summary("gnss plan", "m", vec![(0.5, 0.3, 0.1), (0.0, 1e9, 1e9)]).unwrap();
        assert_eq!((own.count, own.unchecked, own.internal.worst), (2, 1, 0.3));
        assert_eq!(summary("gnss plan", "m", vec![]), None);
    }
}
