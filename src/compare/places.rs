//! Poses and points of two runs against each other.

use crate::evaluate::{Similarity, similarity};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;

/// Distances of what two runs have in common.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distances {
    /// Number of points, or of images.
    pub n: usize,
    /// RMS in space, m.
    pub rms_m: f64,
    /// RMS in height, m.
    pub height_m: f64,
    /// Greatest, m.
    pub max_m: f64,
    /// The name of the point (or image) that differs most.
    pub worst: String,
}

/// Places by name.
pub type Places = BTreeMap<String, Vector3<f64>>;

/// Distances from `before` to `after`; `None` where they have no name in common.
pub fn distances(before: &Places, after: &Places, alignment: &Similarity) -> Option<Distances> {
    let moves: Vec<(&String, Vector3<f64>)> =
        common(before, after).map(|(name, from, to)| (name, alignment.apply(to) - from)).collect();
    let (worst, largest) = moves.iter().max_by(|(_, a), (_, b)| a.norm().total_cmp(&b.norm()))?;
    let n = moves.len() as f64;
    Some(Distances {
        n: moves.len(),
        rms_m: (moves.iter().map(|(_, d)| d.norm_squared()).sum::<f64>() / n).sqrt(),
        height_m: (moves.iter().map(|(_, d)| d.z * d.z).sum::<f64>() / n).sqrt(),
        max_m: largest.norm(),
        worst: (*worst).clone(),
    })
}

fn common<'a>(
    before: &'a Places,
    after: &'a Places,
) -> impl Iterator<Item = (&'a String, &'a Vector3<f64>, &'a Vector3<f64>)> {
    before.iter().filter_map(|(name, from)| Some((name, from, after.get(name)?)))
}

/// The similarity that takes `after` to `before`: two free networks may lie anywhere. `None` of fewer than three
/// points.
pub fn aligning(before: &Places, after: &Places) -> Option<Similarity> {
    let (target, source): (Vec<_>, Vec<_>) = common(before, after).map(|(_, from, to)| (*from, *to)).unzip();
    Some(similarity::target_from_source(&source, &target, None).ok()?.similarity)
}

/// RMS of the angles between the rotations that two runs have in common, mrad.
pub fn rotations_mrad<'a>(pairs: impl Iterator<Item = (&'a UnitQuaternion<f64>, &'a UnitQuaternion<f64>)>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (a, b) in pairs {
        sum += a.angle_to(b).powi(2);
        n += 1.0;
    }
    1e3 * f64::sqrt(sum / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(all: &[(&str, [f64; 3])]) -> Places {
        all.iter().map(|(name, at)| ((*name).to_string(), Vector3::from(*at))).collect()
    }

    #[test]
    fn only_names_in_common_are_compared() {
        let before = places(&[("a", [0.0; 3]), ("b", [0.0; 3]), ("c", [7.0; 3])]);
        let after = places(&[("a", [0.0; 3]), ("b", [3.0, 0.0, 4.0]), ("d", [9.0; 3])]);
        let of = distances(&before, &after, &Similarity::identity()).expect("two points");
        assert_eq!((of.n, of.worst.as_str()), (2, "b"));
        assert!((of.max_m - 5.0).abs() < 1e-12 && (of.rms_m - 12.5_f64.sqrt()).abs() < 1e-12, "{of:?}");
        assert_eq!(distances(&before, &Places::new(), &Similarity::identity()), None);
    }

    #[test]
    fn angles_are_those_of_the_rotations() {
        let a = UnitQuaternion::identity();
        let b = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.002, 0.0));
        assert!((rotations_mrad([(&a, &b)].into_iter()) - 2.0).abs() < 1e-9);
    }
}
