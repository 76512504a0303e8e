//! The shape of one group against the free network.

use super::align::{Aligned, align};
use super::clock;
use super::judged::Judged;
use super::members::{self, FEWEST_OF_FLIGHT};
use super::shape::Change;
use super::survey::{Group, Subject, Survey};
use super::words;
use super::{BEYOND, ln_p, price};
use crate::math::statistics::{chi_square_quantile, mean, median};
use nalgebra::Vector3;
use std::cmp::Ordering;

/// Variances within this factor are equally good: mirrors fit alike, whichever axis they mirror.
const ALIKE: f64 = 4.0;

/// A group under one alternative.
struct Trial {
    change: Change,
    members: Vec<usize>,
    targets: Vec<Vector3<f64>>,
    aligned: Aligned,
}

impl Trial {
    /// `seen`: members that the images give.
    fn new(group: &Group, change: Change, seen: &[usize]) -> Option<Self> {
        let undone = change.undone(group);
        let members: Vec<usize> = seen.iter().copied().filter(|k| undone[*k].is_some()).collect();
        let source: Vec<_> = members.iter().filter_map(|k| group.members[*k].computed).collect();
        let targets: Vec<_> = members.iter().filter_map(|k| undone[*k]).collect();
        let aligned = align(&source, &targets, group.sigma)?;
        Some(Self { change, members, targets, aligned })
    }

    /// Square of the free network's scale, which all alternatives share: in degrees every misfit would be small.
    fn in_network(&self) -> f64 {
        self.aligned.similarity.scale.powi(-2)
    }

    /// Variance of the members that agree.
    fn variance(&self) -> f64 {
        self.aligned.variance * self.in_network()
    }

    /// Robust sum of squares at a variance.
    fn objective(&self, variance: f64, cap: f64) -> f64 {
        self.aligned.objective(variance / self.in_network(), cap)
    }

    /// Mean square under this alternative of the members that fit another one.
    fn moves(&self, other: &Self, cap: f64) -> f64 {
        let fitting = (0..other.members.len()).filter(|k| other.aligned.square(*k) <= cap * other.aligned.variance);
        let own = fitting.filter_map(|k| self.members.binary_search(&other.members[k]).ok());
        let squares: Vec<f64> = own.map(|k| self.aligned.square(k) * self.in_network()).collect();
        mean(&squares)
    }

    /// How far the flight is off that is off most: the length of the median of its misfits, in the free network. `None`
    /// where no flight has enough.
    fn of_flights(&self, group: &Group) -> Option<f64> {
        let of_flight = |flight: usize| {
            let own = (0..self.members.len()).filter(|k| group.members[self.members[*k]].flight == flight);
            let misfits: Vec<Vector3<f64>> = own.map(|k| self.aligned.misfits[k]).collect();
            let along = |axis: usize| median(&misfits.iter().map(|misfit| misfit[axis]).collect::<Vec<_>>());
            (misfits.len() >= FEWEST_OF_FLIGHT).then(|| Vector3::from_fn(|axis, _| along(axis)).norm())
        };
        let largest = (0..group.flights.len()).filter_map(of_flight).reduce(f64::max)?;
        Some(largest / self.aligned.similarity.scale)
    }

    /// How far members are off, or a whole flight, m.
    fn off(&self, group: &Group) -> f64 {
        let members = median(&self.aligned.misfits.iter().map(Vector3::norm).collect::<Vec<_>>());
        self.of_flights(group).map_or(members, |flight| members.max(flight * self.aligned.similarity.scale))
    }

    /// Does a difference of clocks take whole flights to their places? Strips that are all flown one way move together
    /// by it, and those at another speed stay behind: less than single positions are off in a bent network.
    fn is_of_flights(&self, none: Option<&Self>, group: &Group) -> bool {
        let (Change::Clock(_), Some(none)) = (self.change, none) else { return false };
        let [before, after] = [none, self].map(|trial| trial.of_flights(group));
        before.zip(after).is_some_and(|(before, after)| before >= BEYOND * after)
    }
}

