//! The converged base model, prepared so that any set of extra columns can be tested against it.
//!
//! For columns `C` (what each would add to the measurements) the score is `s = C'P v` and its covariance for unit weight
//! `M = C'PC - C'PA (A'PA)^-1 A'PC`: what the base model absorbs is no noise and is taken out. Points are eliminated one by one,
//! then the cameras by one Cholesky factor that serves every test.

use super::columns::Columns;
use super::score::Score;
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, Evaluation, Solver};
use crate::problem::{Layout, Problem, State};
use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Llt;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, Par, Side};
use nalgebra::{Matrix2, Matrix2x6, Matrix3, Vector3};

/// Camera unknowns up to which their normal matrix is factorised densely (6000: 288 MB). Beyond it nothing is taken out for the cameras;
/// every p-value is then too large rather than too small, since `M` can only shrink.
pub const MAX_CAMERA_UNKNOWNS: usize = 6000;

/// A point, eliminated.
struct EliminatedPoint {
    /// `(A_p'PA_p)^-1`, for unit weight, m^2.
    covariance: Matrix3<f64>,
    /// Correction of the point by its own residuals; zero at a converged solution.
    correction: Vector3<f64>,
    /// Per camera unknown that the point sees: how the point follows it.
    follows: Vec<(u32, Vector3<f64>)>,
}

/// Cholesky factor of the cameras' normal matrix with its Jacobi scaling.
struct Cameras {
    factor: Llt<f64>,
    scale: Vec<f64>,
    /// `L^-1` times the scaled gradient.
    gradient: Mat<f64>,
}

/// The base model at its solution.
pub struct Base<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Its solution.
    pub state: &'a State,
    /// Per image measurement, its local redundancy `I - A_p (A_p'PA_p)^-1 A_p'P`, 2x2, cameras held.
    pub redundancy: Vec<Matrix2<f64>>,
    /// Per image measurement, observed minus computed, px.
    pub residual: Vec<[f64; 2]>,
    /// Sum of squares of the standardised residuals of the image measurements.
    pub sum_of_squares: f64,
    /// Their redundancy.
    pub degrees: f64,
    evaluation: Evaluation,
    points: Vec<EliminatedPoint>,
    /// Row and number of the control rows of each point.
    control_row: Vec<Option<usize>>,
    cameras: Option<Cameras>,
    /// Layout unknown to position in the normal matrix.
    position: Vec<u32>,
    unknowns: usize,
}

const NOT_FREE: u32 = u32::MAX;

impl<'a> Base<'a> {
    /// Prepares a solution.
    ///
    /// # Errors
    /// What cannot be projected at `state`.
    pub fn new(problem: &'a Problem, state: &'a State) -> Result<Self, AdjustError> {
        let evaluation = Native.evaluate(problem, state)?;
        let layout = problem.layout();
        let free = problem.free();
        let mut position = vec![NOT_FREE; layout.point(0, 0)];
        let mut unknowns = 0;
        for (slot, _) in position.iter_mut().zip(&free).filter(|(_, free)| **free) {
            *slot = unknowns;
            unknowns += 1;
        }
        let n = problem.observations.len();
        let mut control_row = vec![None; layout.points];
        for (c, observation) in problem.control.iter().enumerate() {
            control_row[observation.index as usize] = Some(2 * n + 3 * c);
        }
        let mut base = Self {
            problem,
            state,
            redundancy: vec![Matrix2::identity(); n],
            residual: Vec::with_capacity(n),
            sum_of_squares: 0.0,
            degrees: 0.0,
            evaluation,
            points: Vec::with_capacity(layout.points),
            control_row,
            cameras: None,
            position,
            unknowns: unknowns as usize,
        };
        for (k, observation) in problem.observations.iter().enumerate() {
            let [x, y] = [base.evaluation.residuals[2 * k], base.evaluation.residuals[2 * k + 1]];
            base.sum_of_squares += x * x + y * y;
            base.residual.push([x / observation.inverse_sigma, y / observation.inverse_sigma]);
        }
        // GNSS and control determine a part of the cameras, so this is a little too small: on the safe side.
        base.degrees = (2 * n) as f64 - 3.0 * layout.points as f64 - f64::from(unknowns);
        let mut scratch = vec![NOT_FREE; base.unknowns];
        for j in 0..layout.points {
            let point = base.eliminate(j, &layout, &mut scratch);
            base.points.push(point);
        }
        if base.unknowns <= MAX_CAMERA_UNKNOWNS {
            base.cameras = Some(base.factorise()?);
        }
        Ok(base)
    }

    /// Variance factor of the image measurements.
    pub fn variance(&self) -> f64 {
        self.sum_of_squares / self.degrees
    }

    /// Are the cameras taken out of the columns?
    pub fn exact(&self) -> bool {
        self.cameras.is_some()
    }

    /// Standardised residual of a row.
    pub fn standardised(&self, row: usize) -> f64 {
        self.evaluation.residuals[row]
    }

