//! How well a free network knows one of its places beside those around it.
//!
//! A point that images of few tie points see, or such an image itself, stands where nobody knows, and a survey does not
//! contradict it there. The covariance comes from the whole fit, and does not depend on what of the poses the datum
//! holds: the similarity and the bent surface that fit the places around are taken away from every error, as they are
//! from the misfits ([`crate::mistakes`]),
//!
//! ```text
//! dx - J (sum J_i'J_i)^-1 sum J_i'dx_i        J = (x, -[x]x, I, t1 I, ..., t6 I),   t = (1, x, y, x^2, x y, y^2)
//! ```
//!
//! with `dx_i` the errors of the members of its group around it (an S-transformation, Baarda 1973). So what bends a
//! large network, or moves all points against all images, stays out: it moves neighbours together.
//!
//! Each covariance costs a solution with the factored normal matrix. So the screening computes it only for members that
//! a mistake names.

use super::network::Oriented;
use crate::block::Block;
use crate::evaluate::{Comparison, Intersection, Intersections};
use crate::math::rotation::skew;
use crate::mistakes::{Group, Mistake, Subject, Survey, are_few, screen, surface_terms};
use crate::null_model::{NullModel, SharedBase};
use crate::residuals::check_points::propagation::propagate;
use crate::residuals::check_points::{Adjusted, alignment::OfPoint};
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};

/// Places around one: three strips of eight images, over which a network is stiff.
const AROUND: usize = 24;
/// Eigenvalue, per place and for lengths of one, below which those around do not tell a part of the common movement: a
/// turn about the line on which they lie.
const UNTOLD: f64 = 1e-6;
/// Columns of the common movement: a similarity, and six terms of each coordinate.
const COMMON: usize = 7 + 18;
/// Above this number of named members the disagreement is no matter of single imprecise places.
const MOST: usize = 100;
/// Kinds of mistakes of single members.
const OF_MEMBERS: [&str; 3] = ["wrong-position", "wrong-coordinate", "exchanged"];

/// Screens a survey, computes the covariance of each member that a mistake names, and screens again with it until no
/// mistake names another member. The survey keeps the covariances. A member whose place the network does not determine
/// loses it: nothing contradicts a place that is unknown.
pub fn screened(
    survey: &mut Survey,
    block: &Block,
    oriented: &Oriented,
    found: &Intersections,
    alpha: f64,
) -> Vec<Mistake> {
    let mut known: Vec<(Subject, usize)> = Vec::new();
    let mut surroundings = None;
    loop {
        let mistakes = screen(survey, alpha);
        let mut asked = suspects(survey, &mistakes);
        asked.retain(|own| !known.contains(own));
        if asked.is_empty() || asked.len() > MOST {
            return mistakes;
        }
        let surroundings = surroundings.get_or_insert_with(|| Surroundings::new(oriented, block));
        for (subject, k) in &asked {
            let Some(group) = survey.groups.iter_mut().find(|group| group.subject == *subject) else { continue };
            match surroundings.as_ref().and_then(|own| own.covariance_of(group, *k, found)) {
                Some(covariance) => group.members[*k].covariance = covariance,
                None => group.members[*k].computed = None,
            }
        }
        known.extend(asked);
    }
}

/// Members that mistakes name one by one, or by a few together.
fn suspects(survey: &Survey, mistakes: &[Mistake]) -> Vec<(Subject, usize)> {
    let mut suspects = Vec::new();
    for mistake in mistakes.iter().filter(|mistake| OF_MEMBERS.contains(&mistake.kind.as_str())) {
        // A control point may be exchanged with a check point.
        let of_images = mistake.subject == Subject::Gnss.key();
        for group in survey.groups.iter().filter(|group| (group.subject == Subject::Gnss) == of_images) {
            let members = group.members.iter().enumerate();
            let named = members.filter(|(_, member)| mistake.names.contains(&member.name));
            suspects.extend(named.map(|(k, _)| (group.subject, k)));
        }
    }
    // A few points are judged together.
    if survey.groups.iter().all(are_few) {
        let groups = survey.groups.iter().filter(|group| mistakes.iter().any(|own| own.subject == group.subject.key()));
        for group in groups {
            let seen = (0..group.members.len()).filter(|k| group.members[*k].computed.is_some());
            let new: Vec<_> = seen.map(|k| (group.subject, k)).filter(|own| !suspects.contains(own)).collect();
            suspects.extend(new);
        }
    }
    suspects
}

