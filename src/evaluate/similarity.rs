//! 3D similarity between two sets of points, in closed form, with its covariance.
//!
//! `target = s R source + t` with the least `sum w |target - s R source - t|^2`. The rotation is the unit quaternion of
//! the largest eigenvalue of Horn's 4x4 matrix (Horn 1987, "Closed-form solution of absolute orientation using unit
//! quaternions"); scale and translation are the least-squares ones for errors in the target (Umeyama 1991, eqs. 41-43).

use crate::block::Pose;
use nalgebra::{Matrix3, Matrix4, Quaternion, SMatrix, SVector, UnitQuaternion, Vector3};

/// Smallest ratio of a set's second to its first principal extent. Below it the points count as collinear: the rotation
/// about their line would be a millionth as well determined as the others.
pub const COLLINEAR_RATIO: f64 = 1e-6;

/// Order of the seven parameters of a covariance: scale, small rotation (rad, axes of the target, from the left),
/// translation (m).
pub const PARAMETERS: [&str; 7] = ["scale", "wx", "wy", "wz", "tx", "ty", "tz"];

/// 7x7 covariance or cofactors, in the order of [`PARAMETERS`].
pub type Matrix7 = SMatrix<f64, 7, 7>;

/// `target = scale * rotation * source + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Scale, positive.
    pub scale: f64,
    /// Rotation, source to target.
    pub rotation: UnitQuaternion<f64>,
    /// Translation, m in the target system.
    pub translation: Vector3<f64>,
}

impl Similarity {
    /// The identity.
    pub fn identity() -> Self {
        Self { scale: 1.0, rotation: UnitQuaternion::identity(), translation: Vector3::zeros() }
    }

    /// A point, taken into the target system.
    pub fn apply(&self, source: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * source * self.scale + self.translation
    }

    /// A pose, taken into the target system: the image sees the transformed points where it saw the points.
    pub fn apply_to_pose(&self, pose: &Pose) -> Pose {
        Pose { rotation: pose.rotation * self.rotation.inverse(), centre: self.apply(&pose.centre) }
    }

    /// The covariance of a point (m^2), taken into the target system; the similarity itself taken as free of error.
    pub fn apply_to_covariance(&self, covariance: &Matrix3<f64>) -> Matrix3<f64> {
        let linear = self.rotation.to_rotation_matrix().into_inner() * self.scale;
        linear * covariance * linear.transpose()
    }

    /// Target to source.
    pub fn inverse(&self) -> Self {
        let (scale, rotation) = (1.0 / self.scale, self.rotation.inverse());
        Self { scale, rotation, translation: -(rotation * self.translation * scale) }
    }

    /// First `other`, then `self`.
    pub fn after(&self, other: &Self) -> Self {
        Self {
            scale: self.scale * other.scale,
            rotation: self.rotation * other.rotation,
            translation: self.apply(&other.translation),
        }
    }

    /// Rotation as `[qw, qx, qy, qz]` with `qw >= 0`: the form of the files.
    pub fn quaternion(&self) -> [f64; 4] {
        let q = self.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [q.w, q.i, q.j, q.k].map(|x| sign * x)
    }
}

/// Why no similarity can be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimilarityError {
    /// Fewer than three points.
    #[error("a similarity needs 3 points, there are {0}")]
    TooFew(usize),
    /// Lists of different lengths.
    #[error(
        "{source_points} source points, {target_points} target points, {weights} weights: the counts must be equal"
    )]
    Counts {
        /// Points in the source.
        source_points: usize,
        /// Points in the target.
        target_points: usize,
        /// Weights.
        weights: usize,
    },
    /// A coordinate or weight is not finite, or a weight not positive.
    #[error("point {0} has a coordinate that is not finite or a weight that is not positive")]
    BadPoint(usize),
    /// On one line, or all in one place.
    #[error("the {0} points are collinear: the rotation about their line is undetermined")]
    Collinear(&'static str),
    /// The sets resemble each other so little that no rotation is best.
    #[error("no rotation is best: the two sets of points do not correspond")]
    Ambiguous,
}

/// An estimated similarity.
#[derive(Debug, Clone, PartialEq)]
pub struct SimilarityFit {
    /// target from source.
    pub similarity: Similarity,
    /// Transformed source minus target (m), in the order of the points: computed minus surveyed when the target is the
    /// survey.
    pub residuals: Vec<Vector3<f64>>,
    /// `sqrt(v'Pv / redundancy)`; one when the weights are `1 / sigma^2` with the right sigma.
    pub sigma0: f64,
    /// `3 n - 7`.
    pub redundancy: usize,
    /// Inverse of the normal matrix: the covariance for sigma0 = 1, in the order of [`PARAMETERS`].
    pub cofactors: Matrix7,
}

