//! The datum: which observed positions take part, or, without any, what of the poses is held.

use super::align::Pair;
use super::intersection::intersect;
use super::{PositionObservation, Problem, ProblemError};
use crate::block::{Block, Role};
use crate::model::Datum;

/// Which observations take part: control, GNSS.
pub(super) fn datum_parts(block: &Block, datum: Datum) -> Result<(bool, bool), ProblemError> {
    let control = block.count(Role::Control) > 0;
    let gnss = block.images.iter().any(|image| image.gnss.is_some());
    match datum {
        Datum::Free => Ok((false, false)),
        Datum::Control if control => Ok((true, false)),
        Datum::Control => Err(ProblemError::Datum { datum: "control", needs: "control points" }),
        Datum::Gnss if gnss => Ok((false, true)),
        Datum::Gnss => Err(ProblemError::Datum { datum: "gnss", needs: "GNSS positions" }),
        Datum::All if control || gnss => Ok((control, gnss)),
        Datum::All => Err(ProblemError::Datum { datum: "all", needs: "control points or GNSS positions" }),
    }
}

impl Problem {
    /// Positions of the approximate block that were observed: projection centres, and control points intersected from
    /// their marks.
    pub(super) fn observed_pairs(&self, block: &Block) -> Vec<Pair> {
        let centre = |observed: &PositionObservation| {
            Some(Pair::new(self.start.poses[observed.index as usize].centre, observed))
        };
        let point = |observed: &PositionObservation| {
            let j = observed.index as usize;
            let marks = &self.observations[self.point_start[j]..self.point_start[j + 1]];
            intersect(block, &self.start.interiors, marks).map(|source| Pair::new(source, observed))
        };
        self.gnss.iter().filter_map(centre).chain(self.control.iter().filter_map(point)).collect()
    }

    /// Minimal constraints: the pose of one image, and of the measured image farthest from it the coordinate in which
    /// they differ most.
    pub(super) fn hold_datum(&mut self) {
        let measured: Vec<usize> = (0..self.pose_free.len()).filter(|image| self.pose_free[*image][0]).collect();
        let Some(&first) = measured.first() else { return };
        let base = self.start.poses[first].centre;
        let from_base = |image: usize| self.start.poses[image].centre - base;
        let farthest = measured.iter().copied().max_by(|a, b| from_base(*a).norm().total_cmp(&from_base(*b).norm()));
        self.pose_free[first] = [false; 6];
        if let Some(farthest) = farthest.filter(|farthest| *farthest != first) {
            self.pose_free[farthest][3 + from_base(farthest).iamax()] = false;
        }
        self.datum_defect = 7;
    }
}
