//! Certificates: the solution of a problem, its precision and its cost, found by refinement in extended precision with
//! the forward model of [`super::forward`]. Neither solver has a part in it but to say where to begin.

use super::forward::ExtendedState;
use super::lineariser::{Curvature, Lineariser};
use super::normal::{CertifyError, Normal};
use super::rank;
use crate::camera::PARAMETER_COUNT;
use crate::problem::{Problem, State};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Version of the files.
const FORMAT: u32 = 1;
/// Refinement ends with a step of so many sigma (all unknowns together). An extended number has 32 digits.
const LAST_STEP_SIGMA: f64 = 1e-18;
/// What a certificate asks at least: twelve digits of sigma are far beyond what is judged by it.
const ENOUGH_SIGMA: f64 = 1e-13;
/// Steps at most. Without the second derivatives of the model each leaves a share that grows with the residuals.
const MOST_STEPS: usize = 100;
/// Poses, and points, whose values a certificate holds at most: evenly spread. The cost is of all.
const MOST_HELD: usize = 24;
/// The same of problems with more images than this.
const FEW_HELD: usize = 8;
const MANY_IMAGES: usize = 500;

/// A value and its standard deviation for unit weight (zero where it is held).
pub type Certified = (f64, f64);

/// Name of an image, quaternion, projection centre (m), standard deviations of rotation (rad) and centre (m).
pub type CertifiedPose = (String, [f64; 4], [f64; 3], [f64; 6]);

/// What is certain of a problem. Numbers are correct to the last digit or two; standard deviations are for unit weight,
/// in the problem's own datum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Version.
    pub format: u32,
    /// Name of the problem.
    pub problem: String,
    /// Fingerprint of the measurements that it is of.
    pub fingerprint: String,
    /// Images, points, residuals, free unknowns.
    pub sizes: [usize; 4],
    /// The last step of the refinement, sigma of all unknowns together; what the solution lacks is less. Zero of what
    /// has no solution.
    pub last_step_sigma: f64,
    /// `sum rho / 2` as the sum of two doubles. Zero of what has no solution.
    pub cost: [f64; 2],
    /// Number of directions that the measurements do not determine, as the rank of the normal equations in extended
    /// precision tells.
    pub null_dimension: usize,
    /// Parameters among which these lie: without them, the rank is full.
    pub null_space: Vec<String>,
    /// Twelve numbers of each camera.
    pub cameras: Vec<(String, Vec<Certified>)>,
    /// Effect parameters.
    pub effects: Vec<(String, f64, f64)>,
    /// Covariance of the free camera and effect parameters (names, lower triangle by rows); of random parameters per
    /// image none.
    pub covariance: (Vec<String>, Vec<Vec<f64>>),
    /// Image, rotation (w, x, y, z), centre (m), standard deviations of turn (rad) and centre (m).
    pub poses: Vec<CertifiedPose>,
    /// Point, position, standard deviations, m.
    pub points: Vec<(String, [f64; 3], [f64; 3])>,
}

/// Shared parameters whose covariance is certified at most.
const MOST_SHARED: usize = 40;

/// Refines a state in extended precision; gives the size of the last step, sigma of all unknowns together.
///
/// # Errors
/// A state that cannot be predicted, singular equations, no convergence.
pub fn refine(problem: &Problem, start: &State) -> Result<(ExtendedState, f64), CertifyError> {
    let lineariser = Lineariser::new(problem)?;
    let name = |unknown: usize| problem.unknown_name(unknown);
    let mut state = ExtendedState::from(start);
    let mut last = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let normal = lineariser.linearise(&state, Curvature::Newton)?;
        // Where outliers bend the other way, the weights alone have a factor; they converge more slowly.
        let (normal, step) = match normal.factor(&name).map(|factor| factor.solve(&normal.descent)) {
            Ok(step) => (normal, step),
            Err(_) => {
                let normal = lineariser.linearise(&state, Curvature::Weights)?;
                let step = normal.factor(&name)?.solve(&normal.descent);
                (normal, step)
            }
        };
        let gain: f64 = step.iter().zip(&normal.descent).map(|(x, g)| (*x * *g).hi).sum();
        let sigma = gain.abs().sqrt();
        lineariser.step(&mut state, &step);
        if sigma <= LAST_STEP_SIGMA || (sigma >= last && sigma <= ENOUGH_SIGMA) {
            return Ok((state, sigma));
        }
        last = sigma;
    }
    if last <= ENOUGH_SIGMA {
        Ok((state, last))
    } else {
        Err(CertifyError::NotConverged { steps: MOST_STEPS, sigma: last })
    }
}

