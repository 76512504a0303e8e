//! Where the reduced system has image blocks, analysed once for all factorisations.

use super::structure::Structure;
use crate::adjust::LinearSolver;
use faer::Side;
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::solvers::SymbolicLlt;
use std::sync::{Arc, Mutex, PoisonError};

/// Up to this many image unknowns the dense factorisation is as fast as the sparse one even on a corridor, the more as it leaves out the rows
/// that a column does not reach.
const DENSE_UNKNOWNS: usize = 2000;

/// Sparsity pattern of the image blocks (lower triangle, compressed columns) and its symbolic factorisation.
pub struct Pattern {
    dim: usize,
    row_start: Vec<usize>,
    slot_column: Vec<u32>,
    pub symbolic: SymbolicSparseColMat<usize>,
    pub factorisation: SymbolicLlt<usize>,
}

/// That of the last problem: a diagnosis refits one block many times, and which images share points does not change.
static LAST: Mutex<Option<Arc<Pattern>>> = Mutex::new(None);

impl Pattern {
    /// Analyses the structure, unless the last one analysed was alike. `None` where the dense factorisation is to be used.
    pub fn of(structure: &Structure, solver: LinearSolver) -> Option<Arc<Self>> {
        let n = structure.images * structure.dim;
        let sparse = match solver {
            LinearSolver::Dense => false,
            LinearSolver::Sparse => true,
            LinearSolver::Auto | LinearSolver::Iterative => n > DENSE_UNKNOWNS,
        };
        if !sparse {
            return None;
        }
        let last = LAST.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(known) = last.filter(|known| known.is_of(structure)) {
            return Some(known);
        }
        let new = Arc::new(Self::analyse(structure)?);
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = Some(new.clone());
        Some(new)
    }

    fn is_of(&self, Structure { dim, row_start, slot_column, .. }: &Structure) -> bool {
        (self.dim, &self.row_start, &self.slot_column) == (*dim, row_start, slot_column)
    }

    fn analyse(structure: &Structure) -> Option<Self> {
        let (dim, n) = (structure.dim, structure.images * structure.dim);
        let mut starts = Vec::with_capacity(n + 1);
        let mut rows = Vec::new();
        for a in 0..structure.images {
            for k in 0..dim {
                starts.push(rows.len());
                for slot in structure.row_start[a]..structure.row_start[a + 1] {
                    let b = structure.slot_column[slot] as usize;
                    let first = if b == a { k } else { 0 };
                    rows.extend((first..dim).map(|l| b * dim + l));
                }
            }
        }
        starts.push(rows.len());
        let symbolic = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
        let factorisation = SymbolicLlt::try_new(symbolic.as_ref(), Side::Lower).ok()?;
        let (row_start, slot_column) = (structure.row_start.clone(), structure.slot_column.clone());
        Some(Self { dim, row_start, slot_column, symbolic, factorisation })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::find;
    use crate::model::{EffectRef, EffectTerm, Model};
    use crate::problem::Problem;
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    fn structure(preset: &str, effects: &[&str]) -> Structure {
        let scenario = Scenario::preset(preset, &BTreeMap::from([("points".into(), 1000.0)])).expect("a preset");
        let block = simulate(&scenario, 1).expect("a block").block;
        let term = |id: &&str| EffectTerm {
            effect: EffectRef::Builtin(find(id).expect("an effect")),
            values: Default::default(),
            held: Vec::new(),
        };
        let effects = effects.iter().map(term).collect();
        let model = Model { effects, ..Model::default() };
        Structure::new(&Problem::new(&block, &model).expect("a problem"))
    }

    #[test]
    fn a_pattern_serves_those_that_are_alike_alone() {
        let [plain, shared] = [&[][..], &["focal-time"]].map(|effects| structure("closerange", effects));
        let [other, of_images] =
            [("dike", &[][..]), ("closerange", &["focal-image"])].map(|(preset, effects)| structure(preset, effects));
        let pattern = Pattern::of(&plain, LinearSolver::Sparse).expect("a sparse one");
        assert!(pattern.is_of(&plain) && pattern.is_of(&shared), "an effect of the border changes nothing");
        for structure in [&other, &of_images] {
            assert!(!pattern.is_of(structure));
            assert!(Pattern::of(structure, LinearSolver::Sparse).expect("a sparse one").is_of(structure));
        }
        assert!(Pattern::of(&plain, LinearSolver::Dense).is_none());
    }
}
