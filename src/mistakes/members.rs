//! Members of a group that do not fit, one by one.

use super::align::Aligned;
use super::bend::Bend;
use super::judged::Judged;
use super::survey::Subject;
use super::words;
use super::{BEYOND, Mistake};
use crate::math::statistics::{f_ln_sf, f_quantile, mad, median};
use nalgebra::Vector3;

/// Shifts of a flight that are physics: what the catalogue allows a drifting receiver (`gnss-drift`), m.
const PLAUSIBLE_SHIFT_M: f64 = 10.0;
/// Standard deviation of a normal sample in its median absolute deviation.
const OF_MAD: f64 = 1.4826;
/// Positions before and after one in its flight that it is held against; twice as many points around one.
const NEIGHBOURS: usize = 3;
/// Images of a flight that must agree on its shift.
pub const FEWEST_OF_FLIGHT: usize = 5;

/// Names the members that do not fit.
pub fn judge(judged: &mut Judged, alpha: f64) {
    let fits = Fits::new(judged, alpha);
    let is_wrong = |k: &usize| {
        // A flight is examined as a whole before its single positions are.
        let is_position = judged.group.subject == Subject::Gnss;
        fits.is_wrong(*k, &Vector3::zeros()) && (is_position || fits.stands_out(*k))
    };
    judged.wrong = (0..judged.targets.len()).filter(is_wrong).collect();
    let mut left = judged.wrong.clone();
    let mut found = Vec::new();
    if judged.group.subject == Subject::Gnss {
        found.extend(flights(judged, &fits, &mut left));
        left.retain(|k| fits.stands_alone(*k, judged));
        let pairs = pairs([judged, judged], [&left, &left], &fits);
        left.retain(|k| pairs.iter().all(|pair| !pair.contains(k)));
        found.extend(pairs.into_iter().map(|pair| {
            let (drop, ln_p) = fits.improbable(&pair);
            words::exchanged_images(pair.map(|k| judged.group.members[k].name.as_str()), drop, ln_p)
        }));
        if !left.is_empty() {
            let names = left.iter().map(|k| judged.group.members[*k].name.clone()).collect();
            let worst = left.iter().map(|k| fits.misfits[*k].norm()).fold(0.0, f64::max);
            let (drop, ln_p) = fits.improbable(&left);
            found.push(words::wrong_positions(names, worst, drop, ln_p));
        }
    } else {
        found.extend(left.iter().map(|k| single(judged, &fits, *k)));
        found.extend(exchanged(judged, judged, &fits));
    }
    judged.mistakes.extend(found);
}

/// A place in the system of the group.
#[derive(Clone, Copy)]
struct Place {
    at: Vector3<f64>,
    /// Variances of what the network knows of it, m^2.
    variances: Vector3<f64>,
}

impl Place {
    /// Where the network puts a member of a group.
    fn of(judged: &Judged, member: usize, aligned: &Aligned) -> Self {
        let similarity = &aligned.similarity;
        let rotation = similarity.rotation.to_rotation_matrix();
        let own = rotation * judged.group.members[member].covariance * rotation.transpose();
        let variances = own.diagonal() * similarity.scale.powi(2);
        Self { at: similarity.apply(&judged.computed[member]), variances }
    }
}

/// What fits beside a group.
struct Fits {
    bend: Bend,
    places: Vec<Place>,
    /// Recorded less computed, the bend taken away.
    misfits: Vec<Vector3<f64>>,
    /// What a pixel is on the object.
    pixel: f64,
    level: f64,
}

impl Fits {
    fn new(judged: &Judged, alpha: f64) -> Self {
        let aligned = &judged.aligned;
        let places: Vec<Place> = (0..judged.computed.len()).map(|k| Place::of(judged, k, aligned)).collect();
        let bend = Bend::of(aligned, &places.iter().map(|place| place.at).collect::<Vec<_>>());
        let misfits = aligned.misfits.iter().zip(&places).map(|(misfit, place)| misfit - bend.at(&place.at)).collect();
        let level = alpha / places.len() as f64;
        Self { bend, places, misfits, pixel: judged.pixel, level }
    }

