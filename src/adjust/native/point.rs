//! All rows of one point: linearised, weighted, and ready to be eliminated.

use super::chain::{self, Prediction};
use super::frame::Frame;
use super::position;
use super::structure::Structure;
use crate::problem::{LOSS_SCALE, Loss, Problem, State};
use nalgebra::{Matrix3, Vector3};

/// `rho(s)` and its derivative; see [`Loss`].
pub fn rho(loss: Loss, s: f64) -> (f64, f64) {
    let a2 = LOSS_SCALE * LOSS_SCALE;
    match loss {
        Loss::None => (s, 1.0),
        Loss::Huber if s <= a2 => (s, 1.0),
        Loss::Huber => (2.0 * LOSS_SCALE * s.sqrt() - a2, LOSS_SCALE / s.sqrt()),
        Loss::Cauchy => (a2 * (s / a2).ln_1p(), 1.0 / (1.0 + s / a2)),
    }
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
    /// Shared derivatives, `2 x border` per image row.
    pub shared: Vec<f64>,
    /// `V = J_point' J_point`.
    pub v_matrix: Matrix3<f64>,
    /// `J_point' v`.
    pub gradient: Vector3<f64>,
    /// `W` of the border, one row of `border` per coordinate of the point.
    pub w_shared: [Vec<f64>; 3],
    /// Rows of control coordinates: derivatives by the border (3 x border), and misclosures.
    pub control: Option<ControlRows>,
    /// `sum rho`.
    pub chi_square: f64,
    /// Border columns that `shared` and `w_shared` hold after [`PointRows::keep_touched_columns`], ascending.
    pub touched: Vec<u32>,
    prediction: Prediction,
}

/// The coordinate observations of a control point.
pub struct ControlRows {
    /// 3 x border.
    pub shared: Vec<f64>,
    /// By the point.
    pub by_point: [[f64; 3]; 3],
    /// Weighted misclosures.
    pub v: [f64; 3],
}

impl<const D: usize> PointRows<D> {
    /// Empty buffers.
    pub fn new() -> Self {
        Self {
            rows: Vec::new(),
            shared: Vec::new(),
            v_matrix: Matrix3::zeros(),
            gradient: Vector3::zeros(),
            w_shared: Default::default(),
            control: None,
            chi_square: 0.0,
            touched: Vec::new(),
            prediction: Prediction::default(),
        }
    }

