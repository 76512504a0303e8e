//! What null models of one fit take for granted: linearised and factorised once.

use crate::adjust::AdjustError;
use crate::adjust::native::for_null_model::{NormalEquations, Pool, Structure, locked};
use crate::measure::Stages;
use crate::problem::{Problem, State};
use std::sync::{Arc, Mutex};

/// The free unknowns of a fit but the columns that are asked about, factorised.
pub(super) struct Base {
    pub normal: NormalEquations,
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
    /// That of a problem, made where the one at hand has other unknowns. `acting`: the effects that act at the state,
    /// candidates not.
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
        let normal = NormalEquations::at(problem, structure, state, pool);
        structure.stages = all_stages;
        let base = Arc::new(Base { normal: normal?, free });
        locked(&self.0).get_or_insert_with(|| base.clone());
        Ok(base)
    }
}
