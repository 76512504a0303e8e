//! The null model: a converged fit, factorised once, and what it says about any columns that it lacks.
//!
//! With `A` the design matrix of the base (cameras, poses, points, the effects that are taken for granted), `P` the weights and `v` the
//! residuals, columns `C` (what they would add to the measurements) have
//!
//! ```text
//! Q = P - P A (A'PA)^-1 A'P        what the base does not absorb
//! s = C'Q v                        score
//! M = C'Q C                        information
//! ```
//!
//! and every question about them is linear algebra of the small system `(s, M)`: for linear models `s'M^-1 s` is the drop of `v'Pv` that a
//! refit with the columns brings, `M^-1 s` their estimate, `M^-1` its covariance for unit weight. Source: Rao's score test.
//!
//! A pass over the points takes each of them out of all columns (`rows`), one factorisation takes cameras and poses out. A second pass
//! projects chosen columns row by row ([`NullModel::parts`]): what is left of a column of which the base takes 99.9 % keeps its digits there,
//! and the parts of `s` and `M` by image come with it.

mod batch;
mod columns;
mod dense_columns;
mod image_cells;
mod measurements;
mod parts;
mod products;
mod rows;
mod source;
mod sums;

pub use columns::{Columns, Coordinate, Entries, Measured, NoColumns};
pub use image_cells::{GROUPINGS, ImageCell, ImageCells};
pub use measurements::{Local, measurements_at};
pub use parts::Parts;

use super::factor::Factor;
use super::linearise;
use super::loss::Curvature;
use super::pattern::Pattern;
use super::point::Prepared;
use super::rank::factor_of_full_rank;
use super::spare::Spare;
use super::structure::Structure;
use super::system::System;
use super::{frames as frames_of, pool, step, structure as structure_of};
use crate::adjust::{AdjustError, LinearSolver};
use crate::camera::Interior;
use crate::effects::{Role, Scope};
use crate::measure::{Frame, Stages};
use crate::problem::{Problem, State};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, Scale};
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::ThreadPool;
use rayon::prelude::*;
use source::{EffectEntry, Source};
use std::sync::Arc;
use sums::Sums;

/// Effects of more parameters than this are taken for fields of which a measurement sees a few (splines over the sensor).
const MOST_DENSE_PARAMETERS: usize = 64;
/// Columns of a product that one task computes.
const TASK_COLUMNS: usize = 64;

/// Score and information of columns for unit weight; columns of effects in scaled units.
#[derive(Debug, Clone)]
pub struct ScoreSystem {
    /// `s`.
    pub score: DVector<f64>,
    /// `M`; its diagonal alone as a column vector where that was asked for. Shared: of thousands of columns it is the largest that there is.
    pub information: Arc<DMatrix<f64>>,
    /// Squared length of each column before anything is taken out.
    pub length: Vec<f64>,
    /// Sum over the points of the squared part that each has of a score.
    pub squares: Vec<f64>,
    /// Information of each column while cameras and poses are held: what `squares` has in the mean where points are independent.
    pub held: Vec<f64>,
    /// How the base's unknowns follow one unit of each column of an effect: images by rank, then border (scaled units), column by column.
    moves: Mat<f64>,
}

/// A converged fit, factorised. See the [module](self).
pub struct NullModel {
    problem: Problem,
    state: State,
    structure: Structure,
    /// The effects that act at the state.
    acting: Stages,
    frames: Vec<Frame>,
    system: System,
    factor: Factor,
    pool: ThreadPool,
    /// Unknowns (layout) of the columns of effects, in the caller's order.
    columns: Vec<usize>,
    units: Vec<f64>,
    /// Position of each among the dense or the local columns.
    places: Vec<ColumnPlace>,
    entries: Vec<Vec<EffectEntry>>,
    effect_columns: [usize; 2],
}

#[derive(Debug, Clone, Copy)]
enum ColumnPlace {
    Dense(usize),
    Local(usize),
}

