//! Do the two solvers agree? At the same point first: residuals and every entry of the Jacobian; then the solutions, in
//! units of their own sigma, the covariance, and the cost.
//!
//! What both share (reading, weights, numbering, datum) this cannot test; those parts have tests of their own.

use super::{AdjustError, Covariance, Evaluation, Solution, Solver};
use crate::math::{null_is_nan, rotation};
use crate::problem::{Problem, State};
use serde::{Deserialize, Serialize};

/// Two exact formulas in double precision at image coordinates of some 1e4 px differ by a few 1e-12 px; a wrong sign or
/// term by far more.
pub const RESIDUAL_PX: f64 = 1e-9;
/// Relative to the largest entry of the column; rounding of a chain of a dozen products.
pub const JACOBIAN_REL: f64 = 1e-9;
/// What is asked of the solutions: a thousandth of what the measurements tell.
pub const PARAMETER_SIGMA: f64 = 1e-3;
/// Of the cost, or of half the redundancy where the cost is below it (error-free blocks): chi-square is stationary, an
/// error of 1e-3 sigma in every unknown changes it by 1e-6 of their number.
pub const COST_REL: f64 = 1e-6;
/// Of standard deviations: they lose the digits of the condition number.
pub const COVARIANCE_REL: f64 = 1e-4;

/// Measurements compared at the same point; larger blocks are compared on an evenly spaced part of their points.
const COMPARED_MEASUREMENTS: usize = 200_000;

/// Largest differences, and whether each stays below its tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// All of them do.
    pub agree: bool,
    /// Of residuals at the same point, in px (positions: in m).
    #[serde(deserialize_with = "null_is_nan")]
    pub residual_max_px: f64,
    /// Of entries of the Jacobian at the same point, by the column's largest.
    #[serde(deserialize_with = "null_is_nan")]
    pub jacobian_max_rel: f64,
    /// Of the solutions' unknowns, in their own sigma.
    #[serde(deserialize_with = "null_is_nan")]
    pub parameter_max_sigma: f64,
    /// Of the cost.
    #[serde(deserialize_with = "null_is_nan")]
    pub cost_rel: f64,
    /// Of standard deviations of camera and effect parameters: at each solver's own solution; where these differ by
    /// more than [`COVARIANCE_REL`], at the first one's.
    #[serde(deserialize_with = "null_is_nan")]
    pub covariance_max_rel: f64,
    /// The unknown behind `parameter_max_sigma`.
    pub worst_unknown: String,
    /// The unknown behind `jacobian_max_rel`.
    pub worst_column: String,
    /// Where `jacobian_max_rel` is: image and point of the row, and the stage where the column is an effect's.
    #[serde(default)]
    pub worst_place: String,
    /// Image measurements whose rows were compared.
    pub compared_measurements: usize,
    /// The solvers agree only since each, or the one that had not converged, was started once more from the other's
    /// solution.
    #[serde(default)]
    pub polished: bool,
    /// Effects in the model that have one derivation, used by both solvers: agreement proves nothing about these.
    #[serde(default)]
    pub one_derivation: Vec<String>,
}

impl Agreement {
    /// At the same point the solvers agree in residuals and Jacobian: they solve the same problem.
    pub fn same_problem(&self) -> bool {
        self.residual_max_px < RESIDUAL_PX && self.jacobian_max_rel < JACOBIAN_REL
    }

    /// What whoever says that the solvers agree has to say with it; `None` where every effect has two derivations.
    pub fn not_independent(&self) -> Option<String> {
        let effects = self.one_derivation.join(", ");
        (!effects.is_empty()).then(|| format!("one derivation: solvers not independent here ({effects})"))
    }
}

