//! The null model: a converged fit, factorised once, and what it says about any columns that it lacks.
//!
//! With `A` the design matrix of the base (cameras, poses, points, the effects that are taken for granted), `P` the
//! weights and `v` the residuals, columns `C` (what they would add to the measurements) have
//!
//! ```text
//! Q = P - P A (A'PA)^-1 A'P        what the base does not absorb
//! s = C'Q v                        score
//! M = C'Q C                        information
//! ```
//!
//! and every question about them is linear algebra of the small system `(s, M)`: for linear models `s'M^-1 s` is the
//! drop of `v'Pv` that a refit with the columns brings, `M^-1 s` their estimate, `M^-1` its covariance for unit weight.
//! Source: Rao's score test.
//!
//! A pass over the points takes each of them out of all columns (`rows`), one factorisation takes cameras and poses
//! out. A second pass projects chosen columns row by row ([`NullModel::parts`]): what is left of a column of which the
//! base takes 99.9 % keeps its digits there, and the parts of `s` and `M` by image and by part of the sensor come with
//! it.
//!
//! Unknowns, normal equations and rows are those of the native solver ([`crate::adjust::native`]).

mod base;
mod batch;
mod cells;
mod columns;
mod dense_columns;
mod families;
mod image_cells;
mod measurements;
mod parts;
mod products;
mod propagation;
mod rows;
mod sample;
mod score_system;
mod source;
mod sums;
mod waves;

pub use base::SharedBase;
pub use columns::{Columns, Coordinate, Entries, Measured, NoColumns};
pub use image_cells::{GROUPINGS, ImageCell, ImageCells};
pub use measurements::{Local, measurements_at};
pub use parts::{Part, Parts};
pub use sample::{MOST_IMAGES, is_column};
pub use score_system::ScoreSystem;

use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::{Pool, Structure, move_images_and_border, structure_of};
use crate::effects::{Role, Scope};
use crate::measure::{self, Frame, Stages};
use crate::problem::{Problem, State};
use base::Base;
use nalgebra::Vector3;
use source::{EffectEntry, Source};
use std::ops::Range;
use std::sync::Arc;

/// A converged fit, factorised. See the [module](self).
pub struct NullModel {
    problem: Problem,
    state: State,
    structure: Structure,
    /// The effects that act at the state.
    acting: Stages,
    frames: Vec<Frame>,
    base: Arc<Base>,
    pool: Pool,
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
    /// Linearises and factorises at `state`. The free unknowns of `problem` are the base; `columns` are unknowns
    /// (numbers of the layout) that are held in it: parameters of effects, whatever their value, and camera parameters.
    ///
    /// # Errors
    /// A singular base; a state that cannot be projected.
    pub fn new(problem: Problem, state: State, columns: Vec<usize>, threads: usize) -> Result<Self, AdjustError> {
        Self::sharing(&SharedBase::default(), problem, state, columns, threads)
    }

    /// The same with the base that other null models of one fit have made, where it is of the same unknowns. `state` is
    /// the fit's, and `problem` differs from its by what is free and by effects that do not act yet.
    ///
    /// # Errors
    /// See [`Self::new`].
    pub fn sharing(
        base: &SharedBase,
        problem: Problem,
        state: State,
        columns: Vec<usize>,
        threads: usize,
    ) -> Result<Self, AdjustError> {
        let mut structure = structure_of(&problem)?;
        // Candidates at their nominal values change nothing: the base does without them.
        let acting = acting(&problem, &state);
        let acting = structure.stages.only(&problem, |effect| acting[effect]);
        let pool = Pool::new(threads)?;
        let base = base.of(&problem, &mut structure, &state, &acting, &pool)?;
        let frames = measure::frames(&problem, &structure.stages, &state)?;
        let mut model = Self {
            acting,
            frames,
            base,
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
    pub fn interior(&self, image: usize) -> &[f64; 12] {
        &self.frames[image].interior
    }

    /// `v'Pv`.
    pub fn chi_square(&self) -> f64 {
        self.base.normal.chi_square()
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
    pub(crate) fn pool(&self) -> &Pool {
        &self.pool
    }

    fn place_columns(&mut self) {
        let layout = self.problem.layout();
        let local = |unknown: usize| {
            let Some(t) = unknown.checked_sub(layout.theta(0)) else { return false };
            let entry = &self.problem.theta[t];
            let instance = &self.problem.effects[entry.effect as usize];
            instance.slots[entry.parameter as usize].0 == Scope::Image
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
            cells: None,
        }
    }

    /// Score and information of the columns of effects, then of the dense and the local columns of `extra`.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn test(&self, extra: &dyn Columns) -> Result<ScoreSystem, AdjustError> {
        self.test_apart(extra, &[])
    }

    /// The same with `families` of columns of effects beside those of `extra`: of two families the information is not a
    /// number.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn test_apart(&self, extra: &dyn Columns, families: &[Range<usize>]) -> Result<ScoreSystem, AdjustError> {
        self.pool.install(|| self.score_system(extra, families, false))
    }

    /// Score and information of each column alone: `information` is a column vector. For scans of many shapes.
    ///
    /// # Errors
    /// A state that cannot be projected.
    pub fn test_each(&self, extra: &dyn Columns) -> Result<ScoreSystem, AdjustError> {
        self.pool.install(|| self.score_system(extra, &[], true))
    }

    /// The state when the columns of effects change by `change` (scaled units) and the base follows, to first order.
    pub fn moved(&self, system: &ScoreSystem, change: &[f64]) -> State {
        let n = self.structure.images * self.structure.dim;
        let mut base = vec![0.0; system.moves.nrows()];
        for (c, change) in change.iter().enumerate().filter(|(_, change)| **change != 0.0) {
            products::add(&mut base, *change, system.moves.col_as_slice(c));
        }
        let mut state = self.state.clone();
        let turn = move_images_and_border(&self.problem, &self.structure, &mut state, &base[..n], &base[n..]);
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
