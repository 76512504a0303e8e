//! Where the reduced system has image blocks, analysed once for all factorisations.

use super::structure::Structure;
use crate::adjust::LinearSolver;
use faer::Side;
use faer::sparse::SymbolicSparseColMat;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::linalg::solvers::SymbolicLlt;
use std::sync::{Arc, Mutex, PoisonError};

/// Up to this many image unknowns the dense factorisation is as fast as the sparse one even on a corridor, the more as
/// it leaves out the rows that a column does not reach.
const DENSE_UNKNOWNS: usize = 2000;

/// Above that, the envelope of the dense factorisation may hold so many times the numbers of the sparse factor. At 2.2
/// times as many (a corridor of a thousand images) both take the same time on one thread, as the sparse matrix is
/// permuted and put together in small pieces first; and the sparse factorisation stays on one thread.
const DENSE_NUMBERS: f64 = 2.5;

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
    /// Analyses the structure, unless the last one analysed was alike. `None` where the dense factorisation is to be
    /// used.
    pub fn of(structure: &Structure, solver: LinearSolver) -> Option<Arc<Self>> {
        let n = structure.images * structure.dim;
        let sparse = match solver {
            LinearSolver::Dense => false,
            LinearSolver::Sparse => true,
            LinearSolver::Auto | LinearSolver::Iterative => {
                n > DENSE_UNKNOWNS && !envelope_is_narrow(&structure.row_start, &structure.slot_column)
            }
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

/// Does the envelope of a graph of images (its lower triangle, column by column from the diagonal on) hold no more than
/// [`DENSE_NUMBERS`] times what a good order of them leaves to a sparse factor?
fn envelope_is_narrow(row_start: &[usize], slot_column: &[u32]) -> bool {
    let images = row_start.len() - 1;
    let mut end = 0;
    let mut envelope = 0;
    for a in 0..images {
        end = end.max(slot_column[row_start[a + 1] - 1] as usize + 1);
        envelope += end - a;
    }
    let rows = slot_column.iter().map(|b| *b as usize).collect();
    let graph = SymbolicSparseColMat::new_checked(images, images, row_start.to_vec(), None, rows);
    let supernodal_flop_ratio_threshold = SupernodalThreshold::FORCE_SIMPLICIAL;
    let parameters = CholeskySymbolicParams { supernodal_flop_ratio_threshold, ..Default::default() };
    factorize_symbolic_cholesky(graph.as_ref(), Side::Lower, SymmetricOrdering::Amd, parameters)
        .is_ok_and(|sparse| envelope as f64 <= DENSE_NUMBERS * sparse.len_val() as f64)
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

    /// Of each image: those after it that it shares points with, by rising number.
    fn is_narrow(images: usize, neighbours: impl Fn(usize) -> Vec<usize>) -> bool {
        let (mut row_start, mut slot_column) = (vec![0], Vec::new());
        for a in 0..images {
            let reached = neighbours(a).into_iter().filter(|b| *b < images);
            slot_column.extend(std::iter::once(a).chain(reached).map(|b| b as u32));
            row_start.push(slot_column.len());
        }
        envelope_is_narrow(&row_start, &slot_column)
    }

    #[test]
    fn an_envelope_is_narrow_where_no_order_of_the_images_leaves_much_less() {
        const IMAGES: usize = 600;
        // A band fills its envelope, and so does an area of strips nearly: whichever way it is cut, the cut is as long
        // as a strip.
        assert!(is_narrow(IMAGES, |a| (a + 1..a + 4).collect()));
        const STRIP: usize = 20;
        let neighbours = |a: usize| {
            let beside = [a + 1].into_iter().filter(|b| b % STRIP != 0);
            beside.chain([a + STRIP]).collect::<Vec<_>>()
        };
        assert!(is_narrow(IMAGES, neighbours));
        // Two corridors that stand one behind the other in the list and share points along their whole length: taken in
        // turns they are a band.
        assert!(!is_narrow(IMAGES, |a| if a < IMAGES / 2 { vec![a + 1, a + IMAGES / 2] } else { vec![a + 1] }));
    }
}
