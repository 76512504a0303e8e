//! A similarity that most points agree with: least median of squares over triples (Rousseeuw 1984), then least
//! squares of those that agree.

use crate::evaluate::similarity::{Matrix7, Similarity, target_from_source};
use crate::math::rotation::skew;
use crate::math::statistics::chi_square_quantile;
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Triples that are tried: with two members of five wrong, all triples miss with a probability of 1e-40.
const TRIPLES: usize = 400;
/// Members that judge a triple; more than these decide no better.
const JUDGES: usize = 200;
/// Rounds of least squares from the best triple.
const ROUNDS: usize = 10;
/// Share of right members that a round keeps.
const KEPT: f64 = 0.99;
/// Fewer members leave nothing to judge: three fit nearly always.
pub const FEWEST: usize = 5;

/// A similarity and how members fit it.
#[derive(Debug, Clone)]
pub struct Aligned {
    /// Survey from free network.
    pub similarity: Similarity,
    /// Recorded minus computed, m.
    pub misfits: Vec<Vector3<f64>>,
    /// Variance of a misfit in units of the stated one, of the members that agree; one at least.
    pub variance: f64,
    /// Degrees of freedom of `variance`.
    pub dof: f64,
    cofactors: Matrix7,
    sigma: [f64; 2],
}

impl Aligned {
    /// Sum of squares of a misfit in stated standard deviations.
    pub fn square(&self, member: usize) -> f64 {
        square(&self.misfits[member], self.sigma)
    }

    /// Robust sum of squares at a variance: a member that does not fit costs what a blunder costs.
    pub fn objective(&self, variance: f64, cap: f64) -> f64 {
        (0..self.misfits.len()).map(|k| (self.square(k) / variance).min(cap)).sum()
    }

    /// Standard deviations of a coordinate as stated, m.
    pub fn stated(&self) -> [f64; 3] {
        [self.sigma[0], self.sigma[0], self.sigma[1]]
    }

    /// Standard deviations (horizontal, height) of a misfit, m.
    pub fn deviation(&self) -> [f64; 2] {
        self.sigma.map(|sigma| sigma * self.variance.sqrt())
    }

    /// Covariance of a point (free network) taken into the survey, from the similarity alone, m^2.
    pub fn covariance(&self, point: &Vector3<f64>) -> Matrix3<f64> {
        let turned = self.similarity.rotation * point;
        let mut jacobian = SMatrix::<f64, 3, 7>::zeros();
        jacobian.set_column(0, &turned);
        jacobian.fixed_view_mut::<3, 3>(0, 1).copy_from(&-skew(&(turned * self.similarity.scale)));
        jacobian.fixed_view_mut::<3, 3>(0, 4).fill_with_identity();
        jacobian * self.cofactors * jacobian.transpose() * self.variance
    }
}

fn square(misfit: &Vector3<f64>, [xy, z]: [f64; 2]) -> f64 {
    (misfit.x * misfit.x + misfit.y * misfit.y) / (xy * xy) + misfit.z * misfit.z / (z * z)
}

/// Numbers from a fixed seed (Knuth's MMIX): the same triples in every run.
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n as u64) as usize
    }
}

/// Members that must agree: more than half.
pub fn majority(members: usize) -> usize {
    (members + 4) / 2
}