impl SimilarityFit {
    /// Covariance by the estimated sigma0, in the order of [`PARAMETERS`].
    pub fn covariance(&self) -> Matrix7 {
        self.cofactors * (self.sigma0 * self.sigma0)
    }
}

/// Estimates the similarity that takes `source` to `target`; weight of a point `1 / sigma^2` of its target coordinates,
/// `None` for equal weights of one.
///
/// # Errors
/// [`SimilarityError`]: fewer than three points, a collinear set, values that are not finite, unequal counts.
pub fn target_from_source(
    source: &[Vector3<f64>],
    target: &[Vector3<f64>],
    weights: Option<&[f64]>,
) -> Result<SimilarityFit, SimilarityError> {
    let n = source.len();
    let ones;
    let weights = match weights {
        Some(weights) => weights,
        None => {
            ones = vec![1.0; n];
            &ones
        }
    };
    if target.len() != n || weights.len() != n {
        return Err(SimilarityError::Counts { source_points: n, target_points: target.len(), weights: weights.len() });
    }
    let finite = |p: &Vector3<f64>| p.iter().all(|x| x.is_finite());
    let good = |i: &usize| finite(&source[*i]) && finite(&target[*i]) && weights[*i].is_finite() && weights[*i] > 0.0;
    if let Some(bad) = (0..n).find(|i| !good(i)) {
        return Err(SimilarityError::BadPoint(bad));
    }
    if n < 3 {
        return Err(SimilarityError::TooFew(n));
    }

    let (source_centroid, source_centred) = centred(source, weights);
    let (target_centroid, target_centred) = centred(target, weights);
    for (name, points) in [("source", &source_centred), ("target", &target_centred)] {
        if is_collinear(points, weights) {
            return Err(SimilarityError::Collinear(name));
        }
    }
    let rotation = best_rotation(&source_centred, &target_centred, weights)?;
    let (mut along, mut spread) = (0.0, 0.0);
    for i in 0..n {
        along += weights[i] * target_centred[i].dot(&(rotation * source_centred[i]));
        spread += weights[i] * source_centred[i].norm_squared();
    }
    let scale = along / spread;
    if scale <= 0.0 {
        return Err(SimilarityError::Ambiguous);
    }
    let similarity = Similarity { scale, rotation, translation: target_centroid - rotation * source_centroid * scale };

    // Residuals from the centred coordinates: exact also for coordinates of millions of metres.
    let residuals: Vec<_> = (0..n).map(|i| rotation * source_centred[i] * scale - target_centred[i]).collect();
    let redundancy = 3 * n - 7;
    let cost: f64 = residuals.iter().zip(weights).map(|(v, w)| w * v.norm_squared()).sum();
    let cofactors = cofactors(&similarity, &source_centroid, &source_centred, weights)
        .ok_or(SimilarityError::Collinear("source"))?;
    Ok(SimilarityFit { similarity, residuals, sigma0: (cost / redundancy as f64).sqrt(), redundancy, cofactors })
}

/// Weighted centroid, and the points about it.
fn centred(points: &[Vector3<f64>], weights: &[f64]) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    // In two rounds: the second removes the rounding that large coordinates leave in the first.
    let total: f64 = weights.iter().sum();
    let mean = |centre: &Vector3<f64>| -> Vector3<f64> {
        points.iter().zip(weights).map(|(p, w)| (p - centre) * *w).sum::<Vector3<f64>>() / total
    };
    let first = mean(&points[0]) + points[0];
    let centroid = first + mean(&first);
    (centroid, points.iter().map(|p| p - centroid).collect())
}

/// Whether the second principal extent vanishes beside the first.
fn is_collinear(points: &[Vector3<f64>], weights: &[f64]) -> bool {
    // Distances from the line of the principal direction, not the second eigenvalue itself, which is lost in the
    // rounding of the first when the ratio of the extents is below 1e-8.
    let scatter: Matrix3<f64> = points.iter().zip(weights).map(|(p, w)| p * p.transpose() * *w).sum();
    let eigen = scatter.symmetric_eigen();
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let extent = |f: &dyn Fn(&Vector3<f64>) -> f64| -> f64 {
        points.iter().zip(weights).map(|(p, w)| w * f(p)).sum::<f64>().sqrt()
    };
    let along = extent(&|p| p.dot(&direction).powi(2));
    let across = extent(&|p| (p - direction * p.dot(&direction)).norm_squared());
    // Written so that a set in one place (0 <= 0) counts too.
    across <= COLLINEAR_RATIO * along
}

