//! What null models of one fit take for granted: linearised and factorised once.

use crate::adjust::native::factor::Factor;
use crate::adjust::native::in_order::locked;
use crate::adjust::native::loss::Curvature;
use crate::adjust::native::pattern::Pattern;
use crate::adjust::native::point::Prepared;
use crate::adjust::native::pool::Pool;
use crate::adjust::native::rank::factor_of_full_rank;
use crate::adjust::native::spare::Spare;
use crate::adjust::native::structure::Structure;
use crate::adjust::native::system::System;
use crate::adjust::native::{frames, linearise};
use crate::adjust::{AdjustError, LinearSolver};
use crate::measure::Stages;
use crate::problem::{Problem, State};
use std::sync::{Arc, Mutex};

/// The free unknowns of a fit but the columns that are asked about, factorised.
pub(super) struct Base {
    pub system: System,
    pub factor: Factor,
    free: Free,
}

/// Which shared unknowns are free, and those of effects; poses and points are the same in all problems of a fit.
#[derive(PartialEq)]
struct Free {
    cameras: Vec<[bool; 12]>,
    effects: Vec<usize>,
}

impl Free {
    fn of(problem: &Problem) -> Self {
        let effects = (0..problem.theta.len()).filter(|t| problem.theta[*t].free).collect();
        Self { cameras: problem.camera_free.clone(), effects }
    }
}

/// The base of the null models of one fit, once there was one.
#[derive(Clone, Default)]
pub struct SharedBase(Arc<Mutex<Option<Arc<Base>>>>);

impl SharedBase {
    /// That of a problem, made where the one at hand has other unknowns. `acting`: the effects that act at the state, candidates not.
    pub(super) fn of(
        &self,
        problem: &Problem,
        structure: &mut Structure,
        state: &State,
        acting: &Stages,
        pool: &Pool,
    ) -> Result<Arc<Base>, AdjustError> {
        let free = Free::of(problem);
        let at_hand = locked(&self.0).clone();
        if let Some(base) = at_hand.filter(|base| base.free == free) {
            return Ok(base);
        }
        let all_stages = std::mem::replace(&mut structure.stages, acting.clone());
        let frames = frames(problem, structure, state)?;
        let at = Prepared { problem, structure, state, frames: &frames };
        let system = pool.install(|| linearise::linearise(&at, 0.0, Curvature::Weights, &Spare::default()))?;
        structure.stages = all_stages;
        let pattern = Pattern::of(structure, LinearSolver::Auto);
        let factor = factor_of_full_rank(problem, structure, &system, pattern.as_deref())?;
        let base = Arc::new(Base { system, factor, free });
        locked(&self.0).get_or_insert_with(|| base.clone());
        Ok(base)
    }
}