    fn in_deviations(&self, misfit: &Vector3<f64>, place: &Place) -> [f64; 3] {
        [0, 1, 2].map(|axis| misfit[axis] / self.deviation(axis, place))
    }

    /// Standard deviation of a misfit: of the members that agree, of the surface there, and of the network.
    fn deviation(&self, axis: usize, place: &Place) -> f64 {
        (self.bend.outside(&place.at) * self.bend.deviation[axis]).hypot(place.variances[axis].sqrt())
    }

    /// Sum of squares of a misfit.
    fn square(&self, misfit: &Vector3<f64>, place: &Place) -> f64 {
        self.in_deviations(misfit, place).iter().map(|x| x * x).sum()
    }

    /// Is a member, moved by `less`, significant among all, and an order of magnitude beyond them and beyond a pixel?
    /// What a lens, a shutter or a sensor does to points is some pixels; few members may agree by chance with all of
    /// it.
    fn is_wrong(&self, k: usize, less: &Vector3<f64>) -> bool {
        let misfit = self.misfits[k] - less;
        let in_deviations = self.in_deviations(&misfit, &self.places[k]);
        let beyond = (0..3).any(|axis| in_deviations[axis].abs().min(misfit[axis].abs() / self.pixel) >= BEYOND);
        beyond && f_ln_sf(self.square(&misfit, &self.places[k]) / 3.0, 3.0, self.bend.dof) < self.level.ln()
    }

    /// Does a position stand out from those before and after it in its flight? A receiver that drifts moves
    /// neighbours together.
    fn stands_alone(&self, k: usize, judged: &Judged) -> bool {
        let flight = judged.group.members[k].flight;
        let from = k.saturating_sub(NEIGHBOURS);
        let near = (from..=k + NEIGHBOURS)
            .filter(|n| *n != k && judged.group.members.get(*n).is_some_and(|m| m.flight == flight));
        let near: Vec<usize> = near.collect();
        let usual = |axis: usize| median(&near.iter().map(|n| self.misfits[*n][axis]).collect::<Vec<_>>());
        near.is_empty() || self.is_wrong(k, &Vector3::from_fn(|axis, _| usual(axis)))
    }

    /// Does a point stand out from those around it? A network that bends (a long corridor, a lens that is not modelled)
    /// moves neighbours together, farther than its own precision says.
    fn stands_out(&self, k: usize) -> bool {
        let distance = |n: &usize| (self.places[*n].at - self.places[k].at).norm();
        let mut around: Vec<usize> = (0..self.places.len()).filter(|n| *n != k).collect();
        around.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        around.truncate(2 * NEIGHBOURS);
        let of_axis = |axis: usize| around.iter().map(|n| self.misfits[*n][axis]).collect::<Vec<_>>();
        if around.len() < NEIGHBOURS {
            return true;
        }
        let usual = Vector3::from_fn(|axis, _| median(&of_axis(axis)));
        let misfit = self.misfits[k] - usual;
        let stands_out = |axis: usize| misfit[axis].abs() >= BEYOND * OF_MAD * mad(&of_axis(axis));
        self.is_wrong(k, &usual) && (0..3).any(stands_out)
    }

    fn fits(&self, misfit: &Vector3<f64>, place: &Place) -> bool {
        self.square(misfit, place) <= 3.0 * f_quantile(1.0 - self.level, 3.0, self.bend.dof)
    }