/// Compares two solvers on a problem that both have solved.
pub fn compare(
    problem: &Problem,
    (a, of_a): (&dyn Solver, &Solution),
    (b, of_b): (&dyn Solver, &Solution),
) -> Result<Agreement, AdjustError> {
    let (part, state) = problem.thinned(&of_a.state, COMPARED_MEASUREMENTS);
    let at_a = a.evaluate(&part, &state)?;
    let at_b = b.evaluate(&part, &state)?;
    let residual_max_px = residual_difference(&part, &at_a, &at_b);
    let (jacobian_max_rel, entry) = jacobian_worst(&part, &at_a, &at_b);
    let column = entry.map(|(_, column)| column);
    let (parameter_max_sigma, unknown) = match (&of_a.covariance, &of_b.covariance) {
        (Some(covariance), _) | (None, Some(covariance)) => {
            parameter_difference(problem, &of_a.state, &of_b.state, covariance)
        }
        (None, None) => (f64::NAN, None),
    };
    let mut covariance_max_rel = 0.0;
    if let (Some(own), Some(other)) = (&of_a.covariance, &of_b.covariance) {
        covariance_max_rel = covariance_difference(own, other);
        // What a displacement that jumps (a sharp flaw at its centre) tells of its place hangs on the nearest
        // measurement alone: between two solutions a ten-thousandth of sigma apart that changes by more than rounding,
        // and neither solver is wrong.
        if covariance_max_rel >= COVARIANCE_REL && of_a.state != of_b.state {
            covariance_max_rel = covariance_difference(own, &b.covariance_at(problem, &of_a.state)?);
        }
    }
    let floor = 0.5 * problem.redundancy().2.max(1) as f64;
    let cost_rel = (of_a.cost - of_b.cost).abs() / of_a.cost.max(of_b.cost).max(floor);
    let plugins = problem.effects.iter().filter(|instance| instance.effect.has_one_derivation());
    let mut agreement = Agreement {
        agree: false,
        residual_max_px,
        jacobian_max_rel,
        parameter_max_sigma,
        cost_rel,
        covariance_max_rel,
        worst_unknown: unknown.map_or_else(String::new, |u| problem.unknown_name(u)),
        worst_column: column.map_or_else(String::new, |u| part.unknown_name(u)),
        worst_place: entry.map_or_else(String::new, |(row, column)| place(&part, row, column)),
        compared_measurements: part.observations.len(),
        polished: false,
        one_derivation: plugins.map(|instance| instance.effect.descriptor().id.to_string()).collect(),
    };
    agreement.agree = agreement.same_problem()
        && parameter_max_sigma < PARAMETER_SIGMA
        && cost_rel < COST_REL
        && covariance_max_rel < COVARIANCE_REL;
    Ok(agreement)
}

/// Holds the derivatives that plug-ins give themselves against differences of their values, at a solution: where one
/// solver runs alone there is no other to disagree.
///
/// # Errors
/// [`AdjustError::WrongDerivative`].
pub fn check_own_derivatives(problem: &Problem, solver: &dyn Solver, state: &State) -> Result<(), AdjustError> {
    if !problem.effects.iter().any(|instance| instance.effect.has_one_derivation()) {
        return Ok(());
    }
    let (part, state) = problem.thinned(state, COMPARED_MEASUREMENTS);
    let of_values = solver.evaluate(&part, &state)?;
    let own = solver.evaluate(&part.with_own_derivatives(), &state)?;
    match jacobian_worst(&part, &of_values, &own) {
        (relative, Some((row, column))) if relative >= JACOBIAN_REL => Err(AdjustError::WrongDerivative {
            column: part.unknown_name(column),
            place: place(&part, row, column),
            relative,
        }),
        _ => Ok(()),
    }
}

/// Largest difference of residuals, unweighted; infinite where the lists do not match.
pub fn residual_difference(problem: &Problem, a: &Evaluation, b: &Evaluation) -> f64 {
    if a.residuals.len() != b.residuals.len() || a.residuals.len() != problem.residual_count() {
        return f64::INFINITY;
    }
    let sigma = |row: usize| match problem.observations.get(row / 2) {
        Some(observation) => 1.0 / observation.inverse_sigma,
        None => {
            let position = row - 2 * problem.observations.len();
            let positions = problem.control.iter().chain(&problem.gnss);
            positions.map(|p| p.sigma[position % 3]).nth(position / 3).unwrap_or(1.0)
        }
    };
    let differences = a.residuals.iter().zip(&b.residuals).enumerate();
    largest(differences.map(|(row, (x, y))| ((x - y) * sigma(row)).abs()))
}

/// The largest value, NaN counted as infinite.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| if value.is_nan() { f64::INFINITY } else { most.max(value) })
}

/// Largest difference of Jacobian entries relative to their column's largest entry, and its column.
pub fn jacobian_difference(problem: &Problem, a: &Evaluation, b: &Evaluation) -> (f64, Option<usize>) {
    let (worst, entry) = jacobian_worst(problem, a, b);
    (worst, entry.map(|(_, column)| column))
}

