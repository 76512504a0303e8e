//! One solve: the problem in apex-solver's variables and factors, and its result taken back.

use crate::colmap::{Image, Model};
use crate::entry::Entry;
use crate::form::Form;
use anyhow::{Context, Result, bail};
use apex_solver::core::VarKey;
use apex_solver::core::loss_functions::{CauchyLoss, LossFunction};
use apex_solver::core::problem::Problem;
use apex_solver::optimizer::gauss_newton::GaussNewtonConfig;
use apex_solver::{
    GaussNewton, JacobianMode, LevenbergMarquardt, LevenbergMarquardtConfig, LinearSolverType, ManifoldType, Optimizer,
};
use nalgebra::{DVector, Quaternion, UnitQuaternion, Vector3};
use std::time::Instant;

/// What a solve took, and how it says that it ended.
pub struct Took {
    pub seconds: f64,
    pub iterations: usize,
    pub status: String,
}

/// Which of apex-solver's solvers, and how long it goes on.
#[derive(Clone, Copy)]
pub enum Method {
    /// Levenberg-Marquardt as its authors set it up for bundle adjustment.
    Usual,
    /// The same with exact steps, for as long as one reduces the cost.
    Tight,
    /// Gauss-Newton, which takes every step.
    GaussNewton,
}

impl Method {
    fn solver(self) -> Box<dyn Optimizer> {
        let usual = LevenbergMarquardtConfig::for_bundle_adjustment();
        match self {
            Method::Usual => Box::new(LevenbergMarquardt::with_config(usual)),
            Method::Tight => Box::new(LevenbergMarquardt::with_config(
                usual
                    .with_linear_solver_type(LinearSolverType::ExplicitSparseSchur)
                    .with_max_iterations(500)
                    .with_cost_tolerance(1e-16)
                    .with_parameter_tolerance(1e-16)
                    .with_gradient_tolerance(1e-16),
            )),
            Method::GaussNewton => Box::new(GaussNewton::with_config(
                GaussNewtonConfig::new()
                    .with_linear_solver_type(LinearSolverType::SparseCholesky)
                    .with_max_iterations(50)
                    .with_cost_tolerance(1e-16)
                    .with_parameter_tolerance(1e-16)
                    .with_gradient_tolerance(1e-16),
            )),
        }
    }
}

/// Adjusts the model, whose poses, points and cameras are then those that were found.
pub fn adjust(entry: &Entry, form: &Form, model: &mut Model, method: Method) -> Result<Took> {
    let mut problem = Problem::new(JacobianMode::Sparse);
    let axes = form.axes();
    let add = |problem: &mut Problem, kind, values: &[f64]| problem.add_variable(kind, DVector::from_row_slice(values));
    let mut poses = Vec::new();
    for image in &model.images {
        let (q, t) = (axes * image.rotation, axes * image.translation);
        poses.push(add(&mut problem, ManifoldType::SE3, &[t.x, t.y, t.z, q.w, q.i, q.j, q.k]));
    }
    let mut points = Vec::new();
    for point in &model.points {
        let key = add(&mut problem, ManifoldType::RN, point.position.as_slice());
        problem.mark_for_elimination(key);
        points.push(key);
    }
    let mut interiors = Vec::new();
    for camera in &model.cameras {
        let Some((values, free)) = form.interior(camera) else { continue };
        let key = add(&mut problem, ManifoldType::RN, &values);
        (0..3).filter(|&k| !free[k]).try_for_each(|k| problem.try_fix_variable(key, k))?;
        interiors.push(key);
    }
    for (image, pose) in model.images.iter().zip(&poses) {
        for (observed, point) in &image.marks {
            let mut variables = vec![*pose, points[*point]];
            variables.extend(interiors.get(image.camera));
            let factor = form.factor(&model.cameras[image.camera], *observed)?;
            problem.try_add_residual_block(&variables, factor, loss(entry)?)?;
        }
    }
    hold_datum(&mut problem, &model.images, &poses)?;

    let started = Instant::now();
    let found = method.solver().optimize(&mut problem)?;
    let seconds = started.elapsed().as_secs_f64();

    let value = |key: VarKey| found.parameters[key].as_param_slice();
    for (image, pose) in model.images.iter_mut().zip(&poses) {
        let &[x, y, z, w, i, j, k] = value(*pose) else { bail!("a pose of seven numbers was expected") };
        image.rotation = axes * UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        image.translation = axes * Vector3::new(x, y, z);
    }
    for (point, key) in model.points.iter_mut().zip(&points) {
        point.position = Vector3::from_column_slice(value(*key));
    }
    for (camera, key) in model.cameras.iter_mut().zip(&interiors) {
        // COLMAP has the principal point between f and k1, and only those coefficients that the camera's model has.
        let found = value(*key);
        camera.params[0] = found[0];
        camera.params.iter_mut().skip(3).zip(&found[1..]).for_each(|(old, new)| *old = *new);
    }
    Ok(Took { seconds, iterations: found.iterations, status: found.status.to_string() })
}

fn loss(entry: &Entry) -> Result<Option<Box<dyn LossFunction + Send + Sync>>> {
    Ok(match entry.cauchy {
        Some(scale) => Some(Box::new(CauchyLoss::new(scale)?)),
        None => None,
    })
}

/// Holds the datum: the pose of the first image, and of the image farthest from it the component of the shift in which
/// they are farthest apart.
fn hold_datum(problem: &mut Problem, images: &[Image], poses: &[VarKey]) -> Result<()> {
    let centre = |image: &Image| -(image.rotation.inverse() * image.translation);
    let base = |k: usize| centre(&images[k]) - centre(&images[0]);
    let far = (1..images.len()).max_by(|&a, &b| base(a).norm().total_cmp(&base(b).norm()));
    let far = far.context("one image has no scale to hold")?;
    (0..6).try_for_each(|component| problem.try_fix_variable(poses[0], component))?;
    Ok(problem.try_fix_variable(poses[far], base(far).iamax())?)
}
