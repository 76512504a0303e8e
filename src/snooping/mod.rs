//! Data snooping: single measurements that stand alone.
//!
//! Rejecting everything beyond a threshold at once takes far too much: one wrong measurement bends its point, and the
//! whole point goes. So (Baarda 1968, with three precautions)
//! - one measurement per point at a time: the worst, then the point is intersected again from the rest with the cameras
//!   held, and so on; the cameras are adjusted anew once per round, until nothing changes;
//! - what was rejected comes back when it fits again, also where its point had no two rays left or was set aside whole;
//! - a measurement is judged against its neighbours in the image as well: an effect that the model lacks moves
//!   neighbours together, an outlier stands alone. It is rejected only if both its own residual and its difference from
//!   theirs are too large.
//!
//! A blunder of hundreds of pixels bends a whole least-squares fit, cameras and all, until measurements that are right
//! stand out and it does not. Where a residual is that large, measurements are judged at a robust fit instead
//! ([`robust_fit`]).
//!
//! The statistic of a measurement is `v' R^-1 v / s0^2`, `R` its local redundancy (2x2, cameras held): chi-square with
//! two degrees of freedom, with one where the point has two rays (across the epipolar plane; along it nothing can be
//! seen). `s0` is taken from the median, which outliers do not move. The threshold is that of the largest of as many as
//! the block has.

mod image;
mod lost;
mod majority;
mod point;
mod robust;
mod round;
pub mod settle;
mod sight;
mod statistic;
mod surroundings;

pub use robust::{has_converged, robust_fit, stand_alone};

use crate::adjust::AdjustError;
use crate::block::{Block, ImageId, Measurement, PointId};
use crate::model::Model;
use crate::problem::{MeasurementKind, Problem, ProblemError, State};
use crate::run::folder::OutlierRow;
use crate::run::set_aside;
use round::Judged;
use sight::Sight;
use std::borrow::Cow;
use std::collections::HashSet;

/// Points below two rays take no part.
const FEWEST_RAYS: usize = 2;

/// How strict the search is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Strictness {
    /// Before a diagnosis: the threshold is 1.5 times wider, since an effect may still be in the residuals.
    #[default]
    Loose,
    /// Once the effects are in the model.
    Tight,
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnoopingOptions {
    /// Before or after the effects are in.
    pub strictness: Strictness,
    /// Probability to reject anything in a block without outliers.
    pub significance: f64,
    /// Most rounds, each with one adjustment.
    pub max_rounds: usize,
}

/// One measurement in a hundred blocks without outliers.
const SIGNIFICANCE: f64 = 0.01;
/// Twice what 2 % of outliers in the simulated blocks need.
pub const MAX_ROUNDS: usize = 8;

impl Default for SnoopingOptions {
    fn default() -> Self {
        Self { strictness: Strictness::Loose, significance: SIGNIFICANCE, max_rounds: MAX_ROUNDS }
    }
}

/// A measurement that was left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejected {
    /// Tie or mark.
    pub kind: MeasurementKind,
    /// Position in [`Block::ties`] or [`Block::marks`].
    pub measurement: usize,
    /// Image.
    pub image: ImageId,
    /// Tie point or surveyed point.
    pub point: PointId,
    /// Square root of the statistic when it was rejected: the residual in its own standard deviations. Infinite where
    /// the rays of its point do not meet, not a number where its image was set aside whole.
    pub normalised: f64,
    /// Round in which it was rejected, from 1.
    pub round: usize,
}

/// Counts of one round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round {
    /// Measurements rejected.
    pub rejected: usize,
    /// Measurements that came back.
    pub returned: usize,
    /// Points of which a measurement may be bent by a worse one elsewhere, and is left for the next round.
    pub held_back: usize,
    /// Is the worst so large that it may have bent measurements beyond the threshold that are right? A least-squares
    /// fit says then that something is wrong, and not what.
    pub bent: bool,
    /// Robust estimate of sigma0 at its begin.
    pub sigma0: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outliers {
    /// Left out, ties first, in the order of the block.
    pub rejected: Vec<Rejected>,
    /// Tie points that lose their last but one ray by it and take no part any more.
    pub lost_points: Vec<PointId>,
    /// Per round; the last changed nothing, unless `settled` is false.
    pub rounds: Vec<Round>,
    /// Did the search come to its end?
    pub settled: bool,
}

