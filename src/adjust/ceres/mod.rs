//! The Ceres solver: forward formula and automatic derivatives in C++ (`cpp/`), quaternions, SuiteSparse; here its Rust
//! face.
//!
//! Nothing of the derivation is shared with the native solver. Its covariance is computed from the Jacobian at the
//! solution (robust weights applied as Ceres applies them) by elimination of the points; there too the rank is checked
//! and null directions are named.

pub mod bridge;
mod view;

#[cfg(test)]
mod tests;

use super::*;
use crate::effects::{Context, Descriptor};
pub use bridge::ffi::watch_exceptions;
use bridge::{builtin_effects, ffi};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use view::Arrays;

/// Name in messages.
const NAME: &str = "ceres";

/// Covariance of poses and points needs the dense inverse of the reduced system: 0.3 GB and a minute at this many
/// unknowns.
pub const LARGEST_DENSE_INVERSE: usize = 6000;

/// The Ceres solver.
#[derive(Debug, Clone, Copy, Default)]
pub struct Ceres;

/// An exception of the C++ side.
fn bridge_error(exception: cxx::Exception) -> AdjustError {
    match exception.what() {
        "std::bad_alloc" => AdjustError::NoMemory { solver: NAME, what: "there is too little memory for this" },
        // Of std::thread.
        "Resource temporarily unavailable" => AdjustError::NoMemory {
            solver: NAME,
            what: "its threads cannot be started: there is too little memory for them",
        },
        what => AdjustError::Bridge(what.to_owned()),
    }
}

/// What the report of a call says that is not success.
fn failure(problem: &Problem, report: &ffi::Report, iterations: usize) -> Option<AdjustError> {
    // What an observation does not have (an antenna no point) comes as an index beyond all.
    let named = |names: &[String], index: u64| usize::try_from(index).ok().and_then(|index| names.get(index)).cloned();
    Some(match report.status {
        ffi::Status::Converged => return None,
        ffi::Status::Cancelled => AdjustError::Cancelled { solver: NAME },
        ffi::Status::NotConverged => {
            AdjustError::NotConverged { solver: NAME, iterations, reason: report.reason.clone() }
        }
        ffi::Status::CannotProject => AdjustError::BadStart {
            image: named(&problem.image_names, report.image),
            point: named(&problem.point_names, report.point),
            reason: report.reason.clone(),
        },
        ffi::Status::Singular => {
            let direction = |bounds: &[u64]| NullDirection {
                components: (bounds[0] as usize..bounds[1] as usize)
                    .map(|k| (problem.unknown_name(report.null_unknowns[k] as usize), report.null_components[k]))
                    .collect(),
            };
            AdjustError::Singular { solver: NAME, directions: report.null_start.windows(2).map(direction).collect() }
        }
        _ => AdjustError::Bridge("unknown status".into()),
    })
}

fn indices(from: &[u64]) -> Vec<usize> {
    from.iter().map(|index| *index as usize).collect()
}

fn vectors(values: &[f64]) -> Vec<Vector3<f64>> {
    values.chunks_exact(3).map(Vector3::from_column_slice).collect()
}

fn state(result: &ffi::SolveResult) -> State {
    let rotation = |q: &[f64]| UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]));
    let poses = result.rotations.chunks_exact(4).zip(vectors(&result.centres));
    State {
        interiors: result.interiors.as_chunks().0.to_vec(),
        theta: result.theta.clone(),
        poses: poses.map(|(q, centre)| crate::problem::Pose { rotation: rotation(q), centre }).collect(),
        points: vectors(&result.points),
    }
}

fn covariance(result: &ffi::SolveResult) -> Covariance {
    Covariance {
        poses: result.pose_covariances.chunks_exact(36).map(SMatrix::from_row_slice).collect(),
        points: result.point_covariances.chunks_exact(9).map(Matrix3::from_row_slice).collect(),
        ..shared_covariance(&result.shared_unknowns, &result.shared, &result.theta_variances)
    }
}

fn shared_covariance(unknowns: &[u64], shared: &[f64], theta_variances: &[f64]) -> Covariance {
    Covariance {
        shared_unknowns: indices(unknowns),
        shared: DMatrix::from_column_slice(unknowns.len(), unknowns.len(), shared),
        poses: Vec::new(),
        points: Vec::new(),
        theta_variances: theta_variances.to_vec(),
        point_parts: Vec::new(),
    }
}

