//! Members of a group that do not fit, one by one.

use super::group::Judged;
use super::survey::Subject;
use super::words;
use super::{BEYOND, Mistake};
use crate::math::statistics::{f_ln_sf, f_quantile, median};
use nalgebra::Vector3;

/// Shifts of a flight that are physics: what the catalogue allows a drifting receiver (`gnss-drift`), m.
const PLAUSIBLE_SHIFT_M: f64 = 10.0;
/// Images of a flight that must agree on its shift.
const FEWEST_OF_FLIGHT: usize = 5;

/// Names the members that do not fit.
pub fn judge(judged: &mut Judged, alpha: f64) {
    let fits = Fits::new(judged, alpha);
    judged.wrong = (0..judged.targets.len()).filter(|k| fits.is_wrong(&judged.aligned.misfits[*k])).collect();
    let mut left = judged.wrong.clone();
    let mut found = Vec::new();
    if judged.group.subject == Subject::Gnss {
        found.extend(flights(judged, &fits, &mut left));
        if !left.is_empty() {
            let names = left.iter().map(|k| judged.group.members[*k].name.clone()).collect();
            let worst = left.iter().map(|k| judged.aligned.misfits[*k].norm()).fold(0.0, f64::max);
            let (drop, ln_p) = fits.improbable(left.iter().map(|k| judged.aligned.misfits[*k]));
            found.push(words::wrong_positions(names, worst, drop, ln_p));
        }
    } else {
        found.extend(left.iter().map(|k| single(judged, &fits, *k)));
        found.extend(exchanged(judged, judged, &fits));
    }
    judged.mistakes.extend(found);
}

/// What fits beside a group.
struct Fits {
    deviation: [f64; 3],
    dof: f64,
    level: f64,
    members: f64,
}

impl Fits {
    fn new(judged: &Judged, alpha: f64) -> Self {
        let [xy, z] = judged.aligned.deviation();
        let members = judged.targets.len() as f64;
        Self { deviation: [xy, xy, z], dof: judged.aligned.dof, level: alpha / members, members }
    }

    fn in_deviations(&self, misfit: &Vector3<f64>) -> [f64; 3] {
        [0, 1, 2].map(|axis| misfit[axis] / self.deviation[axis])
    }

    /// Sum of squares of a misfit.
    fn square(&self, misfit: &Vector3<f64>) -> f64 {
        self.in_deviations(misfit).iter().map(|x| x * x).sum()
    }

    /// Significant among all members, and an order of magnitude beyond them.
    fn is_wrong(&self, misfit: &Vector3<f64>) -> bool {
        let beyond = self.in_deviations(misfit).iter().any(|x| x.abs() >= BEYOND);
        beyond && f_ln_sf(self.square(misfit) / 3.0, 3.0, self.dof) < self.level.ln()
    }

    fn fits(&self, misfit: &Vector3<f64>) -> bool {
        self.square(misfit) <= 3.0 * f_quantile(1.0 - self.level, 3.0, self.dof)
    }

    /// Fall of the sum of squares without these misfits, and `ln p` of the largest.
    fn improbable(&self, misfits: impl Iterator<Item = Vector3<f64>>) -> (f64, f64) {
        let (sum, largest) = misfits
            .map(|misfit| self.square(&misfit))
            .fold((0.0, 0.0_f64), |(sum, most), square| (sum + square, most.max(square)));
        (sum, (f_ln_sf(largest / 3.0, 3.0, self.dof) + self.members.ln()).min(0.0))
    }
}

