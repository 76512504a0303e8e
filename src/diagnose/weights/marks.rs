//! Marks of control points: how precise they are, beside the tie points and whatever the survey says.
//!
//! They pull the images that few tie points hold, so that their residuals alone look better than they are: their
//! factor is a variance component of their coordinates in the whole fit, as those of the survey are. A wrong or
//! imprecise survey is no part of it: the coordinates of control points are unknown beside it.

use super::Coordinates;
use super::groups::Groups;
use crate::null_model::{Entries, Measured};
use crate::problem::{MeasurementKind, PointSource, Problem};
use crate::run::RunError;
use crate::run::fit::Fit;
use crate::run::squares;
use crate::score::Penalised;

/// Marks that take part at most, an even sample of more: their standard deviation is then known to 4 %.
const SAMPLE: usize = 150;

/// Variance of a control coordinate that is as good as unknown, in that of the fit: ten thousand standard deviations.
/// More would leave the place of the block in space, where control alone gives it, to rounding.
const UNKNOWN: f64 = 1e8;

/// Marks, each of their coordinates a column.
pub(super) struct Marks {
    /// Positions in the observations, in order.
    numbers: Vec<usize>,
    /// Marks of the block for each of these.
    pub(super) stride: f64,
}

impl Marks {
    pub(super) fn new(problem: &Problem) -> Self {
        let is_mark = |number: &usize| problem.observations[*number].kind == MeasurementKind::Mark;
        let all: Vec<usize> = (0..problem.observations.len()).filter(is_mark).collect();
        let stride = all.len().div_ceil(SAMPLE).max(1);
        let numbers: Vec<usize> = all.iter().copied().step_by(stride).collect();
        Self { stride: all.len() as f64 / numbers.len().max(1) as f64, numbers }
    }

    /// Number of columns.
    pub(super) fn columns(&self) -> usize {
        2 * self.numbers.len()
    }

    /// Entries of an image measurement; `first`: local column of the first mark.
    pub(super) fn image(&self, first: usize, measured: &Measured<'_>, x: &mut Entries<'_>, y: &mut Entries<'_>) {
        if measured.observation.kind != MeasurementKind::Mark {
            return;
        }
        if let Ok(k) = self.numbers.binary_search(&measured.number) {
            x.standardised(first + 2 * k, 1.0);
            y.standardised(first + 2 * k + 1, 1.0);
        }
    }
}

/// The coordinates of a linearisation beside control of which nothing is known.
pub(super) fn beside_unknown_control(groups: &Groups, coordinates: &Coordinates) -> Groups {
    groups.beside(Penalised { columns: (0..coordinates.of_control()).collect(), variance: UNKNOWN })
}

/// What the marks have of `v'Pv` in the adjustment, and the redundancy of marks and control coordinates together: two
/// for each mark, since the three unknowns of a point take what its three coordinates bring.
pub(super) fn with_control(fit: &Fit) -> Result<(f64, f64), RunError> {
    let sources = &fit.problem.point_sources;
    let (mut chi_square, mut redundancy) = (0.0, 0.0);
    squares::each(fit, |point, _, square| {
        if matches!(sources[point], PointSource::Control(_)) {
            chi_square += square;
            redundancy += 2.0;
        }
    })?;
    Ok((chi_square, redundancy))
}