    /// Fall of the sum of squares without these members, and `ln p` of the largest.
    fn improbable(&self, members: &[usize]) -> (f64, f64) {
        let squares = members.iter().map(|k| self.square(&self.misfits[*k], &self.places[*k]));
        let (sum, largest) = squares.fold((0.0, 0.0_f64), |(sum, most), square| (sum + square, most.max(square)));
        let members = self.places.len() as f64;
        (sum, (f_ln_sf(largest / 3.0, 3.0, self.bend.dof) + members.ln()).min(0.0))
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
        let along = |axis: usize| all.iter().map(|k| fits.misfits[*k][axis]).collect::<Vec<_>>();
        let shift = Vector3::from_fn(|axis, _| median(&along(axis)));
        let fitting: Vec<usize> = all.iter().copied().filter(|k| !fits.is_wrong(*k, &shift)).collect();
        if 2 * fitting.len() <= all.len() || shift.norm() <= PLAUSIBLE_SHIFT_M {
            continue;
        }
        let images: Vec<String> = all.iter().map(|k| judged.group.members[*k].name.clone()).collect();
        let (drop, ln_p) = fits.improbable(&fitting);
        let sigma = shift_sigma(fits, &shift, &fitting);
        found.push(words::flight_offset(name, images, &shift, sigma, drop, ln_p));
        left.retain(|k| !fitting.contains(k));
    }
    found
}

/// Of the length of a shift: its own, and that of the network where the flight is.
fn shift_sigma(fits: &Fits, shift: &Vector3<f64>, fitting: &[usize]) -> f64 {
    let deviation = Vector3::from(fits.bend.deviation);
    let along = shift.component_mul(&deviation).norm() / shift.norm();
    let factor = median(&fitting.iter().map(|k| fits.bend.outside(&fits.places[*k].at)).collect::<Vec<_>>());
    // A median has pi / 2 times the variance of a mean.
    along * (std::f64::consts::FRAC_PI_2 / fitting.len() as f64 + factor * factor - 1.0).sqrt()
}

/// A point by itself: wrong in one coordinate, or as a whole.
fn single(judged: &Judged, fits: &Fits, k: usize) -> Mistake {
    let (misfit, place) = (fits.misfits[k], fits.places[k]);
    let (subject, name) = (judged.group.subject, &judged.group.members[k].name);
    let (drop, ln_p) = fits.improbable(&[k]);
    let in_deviations = fits.in_deviations(&misfit, &place);
    let axis = (0..3).max_by(|a, b| in_deviations[*a].abs().total_cmp(&in_deviations[*b].abs())).unwrap_or(2);
    let mut others = misfit;
    others[axis] = 0.0;
    let sigma = fits.deviation(axis, &place);
    match fits.fits(&others, &place) {
        true => words::wrong_coordinate(subject, name, axis, misfit[axis], sigma, drop, ln_p),
        false => words::wrong_position(subject, name, &misfit, drop, ln_p),
    }
}

/// Pairs of members, one of each group, that fit once exchanged; `wrong`: those that are examined.
fn pairs([one, other]: [&Judged; 2], [wrong, others]: [&[usize]; 2], fits: &Fits) -> Vec<[usize; 2]> {
    let same = std::ptr::eq(one, other);
    let mut found = Vec::new();
    for &i in wrong {
        for &j in others.iter().filter(|j| !same || i < **j) {
            // In the frame of the first group.
            let [here, there] = [(one, i), (other, j)].map(|(group, k)| Place::of(group, k, &one.aligned));
            let crossed = [(other.targets[j], here), (one.targets[i], there)];
            let misfit = |target: &Vector3<f64>, place: &Place| target - place.at - fits.bend.at(&place.at);
            if crossed.iter().all(|(target, place)| fits.fits(&misfit(target, place), place)) {
                found.push([i, j]);
            }
        }
    }
    found
}

/// Points, one of each group, that fit once exchanged.
fn exchanged(one: &Judged, other: &Judged, fits: &Fits) -> Vec<Mistake> {
    let said = |[i, j]: [usize; 2]| {
        let (drop, ln_p) = fits.improbable(&[i]);
        let names = [&one.group.members[i].name, &other.group.members[j].name];
        words::exchanged(one.group.subject, names, drop, ln_p)
    };
    pairs([one, other], [&one.wrong, &other.wrong], fits).into_iter().map(said).collect()
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
