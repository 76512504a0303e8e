//! What a converged base model says about columns that it lacks: with `A` the base's columns and `B` the candidates',
//! `M = B'PB - B'PA (A'PA)^-1 A'PB` and `s = B'Pv - B'PA (A'PA)^-1 A'Pv`, from one linearisation and one factorisation for all
//! candidates together.
//!
//! Source: Rao's score (Lagrange multiplier) test; for nested linear models `s' M^-1 s` is the drop of `v'Pv` that a refit would bring.

use super::factor::{Pattern, ReducedBorder};
use super::point::{Curvature, Prepared};
use super::structure::Structure;
use super::{frames, linearise, lm, pool, project, structure};
use crate::adjust::{AdjustError, LinearSolver, NullDirection};
use crate::problem::{Problem, State};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Candidates' columns with the base taken out.
pub struct Profile<'a> {
    problem: &'a Problem,
    structure: Structure,
    reduced: ReducedBorder,
    /// Border columns of the base and of the candidates.
    base: Vec<usize>,
    candidates: Vec<usize>,
    /// `C_bb^-1 C_bc`, base x candidates, Jacobi-scaled.
    carried: DMatrix<f64>,
    /// `M`. Every candidate column is scaled to unit length before the base is taken out: the diagonal is the share that is left.
    pub information: DMatrix<f64>,
    /// `s` in the same scaling.
    pub score: DVector<f64>,
    /// Raw units per scaled unit of each candidate column.
    pub unit: Vec<f64>,
    /// Layout number of each candidate column.
    pub unknowns: Vec<usize>,
    /// Candidate columns that were projected row by row; the others' `M` and `s` come from the normal equations.
    pub refined: Vec<usize>,
    /// Per image: its part of `s` and of `M` over the columns `refined`, for a variance that does not trust the measurements of an image to
    /// be independent.
    pub by_image: Vec<(DVector<f64>, DMatrix<f64>)>,
    /// `v'Pv` of the base.
    pub chi_square: f64,
}

/// How a candidate unknown is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// Part of the base.
    Base,
    /// A candidate, projected row by row: keeps the digits of a column of which the base leaves little.
    Refined,
    /// A candidate of which the base leaves much (one of many: per image, per cell of the sensor): normal equations suffice.
    Coarse,
}

/// Linearises `problem` (base and candidates together) at `state` and takes the base out of the candidates' columns. Errors: the base is singular; a state that cannot be projected.
pub fn profile<'a>(
    problem: &'a Problem,
    state: &State,
    threads: usize,
    column_of: &dyn Fn(usize) -> Column,
) -> Result<Profile<'a>, AdjustError> {
    let structure = structure(problem)?;
    let frames = frames(problem, &structure, state)?;
    let at = Prepared { problem, structure: &structure, state, frames: &frames };
    let pool = pool(threads)?;
    let system = pool.install(|| linearise::linearise(&at, 0.0, Curvature::Weights))?;
    let pattern = Pattern::new(&structure, LinearSolver::Auto);
    let singular = |what: String| AdjustError::Singular {
        solver: super::NAME,
        directions: vec![NullDirection { components: vec![(what, 1.0)] }],
    };
    let reduced = ReducedBorder::new(&structure, &system, pattern.as_ref(), 0.0)
        .map_err(|_| singular("exterior orientation of some image".into()))?;
    let (candidates, base): (Vec<usize>, Vec<usize>) =
        (0..structure.border.len()).partition(|column| column_of(structure.border[*column]) != Column::Base);
    let part = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| reduced.matrix[(rows[i], columns[j])])
    };
    let base_factor =
        Cholesky::new(part(&base, &base)).ok_or_else(|| singular("shared unknowns of the base model".into()))?;
    let carried = base_factor.solve(&part(&base, &candidates));
    let mut profile = Profile {
        unit: candidates.iter().map(|c| reduced.scale[*c] * structure.border_scale[*c]).collect(),
        unknowns: candidates.iter().map(|c| structure.border[*c]).collect(),
        chi_square: system.chi_square,
        refined: (0..candidates.len())
            .filter(|c| column_of(structure.border[candidates[*c]]) == Column::Refined)
            .collect(),
        information: part(&candidates, &candidates) - part(&base, &candidates).transpose() * &carried,
        score: DVector::from_fn(candidates.len(), |c, _| {
            let taken: f64 = base.iter().enumerate().map(|(i, b)| carried[(i, c)] * reduced.rhs[*b]).sum();
            reduced.rhs[candidates[c]] - taken
        }),
        by_image: Vec::new(),
        problem,
        structure,
        reduced,
        base,
        candidates,
        carried,
    };
    let at = Prepared { problem, structure: &profile.structure, state, frames: &frames };
    let one = DVector::from_element(1, 1.0);
    let moves: Vec<(Vec<f64>, Vec<f64>)> =
        profile.refined.iter().map(|k| profile.moves_of(&profile.border_of(&[*k], &one))).collect();
    profile.by_image = pool.install(|| project::project(&at, &moves));
    let count = profile.refined.len();
    let (mut score, mut information) = (DVector::zeros(count), DMatrix::zeros(count, count));
    for (s, m) in &profile.by_image {
        score += s;
        information += m;
    }
    for (i, a) in profile.refined.iter().enumerate() {
        profile.score[*a] = score[i];
        for (j, b) in profile.refined.iter().enumerate() {
            profile.information[(*a, *b)] = information[(i, j)];
        }
    }
    Ok(profile)
}

impl Profile<'_> {
    /// Image unknowns and border (scaled unknowns) that go with a Jacobi-scaled border.
    fn moves_of(&self, border: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
        let unscaled = border.iter().zip(&self.reduced.scale).map(|(x, s)| x * s).collect();
        (self.reduced.images_of(border, false), unscaled)
    }

    /// The border (Jacobi-scaled) when the candidate columns `columns` take the values `values` and the base follows.
    fn border_of(&self, columns: &[usize], values: &DVector<f64>) -> DVector<f64> {
        let mut border = DVector::zeros(self.reduced.scale.len());
        for (k, column) in columns.iter().enumerate() {
            border[self.candidates[*column]] += values[k];
            for (i, base) in self.base.iter().enumerate() {
                border[*base] -= self.carried[(i, *column)] * values[k];
            }
        }
        border
    }

    /// Where cameras, effects and poses of the base go (to first order) when the candidate columns `columns` take the values `values` (scaled
    /// units): the state `state` moved there. Points stay; they follow from the images.
    pub fn moved(&self, state: &State, columns: &[usize], values: &DVector<f64>) -> State {
        let (images, border) = self.moves_of(&self.border_of(columns, values));
        let mut moved = state.clone();
        lm::move_images_and_border(self.problem, &self.structure, &mut moved, &images, &border);
        moved
    }
}
