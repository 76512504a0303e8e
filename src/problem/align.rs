//! Start values in the datum: the 3D similarity that brings the block nearest to the positions observed.
//!
//! Tie points do not feel a similarity, so the seven unknowns are estimated alone. Left to the adjustment, a turn of
//! the whole block is a long way in small steps: each linear one bends the rays.

use super::{PositionObservation, Problem};
use crate::math::rotation::skew;
use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// A position of the block and where it was observed.
pub(super) struct Pair {
    /// In the block as approximated, m.
    pub source: Vector3<f64>,
    /// Observed, m.
    pub target: Vector3<f64>,
    /// Standard deviations, m.
    pub sigma: Vector3<f64>,
}

impl Pair {
    pub(super) fn new(source: Vector3<f64>, observed: &PositionObservation) -> Self {
        Self { source, target: observed.position, sigma: observed.sigma }
    }
}

/// Fewer positions do not determine a similarity.
const LEAST_PAIRS: usize = 3;
/// Damping, by the diagonal: what the positions hardly determine (the turn about a single straight strip) stays nearly
/// as approximated.
const DAMPING: f64 = 1e-3;
/// The adjustment does the rest: steps that gain less than this share of the sum of squares are left to it.
const GAIN: f64 = 1e-3;
/// A half turn leaves less than this share of the sum of squares: a tenth of the distances.
const TURNED: f64 = 0.01;
/// A turn by half a right angle takes five.
const MOST_STEPS: usize = 50;

/// `target = scale rotation (source - centre) + centre + shift`.
#[derive(Clone)]
struct Alignment {
    scale: f64,
    rotation: UnitQuaternion<f64>,
    shift: Vector3<f64>,
    centre: Vector3<f64>,
}

impl Alignment {
    fn turned(&self, source: &Vector3<f64>) -> Vector3<f64> {
        self.scale * (self.rotation * (source - self.centre))
    }

    fn apply(&self, source: &Vector3<f64>) -> Vector3<f64> {
        self.turned(source) + self.centre + self.shift
    }

    fn sum_of_squares(&self, pairs: &[Pair]) -> f64 {
        pairs
            .iter()
            .map(|pair| (pair.target - self.apply(&pair.source)).component_div(&pair.sigma).norm_squared())
            .sum()
    }

    /// Damped Gauss-Newton step; unknowns: change of ln(scale), turn, shift.
    fn step(&self, pairs: &[Pair], damping: f64) -> Option<Self> {
        let mut normal = SMatrix::<f64, 7, 7>::zeros();
        let mut gradient = SVector::<f64, 7>::zeros();
        for pair in pairs {
            let arm = self.turned(&pair.source);
            let mut row = SMatrix::<f64, 3, 7>::zeros();
            row.set_column(0, &arm);
            row.fixed_view_mut::<3, 3>(0, 1).copy_from(&-skew(&arm));
            row.fixed_view_mut::<3, 3>(0, 4).fill_with_identity();
            let mut rest = pair.target - self.apply(&pair.source);
            for k in 0..3 {
                row.row_mut(k).scale_mut(1.0 / pair.sigma[k]);
                rest[k] /= pair.sigma[k];
            }
            normal += row.transpose() * row;
            gradient += row.transpose() * rest;
        }
        // Turns share one damping: about a straight strip nothing resists.
        let turn = normal.diagonal().fixed_rows::<3>(1).max();
        for k in 0..7 {
            normal[(k, k)] += damping * if (1..4).contains(&k) { turn } else { normal[(k, k)] };
        }
        let step = normal.cholesky()?.solve(&gradient);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[1], step[2], step[3]));
        Some(Self {
            scale: self.scale * step[0].exp(),
            rotation: UnitQuaternion::new_normalize((turn * self.rotation).into_inner()),
            shift: self.shift + Vector3::new(step[4], step[5], step[6]),
            centre: self.centre,
        })
    }
}

/// The similarity of least weighted squares; `None` where there is nothing to gain, or too few positions.
///
/// From a start that is turned by nearly 180 degrees, the best scale is negative: it falls to zero, and all positions
/// with it to one place. Every turn is within 120 degrees of none or of a half turn about one of the axes (a unit
/// quaternion has a component of a half at least), and the search begins at each of the four. A half turn has to fit
/// far better: about a straight strip it fits as well as none, but for noise.
fn align(pairs: &[Pair]) -> Option<Alignment> {
    if pairs.len() < LEAST_PAIRS {
        return None;
    }
    let half_turn = |axis| UnitQuaternion::from_axis_angle(&axis, PI);
    let half_turns = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()].map(half_turn);
    let centre = |of: fn(&Pair) -> Vector3<f64>| pairs.iter().map(of).sum::<Vector3<f64>>() / pairs.len() as f64;
    let (from, to) = (centre(|pair| pair.source), centre(|pair| pair.target));
    let as_is = Alignment { scale: 1.0, rotation: UnitQuaternion::identity(), shift: Vector3::zeros(), centre: from };
    let turned = half_turns.map(|rotation| Alignment { rotation, shift: to - from, ..as_is.clone() });
    let at_start = as_is.sum_of_squares(pairs);
    let (mut best, mut least) = descend(as_is, pairs);
    for start in turned {
        let (other, sum) = descend(start, pairs);
        if is_gain(least, sum) && sum < TURNED * least {
            (best, least) = (other, sum);
        }
    }
    is_gain(at_start, least).then_some(best)
}