/// In words, what a row is of, and at which stage the effect of a column acts.
fn place(problem: &Problem, row: usize, column: usize) -> String {
    let positions = problem.control.iter().chain(&problem.gnss);
    let of = match problem.observations.get(row / 2) {
        Some(observation) => {
            let point = problem.point_start.partition_point(|start| *start <= row / 2) - 1;
            let image = &problem.image_names[observation.image as usize];
            format!("image {image}, point {}", problem.point_names[point])
        }
        None => match positions.map(|position| position.index as usize).nth((row - 2 * problem.observations.len()) / 3)
        {
            Some(target) if row < 2 * problem.observations.len() + 3 * problem.control.len() => {
                format!("surveyed point {}", problem.point_names[target])
            }
            Some(target) => format!("antenna of image {}", problem.image_names[target]),
            None => "an observed parameter".into(),
        },
    };
    let layout = problem.layout();
    let first = layout.theta(0);
    let entry = column.checked_sub(first).and_then(|t| problem.theta.get(t));
    match entry.map(|entry| problem.effects[entry.effect as usize].effect.descriptor().stage) {
        Some(stage) => format!("{} stage, {of}", stage.name()),
        None => of,
    }
}

fn jacobian_worst(problem: &Problem, a: &Evaluation, b: &Evaluation) -> (f64, Option<(usize, usize)>) {
    if a.row_start.len() != b.row_start.len() {
        return (f64::INFINITY, None);
    }
    let mut column_max = vec![0.0f64; problem.layout().total()];
    for evaluation in [a, b] {
        for (column, value) in evaluation.columns.iter().zip(&evaluation.values) {
            column_max[*column] = column_max[*column].max(value.abs());
        }
    }
    let mut worst = (0.0, None);
    let mut note = |row: usize, column: usize, difference: f64| {
        let relative = if difference == 0.0 { 0.0 } else { difference / column_max[column] };
        if relative > worst.0 || relative.is_nan() {
            worst = (if relative.is_nan() { f64::INFINITY } else { relative }, Some((row, column)));
        }
    };
    // An entry that one side leaves out is zero there.
    for row in 0..a.row_start.len() - 1 {
        let (mut i, end_a) = (a.row_start[row], a.row_start[row + 1]);
        let (mut j, end_b) = (b.row_start[row], b.row_start[row + 1]);
        while i < end_a || j < end_b {
            let column_a = if i < end_a { a.columns[i] } else { usize::MAX };
            let column_b = if j < end_b { b.columns[j] } else { usize::MAX };
            let column = column_a.min(column_b);
            let value_a = if column_a == column { a.values[i] } else { 0.0 };
            let value_b = if column_b == column { b.values[j] } else { 0.0 };
            note(row, column, (value_a - value_b).abs());
            i += usize::from(column_a == column);
            j += usize::from(column_b == column);
        }
    }
    worst
}

/// Largest difference of two states in units of sigma, and its unknown. Poses and points count where their covariance
/// is known.
fn parameter_difference(problem: &Problem, a: &State, b: &State, covariance: &Covariance) -> (f64, Option<usize>) {
    let layout = problem.layout();
    let mut worst = (0.0, None);
    let mut note = |unknown: usize, difference: f64, variance: f64| {
        let share = if difference == 0.0 { 0.0 } else { difference.abs() / variance.sqrt() };
        if share > worst.0 || share.is_nan() {
            worst = (if share.is_nan() { f64::INFINITY } else { share }, Some(unknown));
        }
    };
    for (i, unknown) in covariance.shared_unknowns.iter().enumerate() {
        let difference = match layout.camera_parameter(*unknown) {
            Some((c, k)) => a.interiors[c][k] - b.interiors[c][k],
            None => a.theta[unknown - layout.theta(0)] - b.theta[unknown - layout.theta(0)],
        };
        note(*unknown, difference, covariance.shared[(i, i)]);
    }
    for (i, block) in covariance.poses.iter().enumerate() {
        let turn = (a.poses[i].rotation * b.poses[i].rotation.inverse()).to_rotation_matrix();
        let turn = rotation::log(turn.matrix());
        let shift = a.poses[i].centre - b.poses[i].centre;
        for k in (0..6).filter(|k| problem.pose_free[i][*k]) {
            note(layout.pose(i, k), if k < 3 { turn[k] } else { shift[k - 3] }, block[(k, k)]);
        }
    }
    for (j, block) in covariance.points.iter().enumerate() {
        for k in 0..3 {
            note(layout.point(j, k), a.points[j][k] - b.points[j][k], block[(k, k)]);
        }
    }
    worst
}

/// Largest relative difference of the standard deviations of shared unknowns.
fn covariance_difference(a: &Covariance, b: &Covariance) -> f64 {
    if a.shared_unknowns != b.shared_unknowns {
        return f64::INFINITY;
    }
    largest((0..a.shared.nrows()).map(|i| (a.shared[(i, i)].sqrt() / b.shared[(i, i)].sqrt() - 1.0).abs()))
}