impl Outliers {
    /// What was left out, by name, and why.
    pub fn rows(&self, block: &Block) -> Vec<OutlierRow> {
        let row = |rejected: &Rejected| {
            let (kind, point) = match rejected.kind {
                MeasurementKind::Tie => (set_aside::TIE, &block.tie_points[rejected.point.index()].name),
                MeasurementKind::Mark => (set_aside::MARK, &block.surveyed[rejected.point.index()].name),
            };
            let reason = match rejected.normalised {
                size if size.is_finite() => format!("data snooping: a residual of {size:.1} standard deviations"),
                size if size.is_nan() => "most of the measurements of its image are wrong".into(),
                _ => "the rays of its point do not meet".into(),
            };
            let image = block.images[rejected.image.index()].name.clone();
            OutlierRow { image, point: point.clone(), kind: kind.into(), reason }
        };
        self.rejected.iter().map(row).collect()
    }

    /// The block without the rejected measurements.
    pub fn without(&self, block: &Block) -> Block {
        let mut left = Kept::all(block);
        for rejected in &self.rejected {
            left.of(rejected.kind)[rejected.measurement] = false;
        }
        left.block(block).into_owned()
    }
}

/// An adjustment of a block.
#[derive(Debug, Clone, Copy)]
pub struct Solved<'a> {
    /// Its problem.
    pub problem: &'a Problem,
    /// Its solution.
    pub state: &'a State,
}

/// Which measurements are still in.
#[derive(Clone)]
struct Kept {
    ties: Vec<bool>,
    marks: Vec<bool>,
}

impl Kept {
    fn all(block: &Block) -> Self {
        Self { ties: vec![true; block.ties.len()], marks: vec![true; block.marks.len()] }
    }

    fn of(&mut self, kind: MeasurementKind) -> &mut Vec<bool> {
        match kind {
            MeasurementKind::Tie => &mut self.ties,
            MeasurementKind::Mark => &mut self.marks,
        }
    }

    fn is_in(&self, kind: MeasurementKind, measurement: usize) -> bool {
        match kind {
            MeasurementKind::Tie => self.ties[measurement],
            MeasurementKind::Mark => self.marks[measurement],
        }
    }

    fn block<'a>(&self, block: &'a Block) -> Cow<'a, Block> {
        if self.ties.iter().chain(&self.marks).all(|is_in| *is_in) {
            return Cow::Borrowed(block);
        }
        let kept = |rows: &[Measurement], left: &[bool]| {
            rows.iter().zip(left).filter(|(_, left)| **left).map(|(row, _)| *row).collect()
        };
        Cow::Owned(block.with_measurements(kept(&block.ties, &self.ties), kept(&block.marks, &self.marks)))
    }
}

/// A search on its way: what is left out so far, re-judged at every fit.
#[derive(Clone)]
pub struct Snooping {
    left: Kept,
    significance: f64,
    outliers: Outliers,
    apart: Vec<Apart>,
}

/// Did the rays of a tie point meet?
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Apart {
    /// Whenever it took part.
    Never,
    /// They did not, and it may come back with those that do at a solution.
    Once,
    /// Nor did those that came back, where an adjustment starts: nothing could be adjusted with them.
    Again,
}

impl Snooping {
    /// Nothing is left out yet, except points whose rays do not meet in front of the cameras at the block's
    /// approximations and that have no coordinates to start from: before a solution each of their measurements is as
    /// likely to be wrong.
    pub fn new(block: &Block, model: &Model) -> Self {
        let mut search = Self::nothing(block, SIGNIFICANCE);
        for point in unmeetable_points(block, model) {
            search.set_aside(block, point);
        }
        search
    }

    fn nothing(block: &Block, significance: f64) -> Self {
        let apart = vec![Apart::Never; block.tie_points.len()];
        Self { left: Kept::all(block), significance, outliers: Outliers::default(), apart }
    }

    /// Leaves out every measurement of a tie point whose rays do not meet. Was any in?
    ///
    /// Which of them are wrong, the next judgement may tell.
    pub fn set_aside(&mut self, block: &Block, point: PointId) -> bool {
        let apart = &mut self.apart[point.index()];
        *apart = if *apart == Apart::Never { Apart::Once } else { Apart::Again };
        let before = self.outliers.rejected.len();
        for (m, row) in block.ties.iter().enumerate().filter(|(_, row)| row.point == point) {
            if std::mem::replace(&mut self.left.ties[m], false) {
                self.outliers.rejected.push(Rejected {
                    kind: MeasurementKind::Tie,
                    measurement: m,
                    image: row.image,
                    point,
                    normalised: f64::INFINITY,
                    round: self.outliers.rounds.len(),
                });
            }
        }
        self.outliers.rejected.len() > before
    }