    /// Derivative of a standardised measurement's residual by the pose of its image; zero where that is held.
    pub fn by_pose(&self, measurement: usize) -> Matrix2x6<f64> {
        let image = self.problem.observations[measurement].image as usize;
        let first = self.problem.layout().pose(image, 0);
        let mut derivative = Matrix2x6::zeros();
        for k in 0..2 {
            let row = 2 * measurement + k;
            for entry in self.evaluation.row_start[row]..self.evaluation.row_start[row + 1] {
                let column = self.evaluation.columns[entry];
                if (first..first + 6).contains(&column) {
                    derivative[(k, column - first)] = self.evaluation.values[entry];
                }
            }
        }
        derivative
    }

    /// Redundancy of rows without points, from an even sample of them: `sum 1 - a'(A'PA)^-1 a`.
    pub fn redundancy_of(&self, rows: std::ops::Range<usize>, sample: usize) -> f64 {
        let Some(cameras) = &self.cameras else { return rows.len() as f64 };
        let stride = rows.len().div_ceil(sample).max(1);
        let sampled: Vec<usize> = rows.clone().step_by(stride).collect();
        let mut columns = Mat::<f64>::zeros(self.unknowns, sampled.len());
        for (c, row) in sampled.iter().enumerate() {
            for (unknown, value) in self.row(*row).0 {
                columns[(unknown as usize, c)] = value * cameras.scale[unknown as usize];
            }
        }
        solve_lower_triangular_in_place(cameras.factor.L(), columns.as_mut(), Par::Seq);
        let taken: f64 = (0..sampled.len()).map(|c| columns.col_as_slice(c).iter().map(|x| x * x).sum::<f64>()).sum();
        rows.len() as f64 * (1.0 - taken / sampled.len() as f64)
    }

    /// Entries of a row by unknowns that are no point coordinates (positions), and the derivative by its point.
    fn row(&self, row: usize) -> (impl Iterator<Item = (u32, f64)> + '_, Vector3<f64>) {
        let (start, end) = (self.evaluation.row_start[row], self.evaluation.row_start[row + 1]);
        let columns = &self.evaluation.columns[start..end];
        let values = &self.evaluation.values[start..end];
        let first_point = self.position.len();
        let split = columns.partition_point(|column| *column < first_point);
        let mut by_point = Vector3::zeros();
        for (column, value) in columns[split..].iter().zip(&values[split..]) {
            by_point[(column - first_point) % 3] = *value;
        }
        let cameras = columns[..split].iter().zip(&values[..split]);
        (cameras.map(|(column, value)| (self.position[*column], *value)), by_point)
    }

    /// Rows of a point: its measurements, and its surveyed coordinates where they take part.
    fn rows_of(&self, j: usize) -> impl Iterator<Item = usize> + use<> {
        let start = &self.problem.point_start;
        let control = self.control_row[j].map_or(0..0, |row| row..row + 3);
        (2 * start[j]..2 * start[j + 1]).chain(control)
    }

    fn eliminate(&mut self, j: usize, layout: &Layout, scratch: &mut [u32]) -> EliminatedPoint {
        debug_assert!(j < layout.points);
        let mut normal = Matrix3::zeros();
        let mut gradient = Vector3::zeros();
        for row in self.rows_of(j) {
            let (_, by_point) = self.row(row);
            normal += by_point * by_point.transpose();
            gradient += by_point * self.evaluation.residuals[row];
        }
        // A point without information on a coordinate is not eliminated; its measurements are then taken as they are.
        let covariance = normal.try_inverse().unwrap_or_else(Matrix3::zeros);
        let mut follows: Vec<(u32, Vector3<f64>)> = Vec::new();
        for row in self.rows_of(j) {
            let (cameras, by_point) = self.row(row);
            for (unknown, value) in cameras {
                let slot = &mut scratch[unknown as usize];
                if *slot == NOT_FREE {
                    *slot = follows.len() as u32;
                    follows.push((unknown, Vector3::zeros()));
                }
                follows[*slot as usize].1 += by_point * value;
            }
        }
        for (unknown, sum) in &mut follows {
            scratch[*unknown as usize] = NOT_FREE;
            *sum = covariance * *sum;
        }
        for k in self.problem.point_start[j]..self.problem.point_start[j + 1] {
            let (x, y) = (self.row(2 * k).1, self.row(2 * k + 1).1);
            let xy = x.dot(&(covariance * y));
            self.redundancy[k] = Matrix2::new(1.0 - x.dot(&(covariance * x)), -xy, -xy, 1.0 - y.dot(&(covariance * y)));
        }
        EliminatedPoint { covariance, correction: covariance * gradient, follows }
    }

