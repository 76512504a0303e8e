//! One round of the search: each measurement tested against the others of its point and against its neighbours in the
//! image.
//!
//! Of millions of measurements all but a few are beyond doubt. Nothing is kept of those but how far off the worst of
//! their point is; what is to be known of the others is computed again.

use super::point::{Seen, SeenPoint};
use super::sight::Sight;
use super::statistic::{Statistic, Statistics};
use super::surroundings::judge_neighbours;
use super::{Rejected, Round, Strictness};
use crate::math::statistics::chi_square_ln_sf;
use crate::problem::MeasurementKind;
use rayon::prelude::*;
use std::collections::HashSet;

/// Before a diagnosis residuals hold effects too: the threshold is this much wider.
const LOOSE: f64 = 1.5;
/// Share of the worst residual of a round below which another may be its doing: a blunder bends the images that it lies
/// in, by no more than its leverage, which is below a tenth in an image of twenty points or more. What is left stands
/// out in the next round. A residual of which this share is beyond the threshold may have put measurements there that
/// are right.
const BENT: f64 = 0.1;
/// A measurement comes back below this share of the threshold; the gap keeps one from going to and fro.
const RETURN: f64 = 0.8;
/// Points of which the statistics are collected together: so few that no thread is left alone with the last of them for
/// long.
const CHUNK: usize = 256;

/// What a round came to.
pub(super) struct Judged {
    pub(super) round: Round,
    /// Measurements that were rejected or came back, and whether they are in now.
    pub(super) changed: Vec<(MeasurementKind, usize, bool)>,
}

/// How far off the measurements of a point are that are in, taken by themselves.
#[derive(Clone, Copy)]
struct Alone {
    /// The largest statistic with one direction, and with two; negative where there is none.
    largest: [f64; 2],
    /// Is any left out?
    is_incomplete: bool,
}

/// Factor on the stated standard deviation of marks beyond which nobody means it.
const IMPRECISE: f64 = 3.0;
/// Tested marks whose median tells a precision: it is known to a fourth.
const FEWEST_MARKS: usize = 20;

/// Judges every measurement. What `rejected` says of measurements that come back is taken out of it, what is rejected
/// put there.
pub(super) fn judge(
    sight: &mut Sight,
    strictness: Strictness,
    significance: f64,
    number: usize,
    rejected: &mut Vec<Rejected>,
) -> Judged {
    let mut each = each_alone(sight);
    if let Some(factor) = each.imprecision_of_marks() {
        sight.take_marks_as_less_precise(factor);
        each = each_alone(sight);
    }
    let sight = &*sight;
    let variance = each.variance();
    let EachAlone { alone, active, .. } = each;
    let wide = if strictness == Strictness::Loose { LOOSE * LOOSE } else { 1.0 };
    let level = (significance / active.max(1) as f64).ln();
    let beyond = |verdict: Statistic, share: f64| {
        chi_square_ln_sf(verdict.statistic / (variance * wide * share * share), verdict.dof) < level
    };
    // The neighbours can only excuse a measurement: they are asked where its point has one to reject or one to take
    // back.
    let is_in_question = |j: &usize| alone[*j].is_incomplete || alone[*j].largest().any(|largest| beyond(largest, 1.0));
    let (asked, beyond_doubt): (Vec<usize>, Vec<usize>) = (0..sight.points()).partition(is_in_question);
    let mut in_question: Vec<SeenPoint> = asked.par_iter().map(|j| sight.point(*j)).collect();
    judge_neighbours(sight, &mut in_question, variance);
    let others = beyond_doubt.iter().flat_map(|j| alone[*j].largest());
    let of_points = in_question.iter().filter_map(SeenPoint::worst).map(|(_, verdict)| verdict).chain(others);
    let worst = of_points.max_by(|a, b| a.statistic.total_cmp(&b.statistic));
    let largest = worst.map_or(0.0, |worst| worst.statistic);
    // A fit that is bent altogether has large residuals everywhere: they are no measure of what is large then, the
    // stated precision is.
    let bent = worst.is_some_and(|worst| beyond(worst, variance.min(1.0).sqrt() / (BENT * variance.sqrt())));
    let may_be_bent = |verdict: Statistic| verdict.statistic < BENT * BENT * largest;
    let normalised = |verdict: Statistic| (verdict.statistic / variance).sqrt();
    let mut round = Round { rejected: 0, returned: 0, held_back: 0, bent, sigma0: variance.sqrt() };
    let mut changed = Vec::new();
    for point in &mut in_question {
        let mut out = Vec::new();
        if point.lost {
            let revived = point.revive(|point| {
                let worst = point.worst().filter(|(_, verdict)| beyond(*verdict, RETURN));
                worst.map(|(k, verdict)| (k, normalised(verdict)))
            });
            round.returned += revived.returned;
            out = revived.rejected;
            // Now it is known which of them are wrong, and by how much.
            for (k, normalised) in revived.still_out {
                let it = sight.kind_and_measurement(point.seen[k].number);
                let is_it = |r: &&mut Rejected| (r.kind, r.measurement) == it;
                rejected.iter_mut().filter(is_it).for_each(|r| r.normalised = normalised);
            }
        } else {
            while let Some((k, verdict)) = point.worst().filter(|(_, verdict)| beyond(*verdict, 1.0)) {
                if may_be_bent(verdict) {
                    round.held_back += 1;
                    break;
                }
                point.seen[k].active = false;
                out.push((k, normalised(verdict)));
            }
            while let Some((k, _)) = point.best_outside().filter(|(_, verdict)| !beyond(*verdict, RETURN)) {
                point.seen[k].active = true;
                round.returned += 1;
            }
        }
        round.rejected += out.len();
        rejected.extend(out.into_iter().map(|(k, normalised)| {
            let Seen { number: measurement, row, .. } = &point.seen[k];
            let (kind, measurement) = sight.kind_and_measurement(*measurement);
            Rejected { kind, measurement, image: row.image, point: row.point, normalised, round: number }
        }));
        for seen in point.seen.iter().filter(|seen| seen.active != seen.was_active) {
            let (kind, measurement) = sight.kind_and_measurement(seen.number);
            changed.push((kind, measurement, seen.active));
        }
    }
    let returned: HashSet<_> = changed.iter().filter(|(_, _, is_in)| *is_in).map(|(kind, m, _)| (*kind, *m)).collect();
    rejected.retain(|rejected| !returned.contains(&(rejected.kind, rejected.measurement)));
    Judged { round, changed }
}

