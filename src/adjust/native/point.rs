//! All rows of one point: linearised, weighted, and ready to be eliminated.

use super::columns::Columns;
use super::loss::{Curvature, LEAST_CURVATURE, curvature_along, rho};
use super::side_by_side::Cameras;
use super::structure::{FIRST_THETA, LocalColumn, NONE, Structure};
use crate::camera::Interior;
use crate::measure::{self, Frame, MeasureError, Prediction};
use crate::problem::{Problem, State};
use nalgebra::{Matrix3, Vector3};

/// Shrinks the derivatives of a prediction along the unit vector `u` by `share`.
fn shrink_along(p: &mut Prediction, u: [f64; 2], share: f64) {
    fn shrink(d: [&mut [f64]; 2], u: [f64; 2], share: f64) {
        let [x, y] = d;
        for (x, y) in x.iter_mut().zip(y) {
            let along = (1.0 - share) * (u[0] * *x + u[1] * *y);
            *x -= along * u[0];
            *y -= along * u[1];
        }
    }
    let Prediction { d_pose, d_point, d_camera, d_theta, .. } = p;
    shrink(d_pose.each_mut().map(|row| row.as_mut_slice()), u, share);
    shrink(d_point.each_mut().map(|row| row.as_mut_slice()), u, share);
    shrink(d_camera.each_mut().map(|row| row.as_mut_slice()), u, share);
    shrink(d_theta.each_mut().map(|row| row.as_mut_slice()), u, share);
}

/// A state with its images prepared.
pub struct Prepared<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Its structure.
    pub structure: &'a Structure,
    /// The state.
    pub state: &'a State,
    /// Its images.
    pub frames: &'a [Frame],
}

impl<'a> Prepared<'a> {
    /// Its images.
    pub fn cameras(&self) -> Cameras<'a> {
        Cameras { problem: self.problem, stages: &self.structure.stages, frames: self.frames }
    }
}

/// One image measurement: two rows of the weighted design matrix, in scaled unknowns. `D` unknowns per image.
#[derive(Debug, Clone, Copy)]
pub struct Row<const D: usize> {
    /// Rank of the image.
    pub rank: u32,
    /// By the image's unknowns.
    pub image: [[f64; D]; 2],
    /// By the point.
    pub point: [[f64; 3]; 2],
    /// Weighted misclosure, observed minus computed.
    pub v: [f64; 2],
    /// `W = J_image' J_point`.
    pub w: [[f64; 3]; D],
    /// `W V^-1`.
    pub y: [[f64; 3]; D],
}

/// A point's rows and normal equations; buffers are reused from point to point.
pub struct PointRows<const D: usize> {
    /// Image rows, by rank.
    pub rows: Vec<Row<D>>,
    /// Derivatives by the border, one per image row (and buffers of points with more rows).
    pub shared: Vec<SharedRow>,
    /// `V = J_point' J_point`.
    pub v_matrix: Matrix3<f64>,
    /// `J_point' v`.
    pub gradient: Vector3<f64>,
    /// Columns of the border that the point's rows touch.
    pub columns: Columns,
    /// `W` of these columns, one row per coordinate of the point.
    pub w_shared: [Vec<f64>; 3],
    /// `W V^-1` of these columns, once the point is eliminated.
    pub y_shared: Vec<[f64; 3]>,
    /// Rows of control coordinates: derivatives by the border (3 x border), and misclosures.
    pub control: Option<ControlRows>,
    /// `sum rho`.
    pub chi_square: f64,
    curvature: Curvature,
    prediction: Prediction,
    /// Position of each touched column of the border in `columns`.
    position: Vec<u32>,
}

/// Gaps between runs of columns that are filled with zeros: a run costs as much as some columns.
const BRIDGED: u32 = 16;

/// Derivatives of an image measurement by the columns of the border that it touches.
#[derive(Debug, Clone, Default)]
pub struct SharedRow {
    /// The columns.
    pub columns: Columns,
    /// By them, compact.
    pub x: Vec<f64>,
    /// By them, compact.
    pub y: Vec<f64>,
}

/// The coordinate observations of a control point.
#[derive(Debug, Clone, Default)]
pub struct ControlRows {
    /// Columns of the border that they touch.
    pub columns: Columns,
    /// By them, compact, one row per coordinate.
    pub shared: [Vec<f64>; 3],
    /// By the point.
    pub by_point: [[f64; 3]; 3],
    /// Weighted misclosures.
    pub v: [f64; 3],
}

impl SharedRow {
    /// Takes the derivatives that are not zero from a prediction; `local` ascends.
    fn fill(&mut self, local: &[LocalColumn], prediction: &Prediction, weight: f64) {
        self.columns.clear();
        self.x.clear();
        self.y.clear();
        let [x, y] = [0, 1].map(|i| (&prediction.d_camera[i], prediction.d_theta[i].as_slice()));
        let mut next = 0;
        for column in local {
            let of = |(d_camera, d_theta): (&Interior, &[f64])| match column.source {
                k if k < FIRST_THETA => d_camera[k as usize],
                k => d_theta[(k - FIRST_THETA) as usize],
            };
            let (dx, dy) = (of(x), of(y));
            if dx == 0.0 && dy == 0.0 {
                continue;
            }
            if column.column - next <= BRIDGED {
                for between in next..column.column {
                    self.push(between, 0.0, 0.0);
                }
            }
            self.push(column.column, dx * weight * column.scale, dy * weight * column.scale);
            next = column.column + 1;
        }
    }

