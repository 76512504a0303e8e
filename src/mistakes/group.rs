//! The shape of one group against the free network.

use super::align::{Aligned, FEWEST, align};
use super::members;
use super::shape::Change;
use super::survey::{Group, Subject, Survey};
use super::words;
use super::{BEYOND, Mistake, ln_p, price};
use crate::math::statistics::chi_square_quantile;
use nalgebra::Vector3;

/// Variances within this factor are equally good: mirrors fit alike, whichever axis they mirror.
const ALIKE: f64 = 4.0;

/// A group that was judged.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Its members that the images give.
    pub group: Group,
    /// Their positions in the free network.
    pub computed: Vec<Vector3<f64>>,
    /// Recorded positions, the mistake of the whole group undone.
    pub targets: Vec<Vector3<f64>>,
    /// The similarity.
    pub aligned: Aligned,
    /// Members that do not fit.
    pub wrong: Vec<usize>,
    /// What was found.
    pub mistakes: Vec<Mistake>,
}

/// A group of too few members to be judged by itself.
#[derive(Debug, Clone)]
pub struct Few {
    /// Which.
    pub subject: Subject,
    /// Standard deviations as stated, m.
    pub sigma: [f64; 2],
    /// Positions in the free network.
    pub computed: Vec<Vector3<f64>>,
    /// As recorded.
    pub targets: Vec<Vector3<f64>>,
}

impl Few {
    /// `None` of a group that has enough members, or less than two: one position has no shape and no neighbour.
    pub fn of(group: &Group) -> Option<Self> {
        let seen = group.members.iter().filter_map(|member| Some((member.computed?, member.recorded)));
        let (computed, targets): (Vec<_>, Vec<_>) = seen.unzip();
        let few = (2..FEWEST).contains(&targets.len());
        few.then_some(Self { subject: group.subject, sigma: group.sigma, computed, targets })
    }
}

/// A group under one alternative.
struct Trial {
    change: Change,
    members: Vec<usize>,
    targets: Vec<Vector3<f64>>,
    aligned: Aligned,
}

/// Finds the change that takes a group to its shape in the free network, and judges its members under it. `None` where too few members agree under any.
pub fn judge(group: &Group, survey: &Survey, alpha: f64) -> Option<Judged> {
    let seen: Vec<usize> = (0..group.members.len()).filter(|k| group.members[*k].computed.is_some()).collect();
    let cap = chi_square_quantile(1.0 - alpha / seen.len().max(1) as f64, 3.0);
    let mut trials = Vec::new();
    for change in Change::all(group) {
        let undone = change.undone(group);
        let members: Vec<usize> = seen.iter().copied().filter(|k| undone[*k].is_some()).collect();
        let source: Vec<_> = members.iter().filter_map(|k| group.members[*k].computed).collect();
        let targets: Vec<_> = members.iter().filter_map(|k| undone[*k]).collect();
        if let Some(aligned) = align(&source, &targets, group.sigma) {
            trials.push(Trial { change, members, targets, aligned });
        }
    }
    // A member that an alternative leaves without a position costs what a blunder costs.
    let objective = |trial: &Trial, variance: f64| {
        trial.aligned.objective(variance, cap) + cap * (seen.len() - trial.members.len()) as f64
    };
    let none = trials.iter().position(|trial| trial.change == Change::None);
    let mut accepted: Vec<(usize, f64)> = Vec::new();
    for (k, trial) in trials.iter().enumerate().filter(|(_, trial)| trial.change != Change::None) {
        let variance = trial.aligned.variance;
        let before = none.map_or(cap * seen.len() as f64, |none| objective(&trials[none], variance));
        let beyond = none.is_none_or(|none| trials[none].aligned.variance >= BEYOND * BEYOND * variance);
        let drop = before - objective(trial, variance);
        if beyond && drop > price(alpha, trial.change.alternatives()) {
            accepted.push((k, drop));
        }
    }
    let least = accepted.iter().map(|(k, _)| trials[*k].aligned.variance).fold(f64::INFINITY, f64::min);
    let alike = accepted.into_iter().filter(|(k, _)| trials[*k].aligned.variance <= ALIKE * least);
    let best = alike.min_by(|(a, _), (b, _)| {
        let [a, b] = [a, b].map(|k| turned(&trials[*k].aligned, survey));
        a.total_cmp(&b)
    });
    let chosen = best.map(|(k, _)| k).or(none)?;
    let trial = trials.swap_remove(chosen);
    let of = |k: &usize| group.members[*k].clone();
    let mut judged = Judged {
        group: Group { members: trial.members.iter().map(of).collect(), ..group.clone() },
        computed: trial.members.iter().filter_map(|k| group.members[*k].computed).collect(),
        targets: trial.targets,
        aligned: trial.aligned,
        wrong: Vec::new(),
        mistakes: Vec::new(),
    };
    if let Some((_, drop)) = best {
        let ln_p = ln_p(drop, trial.change.alternatives());
        judged.mistakes.push(words::changed(group.subject, trial.change, drop, ln_p));
    }
    members::judge(&mut judged, alpha);
    Some(judged)
}

/// How far a similarity turns the block from where it was approximated: the angle of its vertical, and a little of all its angle.
fn turned(aligned: &Aligned, survey: &Survey) -> f64 {
    /// Where the vertical decides nothing the whole turn does.
    const LITTLE: f64 = 0.1;
    let rotation = aligned.similarity.rotation;
    (rotation * survey.up).angle(&Vector3::z()) + LITTLE * rotation.angle()
}
