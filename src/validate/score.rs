//! How many digits of a result are correct, in units of the standard deviation: 6 digits are a millionth of what the
//! measurements tell.

use super::certificate::{Certificate, Certified, fingerprint};
use super::forward::ExtendedState;
use super::lineariser::Lineariser;
use super::normal::CertifyError;
use crate::adjust::Covariance;
use crate::camera::PARAMETERS;
use crate::math::{DoubleDouble, rotation};
use crate::problem::{Pose, Problem, State};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;
use std::collections::HashMap;

/// Digits that a result has at most: doubles have no more.
const MOST_DIGITS: f64 = 16.0;

/// What a result is worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// `-log10` of the larger of `deviation` and `distance`.
    pub digits: f64,
    /// Largest deviation of a certified value, in its sigma.
    pub deviation: f64,
    /// The value that it is of.
    pub worst: String,
    /// Root of what chi-square exceeds the certified one by, in extended precision. In a least-squares problem no
    /// unknown, and no linear function of them, is off by more than so many of its sigma: this is of all unknowns,
    /// certified one by one or not, and of no datum.
    pub distance: f64,
    /// Relative difference of the cost.
    pub cost: f64,
    /// Largest relative difference of a standard deviation; `None` where the result has none.
    pub sigma: Option<f64>,
}

/// Why a result cannot be scored.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScoreError {
    /// The certificate is of other measurements.
    #[error("problem `{problem}`: its measurements have the fingerprint {found}, the certificate is of {certified}")]
    OtherMeasurements {
        /// Name.
        problem: String,
        /// Of the problem at hand.
        found: String,
        /// Of the certificate.
        certified: String,
    },
    /// The result lacks something that is certified.
    #[error("the result has no {0}")]
    Missing(String),
    /// The result predicts no measurements.
    #[error(transparent)]
    State(#[from] CertifyError),
}

/// Scores a state of a problem.
///
/// # Errors
/// A certificate of other measurements; a state that cannot be predicted.
pub fn score(
    problem: &Problem,
    certificate: &Certificate,
    state: &State,
    covariance: Option<&Covariance>,
) -> Result<Score, ScoreError> {
    let found = fingerprint(problem);
    if found != certificate.fingerprint {
        let (problem, certified) = (certificate.problem.clone(), certificate.fingerprint.clone());
        return Err(ScoreError::OtherMeasurements { problem, found, certified });
    }
    let mut tally = Tally { deviation: 0.0, worst: String::new(), sigma: covariance.map(|_| 0.0) };
    tally.all(problem, certificate, state, covariance)?;
    let cost = Lineariser::new(problem)?.cost(&ExtendedState::from(state))?;
    let certified = DoubleDouble { hi: certificate.cost[0], lo: certificate.cost[1] };
    let excess = (cost - certified).hi;
    // A cost below the least one is rounding of the state, or another minimum: either is a distance.
    let distance = (2.0 * excess.abs()).sqrt();
    let off = tally.deviation.max(distance);
    let off = if off.is_nan() { f64::INFINITY } else { off };
    Ok(Score {
        digits: (-off.log10()).min(MOST_DIGITS),
        deviation: tally.deviation,
        worst: tally.worst,
        distance,
        cost: (excess / certified.hi.max(f64::MIN_POSITIVE)).abs(),
        sigma: tally.sigma,
    })
}

struct Tally {
    deviation: f64,
    worst: String,
    sigma: Option<f64>,
}

/// Positions by name.
fn places(names: &[String]) -> HashMap<&str, usize> {
    names.iter().enumerate().map(|(k, name)| (name.as_str(), k)).collect()
}

fn place(places: &HashMap<&str, usize>, what: &str, name: &str) -> Result<usize, ScoreError> {
    places.get(name).copied().ok_or_else(|| ScoreError::Missing(format!("{what} `{name}`")))
}

impl Tally {
    /// A value, what it should be, and its variance where the result has one.
    fn one(&mut self, name: &dyn Fn() -> String, value: f64, (certified, sigma): Certified, variance: Option<f64>) {
        // A held value has no sigma; that it stays is the datum's business, or the cost's.
        if sigma == 0.0 {
            return;
        }
        let deviation = ((value - certified) / sigma).abs();
        if deviation > self.deviation || deviation.is_nan() {
            (self.deviation, self.worst) = (if deviation.is_nan() { f64::INFINITY } else { deviation }, name());
        }
        if let (Some(largest), Some(variance)) = (&mut self.sigma, variance) {
            let difference = (variance.sqrt() / sigma - 1.0).abs();
            *largest = if difference.is_nan() { f64::INFINITY } else { largest.max(difference) };
        }
    }

    fn all(
        &mut self,
        problem: &Problem,
        certificate: &Certificate,
        state: &State,
        covariance: Option<&Covariance>,
    ) -> Result<(), ScoreError> {
        let layout = problem.layout();
        let shared = |unknown: usize| {
            let covariance = covariance?;
            let k = covariance.shared_unknowns.iter().position(|shared| *shared == unknown)?;
            Some(covariance.shared[(k, k)])
        };
        let cameras = places(&problem.camera_names);
        for (name, values) in &certificate.cameras {
            let c = place(&cameras, "camera", name)?;
            for (k, certified) in values.iter().enumerate() {
                // A tied centre is the principal point, and has no variance of its own.
                let variance = shared(layout.camera(c, k));
                self.one(&|| format!("{name}.{}", PARAMETERS[k]), state.interiors[c][k], *certified, variance);
            }
        }
        for (t, (name, value, sigma)) in certificate.effects.iter().enumerate() {
            let variance = covariance.and_then(|covariance| covariance.theta_variances.get(t).copied());
            self.one(&|| name.clone(), state.theta[t], (*value, *sigma), variance);
        }
        let images = places(&problem.image_names);
        for (name, q, centre, sigma) in &certificate.poses {
            let i = place(&images, "image", name)?;
            let Pose { rotation: found, centre: found_centre } = &state.poses[i];
            let certain = UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]));
            let turn = rotation::log((found * certain.inverse()).to_rotation_matrix().matrix());
            let shift = found_centre - Vector3::from(*centre);
            for k in 0..6 {
                let value = if k < 3 { turn[k] } else { shift[k - 3] };
                let variance = covariance.and_then(|all| all.poses.get(i)).map(|block| block[(k, k)]);
                let part = ["w1", "w2", "w3", "cx", "cy", "cz"][k];
                self.one(&|| format!("{name}.{part}"), value, (0.0, sigma[k]), variance);
            }
        }
        let points = places(&problem.point_names);
        for (name, position, sigma) in &certificate.points {
            let j = place(&points, "point", name)?;
            for k in 0..3 {
                let variance = covariance.and_then(|all| all.points.get(j)).map(|block| block[(k, k)]);
                let value = state.points[j][k];
                self.one(&|| format!("{name}.{}", ["x", "y", "z"][k]), value, (position[k], sigma[k]), variance);
            }
        }
        Ok(())
    }
}