    /// The block without what is left out.
    pub fn block<'a>(&self, block: &'a Block) -> Cow<'a, Block> {
        self.left.block(block)
    }

    /// Numbers of the tie measurements, and of the marks, that are left out.
    pub fn left_out(&self) -> [Vec<usize>; 2] {
        [&self.left.ties, &self.left.marks].map(|left| (0..left.len()).filter(|row| !left[*row]).collect())
    }

    /// Judges every measurement at a fit of [`Self::block`]. Nothing was rejected or came back: the search has come to
    /// its end there.
    pub fn judge(&mut self, block: &Block, fit: Solved<'_>, strictness: Strictness) -> Result<Round, AdjustError> {
        let barred: Vec<bool> = self.apart.iter().map(|apart| *apart == Apart::Again).collect();
        let lost = lost::lost_points(block, &self.left.ties, &self.outliers.rejected, &barred);
        let lost_control = lost::lost_control(block, &self.outliers.rejected, fit)?;
        let number = self.outliers.rounds.len() + 1;
        let mut sight = Sight::new(block, &self.left, &lost, &lost_control, fit)?;
        let rejected = &mut self.outliers.rejected;
        let Judged { round, changed } = round::judge(&mut sight, strictness, self.significance, number, rejected);
        drop(sight);
        for (kind, measurement, is_in) in changed {
            self.left.of(kind)[measurement] = is_in;
        }
        self.outliers.rounds.push(round);
        self.outliers.settled = round.rejected + round.returned == 0;
        Ok(round)
    }

    /// Sets aside again what has come back since `earlier`: nothing could be adjusted with it. Was there anything?
    pub fn refuse_returned(&mut self, earlier: &Self) -> bool {
        let mut refused = false;
        for rejected in &earlier.outliers.rejected {
            let is_in = &mut self.left.of(rejected.kind)[rejected.measurement];
            if std::mem::replace(is_in, false) {
                self.outliers.rejected.push(*rejected);
                if rejected.kind == MeasurementKind::Tie {
                    self.apart[rejected.point.index()] = Apart::Again;
                }
                refused = true;
            }
        }
        refused
    }

    /// Has a judgement since `earlier` found a measurement so far off that it may bend a whole adjustment?
    pub fn found_bent_since(&self, earlier: &Self) -> bool {
        self.outliers.rounds[earlier.outliers.rounds.len()..].iter().any(|round| round.bent)
    }

    /// What was found so far.
    pub fn outliers(&self, block: &Block) -> Outliers {
        let mut outliers = self.outliers.clone();
        outliers.rejected.sort_by_key(|rejected| (rejected.kind as u32, rejected.measurement));
        let (mut rays, mut had) = (vec![0; block.tie_points.len()], vec![0; block.tie_points.len()]);
        for (row, left) in block.ties.iter().zip(&self.left.ties) {
            had[row.point.index()] += 1;
            rays[row.point.index()] += usize::from(*left);
        }
        let lost = (0..rays.len()).filter(|p| rays[*p] < FEWEST_RAYS && had[*p] >= FEWEST_RAYS);
        outliers.lost_points = lost.map(PointId::from).collect();
        outliers
    }
}

/// Tie points that no problem can be laid out with.
fn unmeetable_points(block: &Block, model: &Model) -> Vec<PointId> {
    let Err(ProblemError::NoIntersection { points }) = Problem::new(block, model) else { return Vec::new() };
    let points: HashSet<String> = points.into_iter().collect();
    let is_one = |p: &usize| points.contains(&block.tie_points[*p].name);
    (0..block.tie_points.len()).filter(is_one).map(PointId::from).collect()
}

/// Searches a block; `refit` adjusts the block it is given (from whatever start it likes) and is called once per round.
///
/// Check points are not touched: their marks take part in no adjustment.
///
/// # Errors
/// Those of `refit`, and a solution at which predictions fail.
pub fn find<E: From<AdjustError>>(
    block: &Block,
    options: SnoopingOptions,
    mut refit: impl FnMut(&Block) -> Result<(Problem, State), E>,
) -> Result<Outliers, E> {
    let mut search = Snooping::nothing(block, options.significance);
    for _ in 0..options.max_rounds {
        let (problem, state) = refit(&search.block(block))?;
        search.judge(block, Solved { problem: &problem, state: &state }, options.strictness)?;
        if search.outliers.settled {
            break;
        }
    }
    Ok(search.outliers(block))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn what_came_back_and_cannot_be_adjusted_stays_out() {
        let few = BTreeMap::from([("points".to_string(), 60.0)]);
        let block = simulate(&Scenario::preset("closerange", &few).expect("a preset"), 1).expect("a block").block;
        let mut search = Snooping::nothing(&block, SIGNIFICANCE);
        let point = block.ties[0].point;
        assert!(search.set_aside(&block, point));
        let before = search.clone();
        // A judgement takes its measurements in again.
        (search.left, search.outliers.rejected) = (Kept::all(&block), Vec::new());
        assert!(search.refuse_returned(&before));
        assert_eq!(search.left_out(), before.left_out());
        assert_eq!(search.outliers.rejected, before.outliers.rejected);
        assert_eq!(search.apart[point.index()], Apart::Again);
        assert!(!search.refuse_returned(&before), "nothing is in any more");
    }
}
