//! Reduced systems against dense algebra and each other.

use crate::adjust::noisy::{closerange, dike, two_cameras};
use crate::common::{SOLVERS, effect};
use misclosure::adjust::{Evaluation, ReducedSystem};
use misclosure::model::{Datum, Loss, Model};
use misclosure::problem::Problem;
use nalgebra::{DMatrix, DVector, Matrix3};

/// Of entries of the reduced system, by the diagonal of the system before elimination (where rounding happens): a sum
/// of some thousand products of size 1 in double precision keeps twelve digits.
const REDUCED_REL: f64 = 1e-12;

/// `J'J` and `J'r` of an evaluation, and the same with the points taken out, by dense algebra that no solver uses.
fn eliminated(problem: &Problem, evaluation: &Evaluation) -> (DVector<f64>, ReducedSystem) {
    let layout = problem.layout();
    let points = layout.point(0, 0);
    let unknowns: Vec<usize> = (0..points).filter(|unknown| problem.free()[*unknown]).collect();
    let mut position = vec![usize::MAX; points];
    unknowns.iter().enumerate().for_each(|(i, unknown)| position[*unknown] = i);
    let n = unknowns.len();
    let mut matrix = DMatrix::<f64>::zeros(n, n);
    let mut gradient = DVector::<f64>::zeros(n);
    let mut v = vec![Matrix3::<f64>::zeros(); layout.points];
    let mut w = vec![DMatrix::<f64>::zeros(n, 3); layout.points];
    let mut g = vec![nalgebra::Vector3::<f64>::zeros(); layout.points];
    for row in 0..evaluation.residuals.len() {
        let entries: Vec<(usize, f64)> = (evaluation.row_start[row]..evaluation.row_start[row + 1])
            .map(|k| (evaluation.columns[k], evaluation.values[k]))
            .collect();
        let r = evaluation.residuals[row];
        for (a, x) in &entries {
            if *a < points {
                gradient[position[*a]] += x * r;
            } else {
                g[(a - points) / 3][(a - points) % 3] += x * r;
            }
            for (b, y) in &entries {
                match (*a < points, *b < points) {
                    (true, true) => matrix[(position[*a], position[*b])] += x * y,
                    (true, false) => w[(b - points) / 3][(position[*a], (b - points) % 3)] += x * y,
                    (false, false) => v[(a - points) / 3][((a - points) % 3, (b - points) % 3)] += x * y,
                    (false, true) => {}
                }
            }
        }
    }
    let diagonal = matrix.diagonal();
    for j in 0..layout.points {
        let inverse = v[j].cholesky().expect("a determined point").inverse();
        let y = &w[j] * inverse;
        matrix -= &y * w[j].transpose();
        gradient -= y * g[j];
    }
    (diagonal, ReducedSystem { unknowns, matrix, gradient: gradient.iter().copied().collect() })
}

/// Largest difference of two reduced systems: of the matrix by the diagonal before elimination, of the gradient also by
/// the residuals' length.
fn difference(diagonal: &DVector<f64>, length: f64, a: &ReducedSystem, b: &ReducedSystem) -> (f64, f64) {
    assert_eq!(a.unknowns, b.unknowns);
    let n = a.unknowns.len();
    let (mut matrix, mut gradient) = (0.0f64, 0.0f64);
    for i in 0..n {
        gradient = gradient.max((a.gradient[i] - b.gradient[i]).abs() / (diagonal[i].sqrt() * length));
        for j in 0..n {
            let scale = (diagonal[i] * diagonal[j]).sqrt();
            matrix = matrix.max((a.matrix[(i, j)] - b.matrix[(i, j)]).abs() / scale);
        }
    }
    (matrix, gradient)
}

#[test]
fn reduced_systems_agree_with_each_other_and_with_dense_algebra() {
    let effects = vec![effect("focal-time"), effect("gnss-lever-arm")];
    for (block, model) in [
        (dike(), Model::default()),
        (dike(), Model { datum: Datum::All, effects, ..Model::default() }),
        (dike(), Model { datum: Datum::Control, tie_dc_to_pp: true, loss: Loss::Cauchy, ..Model::default() }),
        (closerange(), Model { datum: Datum::Control, ..Model::default() }),
        (two_cameras(), Model { datum: Datum::All, ..Model::default() }),
    ] {
        let problem = Problem::new(&block, &model).expect("a problem");
        let systems: Vec<ReducedSystem> = SOLVERS
            .iter()
            .map(|solver| solver.reduced_system(&problem, &problem.start).expect("a reduced system"))
            .collect();
        for (solver, system) in SOLVERS.iter().zip(&systems) {
            let evaluation = solver.evaluate(&problem, &problem.start).expect("an evaluation");
            let length = evaluation.residuals.iter().map(|r| r * r).sum::<f64>().sqrt();
            let (diagonal, expected) = eliminated(&problem, &evaluation);
            for (what, other) in [("dense algebra", &expected), ("the first solver", &systems[0])] {
                let (matrix, gradient) = difference(&diagonal, length, system, other);
                println!("{} against {what}: matrix {matrix:.1e}, gradient {gradient:.1e}", solver.name());
                assert!(matrix < REDUCED_REL, "{}: {} against {what}: matrix {matrix:e}", block.name, solver.name());
                assert!(
                    gradient < REDUCED_REL,
                    "{}: {} against {what}: gradient {gradient:e}",
                    block.name,
                    solver.name()
                );
            }
        }
    }
}