/// Certifies the solution near `start`.
///
/// # Errors
/// As [`refine`].
pub fn certify(name: &str, problem: &Problem, start: &State) -> Result<Certificate, CertifyError> {
    let (state, last_step_sigma) = refine(problem, start)?;
    let lineariser = Lineariser::new(problem)?;
    let normal = lineariser.linearise(&state, Curvature::Weights)?;
    let layout = problem.layout();
    let most = if layout.images > MANY_IMAGES { FEW_HELD } else { MOST_HELD };
    let (images, points) = (spread(layout.images, most), spread(layout.points, most));
    let mut wanted: Vec<usize> = (0..layout.pose(0, 0)).collect();
    wanted.extend(images.iter().flat_map(|i| (0..6).map(|k| layout.pose(*i, k))));
    wanted.extend(points.iter().flat_map(|j| (0..3).map(|k| layout.point(*j, k))));
    let column = |unknown: usize| normal.unknowns.binary_search(&unknown).ok();
    let factor = normal.factor(&|unknown| problem.unknown_name(unknown))?;
    let deviations: Vec<(usize, f64)> = wanted
        .into_par_iter()
        .map(|unknown| (unknown, column(unknown).map_or(0.0, |column| factor.sigma(column))))
        .collect();
    let sigma = |unknown: usize| {
        deviations.binary_search_by_key(&unknown, |(unknown, _)| *unknown).map_or(f64::NAN, |k| deviations[k].1)
    };
    let shared: Vec<usize> = shared_unknowns(problem).into_iter().filter(|u| column(*u).is_some()).collect();
    let rows: Vec<Vec<f64>> = shared
        .par_iter()
        .enumerate()
        .map(|(i, unknown)| {
            let solved = factor.column(column(*unknown).unwrap_or(0));
            shared[..=i].iter().map(|other| solved[column(*other).unwrap_or(0)].hi).collect()
        })
        .collect();
    let cameras = (0..layout.cameras).map(|c| {
        let value = |k: usize| (state.interiors[c][k].hi, sigma(layout.camera(c, k)));
        let mut values: Vec<Certified> = (0..PARAMETER_COUNT).map(value).collect();
        if problem.tie_dc_to_pp {
            (values[3], values[4]) = (values[1], values[2]);
        }
        (problem.camera_names[c].clone(), values)
    });
    let effects = problem.theta.iter().enumerate();
    let effects = effects.map(|(t, entry)| (entry.name.clone(), state.theta[t].hi, sigma(layout.theta(t))));
    let poses = images.iter().map(|i| {
        let rotation = Matrix3::from_fn(|r, c| state.rotations[*i][r][c].hi);
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let deviations = std::array::from_fn(|k| sigma(layout.pose(*i, k)));
        (problem.image_names[*i].clone(), [q.w, q.i, q.j, q.k], state.centres[*i].map(|c| c.hi), deviations)
    });
    let points = points.iter().map(|j| {
        let deviations = std::array::from_fn(|k| sigma(layout.point(*j, k)));
        (problem.point_names[*j].clone(), state.points[*j].map(|c| c.hi), deviations)
    });
    Ok(Certificate {
        last_step_sigma,
        cost: [normal.cost.hi, normal.cost.lo],
        cameras: cameras.collect(),
        effects: effects.collect(),
        covariance: (shared.iter().map(|unknown| problem.unknown_name(*unknown)).collect(), rows),
        poses: poses.collect(),
        points: points.collect(),
        ..Certificate::empty(name, problem, &normal)
    })
}

