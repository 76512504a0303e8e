//! Two groups of the right shape against each other: both must give the free network the same place.

use super::align::{of_majority, usual_square};
use super::judged::{Few, Judged};
use super::relation::{Difference, GEOID_M, Relation, Tilt, relations};
use super::survey::{Focal, Subject, Survey};
use super::words;
use super::{BEYOND, Mistake, ln_p, price};
use crate::evaluate::similarity::Similarity;
use crate::math::statistics::{chi_square_quantile, median};
use nalgebra::Vector3;

/// Arms of antennas, a base station of autonomous coordinates and realisations of one datum make smaller offsets, m:
/// what `gnss-shift` may explain.
const STATIONS_M: f64 = 10.0;
/// Datums of one country differ by less, m: farther is another system.
const DATUMS_M: f64 = 110.0;
/// Times its own standard deviation that the focal length of the network may be wrong by.
const FOCAL_SIGMAS: f64 = 3.0;
/// Share by which a stated focal length is off without a mistake: EXIF has tenths of a millimetre of lenses of five
/// and more, and pixel sizes as rounded.
const FOCAL_ROUNDING: f64 = 0.02;
/// Scales of maps differ from one by less (`map-scale`).
const MAP_SCALE: f64 = 3e-3;

/// A group that is held against another one.
struct Tested<'a> {
    subject: Subject,
    computed: &'a [Vector3<f64>],
    targets: &'a [Vector3<f64>],
    /// Members that are left out.
    wrong: &'a [usize],
    /// Standard deviations of its misfits, m: stated ones of a group that is too small to judge by itself.
    deviation: [f64; 2],
    /// `None` of a group that is too small.
    similarity: Option<&'a Similarity>,
}

impl<'a> Tested<'a> {
    fn judged(judged: &'a Judged) -> Self {
        Self {
            subject: judged.group.subject,
            computed: &judged.computed,
            targets: &judged.targets,
            wrong: &judged.wrong,
            deviation: judged.aligned.deviation(),
            similarity: Some(&judged.aligned.similarity),
        }
    }

    fn few(few: &'a Few) -> Self {
        let Few { subject, sigma, computed, targets } = few;
        Self { subject: *subject, computed, targets, wrong: &[], deviation: *sigma, similarity: None }
    }
}

/// Which differences are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gate {
    /// Those that no bent network makes.
    Certain,
    /// Smaller ones, too, of which a relation leaves nothing: an adjustment has to tell whether they are mistakes.
    Doubtful,
}

/// Differences between the groups that were judged, and of those that are too small for that from the others.
pub fn judge_all(judged: &[Judged], few: &[Few], survey: &Survey, alpha: f64, gate: Gate) -> Vec<Mistake> {
    let find = |subject: Subject| judged.iter().find(|one| one.group.subject == subject && one.placed);
    let tested = |subject: Subject| {
        let small = || few.iter().find(|one| one.subject == subject).map(Tested::few);
        find(subject).map(Tested::judged).or_else(small)
    };
    let mut found = Vec::new();
    // Positions of images against points; then points against points, which no antenna and no focal length stand
    // between.
    let points = tested(Subject::Control).or_else(|| tested(Subject::Check));
    if let (Some(gnss), Some(points)) = (find(Subject::Gnss), points) {
        found.extend(judge(gnss, &points, survey, alpha, gate));
    }
    if let (Some(control), Some(check)) = (find(Subject::Control), tested(Subject::Check)) {
        // Of two lists of points the one that is further from the antennas is held against the other one.
        let apart = |points: &Tested<'_>| find(Subject::Gnss).map_or(0.0, |gnss| Held::new(gnss, points).apart());
        let other = find(Subject::Check).filter(|_| apart(&Tested::judged(control)) > apart(&check));
        found.extend(match other {
            Some(check) => judge(check, &Tested::judged(control), survey, alpha, gate),
            None => judge(control, &check, survey, alpha, gate),
        });
    }
    // What contradicts both other groups has one mistake.
    found.dedup_by(|second, first| (&second.kind, &second.subject) == (&first.kind, &first.subject));
    found
}

/// A group beside the place that another one gives it.
struct Held {
    /// Members that are not wrong by themselves.
    right: Vec<usize>,
    recorded: Vec<Vector3<f64>>,
    expected: Vec<Vector3<f64>>,
    /// Standard deviations of a misfit, m.
    deviation: Vector3<f64>,
}

impl Held {
    fn new(reference: &Judged, tested: &Tested<'_>) -> Self {
        let right: Vec<usize> = (0..tested.targets.len()).filter(|k| !tested.wrong.contains(k)).collect();
        let recorded = right.iter().map(|k| tested.targets[*k]).collect();
        let expected = right.iter().map(|k| reference.aligned.similarity.apply(&tested.computed[*k])).collect();
        // What the images do to the shape of a block is some pixels: control around check points shows a dome as an
        // offset.
        let deviation = deviation(reference, tested, &right).map(|own| own.hypot(reference.pixel));
        Self { right, recorded, expected, deviation }
    }