impl NullModel {
    /// Linearises and factorises at `state`. The free unknowns of `problem` are the base; `columns` are unknowns (numbers of the layout) that
    /// are held in it: parameters of effects, whatever their value, and camera parameters.
    ///
    /// # Errors
    /// A singular base; a state that cannot be projected.
    pub fn new(problem: Problem, state: State, columns: Vec<usize>, threads: usize) -> Result<Self, AdjustError> {
        let mut structure = structure_of(&problem)?;
        // Candidates at their nominal values change nothing: the base does without them.
        let acting = acting(&problem, &state);
        let acting = structure.stages.only(&problem, |effect| acting[effect]);
        let all_stages = std::mem::replace(&mut structure.stages, acting.clone());
        let frames = frames_of(&problem, &structure, &state)?;
        let at = Prepared { problem: &problem, structure: &structure, state: &state, frames: &frames };
        let pool = pool(threads)?;
        let system = pool.install(|| linearise::linearise(&at, 0.0, Curvature::Weights, &Spare::default()))?;
        structure.stages = all_stages;
        let frames = frames_of(&problem, &structure, &state)?;
        let pattern = Pattern::of(&structure, LinearSolver::Auto);
        let factor = factor_of_full_rank(&problem, &structure, &system, pattern.as_deref())?;
        let mut model = Self {
            acting,
            frames,
            system,
            factor,
            pool,
            units: columns.iter().map(|unknown| scale_of(&problem, *unknown)).collect(),
            columns,
            places: Vec::new(),
            entries: Vec::new(),
            effect_columns: [0; 2],
            structure,
            problem,
            state,
        };
        model.place_columns();
        Ok(model)
    }

    /// The problem: base and columns.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The state that it was linearised at.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Interior orientation of an image, after the effects on it.
    pub fn interior(&self, image: usize) -> &Interior {
        &self.frames[image].interior
    }

    /// `v'Pv`.
    pub fn chi_square(&self) -> f64 {
        self.system.chi_square
    }

    /// Unknown (number of the layout) of a column of an effect.
    pub fn unknown(&self, column: usize) -> usize {
        self.columns[column]
    }

    /// Raw unit per scaled unit of the columns of effects.
    pub fn units(&self) -> &[f64] {
        &self.units
    }

    /// The threads that it uses.
    pub fn pool(&self) -> &ThreadPool {
        &self.pool
    }

    fn place_columns(&mut self) {
        let layout = self.problem.layout();
        let local = |unknown: usize| {
            let Some(t) = unknown.checked_sub(layout.theta(0)) else { return false };
            let entry = &self.problem.theta[t];
            let instance = &self.problem.effects[entry.effect as usize];
            instance.slots[entry.parameter as usize].0 == Scope::Image || instance.slots.len() > MOST_DENSE_PARAMETERS
        };
        let mut counts = [0; 2];
        let mut place_of = vec![None; layout.pose(0, 0)];
        for unknown in &self.columns {
            let place = if local(*unknown) {
                counts[1] += 1;
                ColumnPlace::Local(counts[1] - 1)
            } else {
                counts[0] += 1;
                ColumnPlace::Dense(counts[0] - 1)
            };
            self.places.push(place);
            place_of[*unknown] = Some(place);
        }
        self.effect_columns = counts;
        let entry = |source: usize, unknown: usize| {
            let (column, local) = match place_of[unknown]? {
                ColumnPlace::Dense(column) => (column as u32, false),
                ColumnPlace::Local(column) => (column as u32, true),
            };
            Some(EffectEntry { source: source as u32, column, local, scale: scale_of(&self.problem, unknown) })
        };
        let of_image = |image: usize| -> Vec<EffectEntry> {
            let camera = self.problem.image_contexts[image].camera as usize;
            let cameras = (0..12).filter_map(|k| entry(k, layout.camera(camera, k)));
            let thetas = self.structure.stages.theta_indices(&self.problem, image).into_iter().enumerate();
            cameras.chain(thetas.filter_map(|(p, t)| entry(12 + p, layout.theta(t)))).collect()
        };
        self.entries = (0..layout.images).map(of_image).collect();
    }