/// Does a sum of squares fall by something that the observations tell?
fn is_gain(from: f64, to: f64) -> bool {
    from - to >= (GAIN * from).max(1.0)
}

/// Where damped steps from a start end, and the sum of squares there.
fn descend(start: Alignment, pairs: &[Pair]) -> (Alignment, f64) {
    let (mut least, mut best, mut damping) = (start.sum_of_squares(pairs), start, DAMPING);
    for _ in 0..MOST_STEPS {
        let Some(next) = best.step(pairs, damping) else { break };
        let sum = next.sum_of_squares(pairs);
        if sum.is_nan() || sum >= least {
            if damping > 1.0 {
                break;
            }
            damping *= 10.0;
            continue;
        }
        if !is_gain(least, sum) {
            break;
        }
        (best, least) = (next, sum);
        damping = DAMPING;
    }
    (best, least)
}

impl Problem {
    /// Takes the start values of the images that take part, and of all tie points, into the system of the observed
    /// positions.
    pub(super) fn align_start(&mut self, pairs: &[Pair]) {
        let Some(alignment) = align(pairs) else { return };
        for (pose, free) in self.start.poses.iter_mut().zip(&self.pose_free) {
            if *free != [false; 6] {
                pose.rotation *= alignment.rotation.inverse();
                pose.centre = alignment.apply(&pose.centre);
            }
        }
        let surveyed: Vec<usize> = self.control.iter().map(|observed| observed.index as usize).collect();
        for (j, point) in self.start.points.iter_mut().enumerate() {
            // Control points start where they were surveyed.
            if surveyed.binary_search(&j).is_err() {
                *point = alignment.apply(point);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(change: &Alignment, sources: &[[f64; 3]]) -> Vec<Pair> {
        let pair = |source: &[f64; 3]| {
            let source = Vector3::from(*source);
            Pair { source, target: change.apply(&source), sigma: Vector3::new(0.1, 0.1, 0.3) }
        };
        sources.iter().map(pair).collect()
    }

    #[test]
    fn a_large_similarity_is_found() {
        let change = Alignment {
            scale: 1.5,
            rotation: UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.7)),
            shift: Vector3::new(300.0, -20.0, 4.0),
            centre: Vector3::new(5.0, 5.0, 1.0),
        };
        let sources = [[0.0, 0.0, 0.0], [40.0, 3.0, 1.0], [5.0, 60.0, -2.0], [33.0, 52.0, 8.0], [18.0, 9.0, 4.0]];
        let pairs = pairs(&change, &sources);
        let found = align(&pairs).expect("something to gain");
        // What is left is less than the gain that is not pursued.
        assert!(found.sum_of_squares(&pairs) < 1.0, "{}", found.sum_of_squares(&pairs));
    }

    /// From any start, half turns and turns close to them included.
    #[test]
    fn turns_of_every_size_are_found() {
        let sources = [[0.0, 0.0, 0.0], [40.0, 3.0, 1.0], [5.0, 60.0, -2.0], [33.0, 52.0, 8.0], [18.0, 9.0, 4.0]];
        for axis in
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [-3.0, 1.0, 2.0]]
        {
            for degrees in [30.0, 90.0, 120.0, 150.0, 170.0, 180.0_f64] {
                let turn = Vector3::from(axis).normalize() * degrees.to_radians();
                let (rotation, shift) = (UnitQuaternion::from_scaled_axis(turn), Vector3::new(5e3, -3e3, 40.0));
                let pairs = pairs(&Alignment { scale: 3.0, rotation, shift, centre: Vector3::zeros() }, &sources);
                let found = align(&pairs).expect("something to gain");
                let left = found.sum_of_squares(&pairs);
                assert!(left < 1.0, "{degrees} degrees about {axis:?}: {left}");
            }
        }
    }

    #[test]
    fn what_fits_stays_where_it_is() {
        let identity = Alignment {
            scale: 1.0,
            rotation: UnitQuaternion::identity(),
            shift: Vector3::zeros(),
            centre: Vector3::zeros(),
        };
        let sources = [[0.0, 0.0, 0.0], [40.0, 3.0, 1.0], [5.0, 60.0, -2.0]];
        assert!(align(&pairs(&identity, &sources)).is_none());
        assert!(align(&pairs(&Alignment { scale: 2.0, ..identity }, &sources[..2])).is_none(), "two positions");
    }

    #[test]
    fn a_straight_strip_does_not_turn_about_itself() {
        let shifted = Alignment {
            scale: 1.0,
            rotation: UnitQuaternion::identity(),
            shift: Vector3::new(10.0, 0.0, 0.0),
            centre: Vector3::zeros(),
        };
        let mut pairs = pairs(&shifted, &[[0.0, 0.0, 50.0], [10.0, 0.0, 50.0], [20.0, 1e-9, 50.0], [30.0, 0.0, 50.0]]);
        pairs[1].target.z += 0.4;
        let found = align(&pairs).expect("something to gain");
        let roll = found.rotation.scaled_axis().x;
        assert!(roll.abs() < 1e-6, "turned by {roll} rad about the strip");
        assert!((found.shift.x - 10.0).abs() < 0.1);
    }
}