/// Finds the change that takes a group to its shape in the free network, and judges its members under it. `None`
/// where too few members agree under any.
pub fn judge(group: &Group, survey: &Survey, alpha: f64) -> Option<Judged> {
    let seen: Vec<usize> = (0..group.members.len()).filter(|k| group.members[*k].computed.is_some()).collect();
    let cap = chi_square_quantile(1.0 - alpha / seen.len().max(1) as f64, 3.0);
    let trial = |change: Change| Trial::new(group, change, &seen);
    let mut trials: Vec<Trial> = Change::all(group).into_iter().filter_map(trial).collect();
    let none = trials.iter().position(|trial| trial.change == Change::None);
    if group.subject == Subject::Gnss
        && let Some(clock) = clock::best(group, none.map(|none| trials[none].off(group)))
    {
        trials.extend(Trial::new(group, Change::Clock(clock), &seen));
    }
    let mut accepted: Vec<(usize, f64)> = Vec::new();
    for (k, trial) in trials.iter().enumerate().filter(|(_, trial)| trial.change != Change::None) {
        let variance = trial.variance();
        // A member that an alternative leaves without a position costs what a blunder costs.
        let after = trial.objective(variance, cap) + cap * (seen.len() - trial.members.len()) as f64;
        let before = none.map_or(cap * seen.len() as f64, |none| trials[none].objective(variance, cap));
        let none = none.map(|none| &trials[none]);
        let beyond = none.is_none_or(|none| none.moves(trial, cap) >= BEYOND * BEYOND * variance);
        let beyond = beyond || trial.is_of_flights(none, group);
        if beyond && before - after > price(alpha, trial.change.alternatives()) {
            accepted.push((k, before - after));
        }
    }
    let least = accepted.iter().map(|(k, _)| trials[*k].variance()).fold(f64::INFINITY, f64::min);
    let alike = accepted.into_iter().filter(|(k, _)| trials[*k].variance() <= ALIKE * least);
    let best = alike.min_by(|(a, _), (b, _)| {
        // A list that slipped by one place looks like clocks that differ by one interval, and is the simpler mistake.
        let order = |k: &usize| (matches!(trials[*k].change, Change::Clock(_)), turned(&trials[*k].aligned, survey));
        order(a).partial_cmp(&order(b)).unwrap_or(Ordering::Equal)
    });
    let chosen = best.map(|(k, _)| k).or(none)?;
    let trial = trials.swap_remove(chosen);
    let of = |k: &usize| group.members[*k].clone();
    let mut judged = Judged {
        group: Group { members: trial.members.iter().map(of).collect(), ..group.clone() },
        computed: trial.members.iter().filter_map(|k| group.members[*k].computed).collect(),
        targets: trial.targets,
        pixel: survey.pixel * trial.aligned.similarity.scale,
        aligned: trial.aligned,
        placed: !matches!(trial.change, Change::Degrees(_)),
        wrong: Vec::new(),
        mistakes: Vec::new(),
    };
    if let Some((_, drop)) = best {
        let ln_p = ln_p(drop, trial.change.alternatives());
        judged.mistakes.push(words::changed(group.subject, trial.change, drop, ln_p));
    }
    // A position between two recorded ones is nobody's: what is wrong shows once the clocks agree.
    if !matches!(trial.change, Change::Clock(_)) {
        members::judge(&mut judged, alpha);
    }
    Some(judged)
}

/// How far a similarity turns the block from where it was approximated: the angle of its vertical, and a little of
/// all its angle.
fn turned(aligned: &Aligned, survey: &Survey) -> f64 {
    /// Where the vertical decides nothing the whole turn does.
    const LITTLE: f64 = 0.1;
    let rotation = aligned.similarity.rotation;
    (rotation * survey.up).angle(&Vector3::z()) + LITTLE * rotation.angle()
}