    /// Effects that act, and those that have a column at one of some places.
    fn stages_of(&self, wanted: impl Fn(&ColumnPlace) -> bool) -> Stages {
        let theta = self.problem.layout().theta(0);
        let columns = self.places.iter().zip(&self.columns).filter(|(place, _)| wanted(place));
        let mut kept = acting(&self.problem, &self.state);
        for t in columns.filter_map(|(_, unknown)| unknown.checked_sub(theta)) {
            kept[self.problem.theta[t].effect as usize] = true;
        }
        self.structure.stages.only(&self.problem, |effect| kept[effect])
    }

    fn source<'s>(&'s self, extra: &'s dyn Columns) -> Source<'s> {
        Source {
            problem: &self.problem,
            state: &self.state,
            structure: &self.structure,
            stages: &self.structure.stages,
            frames: &self.frames,
            effects: &self.entries,
            effect_columns: self.effect_columns,
            extra,
            carry: None,
        }
    }

    /// Score and information of the columns of effects, then of the dense and the local columns of `extra`.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn test(&self, extra: &dyn Columns) -> Result<ScoreSystem, AdjustError> {
        self.pool.install(|| self.sums(extra, false))
    }

    /// Score and information of each column alone: `information` is a column vector. For scans of many shapes.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn test_each(&self, extra: &dyn Columns) -> Result<ScoreSystem, AdjustError> {
        self.pool.install(|| self.sums(extra, true))
    }

    fn sums(&self, extra: &dyn Columns, each_alone: bool) -> Result<ScoreSystem, AdjustError> {
        let source = self.source(extra);
        let mut sums = Sums::of(&source, each_alone)?;
        let border = self.structure.border.len();
        let [effects_dense, effects_local] = self.effect_columns;
        let dense = (0..extra.dense()).map(|k| ColumnPlace::Dense(effects_dense + k));
        let local = (0..extra.local()).map(|k| ColumnPlace::Local(effects_local + k));
        let places: Vec<ColumnPlace> = self.places.iter().copied().chain(dense).chain(local).collect();
        let (q, n, d, l) = (places.len(), self.structure.images * self.structure.dim, sums.dense, sums.local);
        // Columns of the sums that the caller's are.
        let own = |place: ColumnPlace| match place {
            ColumnPlace::Dense(k) => border + k,
            ColumnPlace::Local(k) => d + k,
        };
        let with_base = Mat::from_fn(n + border, q, |i, c| match (i < n, own(places[c])) {
            (true, k) if k < d => sums.image_dense[i * d + k],
            (true, k) => sums.image_local(i, self.structure.dim, k - d),
            (false, k) if k < d => sums.dense_dense[(i - n) * d + k],
            (false, k) => sums.local_dense[(k - d) * d + i - n],
        });
        // Of hundreds of images and thousands of columns these are the largest of all.
        sums.forget_images();
        let among = |a: usize, b: usize| match (a.min(b), a.max(b)) {
            (a, b) if b < d => sums.dense_dense[a * d + b],
            (a, b) if a < d => sums.local_dense[(b - d) * d + a],
            (a, b) if each_alone => {
                if a == b {
                    sums.local_local[a - d]
                } else {
                    0.0
                }
            }
            (a, b) => sums.local_local[(a - d) * l + b - d],
        };
        let own_places = || places.iter().map(|place| own(*place));
        let length =
            own_places().map(|k| if k < d { sums.length_dense[k] } else { sums.length_local[k - d] }).collect();
        let squares =
            own_places().map(|k| if k < d { sums.squares_dense[k] } else { sums.squares_local[k - d] }).collect();
        let held: Vec<f64> = own_places().map(|k| among(k, k)).collect();
        let mut information = if each_alone {
            DMatrix::from_column_slice(q, 1, &held)
        } else {
            DMatrix::from_fn(q, q, |i, j| if i < j { 0.0 } else { among(own(places[i]), own(places[j])) })
        };
        let scores = own_places().map(|k| if k < d { sums.score_dense[k] } else { sums.score_local[k - d] });
        let mut score = DVector::from_iterator(q, scores);
        drop(sums);
        let solved = self.factor.solve_columns(&with_base);
        let rhs = |i: usize| if i < n { self.system.rhs_images[i] } else { self.system.rhs_border[i - n] };
        for (c, score) in score.iter_mut().enumerate() {
            *score -= solved.col_as_slice(c).iter().enumerate().map(|(i, x)| x * rhs(i)).sum::<f64>();
        }
        if each_alone {
            for (c, information) in information.iter_mut().enumerate() {
                *information -=
                    with_base.col_as_slice(c).iter().zip(solved.col_as_slice(c)).map(|(a, b)| a * b).sum::<f64>();
            }
        } else {
            take_product(&mut information, &with_base, &solved);
            information.fill_upper_triangle_with_lower_triangle();
        }
        drop(with_base);
        // A copy, since what is cut off would stay in memory.
        let moves = Scale(-1.0) * solved.subcols(0, self.columns.len());
        Ok(ScoreSystem { score, information: Arc::new(information), length, squares, held, moves })
    }

    /// The state when the columns of effects change by `change` (scaled units) and the base follows, to first order.
    pub fn moved(&self, system: &ScoreSystem, change: &[f64]) -> State {
        let n = self.structure.images * self.structure.dim;
        let mut base = vec![0.0; system.moves.nrows()];
        for (c, change) in change.iter().enumerate().filter(|(_, change)| **change != 0.0) {
            products::add(&mut base, *change, system.moves.col_as_slice(c));
        }
        let mut state = self.state.clone();
        let turn = step::move_images_and_border(&self.problem, &self.structure, &mut state, &base[..n], &base[n..]);
        let layout = self.problem.layout();
        for ((unknown, unit), change) in self.columns.iter().zip(&self.units).zip(change) {
            match unknown.checked_sub(layout.theta(0)) {
                Some(t) => state.theta[t] += change * unit,
                None => state.interiors[unknown / 12][unknown % 12] += change * unit,
            }
        }
        for point in &mut state.points {
            *point = turn.position(point, &Vector3::zeros());
        }
        state
    }
}