/// Horn's quaternion for centred points.
fn best_rotation(
    source: &[Vector3<f64>],
    target: &[Vector3<f64>],
    weights: &[f64],
) -> Result<UnitQuaternion<f64>, SimilarityError> {
    let mut s = Matrix3::zeros();
    for i in 0..source.len() {
        s += source[i] * target[i].transpose() * weights[i];
    }
    let [xx, xy, xz] = [s[(0, 0)], s[(0, 1)], s[(0, 2)]];
    let [yx, yy, yz] = [s[(1, 0)], s[(1, 1)], s[(1, 2)]];
    let [zx, zy, zz] = [s[(2, 0)], s[(2, 1)], s[(2, 2)]];
    #[rustfmt::skip]
    let horn = Matrix4::new(
        xx + yy + zz, yz - zy,       zx - xz,        xy - yx,
        yz - zy,      xx - yy - zz,  xy + yx,        zx + xz,
        zx - xz,      xy + yx,       -xx + yy - zz,  yz + zy,
        xy - yx,      zx + xz,       yz + zy,        -xx - yy + zz,
    );
    let eigen = horn.symmetric_eigen();
    let best = eigen.eigenvalues.imax();
    let gap = (0..4)
        .filter(|&i| i != best)
        .map(|i| eigen.eigenvalues[best] - eigen.eigenvalues[i])
        .fold(f64::INFINITY, f64::min);
    // The gap is twice the second extent squared (of the common shape): far below it the eigenvector is arbitrary.
    if gap <= COLLINEAR_RATIO * COLLINEAR_RATIO * eigen.eigenvalues[best].abs() {
        return Err(SimilarityError::Ambiguous);
    }
    let q = eigen.eigenvectors.column(best);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    Ok(polished(rotation, source, target, weights))
}

/// One Newton step on the rotation alone: for narrow sets the eigenvector has lost the digits of the ratio of the
/// eigenvalues, the step restores them.
fn polished(
    rotation: UnitQuaternion<f64>,
    source: &[Vector3<f64>],
    target: &[Vector3<f64>],
    weights: &[f64],
) -> UnitQuaternion<f64> {
    // Maximise sum w target . exp([a]x) R source: gradient sum w (R source) x target, Hessian sum w (sym(p t') - (p.t)
    // I).
    let mut gradient = Vector3::zeros();
    let mut curvature = Matrix3::zeros();
    for i in 0..source.len() {
        let p = rotation * source[i];
        gradient += p.cross(&target[i]) * weights[i];
        let outer = p * target[i].transpose();
        curvature += (Matrix3::identity() * p.dot(&target[i]) - (outer + outer.transpose()) * 0.5) * weights[i];
    }
    match curvature.cholesky() {
        Some(factor) => UnitQuaternion::from_scaled_axis(factor.solve(&gradient)) * rotation,
        None => rotation,
    }
}

/// Inverse normal matrix, by way of the parameters about the centroid, which are well conditioned.
fn cofactors(
    similarity: &Similarity,
    centroid: &Vector3<f64>,
    source_centred: &[Vector3<f64>],
    weights: &[f64],
) -> Option<Matrix7> {
    let turned = |p: &Vector3<f64>| similarity.rotation * p;
    let mut normal = Matrix7::zeros();
    for (p, w) in source_centred.iter().zip(weights) {
        let p = turned(p);
        // d target = ds R p + dw x (s R p) + dt.
        let mut jacobian = SMatrix::<f64, 3, 7>::zeros();
        jacobian.set_column(0, &p);
        jacobian.fixed_view_mut::<3, 3>(0, 1).copy_from(&(-crate::math::rotation::skew(&(p * similarity.scale))));
        jacobian.fixed_view_mut::<3, 3>(0, 4).fill_with_identity();
        normal += jacobian.transpose() * jacobian * *w;
    }
    // Scaled to a unit diagonal before the inversion: metres beside radians beside a ratio.
    let unit = SVector::<f64, 7>::from_fn(|i, _| 1.0 / normal[(i, i)].sqrt());
    let scaled = Matrix7::from_diagonal(&unit) * normal * Matrix7::from_diagonal(&unit);
    let inverse = Matrix7::from_diagonal(&unit) * scaled.cholesky()?.inverse() * Matrix7::from_diagonal(&unit);
    // t = t_centroid - s R centroid: dt = dt_centroid - ds R c - dw x (s R c).
    let c = turned(centroid);
    let mut to_origin = Matrix7::identity();
    to_origin.fixed_view_mut::<3, 1>(4, 0).copy_from(&-c);
    to_origin.fixed_view_mut::<3, 3>(4, 1).copy_from(&crate::math::rotation::skew(&(c * similarity.scale)));
    Some(to_origin * inverse * to_origin.transpose())
}

#[cfg(test)]
#[path = "similarity_tests.rs"]
mod tests;