/// Certifies the null space of a problem that has no solution: its dimension, and that it lies among the parameters
/// named.
///
/// # Errors
/// Start values that cannot be predicted; too many unknowns; a null space that lies elsewhere, in the message.
pub fn certify_null_space(name: &str, problem: &Problem, among: &[String]) -> Result<Certificate, CertifyError> {
    let lineariser = Lineariser::new(problem)?;
    let normal = lineariser.linearise(&ExtendedState::from(&problem.start), Curvature::Weights)?;
    let null_dimension = rank::defect(&normal, &|_| true)?;
    let is_named = |unknown: usize| among.contains(&problem.unknown_name(unknown));
    let without = rank::defect(&normal, &|unknown| !is_named(unknown))?;
    if without > 0 {
        let text = format!("{without} directions that none of {} takes part in", among.join(", "));
        return Err(CertifyError::Singular(text));
    }
    Ok(Certificate { null_dimension, null_space: among.to_vec(), ..Certificate::empty(name, problem, &normal) })
}

impl Certificate {
    fn empty(name: &str, problem: &Problem, normal: &Normal) -> Self {
        let layout = problem.layout();
        Self {
            format: FORMAT,
            problem: name.into(),
            fingerprint: fingerprint(problem),
            sizes: [layout.images, layout.points, problem.residual_count(), normal.unknowns.len()],
            last_step_sigma: 0.0,
            cost: [0.0; 2],
            null_dimension: 0,
            null_space: Vec::new(),
            cameras: Vec::new(),
            effects: Vec::new(),
            covariance: Default::default(),
            poses: Vec::new(),
            points: Vec::new(),
        }
    }

    /// As a file: a line per camera, parameter, pose and point.
    ///
    /// # Errors
    /// None but those of a serialiser.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        let whole = serde_json::to_string(self)?;
        // Every row of a table and every key of the top begins a line.
        let mut text = String::with_capacity(whole.len());
        let (mut depth, mut quoted) = (0, false);
        for character in whole.chars() {
            quoted ^= character == '"';
            match character {
                '[' | '{' if !quoted => {
                    if depth == 2 && character == '[' && text.ends_with('[') {
                        text.push('\n');
                    }
                    depth += 1;
                    text.push(character);
                }
                ']' | '}' if !quoted => {
                    depth -= 1;
                    text.push(character);
                }
                ',' if !quoted && depth == 1 => text.push_str(",\n"),
                ',' if !quoted && depth == 2 && text.ends_with(']') => text.push_str(",\n"),
                _ => text.push(character),
            }
        }
        text.push('\n');
        Ok(text)
    }
}

/// Free camera and effect parameters whose covariance is certified.
fn shared_unknowns(problem: &Problem) -> Vec<usize> {
    let layout = problem.layout();
    let (free, random) = (problem.free(), |t: usize| problem.theta[t].prior_sigma.is_some());
    let cameras = (0..layout.theta(0)).filter(|unknown| free[*unknown]);
    let theta = (0..layout.theta).filter(|t| free[layout.theta(*t)] && !random(*t)).map(|t| layout.theta(t));
    cameras.chain(theta).take(MOST_SHARED).collect()
}

/// So many of `count`, evenly spread, first and last among them.
pub fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|k| k * (count - 1) / (most - 1)).collect()
}

/// FNV-1a of the measurements: two machines that make the same block have the same.
pub fn fingerprint(problem: &Problem) -> String {
    let images = problem.observations.iter().flat_map(|o| [o.x, o.y, f64::from(o.image)]);
    let positions = problem.control.iter().chain(&problem.gnss).flat_map(|seen| <[f64; 3]>::from(seen.position));
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for value in images.chain(positions) {
        for byte in value.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_and_the_last_are_among_what_is_held() {
        assert_eq!(spread(3, 5), [0, 1, 2]);
        let of_many = spread(1000, 4);
        assert_eq!((of_many[0], of_many[3], of_many.len()), (0, 999, 4));
    }
}