/// Which effects act: those of which a parameter is free or away from its nominal value.
fn acting(problem: &Problem, state: &State) -> Vec<bool> {
    let mut acting = vec![false; problem.effects.len()];
    for (entry, value) in problem.theta.iter().zip(&state.theta) {
        let parameter =
            &problem.effects[entry.effect as usize].effect.descriptor().parameters[entry.parameter as usize];
        let linear = matches!(parameter.role, Role::Estimated | Role::Random(_));
        acting[entry.effect as usize] |= entry.free || linear && *value != parameter.nominal;
    }
    acting
}

/// Raw unit per scaled unit of an unknown of cameras or effects.
fn scale_of(problem: &Problem, unknown: usize) -> f64 {
    match unknown.checked_sub(problem.layout().theta(0)) {
        Some(t) => problem.theta[t].scale,
        None => problem.camera_scales[unknown / 12][unknown % 12],
    }
}

/// Takes `a'b` from the lower triangle of `matrix`; the same sums for every number of threads.
fn take_product(matrix: &mut DMatrix<f64>, a: &Mat<f64>, b: &Mat<f64>) {
    let q = a.ncols();
    matrix.as_mut_slice().par_chunks_mut((TASK_COLUMNS * q).max(1)).enumerate().for_each(|(task, columns)| {
        let (first, count) = (task * TASK_COLUMNS, columns.len() / q.max(1));
        let columns = faer::MatMut::from_column_major_slice_mut(columns, q, count).subrows_mut(first, q - first);
        let (left, right) = (a.subcols(first, q - first), b.subcols(first, count));
        matmul(columns, Accum::Add, left.transpose(), right, -1.0, Par::Seq);
    });
}