    /// Linearises point `j`. Errors: the image in which it cannot be projected.
    pub fn linearise(&mut self, at: &Prepared<'_>, j: usize) -> Result<(), usize> {
        let Prepared { problem, structure, state, frames } = at;
        let border = structure.border.len();
        let object = &state.points[j];
        self.rows.clear();
        self.shared.clear();
        self.chi_square = 0.0;
        self.v_matrix = Matrix3::zeros();
        self.gradient = Vector3::zeros();
        for w in &mut self.w_shared {
            w.clear();
            w.resize(border, 0.0);
        }
        for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let image = observation.image as usize;
            let p = &mut self.prediction;
            chain::predict(problem, &structure.stages, &frames[image], observation, object, p).ok_or(image)?;
            let misclosure = [observation.x - p.point[0], observation.y - p.point[1]];
            let normalised = misclosure.map(|m| m * observation.inverse_sigma);
            let s = normalised[0] * normalised[0] + normalised[1] * normalised[1];
            let (cost, slope) = rho(problem.loss, s);
            self.chi_square += cost;
            let weight = observation.inverse_sigma * slope.sqrt();

            let base = structure.rank[image] as usize * structure.dim;
            let start = self.shared.len();
            self.shared.resize(start + 2 * border, 0.0);
            let mut row = Row {
                rank: structure.rank[image],
                image: [[0.0; D]; 2],
                point: [[0.0; 3]; 2],
                v: misclosure.map(|m| m * weight),
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
                let shared = &mut self.shared[start + i * border..start + (i + 1) * border];
                for column in &structure.local[image] {
                    let d = match column.source {
                        k if k < 12 => p.d_camera[i][k as usize],
                        k => p.d_theta[i][k as usize - 12],
                    };
                    shared[column.column as usize] = d * weight * column.scale;
                }
                for k in 0..3 {
                    row.point[i][k] = p.d_point[i][k] * weight;
                }
                for a in 0..3 {
                    self.gradient[a] += row.point[i][a] * row.v[i];
                    for b in 0..3 {
                        self.v_matrix[(a, b)] += row.point[i][a] * row.point[i][b];
                    }
                    for (w, s) in self.w_shared[a].iter_mut().zip(shared.iter()) {
                        *w += row.point[i][a] * s;
                    }
                }
            }
            for k in 0..D {
                for a in 0..3 {
                    row.w[k][a] = row.image[0][k] * row.point[0][a] + row.image[1][k] * row.point[1][a];
                }
            }
            self.rows.push(row);
        }
        self.linearise_control(at, j)
    }

    /// Adds the observed coordinates of a control point.
    fn linearise_control(&mut self, at: &Prepared<'_>, j: usize) -> Result<(), usize> {
        let Prepared { problem, structure, state, .. } = at;
        self.control = None;
        let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) else {
            return Ok(());
        };
        let observation = &problem.control[c];
        let border = structure.border.len();
        let p = position::predict_surveyed(problem, &structure.stages, &state.theta, &state.points[j]).ok_or(0usize)?;
        let mut rows = ControlRows { shared: vec![0.0; 3 * border], by_point: [[0.0; 3]; 3], v: [0.0; 3] };
        for i in 0..3 {
            let weight = 1.0 / observation.sigma[i];
            rows.v[i] = (observation.position[i] - p.position[i]) * weight;
            self.chi_square += rows.v[i] * rows.v[i];
            let by_point: [f64; 3] = std::array::from_fn(|k| p.derivative[(i, 3 + k)] * weight);
            rows.by_point[i] = by_point;
            // Control effects have no image of their own: any image's list of global parameters serves.
            for column in structure.local.first().into_iter().flatten().filter(|column| column.source >= 12) {
                rows.shared[i * border + column.column as usize] =
                    p.d_theta[column.source as usize - 12][i] * weight * column.scale;
            }
            for a in 0..3 {
                self.gradient[a] += by_point[a] * rows.v[i];
                for b in 0..3 {
                    self.v_matrix[(a, b)] += by_point[a] * by_point[b];
                }
                for (w, s) in self.w_shared[a].iter_mut().zip(&rows.shared[i * border..(i + 1) * border]) {
                    *w += by_point[a] * s;
                }
            }
        }
        self.control = Some(rows);
        Ok(())
    }

    /// Leaves out the border columns that are zero in every row of the point; `touched` names those that stay.
    pub fn keep_touched_columns(&mut self) {
        let border = self.w_shared[0].len();
        let control = self.control.as_ref().map_or(&[][..], |control| &control.shared);
        self.touched.clear();
        for l in 0..border {
            let rows = self.shared.iter().skip(l).step_by(border).chain(control.iter().skip(l).step_by(border));
            if rows.into_iter().any(|value| *value != 0.0) {
                self.touched.push(l as u32);
            }
        }
        let keep = |values: &mut Vec<f64>, touched: &[u32]| {
            let lines = values.len() / border;
            let mut end = 0;
            for line in 0..lines {
                for column in touched {
                    values[end] = values[line * border + *column as usize];
                    end += 1;
                }
            }
            values.truncate(end);
        };
        keep(&mut self.shared, &self.touched);
        for w in &mut self.w_shared {
            keep(w, &self.touched);
        }
        if let Some(control) = &mut self.control {
            keep(&mut control.shared, &self.touched);
        }
    }

    /// `sum rho` of point `j` moved to `object`, at the state and images `next`. Errors: it cannot be projected.
    pub fn chi_square_moved(
        &mut self,
        at: &Prepared<'_>,
        next: &State,
        next_frames: &[Frame],
        j: usize,
        object: &Vector3<f64>,
    ) -> Result<f64, usize> {
        let Prepared { problem, structure, .. } = at;
        let mut sum = 0.0;
        for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let image = observation.image as usize;
            let point = chain::predict_point(
                problem,
                &structure.stages,
                &next_frames[image],
                observation,
                object,
                &mut self.prediction,
            )
            .ok_or(image)?;
            let (dx, dy) = (observation.x - point[0], observation.y - point[1]);
            let s = (dx * dx + dy * dy) * observation.inverse_sigma * observation.inverse_sigma;
            sum += rho(problem.loss, s).0;
        }
        if let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) {
            let observation = &problem.control[c];
            let p = position::predict_surveyed(problem, &structure.stages, &next.theta, object).ok_or(0usize)?;
            sum += (observation.position - p.position).component_div(&observation.sigma).norm_squared();
        }
        Ok(sum)
    }
}

impl<const D: usize> Default for PointRows<D> {
    fn default() -> Self {
        Self::new()
    }
}

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
    let inverse = unit.cholesky()?.inverse();
    Some(Matrix3::from_fn(|i, j| inverse[(i, j)] / (scale[i] * scale[j])))
}
