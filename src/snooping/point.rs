//! The measurements of one point at a solution, each tested against the others.

use super::FEWEST_RAYS;
use super::statistic::{Statistic, Weight};
use crate::block::Measurement;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// A measurement at a solution, standardised.
pub(super) struct Seen {
    /// Its number in [`Sight`](super::sight::Sight).
    pub(super) number: usize,
    pub(super) row: Measurement,
    /// Is it in?
    pub(super) active: bool,
    /// Was it in when the round began?
    pub(super) was_active: bool,
    /// Observed minus computed, cameras and point as adjusted.
    pub(super) residual: Vector2<f64>,
    /// Derivative of the computed by the point.
    pub(super) by_point: Matrix2x3<f64>,
    /// Displacement of the neighbours.
    pub(super) neighbours: Option<Vector2<f64>>,
}

/// A point's measurements at a solution, those left out included.
pub(super) struct SeenPoint {
    pub(super) seen: Vec<Seen>,
    /// Weight of its surveyed coordinates; zero for a tie point.
    pub(super) surveyed: Matrix3<f64>,
    /// Is it one that takes no part?
    pub(super) lost: bool,
}

/// A measurement that is in, its point intersected with the cameras held.
#[derive(Clone, Copy)]
pub(super) struct Intersected {
    pub(super) residual: Vector2<f64>,
    pub(super) redundancy: Matrix2<f64>,
    pub(super) weight: Option<Weight>,
}

impl SeenPoint {
    /// Covariance of the point and its shift by the measurements that are in; `None` where they do not determine it.
    fn intersect(&self) -> Option<(Matrix3<f64>, Vector3<f64>)> {
        let mut normal = self.surveyed;
        let mut gradient = Vector3::zeros();
        let mut rays = 0;
        for seen in self.seen.iter().filter(|seen| seen.active) {
            normal += seen.by_point.transpose() * seen.by_point;
            gradient += seen.by_point.transpose() * seen.residual;
            rays += 1;
        }
        let known = self.surveyed != Matrix3::zeros();
        let covariance = (rays >= FEWEST_RAYS || known).then(|| normal.try_inverse())??;
        Some((covariance, covariance * gradient))
    }

    /// Those that are in, with their positions among its measurements; none where nothing is tested.
    pub(super) fn intersected(&self) -> impl Iterator<Item = (usize, Intersected)> {
        self.intersect().into_iter().flat_map(|(covariance, shift)| {
            self.seen.iter().enumerate().filter(|(_, seen)| seen.active).map(move |(k, seen)| {
                let redundancy = Matrix2::identity() - seen.by_point * covariance * seen.by_point.transpose();
                let residual = seen.residual - seen.by_point * shift;
                (k, Intersected { residual, redundancy, weight: Weight::of(redundancy) })
            })
        })
    }

    /// The worst measurement among those that are in.
    pub(super) fn worst(&self) -> Option<(usize, Statistic)> {
        let verdicts = self.intersected().filter_map(|(k, Intersected { residual, redundancy, weight })| {
            Some((k, self.seen[k].verdict(residual, redundancy, weight?)))
        });
        verdicts.max_by(|(_, a), (_, b)| a.statistic.total_cmp(&b.statistic))
    }

    /// The best measurement among those that were out at the begin of the round and still are.
    pub(super) fn best_outside(&self) -> Option<(usize, Statistic)> {
        let (covariance, shift) = self.intersect()?;
        let outside = self.seen.iter().enumerate().filter(|(_, seen)| !seen.active && !seen.was_active);
        let verdicts = outside.filter_map(|(k, seen)| {
            // Prediction from the others; the redundancy that it would have, and the residual, once it is back in.
            let predicted = Matrix2::identity() + seen.by_point * covariance * seen.by_point.transpose();
            let redundancy = predicted.try_inverse()?;
            let residual = redundancy * (seen.residual - seen.by_point * shift);
            Some((k, seen.verdict(residual, redundancy, Weight::of(redundancy)?)))
        });
        verdicts.min_by(|(_, a), (_, b)| a.statistic.total_cmp(&b.statistic))
    }
}

impl Seen {
    fn verdict(&self, residual: Vector2<f64>, redundancy: Matrix2<f64>, weight: Weight) -> Statistic {
        let own = weight.verdict(residual);
        let Some(displacement) = self.neighbours else { return own };
        let apart = weight.verdict(residual - redundancy * displacement);
        if apart.statistic < own.statistic { apart } else { own }
    }
}