/// The similarity from `source` to `target` that most members agree with; `None` where there are too few, or none is
/// determined.
pub fn align(source: &[Vector3<f64>], target: &[Vector3<f64>], sigma: [f64; 2]) -> Option<Aligned> {
    let n = source.len();
    if n < FEWEST {
        return None;
    }
    let all: Vec<usize> = (0..n).collect();
    let judges: Vec<usize> = (0..n).step_by(n.div_ceil(JUDGES)).collect();
    let mut best: Option<(f64, Similarity)> = None;
    let mut draw = Draw(0x6d69_7363);
    for number in 0..=TRIPLES {
        // The first set is everything: where nothing is wrong it is the best one.
        let triple = [draw.below(n), draw.below(n), draw.below(n)];
        let chosen: &[usize] = if number == 0 { &all } else { &triple };
        let Some(similarity) = similarity(source, target, chosen, sigma).map(|(similarity, _)| similarity) else {
            continue;
        };
        let score = middle(source, target, &similarity, &judges, sigma);
        if best.as_ref().is_none_or(|(least, _)| score < *least) {
            best = Some((score, similarity));
        }
    }
    let (_, mut current) = best?;
    let mut cofactors = Matrix7::zeros();
    let mut kept: Vec<usize> = Vec::new();
    let (usual, limit) = (usual_square(n), chi_square_quantile(KEPT, 3.0));
    for _ in 0..ROUNDS {
        let limit = limit * (middle(source, target, &current, &all, sigma) / usual).max(1.0);
        let fits = |k: &usize| square(&(target[*k] - current.apply(&source[*k])), sigma) <= limit;
        let next: Vec<usize> = all.iter().copied().filter(fits).collect();
        if next == kept {
            break;
        }
        (current, cofactors) = similarity(source, target, &next, sigma)?;
        kept = next;
    }
    if kept.len() < majority(n) {
        return None;
    }
    let misfits: Vec<Vector3<f64>> = source.iter().zip(target).map(|(p, t)| t - current.apply(p)).collect();
    let dof = (3 * kept.len() - 7) as f64;
    let variance = (kept.iter().map(|k| square(&misfits[*k], sigma)).sum::<f64>() / dof).max(1.0);
    Some(Aligned { similarity: current, misfits, variance, dof, cofactors, sigma })
}

fn similarity(
    source: &[Vector3<f64>],
    target: &[Vector3<f64>],
    chosen: &[usize],
    [xy, z]: [f64; 2],
) -> Option<(Similarity, Matrix7)> {
    let of = |points: &[Vector3<f64>]| chosen.iter().map(|k| points[*k]).collect::<Vec<_>>();
    let weight = 3.0 / (2.0 * xy * xy + z * z);
    let fit = target_from_source(&of(source), &of(target), Some(&vec![weight; chosen.len()])).ok()?;
    Some((fit.similarity, fit.cofactors))
}

/// The square that a majority does not exceed.
fn middle(
    source: &[Vector3<f64>],
    target: &[Vector3<f64>],
    similarity: &Similarity,
    judges: &[usize],
    sigma: [f64; 2],
) -> f64 {
    let squares = judges.iter().map(|k| square(&(target[*k] - similarity.apply(&source[*k])), sigma)).collect();
    of_majority(squares)
}

/// The value that a majority does not exceed; not a number without any.
pub fn of_majority(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let most = majority(values.len()).min(values.len());
    *values.select_nth_unstable_by(most - 1, f64::total_cmp).1
}

/// What [`of_majority`] gives of squares of right members whose variance is one.
pub fn usual_square(members: usize) -> f64 {
    let most = majority(members).min(members) as f64;
    chi_square_quantile((most - 0.5) / members as f64, 3.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn two_members_of_five_may_be_wrong() {
        let source: Vec<Vector3<f64>> =
            (0..20).map(|k| Vector3::new(f64::from(k * 7 % 20), f64::from(k * 3 % 11), f64::from(k % 4))).collect();
        let truth = Similarity {
            scale: 2.0,
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.2, 0.7)),
            translation: Vector3::new(5e5, 5e6, 300.0),
        };
        let mut target: Vec<Vector3<f64>> = source.iter().map(|p| truth.apply(p)).collect();
        (0..8).for_each(|k| target[2 * k] += Vector3::new(3.0 * k as f64 + 1.0, -5.0, 40.0));
        let found = align(&source, &target, [0.01, 0.02]).expect("a majority");
        assert!((found.similarity.scale - 2.0).abs() < 1e-6 && found.variance == 1.0, "{found:?}");
        assert!(found.misfits[1].norm() < 1e-3 && found.misfits[4].norm() > 30.0);
        assert!(found.covariance(&source[3]).trace().sqrt() < 0.02, "known as well as its points");
        assert!(align(&source[..4], &target[..4], [0.01, 0.02]).is_none(), "four points judge nothing");
    }
}