/// A network, factorised.
struct Surroundings<'a> {
    oriented: &'a Oriented,
    block: &'a Block,
    null: NullModel,
    base: SharedBase,
    /// Variance of unit weight, one at least.
    variance: f64,
}

impl<'a> Surroundings<'a> {
    /// `None` of a network that its measurements do not determine.
    fn new(oriented: &'a Oriented, block: &'a Block) -> Option<Self> {
        let fit = &oriented.fit;
        let base = SharedBase::default();
        let (problem, state) = (fit.problem.clone(), fit.solution.state.clone());
        let null = NullModel::sharing(&base, problem, state, Vec::new(), oriented.threads).ok()?;
        let variance = (fit.chi_square() / fit.problem.redundancy().2 as f64).max(1.0);
        Some(Self { oriented, block, null, base, variance })
    }

    /// Of the place of a member, points from their marks as they were `found`; m^2. `None` where it is not determined.
    fn covariance_of(&self, group: &Group, member: usize, found: &Intersections) -> Option<Matrix3<f64>> {
        let shares = shares(group, member)?;
        let (gradients, of_marks) = match group.subject {
            Subject::Gnss => (self.of_centres(group, &shares)?, Matrix3::zeros()),
            Subject::Control | Subject::Check => self.of_points(group, &shares, found)?,
        };
        let of_network = self.null.covariance_of(&gradients);
        let covariance = (of_network.fixed_view::<3, 3>(0, 0) + of_marks) * self.variance;
        covariance.iter().all(|value| value.is_finite()).then_some(covariance)
    }

    /// Derivatives by the unknowns but those of points.
    fn of_centres(&self, group: &Group, shares: &[(usize, Matrix3<f64>)]) -> Option<DMatrix<f64>> {
        let layout = self.null.problem().layout();
        let mut gradients = DMatrix::zeros(layout.point(0, 0), 3);
        for (k, share) in shares {
            let image = self.block.images.iter().position(|image| image.name == group.members[*k].name)?;
            gradients.fixed_rows_mut::<3>(layout.pose(image, 3)).copy_from(&share.transpose());
        }
        Some(gradients)
    }

    /// The same, and the covariance from the marks of the points.
    fn of_points(
        &self,
        group: &Group,
        shares: &[(usize, Matrix3<f64>)],
        found: &Intersections,
    ) -> Option<(DMatrix<f64>, Matrix3<f64>)> {
        let fit = &self.oriented.fit;
        let (mut points, mut of_points) = (Vec::new(), Vec::new());
        for (k, share) in shares {
            let name = &group.members[*k].name;
            let is_it = |point: &&Intersection| self.block.surveyed[point.point.index()].name == *name;
            points.push(found.points.iter().find(is_it)?.clone());
            let mut of_point = OfPoint::zeros();
            of_point.fixed_view_mut::<3, 3>(0, 0).copy_from(&share.transpose());
            of_points.push(of_point);
        }
        let comparison = Comparison {
            similarity: None,
            fit: None,
            rows: Vec::new(),
            failed: Vec::new(),
            intersections: Intersections { points, failed: Vec::new() },
            control: None,
            check: None,
        };
        let adjusted = Adjusted {
            block: self.block,
            model: &fit.model,
            problem: &fit.problem,
            state: &fit.solution.state,
            comparison: Some(&comparison),
            null_base: &self.base,
        };
        let propagation = propagate(&adjusted, &comparison, &of_points).ok()??;
        let of_marks = propagation.marks.fixed_view::<3, 3>(0, 0).into_owned();
        Some((propagation.gradients.columns(0, 3).into_owned(), of_marks))
    }
}

