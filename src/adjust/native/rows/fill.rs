//! Rows of many measurements side by side.

use super::super::point::Prepared;
use super::super::side_by_side::{Eights, Workspace};
use super::Rows;
use crate::measure::MeasureError;
use crate::measure::lanes::Lane;
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Fills the rows of the image measurements of some points.
pub(super) struct FillMeasured<'a, 'b> {
    pub rows: &'a mut Rows,
    pub at: &'a Prepared<'b>,
    pub points: Range<usize>,
    pub work: &'a mut Workspace,
}

impl WithSimd for FillMeasured<'_, '_> {
    type Output = Result<(), MeasureError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { rows, at, points, work } = self;
        let start = at.problem.point_start[points.start];
        let mut eights = Eights::new(at.cameras(), &at.state.points[points.clone()], points, &mut work.views);
        let mut costs = Lane::default();
        while work.linearise(simd, at.cameras(), rows.curvature, &mut eights, &mut costs)? {
            rows.spread(simd, at, start, &work.eight, &work.predictions);
        }
        rows.chi_square += costs.iter().sum::<f64>();
        Ok(())
    }
}