    fn push(&mut self, column: u32, x: f64, y: f64) {
        self.columns.push(column);
        self.x.push(x);
        self.y.push(y);
    }
}

impl<const D: usize> PointRows<D> {
    /// Empty buffers; rows with the weights of a robust loss alone.
    pub fn new() -> Self {
        Self::with(Curvature::Weights)
    }

    /// Empty buffers.
    pub fn with(curvature: Curvature) -> Self {
        Self {
            curvature,
            rows: Vec::new(),
            shared: Vec::new(),
            v_matrix: Matrix3::zeros(),
            gradient: Vector3::zeros(),
            columns: Columns::default(),
            w_shared: Default::default(),
            y_shared: Vec::new(),
            control: None,
            chi_square: 0.0,
            prediction: Prediction::default(),
            position: Vec::new(),
        }
    }

    /// Linearises point `j`. Errors: an observation of it that cannot be computed.
    pub fn linearise(&mut self, at: &Prepared<'_>, j: usize) -> Result<(), MeasureError> {
        let Prepared { problem, structure, state, frames } = at;
        let object = &state.points[j];
        self.rows.clear();
        self.chi_square = 0.0;
        self.v_matrix = Matrix3::zeros();
        self.gradient = Vector3::zeros();
        for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let image = observation.image as usize;
            let p = &mut self.prediction;
            measure::predict(problem, &structure.stages, &frames[image], image, object, p)
                .ok_or_else(|| MeasureError::image_point(problem, j, image))?;
            let misclosure = [observation.x - p.point[0], observation.y - p.point[1]];
            let normalised = misclosure.map(|m| m * observation.inverse_sigma);
            let s = normalised[0] * normalised[0] + normalised[1] * normalised[1];
            let (cost, slope) = rho(problem.loss, s);
            self.chi_square += cost;
            let weight = observation.inverse_sigma * slope.sqrt();
            let mut v = misclosure.map(|m| m * weight);
            let along = curvature_along(problem.loss, s);
            if self.curvature == Curvature::Newton && along < 1.0 {
                // Smaller derivatives along the residual, and a residual that much larger: the same gradient, less
                // curvature.
                let share = along.max(LEAST_CURVATURE).sqrt();
                shrink_along(p, normalised.map(|n| n / s.sqrt()), share);
                v = v.map(|v| v / share);
            }

            let base = structure.rank[image] as usize * structure.dim;
            let mut row = Row {
                rank: structure.rank[image],
                image: [[0.0; D]; 2],
                point: [[0.0; 3]; 2],
                v,
                w: [[0.0; 3]; D],
                y: [[0.0; 3]; D],
            };
            for i in 0..2 {
                for k in 0..6 {
                    let held = structure.image_unknowns[base + k] == usize::MAX;
                    row.image[i][k] = if held { 0.0 } else { p.d_pose[i][k] * weight };
                }
                for column in &structure.own[image] {
                    row.image[i][column.row as usize] = p.d_theta[i][column.source as usize] * weight * column.scale;
                }
                for k in 0..3 {
                    row.point[i][k] = p.d_point[i][k] * weight;
                }
                for a in 0..3 {
                    self.gradient[a] += row.point[i][a] * row.v[i];
                    for b in 0..3 {
                        self.v_matrix[(a, b)] += row.point[i][a] * row.point[i][b];
                    }
                }
            }
            for k in 0..D {
                for a in 0..3 {
                    row.w[k][a] = row.image[0][k] * row.point[0][a] + row.image[1][k] * row.point[1][a];
                }
            }
            let r = self.rows.len();
            if self.shared.len() == r {
                self.shared.push(SharedRow::default());
            }
            self.shared[r].fill(&structure.local[image], p, weight);
            self.rows.push(row);
        }
        self.linearise_control(at, j)?;
        self.multiply_shared(structure.border.len());
        Ok(())
    }

    /// Adds the observed coordinates of a control point.
    fn linearise_control(&mut self, at: &Prepared<'_>, j: usize) -> Result<(), MeasureError> {
        let Prepared { problem, structure, state, .. } = at;
        self.control = None;
        let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) else {
            return Ok(());
        };
        let observation = &problem.control[c];
        let p = measure::predict_surveyed(problem, &structure.stages, &state.theta, &state.points[j])
            .ok_or_else(|| MeasureError::surveyed(problem, j))?;
        let mut rows = ControlRows::default();
        let weight: [f64; 3] = std::array::from_fn(|i| 1.0 / observation.sigma[i]);
        // Control effects have no image of their own: any image's list of global parameters serves.
        for column in structure.local.first().into_iter().flatten().filter(|column| column.source >= FIRST_THETA) {
            let d = p.d_theta[(column.source - FIRST_THETA) as usize];
            if d != [0.0; 3] {
                rows.columns.push(column.column);
                for i in 0..3 {
                    rows.shared[i].push(d[i] * weight[i] * column.scale);
                }
            }
        }
        for i in 0..3 {
            rows.v[i] = (observation.position[i] - p.position[i]) * weight[i];
            self.chi_square += rows.v[i] * rows.v[i];
            let by_point: [f64; 3] = std::array::from_fn(|k| p.derivative[(i, 3 + k)] * weight[i]);
            rows.by_point[i] = by_point;
            for a in 0..3 {
                self.gradient[a] += by_point[a] * rows.v[i];
                for b in 0..3 {
                    self.v_matrix[(a, b)] += by_point[a] * by_point[b];
                }
            }
        }
        self.control = Some(rows);
        Ok(())
    }

    /// Collects the columns of the border that any row touches, and their `W`.
    fn multiply_shared(&mut self, border: usize) {
        let shared = &self.shared[..self.rows.len()];
        self.position.clear();
        self.position.resize(border, NONE);
        let control = self.control.as_ref().map(|control| &control.columns);
        for columns in shared.iter().map(|row| &row.columns).chain(control) {
            for run in columns.runs() {
                self.position[run.column..run.column + run.length].fill(0);
            }
        }
        self.columns.clear();
        for (column, position) in self.position.iter_mut().enumerate().filter(|(_, position)| **position != NONE) {
            *position = self.columns.len() as u32;
            self.columns.push(column as u32);
        }
        let n = self.columns.len();
        for w in &mut self.w_shared {
            w.clear();
            w.resize(n, 0.0);
        }
        let mut add = |columns: &Columns, by_point: &[f64; 3], values: &[f64]| {
            for run in columns.runs() {
                let to = self.position[run.column] as usize;
                let values = &values[run.position..run.position + run.length];
                for (w, a) in self.w_shared.iter_mut().zip(by_point) {
                    for (w, value) in w[to..to + run.length].iter_mut().zip(values) {
                        *w += a * value;
                    }
                }
            }
        };
        for (row, shared) in self.rows.iter().zip(shared) {
            add(&shared.columns, &row.point[0], &shared.x);
            add(&shared.columns, &row.point[1], &shared.y);
        }
        if let Some(control) = &self.control {
            for (by_point, values) in control.by_point.iter().zip(&control.shared) {
                add(&control.columns, by_point, values);
            }
        }
    }
}