    fn factorise(&self) -> Result<Cameras, AdjustError> {
        let system = Native.reduced_system(self.problem, self.state)?;
        let scale: Vec<f64> = (0..self.unknowns).map(|k| system.matrix[(k, k)].sqrt().recip()).collect();
        let matrix = Mat::from_fn(self.unknowns, self.unknowns, |i, k| system.matrix[(i, k)] * scale[i] * scale[k]);
        let factor = Llt::new(matrix.as_ref(), Side::Lower).map_err(|_| AdjustError::NotConverged {
            solver: "native",
            iterations: 0,
            reason: "the cameras are not determined at this state".into(),
        })?;
        let mut gradient = Mat::from_fn(self.unknowns, 1, |i, _| system.gradient[i] * scale[i]);
        solve_lower_triangular_in_place(factor.L(), gradient.as_mut(), Par::Seq);
        Ok(Cameras { factor, scale, gradient })
    }

    /// Score of columns and its covariance for unit weight.
    pub fn score(&self, columns: &Columns) -> Score {
        let q = columns.count;
        let mut score = Score::new(q);
        let mut cross = Mat::<f64>::zeros(if self.cameras.is_some() { self.unknowns } else { 0 }, q);
        let mut scratch = vec![NOT_FREE; q];
        for j in 0..self.points.len() {
            self.add_point(j, columns, &mut score, &mut cross, &mut scratch);
        }
        for (row, entries) in &columns.other_rows {
            for (a, value) in entries {
                score.vector[*a] += value * self.evaluation.residuals[*row];
                for (b, other) in entries.iter().filter(|(b, _)| b <= a) {
                    score.matrix[(*a, *b)] += value * other;
                }
                score.size[*a] += value * value;
                for (unknown, derivative) in self.row(*row).0.filter(|_| self.cameras.is_some()) {
                    cross[(unknown as usize, *a)] += value * derivative;
                }
            }
        }
        score.cameras_held = score.matrix.diagonal().iter().copied().collect();
        if let Some(cameras) = &self.cameras {
            cameras.project(&mut score, cross);
        }
        score
    }

    fn add_point(&self, j: usize, columns: &Columns, score: &mut Score, cross: &mut Mat<f64>, scratch: &mut [u32]) {
        let point = &self.points[j];
        // The point's columns, how the point follows each (3-vector), and the point's part of each score.
        let mut own: Vec<(u32, Vector3<f64>, f64)> = Vec::new();
        for k in self.problem.point_start[j]..self.problem.point_start[j + 1] {
            let weight = self.problem.observations[k].inverse_sigma;
            let residual = [self.evaluation.residuals[2 * k], self.evaluation.residuals[2 * k + 1]];
            let (by_x, by_y) = (self.row(2 * k).1, self.row(2 * k + 1).1);
            let entries = columns.of(k);
            for (position, entry) in entries.iter().enumerate() {
                let (a, x, y) = (entry.column as usize, entry.x * weight, entry.y * weight);
                let slot = &mut scratch[a];
                if *slot == NOT_FREE {
                    *slot = own.len() as u32;
                    own.push((entry.column, Vector3::zeros(), 0.0));
                }
                let (_, moves, part) = &mut own[*slot as usize];
                *moves += by_x * x + by_y * y;
                *part += x * residual[0] + y * residual[1];
                score.size[a] += x * x + y * y;
                for other in &entries[..=position] {
                    score.add(a, other.column as usize, weight * (x * other.x + y * other.y));
                }
                if self.cameras.is_some() {
                    let column = cross.col_as_slice_mut(a);
                    for (row, value) in [(2 * k, x), (2 * k + 1, y)].into_iter().filter(|(_, value)| *value != 0.0) {
                        for (unknown, derivative) in self.row(row).0 {
                            column[unknown as usize] += value * derivative;
                        }
                    }
                }
            }
        }
        for position in 0..own.len() {
            let (column, moves, part) = own[position];
            let a = column as usize;
            scratch[a] = NOT_FREE;
            let shift = point.covariance * moves;
            for (other, other_moves, _) in &own[..=position] {
                score.add(a, *other as usize, -shift.dot(other_moves));
            }
            let part = part - moves.dot(&point.correction);
            score.vector[a] += part;
            score.squares[a] += part * part;
            if self.cameras.is_some() {
                let slice = cross.col_as_slice_mut(a);
                for (unknown, follows) in &point.follows {
                    slice[*unknown as usize] -= moves.dot(follows);
                }
            }
        }
    }
}

impl Cameras {
    fn project(&self, score: &mut Score, mut cross: Mat<f64>) {
        let q = cross.ncols();
        for a in 0..q {
            for (value, scale) in cross.col_as_slice_mut(a).iter_mut().zip(&self.scale) {
                *value *= scale;
            }
        }
        solve_lower_triangular_in_place(self.factor.L(), cross.as_mut(), Par::Seq);
        let mut taken = Mat::<f64>::zeros(q, 1);
        matmul(taken.as_mut(), Accum::Replace, cross.transpose(), self.gradient.as_ref(), 1.0, Par::Seq);
        let mut square = Mat::<f64>::zeros(q, q);
        matmul(square.as_mut(), Accum::Replace, cross.transpose(), cross.as_ref(), 1.0, Par::Seq);
        for a in 0..q {
            score.vector[a] -= taken[(a, 0)];
            for b in 0..=a {
                score.matrix[(a, b)] -= square[(a, b)];
            }
        }
    }
}
