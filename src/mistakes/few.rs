//! Control that is too little for a majority: three or four points, and no other group beside them.
//!
//! Three points leave two degrees of freedom beside a similarity, four leave five. Nobody can say which of them is
//! wrong, as with more points, where most agree ([`super::group`]). Two things can still be said: that all of them
//! together contradict the shape that the images give, and that they fit it upside down alone, because a triangle or a
//! flat square turns into its mirror image about an axis in its plane. A cause is named where just one of those that
//! are tried takes the contradiction away, and four points were there to refuse it.

use super::align::FEWEST;
use super::shape::Change;
use super::survey::{Group, Subject, Survey};
use super::values::placed::extent;
use super::{BEYOND, Mistake, ln_p, words};
use crate::evaluate::similarity::{Similarity, SimilarityError, target_from_source};
use nalgebra::Vector3;

/// Points that a similarity needs.
const LEAST: usize = 3;
/// Points of which a wrong alternative fits by chance in less than one of some thousand cases: it would have to come
/// within a tenth in five directions. Of three points there are two directions.
const NAMED_FROM: usize = 4;

/// What may have been done to the coordinates.
#[derive(Clone, Copy)]
enum Cause {
    Changed(Change),
    /// Two members exchanged.
    Pair(usize, usize),
}

/// How points fit as they are.
pub enum Fit {
    /// Off by so much, m (RMS).
    Off(f64),
    /// The two shapes do not resemble each other.
    None,
    /// They fit, the cameras below the ground.
    UpsideDown,
}

/// The points under one cause.
struct Trial {
    cause: Cause,
    similarity: Similarity,
    /// Root mean square misfit by degree of freedom, in the free network's own length.
    misfit: f64,
    /// Sum of squares in stated standard deviations.
    square: f64,
    /// What nobody tells from a good fit: an order of magnitude beyond the stated precision, a pixel, and what the
    /// network knows of each point beside the others.
    limit: f64,
    /// Do cameras lie below the points that lie above them as approximated?
    upside_down: bool,
}

impl Trial {
    fn new(cause: Cause, group: &Group, survey: &Survey) -> Result<Self, SimilarityError> {
        let change = if let Cause::Changed(change) = cause { change } else { Change::None };
        let mut targets: Vec<Vector3<f64>> = change.undone(group).into_iter().flatten().collect();
        if let Cause::Pair(i, j) = cause {
            targets.swap(i, j);
        }
        let source: Vec<Vector3<f64>> = group.members.iter().filter_map(|member| member.computed).collect();
        let similarity = target_from_source(&source, &targets, None)?.similarity;
        let misfits = source.iter().zip(&targets).map(|(p, target)| target - similarity.apply(p));
        let dof = (3 * targets.len() - 7) as f64;
        let [xy, z] = group.sigma;
        let sum = |of: &dyn Fn(Vector3<f64>) -> f64| misfits.clone().map(of).sum::<f64>();
        let of_network = group.members.iter().map(|member| member.covariance.trace() / 3.0);
        let network = (of_network.sum::<f64>() / targets.len() as f64).sqrt();
        // Of numbers that are all alike within their stated precision, as degrees are, that says nothing.
        let stated = Some(xy.max(z)).filter(|sigma| extent(&targets) > BEYOND * sigma);
        Ok(Self {
            cause,
            misfit: (sum(&|v| v.norm_squared()) / dof).sqrt() / similarity.scale,
            square: sum(&|v| v.xy().norm_squared() / (xy * xy) + v.z * v.z / (z * z)),
            limit: BEYOND * (stated.unwrap_or(0.0) / similarity.scale).max(survey.pixel).max(network),
            upside_down: is_above(&survey.cameras) && is_above(&-(similarity.rotation * survey.cameras)),
            similarity,
        })
    }

    fn is_good(&self) -> bool {
        self.misfit < self.limit && !self.upside_down
    }

    /// Does it change heights alone? Four points near a plane tell one number of their heights, and a wrong cause hits
    /// it by chance.
    fn is_of_heights(&self) -> bool {
        matches!(self.cause, Cause::Changed(Change::HeightUnit(_) | Change::Reversed(2)))
    }

    fn is_mirror(&self) -> bool {
        matches!(self.cause, Cause::Changed(Change::Exchanged(..) | Change::Reversed(_)))
    }
}

/// Do the images give fewer members than a majority needs?
pub fn are_few(group: &Group) -> bool {
    group.members.iter().filter(|member| member.computed.is_some()).count() < FEWEST
}