    /// Variance factor of misfits, one where they are as expected.
    fn variance(&self, misfits: &[Vector3<f64>]) -> f64 {
        let squares = misfits.iter().map(|misfit| square(misfit, &self.deviation)).collect();
        (of_majority(squares) / usual_square(self.right.len())).max(1.0)
    }

    /// The same of what is recorded.
    fn apart(&self) -> f64 {
        self.variance(&Relation::Same.misfits(&self.recorded, &self.expected))
    }
}

/// Holds `tested` against the place that `reference` gives it.
fn judge(reference: &Judged, tested: &Tested<'_>, survey: &Survey, alpha: f64, gate: Gate) -> Option<Mistake> {
    let held = Held::new(reference, tested);
    let variance = |misfits: &[Vector3<f64>]| held.variance(misfits);
    let Held { right, recorded, expected, deviation } = &held;
    let before = Relation::Same.misfits(recorded, expected);
    if gate == Gate::Certain && variance(&before) < BEYOND * BEYOND {
        return None;
    }
    let explains = |before: f64, after: f64| explains(before, after, gate);
    let all = relations().into_iter().map(|relation| (relation, relation.misfits(recorded, expected)));
    let mut all: Vec<(Relation, Vec<Vector3<f64>>)> = all.collect();
    // Small numbers fit flat ground, whatever was recorded: heights in another unit restore the relief or the level.
    let flattened = variance(&Relation::flattened(recorded, expected));
    all.retain(|(relation, after)| {
        !matches!(relation, Relation::HeightUnit(_)) || explains(flattened, variance(after))
    });
    // A network that bends a little tilts its parts: a tilt is asked for where nothing simpler explains the difference.
    if all.iter().any(|(relation, after)| *relation != Relation::Tilt && explains(variance(&before), variance(after))) {
        all.retain(|(relation, _)| *relation != Relation::Tilt);
    }
    let least = all.iter().map(|(_, misfits)| variance(misfits)).fold(f64::INFINITY, f64::min);
    // One or two members cannot outvote each other: a blunder in all of them and an offset are the same.
    let cap = match right.len() {
        0..=2 => f64::INFINITY,
        members => chi_square_quantile(1.0 - alpha / members as f64, 3.0),
    };
    let objective = |misfits: &[Vector3<f64>]| {
        misfits.iter().map(|misfit| (square(misfit, deviation) / least).min(cap)).sum::<f64>()
    };
    let cost = |relation: &Relation| match relation.freedom() {
        (_, 0) => 0.0,
        (_, numbers) => chi_square_quantile(1.0 - alpha, numbers as f64),
    };
    let total = |(relation, misfits): &(Relation, Vec<Vector3<f64>>)| objective(misfits) + cost(relation);
    let (relation, after) = all[1..].iter().min_by(|a, b| total(a).total_cmp(&total(b)))?;
    let shift = middle(&before);
    let drop = objective(&before) - objective(after);
    let (alternatives, _) = relation.freedom();
    let pays = drop > price(alpha, alternatives) + cost(relation);
    if pays && explains(variance(&before), variance(after)) {
        let sigma = Vector3::from_fn(|axis, _| sigma_of_shift(reference, tested, right, axis));
        let ln_p = ln_p(drop - cost(relation), alternatives);
        let tilt = Tilt::of(&before, expected).map_or(0.0, |tilt| tilt.angle());
        let difference = Difference { relation: *relation, shift, sigma, tilt, drop, ln_p };
        let found = named(reference, tested, survey, &difference);
        let is_of_one = |own: &Mistake| right.len() == 1 && own.kind == "height-offset";
        return found.map(|own| if is_of_one(&own) { words::of_one_point(own) } else { own });
    }
    if gate == Gate::Doubtful {
        return None;
    }
    let drop = before.iter().map(|misfit| square(misfit, deviation).min(cap)).sum();
    other_frame(reference, tested, shift, drop)
}

/// Does a relation that leaves the variance `after` explain `before`? What is left beside it is less than what would be
/// a mistake by itself, and an order of magnitude less than it. Of a doubtful one, a tenth of its variance.
fn explains(before: f64, after: f64, gate: Gate) -> bool {
    match gate {
        Gate::Certain => after < BEYOND * BEYOND && before >= BEYOND * BEYOND * after,
        Gate::Doubtful => before >= BEYOND * after,
    }
}

/// A height offset against GNSS positions with a better value; `focal`: see `words::height_offset`.
pub fn with_value(mistake: &Mistake, value: f64, sigma: f64, focal: Option<f64>) -> Mistake {
    let subject = if mistake.subject == Subject::Check.key() { Subject::Check } else { Subject::Control };
    let [shift, sigma] = [value, sigma].map(|own| Vector3::new(0.0, 0.0, own));
    let Mistake { drop, ln_p, .. } = *mistake;
    let difference = Difference { relation: Relation::Height, shift, sigma, tilt: 0.0, drop, ln_p };
    let offset = words::height_offset(Subject::Gnss, subject, &difference, focal);
    if words::is_of_one_point(mistake) { words::of_one_point(offset) } else { offset }
}