impl<const D: usize> Default for PointRows<D> {
    fn default() -> Self {
        Self::new()
    }
}

/// Least square of a pivot of a point's normal matrix, scaled to unit diagonal. The matrix is a sum over some ten rows,
/// rounded to a few units of 1e-16: whether what is left below this is above zero is chance, and differs from one order
/// of the sum to the next.
pub const LEAST_PIVOT: f64 = 1e-14;

/// Inverse of `V` with its diagonal raised by the factor `1 + damping`; `None` when singular (rays that do not
/// meet). Scaled to unit diagonal first, so that the test does not depend on units.
pub fn inverse_of_damped(v: &Matrix3<f64>, damping: f64) -> Option<Matrix3<f64>> {
    let scale = v.diagonal().map(f64::sqrt);
    if scale.min() <= 0.0 || !scale.sum().is_finite() {
        return None;
    }
    let mut unit = Matrix3::from_fn(|i, j| v[(i, j)] / (scale[i] * scale[j]));
    for i in 0..3 {
        unit[(i, i)] += damping;
    }
    let factor = unit.cholesky()?;
    if factor.l_dirty().diagonal().min().powi(2) < LEAST_PIVOT {
        return None;
    }
    let inverse = factor.inverse();
    Some(Matrix3::from_fn(|i, j| inverse[(i, j)] / (scale[i] * scale[j])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal matrix of a point that two rays of this angle meet in, which differ by the rounding of `noise`.
    fn normal(angle: f64, noise: f64) -> Matrix3<f64> {
        let across = |angle: f64| Vector3::new(angle.cos(), 0.0, angle.sin());
        let up = Vector3::new(0.0, 1.0, 0.0);
        let rows = [across(0.3), across(0.3 + angle), up, up];
        let sum: Matrix3<f64> = rows.iter().map(|row| row * row.transpose()).sum();
        sum + Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, noise))
    }

    #[test]
    fn rays_whose_angle_is_rounding_do_not_meet() {
        let known = inverse_of_damped(&normal(1e-3, 0.0), 0.0).expect("rays that meet");
        approx::assert_relative_eq!(known * normal(1e-3, 0.0), Matrix3::identity(), epsilon = 1e-8);
        // On the one side of zero or on the other: the answer is the same.
        for noise in [0.0, 2e-16, 5e-16, 1e-15, -5e-16] {
            assert!(inverse_of_damped(&normal(1e-8, noise), 0.0).is_none(), "{noise:e}");
        }
        assert!(inverse_of_damped(&normal(1e-8, 0.0), 1e-7).is_some(), "damped");
    }
}