/// Judges a group of three or four members; `None` of others, and where it fits.
pub fn judge(group: &Group, survey: &Survey) -> Option<Mistake> {
    let members: Vec<_> = group.members.iter().filter(|member| member.computed.is_some()).cloned().collect();
    if !are_few(group) || members.len() < LEAST || group.subject == Subject::Gnss {
        return None;
    }
    let group = &Group { members, ..group.clone() };
    let as_is = match Trial::new(Cause::Changed(Change::None), group, survey) {
        Ok(own) if own.is_good() => return None,
        Ok(own) => Some(own),
        Err(SimilarityError::Ambiguous) => None,
        // Points in a line have no similarity, which is another mistake.
        Err(_) => return None,
    };
    let misfit = as_is.as_ref().map_or(f64::INFINITY, |own| own.misfit);
    let upside_down = as_is.as_ref().is_some_and(|own| own.misfit < own.limit);
    let count = group.members.len();
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| Cause::Pair(i, j)));
    let is_of_columns = |change: &Change| !matches!(change, Change::None | Change::Shifted(_));
    let changes = Change::all(group).into_iter().filter(is_of_columns).map(Cause::Changed);
    let trials: Vec<Trial> = changes.chain(pairs).filter_map(|cause| Trial::new(cause, group, survey).ok()).collect();
    let tried = trials.len();
    // Something has to become better: by an order of magnitude, or the right way up.
    let is_better = |own: &Trial| own.is_good() && (upside_down || BEYOND * own.misfit < misfit);
    let mut fitting: Vec<Trial> = trials.into_iter().filter(is_better).collect();
    if fitting.iter().all(Trial::is_mirror) {
        // Mirrors fit alike, whichever axis they mirror: the one that turns the block least.
        fitting.sort_by(|a, b| a.similarity.rotation.angle().total_cmp(&b.similarity.rotation.angle()));
        fitting.truncate(1);
    }
    match fitting.as_slice() {
        [one] if upside_down || (count >= NAMED_FROM && !one.is_of_heights()) => {
            let drop = as_is.map_or(f64::NAN, |own| own.square - one.square);
            Some(named(one.cause, group, drop, ln_p(drop, tried)))
        }
        several => {
            let causes: Vec<String> = several.iter().map(|own| said(own.cause, group)).collect();
            let names = group.members.iter().map(|member| member.name.clone()).collect();
            let fit = match as_is {
                Some(_) if upside_down => Fit::UpsideDown,
                Some(own) => Fit::Off(own.misfit * own.similarity.scale),
                None => Fit::None,
            };
            Some(words::contradicting(group.subject, names, fit, &causes))
        }
    }
}

/// Is a direction that of the vertical, roughly?
fn is_above(direction: &Vector3<f64>) -> bool {
    direction.z > 0.5 * direction.norm()
}

fn named(cause: Cause, group: &Group, drop: f64, ln_p: f64) -> Mistake {
    match cause {
        Cause::Changed(change) => words::changed(group.subject, change, drop, ln_p),
        Cause::Pair(i, j) => {
            words::exchanged(group.subject, [&group.members[i].name, &group.members[j].name], drop, ln_p)
        }
    }
}

/// What a cause does, as a part of a sentence.
fn said(cause: Cause, group: &Group) -> String {
    match cause {
        Cause::Changed(change) => words::in_short(change),
        Cause::Pair(i, j) => format!("{} and {} exchanged", group.members[i].name, group.members[j].name),
    }
}

#[cfg(test)]
mod tests {
    use super::super::survey::{Focal, Member};
    use super::*;
    use nalgebra::{Matrix3, UnitQuaternion};