/// Median of misfits, by axis.
fn middle(misfits: &[Vector3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| median(&misfits.iter().map(|misfit| misfit[axis]).collect::<Vec<_>>()))
}

/// A difference with its name; `None` where physics explains it.
fn named(reference: &Judged, tested: &Tested<'_>, survey: &Survey, difference: &Difference) -> Option<Mistake> {
    let [one, other] = [reference.group.subject, tested.subject];
    let antennas = one == Subject::Gnss;
    let Difference { relation, shift, .. } = difference;
    // A little beside straight up is what the bent network adds.
    let upright = BEYOND * shift.xy().norm() <= shift.z.abs();
    let relation = if *relation == Relation::Shift && upright { Relation::Height } else { *relation };
    match relation {
        // A wrong focal length moves all images up or down, too.
        Relation::Height if antennas => {
            let distance = survey.distance * reference.aligned.similarity.scale;
            let (share, stated) = match survey.focal {
                Focal::Determined(sigma) => (FOCAL_SIGMAS * sigma, None),
                Focal::Stated => (FOCAL_ROUNDING, Some(shift.z.abs() / distance)),
            };
            let beyond = shift.z.abs() >= GEOID_M[0].max(share * distance);
            beyond.then(|| words::height_offset(one, other, difference, stated))
        }
        Relation::Plan | Relation::Shift if antennas => match shift.norm() {
            distance if distance > DATUMS_M => Some(words::other_frame(one, other, distance, difference)),
            distance if distance > STATIONS_M => Some(words::plan_offset(one, other, difference)),
            _ => None,
        },
        Relation::Height => Some(words::height_offset(one, other, difference, None)),
        Relation::Tilt => Some(words::tilt(one, other, difference)),
        Relation::Plan | Relation::Shift => Some(words::plan_offset(one, other, difference)),
        _ => Some(words::recorded_otherwise(one, other, difference)),
    }
}

/// What no simple relation explains: turned, of another scale, or of another system.
fn other_frame(reference: &Judged, tested: &Tested<'_>, shift: Vector3<f64>, drop: f64) -> Option<Mistake> {
    let [one, other] = [reference.group.subject, tested.subject];
    let between: Similarity = tested.similarity?.after(&reference.aligned.similarity.inverse());
    let difference =
        Difference { relation: Relation::Shift, shift, sigma: Vector3::zeros(), tilt: 0.0, drop, ln_p: ln_p(drop, 1) };
    let vertical = (between.rotation * Vector3::z()).angle(&Vector3::z());
    let angle = between.rotation.angle();
    let scaled = between.scale.ln().abs() > MAP_SCALE;
    match (scaled, angle > vertical + MAP_SCALE) {
        _ if one == Subject::Gnss && difference.shift.norm() > DATUMS_M => {
            Some(words::other_frame(one, other, difference.shift.norm(), &difference))
        }
        (true, _) if !turned_much(angle) => Some(words::scale(one, other, between.scale, &difference)),
        (_, true) => {
            let heading = between.rotation * Vector3::x();
            Some(words::rotation(one, other, heading.y.atan2(heading.x).to_degrees(), &difference))
        }
        _ if one == Subject::Gnss => None,
        _ => Some(words::other_frame(one, other, difference.shift.norm(), &difference)),
    }
}

/// A scale beside a turn by more than this is another system.
fn turned_much(angle: f64) -> bool {
    const DEGREE: f64 = std::f64::consts::PI / 180.0;
    angle > DEGREE
}

/// Standard deviations of a misfit between two groups: of both, and of the similarity that takes the one to the other.
fn deviation(reference: &Judged, tested: &Tested<'_>, right: &[usize]) -> Vector3<f64> {
    let own = |deviation: [f64; 2], axis: usize| deviation[usize::from(axis == 2)].powi(2);
    Vector3::from_fn(|axis, _| {
        let carried = |k: &usize| reference.aligned.covariance(&tested.computed[*k])[(axis, axis)];
        let carried = median(&right.iter().map(carried).collect::<Vec<_>>());
        (own(reference.aligned.deviation(), axis) + own(tested.deviation, axis) + carried).sqrt()
    })
}

/// Standard deviation of the median of the misfits along an axis.
fn sigma_of_shift(reference: &Judged, tested: &Tested<'_>, right: &[usize], axis: usize) -> f64 {
    let all = deviation(reference, tested, right)[axis];
    // The similarities of both groups stand behind all misfits alike.
    all * (1.0 / right.len() as f64 + 1.0 / reference.targets.len() as f64).sqrt().max(0.5)
}

fn square(misfit: &Vector3<f64>, deviation: &Vector3<f64>) -> f64 {
    misfit.component_div(deviation).norm_squared()
}
