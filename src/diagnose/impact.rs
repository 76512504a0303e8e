//! What an effect does in object space: how far surveyed points move when it is taken in, to first order; without
//! surveyed points, a sample of tie points after a similarity, which the block does not feel.

use super::linearised::Linearised;
use super::select::{Judged, Nature, Situation, Taken};
use crate::block::{Block, PointId, Role};
use crate::evaluate::Similarity;
use crate::math::intersect::PointSystem;
use crate::measure::{Predictor, Sighted};
use crate::problem::{Problem, State};
use crate::run;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Points over which an impact is averaged at most: a mean over this many evenly spaced points is good to some percent.
const SAMPLE: usize = 200;
/// Steps of an intersection that starts at the adjusted point.
const STEPS: usize = 2;

/// How far points move, RMS.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// In space, m.
    pub rms_m: f64,
    /// In height alone, m.
    pub height_m: f64,
    /// Of surveyed points; of a sample of tie points otherwise.
    pub surveyed: bool,
}

impl Impact {
    /// Of all values of a set of which columns are a sample: values of images are independent, and so are their moves.
    fn of_all_values(self, linearised: &Linearised, set: usize) -> Self {
        let factor = linearised.values_per_column(set).sqrt();
        Self { rms_m: factor * self.rms_m, height_m: factor * self.height_m, ..self }
    }
}

/// Impact of each candidate beside what is in.
pub fn of_candidates(
    block: &Block,
    linearised: &Linearised,
    situation: &Situation<'_>,
    judged: &[Judged],
) -> Vec<Option<Impact>> {
    let probe = Probe::new(block, linearised);
    let now = linearised.solution(situation);
    let before = probe.positions(&linearised.moved(&now));
    let of = |one: &Judged| {
        let mut with = situation.clone();
        let variance = one.component.as_ref().map_or(0.0, |c| c.deviation.powi(2) / c.variance);
        with.taken.push(Taken { set: one.set, variance });
        if linearised.sets[one.set].nature == Nature::Chance && variance == 0.0 {
            return None;
        }
        let after = probe.positions(&linearised.moved(&linearised.solution(&with)));
        Some(probe.impact(&before, &after)?.of_all_values(linearised, one.set))
    };
    judged.iter().map(of).collect()
}

/// What each effect that is in did to the points: how far they move when it is left out.
pub fn of_taken(block: &Block, linearised: &Linearised, situation: &Situation<'_>) -> Vec<(String, Option<Impact>)> {
    let probe = Probe::new(block, linearised);
    let with = probe.positions(&linearised.moved(&linearised.solution(situation)));
    let of = |taken: &Taken| {
        let id = linearised.sets[taken.set].id.clone();
        let without = situation.without(&id);
        let without = probe.positions(&linearised.moved(&linearised.solution(&without)));
        let impact = probe.impact(&without, &with);
        (id, impact.map(|impact| impact.of_all_values(linearised, taken.set)))
    };
    situation.taken.iter().map(of).collect()
}

/// How far points move when columns take some values instead of none, for each of several lists of values.
pub fn of_values(block: &Block, linearised: &Linearised, values: &[Vec<f64>]) -> Vec<Option<Impact>> {
    let probe = Probe::new(block, linearised);
    let none = vec![0.0; linearised.values.len()];
    let before = probe.positions(&linearised.moved(&none));
    values.iter().map(|values| probe.impact(&before, &probe.positions(&linearised.moved(values)))).collect()
}

/// Points whose moves are looked at.
struct Probe<'a> {
    problem: &'a Problem,
    state: &'a State,
    /// The block with the marks of a sample of its surveyed points alone.
    sample: Block,
    surveyed: bool,
}

impl<'a> Probe<'a> {
    fn new(block: &Block, linearised: &'a Linearised) -> Self {
        let sample = sampled(block);
        let surveyed = !sample.marks.is_empty();
        Self { problem: linearised.null.problem(), state: linearised.null.state(), sample, surveyed }
    }

    fn positions(&self, state: &State) -> BTreeMap<usize, Vector3<f64>> {
        if self.surveyed {
            let comparison = run::compare_state(&self.sample, self.problem, state).ok().flatten();
            let rows = comparison.into_iter().flat_map(|comparison| comparison.rows);
            return rows.map(|row| (PointId::index(row.point), row.d)).collect();
        }
        let points = self.problem.point_sources.len();
        let stride = points.div_ceil(SAMPLE).max(1);
        let Ok(predictor) = Predictor::new(self.problem, state) else { return BTreeMap::new() };
        let intersected = |j: usize| Some((j, self.intersect(&predictor, j)?));
        (0..points).step_by(stride).filter_map(intersected).collect()
    }

    /// A tie point intersected from the images of a state.
    fn intersect(&self, predictor: &Predictor<'_>, j: usize) -> Option<Vector3<f64>> {
        let mut object = self.state.points[j];
        for _ in 0..STEPS {
            let mut system = PointSystem::default();
            let rows = &self.problem.observations[self.problem.point_start[j]..self.problem.point_start[j + 1]];
            let sighted = rows.iter().map(|o| Sighted { image: o.image as usize, point: object });
            for (row, predicted) in rows.iter().zip(predictor.image_points(sighted)) {
                let (computed, by_point) = predicted?;
                system.add(Vector2::new(row.x - computed[0], row.y - computed[1]), by_point, 1.0);
            }
            object += system.step()?;
        }
        Some(object)
    }

    fn impact(&self, before: &BTreeMap<usize, Vector3<f64>>, after: &BTreeMap<usize, Vector3<f64>>) -> Option<Impact> {
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> =
            before.iter().filter_map(|(point, position)| Some((*position, *after.get(point)?))).collect();
        let alignment = match self.surveyed {
            true => Similarity::identity(),
            false => similarity(&pairs)?,
        };
        let moves: Vec<Vector3<f64>> = pairs.iter().map(|(from, to)| alignment.apply(to) - from).collect();
        let n = moves.len() as f64;
        (!moves.is_empty()).then(|| Impact {
            rms_m: (moves.iter().map(Vector3::norm_squared).sum::<f64>() / n).sqrt(),
            height_m: (moves.iter().map(|d| d.z * d.z).sum::<f64>() / n).sqrt(),
            surveyed: self.surveyed,
        })
    }
}

fn similarity(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Similarity> {
    let (to, from): (Vec<_>, Vec<_>) = pairs.iter().copied().unzip();
    Some(crate::evaluate::similarity::target_from_source(&from, &to, None).ok()?.similarity)
}

/// The block with its control points and evenly spaced check points alone marked.
fn sampled(block: &Block) -> Block {
    let checks: Vec<usize> = (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == Role::Check).collect();
    let stride = checks.len().div_ceil(SAMPLE).max(1);
    let kept: BTreeSet<usize> = checks.into_iter().step_by(stride).collect();
    let mut sample = block.clone();
    sample.ties = Vec::new();
    sample.marks.retain(|mark| {
        let point = mark.point.index();
        block.surveyed[point].role == Role::Control || kept.contains(&point)
    });
    sample
}