    const SQUARE: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [80.0, 0.0, 0.5], [0.0, 60.0, 0.0], [70.0, 75.0, 1.0]];

    /// Points whose recorded coordinates were changed, beside a network that is turned by `degrees` about the x axis.
    fn judged(
        places: &[[f64; 3]],
        degrees: f64,
        change: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
    ) -> Option<Mistake> {
        known_to(1e-4, places, degrees, change)
    }

    /// The same where the network knows each point to `sigma`, in its own length.
    fn known_to(
        sigma: f64,
        places: &[[f64; 3]],
        degrees: f64,
        change: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
    ) -> Option<Mistake> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), degrees.to_radians());
        let member = |(k, place): (usize, &[f64; 3])| Member {
            name: format!("g{k}"),
            recorded: change(k, (*place).into()),
            computed: Some(0.1 * (turn * Vector3::from(*place))),
            covariance: Matrix3::from_diagonal_element(sigma * sigma),
            flight: 0,
            time: None,
        };
        let members = places.iter().enumerate().map(member).collect();
        let group = Group { subject: Subject::Control, sigma: [0.01, 0.02], members, flights: vec![] };
        let cameras = turn * Vector3::new(0.0, 0.0, 8.0);
        let survey =
            Survey { groups: vec![], up: Vector3::z(), cameras, distance: 8.0, pixel: 0.002, focal: Focal::Stated };
        judge(&group, &survey)
    }

    #[test]
    fn points_that_fit_are_not_judged() {
        // In any system of the approximate poses.
        for degrees in [0.0, 5.0, 90.0, 180.0] {
            assert_eq!(judged(&SQUARE, degrees, |_, p| p), None);
            assert_eq!(judged(&SQUARE[..3], degrees, |_, p| p), None);
        }
        assert_eq!(judged(&SQUARE, 0.0, |k, p| if k == 1 { p + Vector3::new(0.0, 0.0, 0.1) } else { p }), None);
        assert_eq!(
            judged(&SQUARE[..2], 0.0, |k, p| p * k as f64),
            None,
            "two points are too few, which is said elsewhere"
        );
    }

    #[test]
    fn four_points_name_what_alone_explains_them() {
        let exchanged = judged(&SQUARE, 0.0, |k, p| if k < 2 { SQUARE[1 - k].into() } else { p }).expect("a mistake");
        assert_eq!((exchanged.kind.as_str(), exchanged.names), ("exchanged", vec!["g0".into(), "g1".into()]));
        let axes = judged(&SQUARE, 0.0, |_, p| Vector3::new(p.y, p.x, p.z)).expect("a mistake");
        assert_eq!(axes.kind, "axes-exchanged");
        let degrees = |p: Vector3<f64>| Vector3::new(48.0 + p.y / 111_195.0, 11.0 + p.x / 74_400.0, p.z);
        assert_eq!(judged(&SQUARE, 0.0, |_, p| degrees(p)).expect("a mistake").kind, "geographic");
    }

    #[test]
    fn a_network_that_bends_contradicts_nobody() {
        let wrong = |k: usize, p: Vector3<f64>| if k == 3 { p + Vector3::new(9.0, 4.0, 30.0) } else { p };
        assert!(known_to(0.01, &SQUARE, 0.0, wrong).is_some());
        assert_eq!(known_to(0.5, &SQUARE, 0.0, wrong), None);
    }

    #[test]
    fn what_several_causes_explain_is_said_without_one() {
        let wrong = judged(&SQUARE, 0.0, |k, p| if k == 3 { p + Vector3::new(9.0, 4.0, 30.0) } else { p });
        let wrong = wrong.expect("a contradiction");
        assert_eq!((wrong.kind.as_str(), wrong.names.len()), ("shape", 4));
        assert!(wrong.value.is_some_and(|off| off > 5.0) && wrong.sentence.contains("do not tell"), "{wrong:?}");
        // Of a square, two corners exchanged are the other two exchanged in its mirror image: the vertical refuses it.
        let square = [[0.0, 0.0, 0.0], [80.0, 0.0, 0.0], [80.0, 80.0, 0.0], [0.0, 80.0, 0.0]];
        let corners = |degrees| judged(&square, degrees, |k, p| if k < 2 { square[1 - k].into() } else { p });
        let found = corners(0.0).expect("a mistake");
        assert_eq!((found.kind.as_str(), found.names), ("exchanged", vec!["g0".into(), "g1".into()]));
        let found = corners(180.0).expect("a contradiction");
        assert_eq!(found.kind, "shape");
        assert!(found.sentence.contains("g0 and g1 exchanged; g2 and g3 exchanged"), "{}", found.sentence);
    }

    #[test]
    fn a_triangle_that_fits_upside_down_is_mirrored() {
        let found = judged(&SQUARE[..3], 0.0, |_, p| Vector3::new(p.y, p.x, p.z)).expect("a mistake");
        assert_eq!(found.kind, "axes-exchanged");
        // Poses whose cameras lie below the points know no vertical.
        assert_eq!(judged(&SQUARE[..3], 180.0, |_, p| Vector3::new(p.y, p.x, p.z)), None);
    }
}
