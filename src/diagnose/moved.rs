//! How far a diagnosis moved the points: measured between two adjustments, the one before anything was added and the
//! one that is handed on. (What [`super::impact`] says is of one effect, to first order and at the weights of one
//! model.)

use crate::block::{Block, PointId, Role};
use crate::evaluate::{Similarity, similarity};
use crate::problem::PointSource;
use crate::run::fit::Fit;
use crate::run::{self, RunError};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which points moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Check points.
    Check,
    /// Control points of a block that has no check points.
    Control,
    /// Tie points of a block that has neither.
    Tie,
}

/// Distances between the points of two adjustments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// RMS in space, m.
    pub rms_m: f64,
    /// RMS in height alone, m.
    pub height_m: f64,
    /// Number of points.
    pub points: usize,
    /// Their kind.
    pub of: Kind,
    /// Row of the ledger whose adjustment has none of the effects.
    #[serde(default)]
    pub step: usize,
}

/// Distances between the points of two fits of a block; `None` where they have no points in common.
///
/// # Errors
/// A fit whose model cannot project its points.
pub fn between(block: &Block, base: &Fit, last: &Fit) -> Result<Option<Moved>, RunError> {
    for (role, of) in [(Role::Check, Kind::Check), (Role::Control, Kind::Control)] {
        let [before, after] = [surveyed(block, base, role)?, surveyed(block, last, role)?];
        if let Some(moved) = distances(&before, &after, &Similarity::identity(), of) {
            return Ok(Some(moved));
        }
    }
    let [before, after] = [ties(base), ties(last)];
    // A free network may lie anywhere: its points are compared after a similarity.
    let alignment = match last.problem.datum_defect {
        0 => Some(Similarity::identity()),
        _ => similarity_of(&before, &after),
    };
    Ok(alignment.and_then(|alignment| distances(&before, &after, &alignment, Kind::Tie)))
}

type Points = BTreeMap<usize, Vector3<f64>>;

/// Computed less surveyed coordinates of the points of a role: the survey cancels in a difference.
fn surveyed(block: &Block, fit: &Fit, role: Role) -> Result<Points, RunError> {
    let comparison = run::compare(block, &fit.problem, &fit.solution)?;
    let rows = comparison.into_iter().flat_map(|comparison| comparison.rows);
    Ok(rows.filter(|row| row.role == role).map(|row| (PointId::index(row.point), row.d)).collect())
}

fn ties(fit: &Fit) -> Points {
    let sources = fit.problem.point_sources.iter().zip(&fit.solution.state.points);
    let tie = |(source, point): (&PointSource, &Vector3<f64>)| match source {
        PointSource::Tie(id) => Some((PointId::index(*id), *point)),
        PointSource::Control(_) => None,
    };
    sources.filter_map(tie).collect()
}

fn pairs<'a>(before: &'a Points, after: &'a Points) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + 'a {
    before.iter().filter_map(|(point, position)| Some((*position, *after.get(point)?)))
}

fn similarity_of(before: &Points, after: &Points) -> Option<Similarity> {
    let (target, source): (Vec<_>, Vec<_>) = pairs(before, after).unzip();
    Some(similarity::target_from_source(&source, &target, None).ok()?.similarity)
}

fn distances(before: &Points, after: &Points, alignment: &Similarity, of: Kind) -> Option<Moved> {
    let moves: Vec<Vector3<f64>> = pairs(before, after).map(|(from, to)| alignment.apply(&to) - from).collect();
    let mean = |square: fn(&Vector3<f64>) -> f64| (moves.iter().map(square).sum::<f64>() / moves.len() as f64).sqrt();
    let moved = || Moved {
        rms_m: mean(Vector3::norm_squared),
        height_m: mean(|d| d.z * d.z),
        points: moves.len(),
        of,
        step: 0,
    };
    (!moves.is_empty()).then(moved)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(all: &[[f64; 3]]) -> Points {
        all.iter().map(|p| Vector3::from(*p)).enumerate().collect()
    }

    #[test]
    fn distances_are_those_of_the_points_in_common() {
        let before = points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [9.0, 9.0, 9.0]]);
        let after = points(&[[3.0, 0.0, 4.0], [1.0, 0.0, 0.0]]);
        let moved = distances(&before, &after, &Similarity::identity(), Kind::Check).expect("two points");
        assert_eq!((moved.points, moved.of), (2, Kind::Check));
        assert!((moved.rms_m - 12.5_f64.sqrt()).abs() < 1e-12 && (moved.height_m - 8.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(distances(&before, &Points::new(), &Similarity::identity(), Kind::Tie), None);
    }

    #[test]
    fn a_free_network_that_only_lies_elsewhere_has_not_moved() {
        let before = points(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]);
        let after =
            before.iter().map(|(k, p)| (*k, 2.0 * Vector3::new(-p.y, p.x, p.z) + Vector3::repeat(5.0))).collect();
        let alignment = similarity_of(&before, &after).expect("four points");
        let moved = distances(&before, &after, &alignment, Kind::Tie).expect("points");
        assert!(moved.rms_m < 1e-9, "{moved:?}");
    }
}