impl Solver for Ceres {
    fn name(&self) -> &'static str {
        NAME
    }

    fn solve(
        &self,
        problem: &Problem,
        options: &Options,
        progress: &mut Progress<'_>,
    ) -> Result<Solution, AdjustError> {
        let Options {
            max_iterations,
            chi_square_change,
            idle_steps,
            may_stay_unconverged,
            threads,
            linear_solver,
            covariance: wanted,
            ref stop,
        } = *options;
        if idle_steps.is_some() {
            let option = "an end after idle steps".into();
            return Err(AdjustError::Unsupported { solver: NAME, option });
        }
        if may_stay_unconverged {
            let option = "a state that is not converged".into();
            return Err(AdjustError::Unsupported { solver: NAME, option });
        }
        if wanted == CovarianceOf::WithParts {
            let option = "the parts of the covariance of points".into();
            return Err(AdjustError::Unsupported { solver: NAME, option });
        }
        let points = problem.layout().point(0, 0);
        let reduced = problem.free()[..points].iter().filter(|free| **free).count();
        if wanted == CovarianceOf::Everything && reduced > LARGEST_DENSE_INVERSE {
            let text = format!(
                "the covariance of poses and points with {reduced} unknowns besides the points (at most \
                 {LARGEST_DENSE_INVERSE}); ask for the covariance of the shared parameters alone"
            );
            return Err(AdjustError::Unsupported { solver: NAME, option: text });
        }
        let clamp = |value: usize| u32::try_from(value).unwrap_or(u32::MAX).min(i32::MAX as u32);
        let own = ffi::SolveOptions {
            max_iterations: clamp(max_iterations),
            chi_square_change,
            threads: clamp(threads),
            linear_solver: match linear_solver {
                LinearSolver::Auto => 0,
                LinearSolver::Dense => 1,
                LinearSolver::Sparse => 2,
                LinearSolver::Iterative => 3,
            },
            covariance: match wanted {
                CovarianceOf::Nothing => 0,
                CovarianceOf::Shared => 1,
                CovarianceOf::Everything | CovarianceOf::WithParts => 2,
            },
        };
        let arrays = Arrays::new(problem, &problem.start)?;
        let mut progress = |iteration: &Iteration| match stop.is_raised() {
            true => ControlFlow::Break(()),
            false => progress(iteration),
        };
        let mut watch = bridge::Watch::new(&mut progress);
        let result = bridge::solve(&arrays.view(), &own, &mut watch).map_err(bridge_error)?;
        if let Some(payload) = watch.panic {
            let text = payload.downcast_ref::<&str>().map(ToString::to_string);
            let text = text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
            return Err(AdjustError::Bridge(format!("the progress callback panicked: {text}")));
        }
        if let Some(error) = failure(problem, &result.report, result.iterations as usize) {
            return Err(error);
        }
        Ok(Solution {
            state: state(&result),
            cost: result.cost,
            converged: true,
            iterations: result.iterations as usize,
            seconds: result.seconds,
            gradient_max: result.gradient_max,
            covariance: (wanted != CovarianceOf::Nothing).then(|| covariance(&result)),
        })
    }

    fn evaluate(&self, problem: &Problem, state: &State) -> Result<Evaluation, AdjustError> {
        let arrays = Arrays::new(problem, state)?;
        let result = ffi::evaluate(&arrays.view()).map_err(bridge_error)?;
        if let Some(error) = failure(problem, &result.report, 0) {
            return Err(error);
        }
        Ok(Evaluation {
            residuals: result.residuals,
            row_start: indices(&result.row_start),
            columns: indices(&result.columns),
            values: result.values,
        })
    }

    fn reduced_system(&self, problem: &Problem, state: &State) -> Result<ReducedSystem, AdjustError> {
        let arrays = Arrays::new(problem, state)?;
        let result = ffi::reduce(&arrays.view()).map_err(bridge_error)?;
        if let Some(error) = failure(problem, &result.report, 0) {
            return Err(error);
        }
        let count = result.unknowns.len();
        Ok(ReducedSystem {
            unknowns: indices(&result.unknowns),
            matrix: DMatrix::from_row_slice(count, count, &result.matrix),
            gradient: result.gradient,
        })
    }

    fn covariance_at(&self, problem: &Problem, state: &State) -> Result<Covariance, AdjustError> {
        let arrays = Arrays::new(problem, state)?;
        let result = ffi::covariance_at(&arrays.view()).map_err(bridge_error)?;
        match failure(problem, &result.report, 0) {
            Some(error) => Err(error),
            None => Ok(shared_covariance(&result.shared_unknowns, &result.shared, &result.theta_variances)),
        }
    }
}

/// Descriptors of the built-in effects of C++, by the order of their file names.
///
/// # Errors
/// A table that does not fit this build.
pub fn cpp_descriptors() -> Result<Vec<Descriptor>, AdjustError> {
    let effects = builtin_effects().map_err(|error| AdjustError::Bridge(error.to_string()))?;
    Ok(effects.iter().map(|effect| effect.descriptor().clone()).collect())
}

/// Output (m), derivatives by input (m x n) and by theta (m x p), row-major.
pub type ValueAndDerivatives = (Vec<f64>, Vec<f64>, Vec<f64>);

/// Value (m) and derivatives by input (m x n) and theta (m x p), row-major, of the C++ derivation of a built-in effect.
///
/// # Errors
/// An unknown id, slices of the wrong length, or a place outside the effect's domain, as [`AdjustError::Bridge`].
pub fn cpp_eval(
    id: &str,
    context: &Context<'_>,
    input: &[f64],
    theta: &[f64],
) -> Result<ValueAndDerivatives, AdjustError> {
    let fail = |text: String| AdjustError::Bridge(text);
    let effects = builtin_effects().map_err(|error| fail(error.to_string()))?;
    let effect = effects
        .iter()
        .find(|effect| effect.descriptor().id == id)
        .ok_or_else(|| fail(format!("no effect `{id}` in C++")))?;
    let descriptor = effect.descriptor();
    let (n, m, p) = (descriptor.stage.inputs(), descriptor.stage.outputs(), descriptor.parameters.len());
    if input.len() != n || theta.len() != p {
        return Err(fail(format!(
            "effect `{id}` takes {n} inputs and {p} parameters, got {} and {}",
            input.len(),
            theta.len()
        )));
    }
    let (mut out, mut d_input, mut d_theta) = (vec![0.0; m], vec![0.0; m * n], vec![0.0; m * p]);
    effect
        .evaluate(context, input, theta, &mut out, Some(&mut d_input), Some(&mut d_theta))
        .map_err(|outside| fail(format!("effect `{id}`: {outside}")))?;
    Ok((out, d_input, d_theta))
}