/// Flights whose positions share a shift; their images are taken out of `left`.
fn flights(judged: &Judged, fits: &Fits, left: &mut Vec<usize>) -> Vec<Mistake> {
    let mut found = Vec::new();
    for (flight, name) in judged.group.flights.iter().enumerate() {
        let of_flight = |k: &usize| judged.group.members[*k].flight == flight;
        let all: Vec<usize> = (0..judged.targets.len()).filter(of_flight).collect();
        let wrong: Vec<usize> = left.iter().copied().filter(of_flight).collect();
        if wrong.len() < FEWEST_OF_FLIGHT || 2 * wrong.len() <= all.len() {
            continue;
        }
        let along = |axis: usize| all.iter().map(|k| judged.aligned.misfits[*k][axis]).collect::<Vec<_>>();
        let shift = Vector3::from_fn(|axis, _| median(&along(axis)));
        let fitting = all.iter().filter(|k| !fits.is_wrong(&(judged.aligned.misfits[**k] - shift)));
        let fitting: Vec<usize> = fitting.copied().collect();
        if 2 * fitting.len() <= all.len() || shift.norm() <= PLAUSIBLE_SHIFT_M {
            continue;
        }
        let images: Vec<String> = all.iter().map(|k| judged.group.members[*k].name.clone()).collect();
        let (drop, ln_p) = fits.improbable(fitting.iter().map(|k| judged.aligned.misfits[*k]));
        let sigma = shift_sigma(fits, &shift, fitting.len());
        found.push(words::flight_offset(name, images, &shift, sigma, drop, ln_p));
        left.retain(|k| !fitting.contains(k));
    }
    found
}

fn shift_sigma(fits: &Fits, shift: &Vector3<f64>, n: usize) -> f64 {
    let variance: f64 = (0..3).map(|k| (shift[k] * fits.deviation[k]).powi(2)).sum::<f64>() / shift.norm_squared();
    // A median has pi / 2 times the variance of a mean.
    (variance * std::f64::consts::FRAC_PI_2 / n as f64).sqrt()
}

/// A point by itself: wrong in one coordinate, or as a whole.
fn single(judged: &Judged, fits: &Fits, k: usize) -> Mistake {
    let misfit = judged.aligned.misfits[k];
    let (subject, name) = (judged.group.subject, &judged.group.members[k].name);
    let (drop, ln_p) = fits.improbable(std::iter::once(misfit));
    let in_deviations = fits.in_deviations(&misfit);
    let axis = (0..3).max_by(|a, b| in_deviations[*a].abs().total_cmp(&in_deviations[*b].abs())).unwrap_or(2);
    let mut others = misfit;
    others[axis] = 0.0;
    match fits.fits(&others) {
        true => words::wrong_coordinate(subject, name, axis, misfit[axis], fits.deviation[axis], drop, ln_p),
        false => words::wrong_position(subject, name, &misfit, drop, ln_p),
    }
}

/// Pairs of points, one of each group, that fit once exchanged.
fn exchanged(one: &Judged, other: &Judged, fits: &Fits) -> Vec<Mistake> {
    let same = std::ptr::eq(one, other);
    let mut found = Vec::new();
    for &i in &one.wrong {
        for &j in other.wrong.iter().filter(|j| !same || i < **j) {
            // In the frame of the first group.
            let at = |judged: &Judged, k: usize| one.aligned.similarity.apply(&judged.computed[k]);
            let crossed = [other.targets[j] - at(one, i), one.targets[i] - at(other, j)];
            if crossed.iter().all(|misfit| fits.fits(misfit)) {
                let (drop, ln_p) = fits.improbable([one.aligned.misfits[i], other.aligned.misfits[j]].into_iter());
                let names = [&one.group.members[i].name, &other.group.members[j].name];
                found.push(words::exchanged(one.group.subject, names, drop, ln_p));
            }
        }
    }
    found
}

/// Points of two groups that fit once exchanged: a control point and a check point.
pub fn exchanged_between(judged: &[Judged], alpha: f64) -> Vec<Mistake> {
    let find = |subject: Subject| judged.iter().find(|one| one.group.subject == subject);
    let (Some(control), Some(check)) = (find(Subject::Control), find(Subject::Check)) else { return Vec::new() };
    exchanged(control, check, &Fits::new(control, alpha))
}

/// Without what a point was called alone, where an exchange explains it.
pub fn without_repetition(found: Vec<Mistake>) -> Vec<Mistake> {
    let pairs = found.iter().filter(|mistake| mistake.kind == "exchanged");
    let exchanged: Vec<String> = pairs.flat_map(|mistake| mistake.names.clone()).collect();
    let alone = |mistake: &Mistake| mistake.kind == "wrong-coordinate" || mistake.kind == "wrong-position";
    let repeated = |m: &Mistake| m.subject != "gnss" && alone(m) && m.names.iter().all(|n| exchanged.contains(n));
    found.into_iter().filter(|mistake| !repeated(mistake)).collect()
}