/// How far off the measurements of each point are by themselves.
#[derive(Default)]
struct EachAlone {
    alone: Vec<Alone>,
    /// Of the measurements of tie points, and of marks.
    statistics: [Statistics; 2],
    /// How many measurements are in.
    active: usize,
}

impl EachAlone {
    fn append(&mut self, other: Self) {
        self.alone.extend(other.alone);
        self.active += other.active;
        self.statistics.iter_mut().zip(other.statistics).for_each(|(own, other)| own.append(other));
    }

    /// Variance factor of all together.
    fn variance(&self) -> f64 {
        let [ties, marks] = &self.statistics;
        Statistics::variance([ties, marks])
    }

    /// Factor on the stated standard deviation of marks, where most of them ask for more than [`IMPRECISE`]. Then the
    /// precision is stated wrongly, and none of them is a blunder for that.
    fn imprecision_of_marks(&self) -> Option<f64> {
        let [ties, marks] = &self.statistics;
        let factor = (Statistics::variance([marks]) / Statistics::variance([ties])).sqrt();
        (marks.len() >= FEWEST_MARKS && factor > IMPRECISE).then_some(factor)
    }
}

fn each_alone(sight: &Sight) -> EachAlone {
    let of_chunk = |chunk: &[usize]| {
        let mut each = EachAlone::default();
        for j in chunk {
            let point = sight.point(*j);
            let mut of_point = Alone { largest: [-1.0; 2], is_incomplete: point.seen.iter().any(|s| !s.active) };
            each.active += point.seen.iter().filter(|seen| seen.active).count();
            let verdicts = point.intersected().filter_map(|(_, local)| Some(local.weight?.verdict(local.residual)));
            for verdict in verdicts {
                of_point.add(verdict);
                each.statistics[usize::from(sight.is_marked(*j))].add(verdict);
            }
            each.alone.push(of_point);
        }
        each
    };
    let all: Vec<usize> = (0..sight.points()).collect();
    let mut each = EachAlone::default();
    all.par_chunks(CHUNK).map(of_chunk).collect::<Vec<_>>().into_iter().for_each(|chunk| each.append(chunk));
    each
}

impl Alone {
    fn add(&mut self, Statistic { statistic, dof }: Statistic) {
        let largest = &mut self.largest[usize::from(dof > 1.0)];
        *largest = largest.max(statistic);
    }

    fn largest(&self) -> impl Iterator<Item = Statistic> + use<> {
        let [one, two] = self.largest;
        [(one, 1.0), (two, 2.0)]
            .into_iter()
            .filter(|(s, _)| *s >= 0.0)
            .map(|(statistic, dof)| Statistic { statistic, dof })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::problem::Problem;
    use crate::scenario::{Scenario, add_noise, simulate};
    use crate::snooping::{Kept, SIGNIFICANCE, Solved};
    use std::collections::BTreeMap;

    /// px.
    const NOISE: f64 = 0.3;

    /// One round at the true cameras and points, measurement 7 left out before: what came back, and is it in?
    fn round_with_one_left_out(error_px: f64) -> (Round, bool) {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        add_noise(&mut block, NOISE, 1).expect("noise");
        block.ties[7].x += error_px;
        let problem = Problem::new(&block, &Model::default()).expect("a problem");
        let state = problem.start.clone();
        let mut left = Kept::all(&block);
        left.ties[7] = false;
        let solved = Solved { problem: &problem, state: &state };
        let mut sight = Sight::new(&block, &left, &[], &[], solved).expect("a solution");
        let Judged { round, changed } = judge(&mut sight, Strictness::Loose, SIGNIFICANCE, 2, &mut Vec::new());
        (round, changed.contains(&(MeasurementKind::Tie, 7, true)))
    }

    #[test]
    fn what_fits_again_comes_back() {
        let (round, back) = round_with_one_left_out(0.0);
        assert!(back && round.returned == 1 && round.rejected == 0, "{round:?}");
        let (round, back) = round_with_one_left_out(20.0 * NOISE);
        assert!(!back && round.returned == 0 && round.rejected == 0, "{round:?}");
    }
}