/// What the error of a member less the common movement of those around takes of the error of each: itself the whole.
/// `None` of one that is nowhere.
fn shares(group: &Group, member: usize) -> Option<Vec<(usize, Matrix3<f64>)>> {
    let place = group.members[member].computed?;
    let others = group.members.iter().enumerate().filter(|(k, _)| *k != member);
    let mut around: Vec<(usize, Vector3<f64>)> = others.filter_map(|(k, other)| Some((k, other.computed?))).collect();
    around.sort_by(|(_, a), (_, b)| (a - place).norm().total_cmp(&(b - place).norm()));
    around.truncate(AROUND);
    if around.is_empty() {
        return None;
    }
    let middle = around.iter().map(|(_, at)| at).sum::<Vector3<f64>>() / around.len() as f64;
    let extent = around.iter().map(|(_, at)| (at - middle).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let terms = surface_terms(around.len());
    let by_common = |at: &Vector3<f64>| {
        let arm = (at - middle) / extent;
        let mut columns = SMatrix::<f64, 3, COMMON>::zeros();
        columns.set_column(0, &arm);
        columns.fixed_view_mut::<3, 3>(0, 1).copy_from(&-skew(&arm));
        columns.fixed_view_mut::<3, 3>(0, 4).fill_with_identity();
        let surface = match terms {
            6 => [1.0, arm.x, arm.y, arm.x * arm.x, arm.x * arm.y, arm.y * arm.y],
            4 => [1.0, arm.x, arm.y, arm.xy().norm_squared(), 0.0, 0.0],
            _ => [0.0; 6],
        };
        for (k, term) in surface.into_iter().enumerate() {
            columns.fixed_view_mut::<3, 3>(0, 7 + 3 * k).fill_diagonal(term);
        }
        columns
    };
    let columns: Vec<SMatrix<f64, 3, COMMON>> = around.iter().map(|(_, at)| by_common(at)).collect();
    let normal: SMatrix<f64, COMMON, COMMON> = columns.iter().map(|own| own.transpose() * own).sum();
    let at_place = by_common(&place) * normal.pseudo_inverse(UNTOLD * around.len() as f64).ok()?;
    let of_others = around.iter().zip(columns).map(|((k, _), own)| (*k, -at_place * own.transpose()));
    Some(std::iter::once((member, Matrix3::identity())).chain(of_others).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mistakes::Member;

    fn group(places: &[Vector3<f64>]) -> Group {
        let member = |at: &Vector3<f64>| Member {
            name: String::new(),
            recorded: *at,
            computed: Some(*at),
            covariance: Matrix3::zeros(),
            flight: 0,
            time: None,
        };
        let members = places.iter().map(member).collect();
        Group { subject: Subject::Control, sigma: [0.01; 2], members, flights: Vec::new() }
    }

    #[test]
    fn what_moves_or_bends_all_places_is_no_error_of_one() {
        let places: Vec<Vector3<f64>> = (0..40)
            .map(|k| Vector3::new(20.0 * f64::from(k % 8) - 50.0, 25.0 * f64::from(k / 8), f64::from(k * k % 11)))
            .collect();
        let (turn, shift) = (Vector3::new(0.3, -0.2, 0.5), Vector3::new(4.0, 1.0, -7.0));
        let moved = |at: &Vector3<f64>| {
            let bent = Vector3::new(1e-3 * at.x * at.y, 0.0, 2e-3 * at.x * at.x - 1e-3 * at.y * at.y);
            at * 0.02 + turn.cross(at) + shift + bent
        };
        let shares = shares(&group(&places), 11).expect("a place");
        assert_eq!(shares.len(), AROUND + 1);
        let left: Vector3<f64> = shares.iter().map(|(k, share)| share * moved(&places[*k])).sum();
        assert!(left.norm() < 1e-9, "{left}");
        let own: Vector3<f64> = shares.iter().filter(|(k, _)| *k == 11).map(|(_, share)| share * shift).sum();
        assert_eq!(own, shift, "the member keeps its own error");
    }
}
