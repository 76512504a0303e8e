//! A block's measurements at a solution: each tested against the others of its point and against its neighbours in the image.

use super::majority::meeting;
use super::{FEWEST_RAYS, Kept, Rejected, Round, SnoopingOptions, Solved, Strictness};
use crate::adjust::AdjustError;
use crate::block::{Block, Measurement, PointId};
use crate::diagnose::neighbours::Neighbours;
use crate::math::statistics::{chi_square_ln_sf, chi_square_quantile, median};
use crate::measure::Predictor;
use crate::problem::{MeasurementKind, PointSource};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use std::collections::HashSet;

/// Before a diagnosis residuals hold effects too: the threshold is this much wider.
const LOOSE: f64 = 1.5;
/// Share of the worst residual of a round below which another may be its doing: a blunder bends the images that it lies in, by no more than its
/// leverage, which is below a tenth in an image of twenty points or more. What is left stands out in the next round. A residual of which this share is
/// beyond the threshold may have put measurements there that are right.
const BENT: f64 = 0.1;
/// A measurement comes back below this share of the threshold; the gap keeps one from going to and fro.
const RETURN: f64 = 0.8;
/// Directions with less redundancy are not tested: twenty sigma there show as less than five.
const SMALLEST_REDUNDANCY: f64 = 0.05;
/// Neighbours that a measurement is judged against.
const NEIGHBOURS: usize = 12;
/// Neighbours below which it is judged by itself alone.
const FEWEST_NEIGHBOURS: usize = 4;
/// Steps of the robust mean over the neighbours.
const REWEIGHTINGS: usize = 5;
/// Standardised difference at which a neighbour counts half.
const HALF_WEIGHT: f64 = 3.0;

/// A measurement at a solution, standardised.
pub(super) struct Seen {
    pub(super) kind: MeasurementKind,
    pub(super) measurement: usize,
    row: Measurement,
    pub(super) active: bool,
    /// Observed minus computed, cameras and point as adjusted.
    residual: Vector2<f64>,
    /// Derivative of the computed by the point.
    by_point: Matrix2x3<f64>,
    /// Displacement of the neighbours.
    neighbours: Option<Vector2<f64>>,
}

/// A block's measurements at a solution, those left out included.
pub(super) struct Sight {
    pub(super) seen: Vec<Seen>,
    /// Measurements of point `j`: `seen[starts[j]..starts[j + 1]]`.
    starts: Vec<usize>,
    /// Weight of the surveyed coordinates of each point.
    surveyed: Vec<Matrix3<f64>>,
    /// Is the point one that takes no part?
    lost: Vec<bool>,
    images: usize,
}

/// A measurement tested against the others of its point.
#[derive(Clone, Copy)]
struct Statistic {
    /// Statistic, the lesser of its own and of its difference from the neighbours.
    statistic: f64,
    dof: f64,
}

impl Sight {
    /// `lost`: tie points that take no part and are to be judged anew.
    pub(super) fn new(block: &Block, left: &Kept, lost: &[bool], fit: &Solved) -> Result<Self, AdjustError> {
        let Solved { problem, state } = fit;
        let predictor = Predictor::new(problem, state)?;
        let by_point = |rows: &[Measurement], points: usize| {
            let mut of = vec![Vec::new(); points];
            rows.iter().enumerate().for_each(|(m, row)| of[row.point.index()].push(m));
            of
        };
        let ties = by_point(&block.ties, block.tie_points.len());
        let marks = by_point(&block.marks, block.surveyed.len());
        let mut sight = Self {
            seen: Vec::new(),
            starts: vec![0],
            surveyed: vec![Matrix3::zeros(); state.points.len()],
            lost: vec![false; state.points.len()],
            images: block.images.len(),
        };
        for control in &problem.control {
            let weights = control.sigma.map(|sigma| sigma.powi(-2));
            sight.surveyed[control.index as usize] = Matrix3::from_diagonal(&weights);
        }
        // Poses of images that take no part are what they were given as, and nothing can be judged by them.
        let idle = problem.unoriented_images();
        let mut points: Vec<_> = problem.point_sources.iter().copied().zip(state.points.iter().copied()).collect();
        for point in (0..lost.len()).filter(|point| lost[*point]) {
            let rows: Vec<&Measurement> = ties[point].iter().map(|m| &block.ties[*m]).collect();
            let rows: Vec<&Measurement> = rows.into_iter().filter(|row| !idle[row.image.index()]).collect();
            if let Some(position) = meeting(block, state, &rows) {
                points.push((PointSource::Tie(PointId::from(point)), position));
                sight.surveyed.push(Matrix3::zeros());
                sight.lost.push(true);
            }
        }
        let seen_of = |(source, point): &(PointSource, Vector3<f64>)| -> Vec<Seen> {
            let (kind, own, rows, sigma) = match source {
                PointSource::Tie(id) => (MeasurementKind::Tie, &ties[id.index()], &block.ties, block.sigma.tie_px),
                PointSource::Control(id) => {
                    (MeasurementKind::Mark, &marks[id.index()], &block.marks, block.sigma.mark_px)
                }
            };
            let seen = |m: &usize| {
                let row = rows[*m];
                if idle[row.image.index()] {
                    return None;
                }
                // What cannot be projected was left out before, or it could not have been adjusted.
                let (computed, by_point) = predictor.image_point(row.image.index(), [row.x, row.y], point)?;
                let weight = 1.0 / row.sigma.unwrap_or(sigma);
                Some(Seen {
                    kind,
                    measurement: *m,
                    row,
                    active: left.is_in(kind, *m),
                    residual: Vector2::new(row.x - computed[0], row.y - computed[1]) * weight,
                    by_point: by_point * weight,
                    neighbours: None,
                })
            };
            own.iter().filter_map(seen).collect()
        };
        let of_points: Vec<Vec<Seen>> = points.par_iter().map(seen_of).collect();
        for of_point in of_points {
            sight.seen.extend(of_point);
            sight.starts.push(sight.seen.len());
        }
        Ok(sight)
    }

    pub(super) fn round(&mut self, options: SnoopingOptions, number: usize, rejected: &mut Vec<Rejected>) -> Round {
        let before: Vec<bool> = self.seen.iter().map(|seen| seen.active).collect();
        let local = self.local();
        let variance = variance(&local);
        let wide = if options.strictness == Strictness::Loose { LOOSE * LOOSE } else { 1.0 };
        let level = (options.significance / before.iter().filter(|active| **active).count().max(1) as f64).ln();
        let beyond = |verdict: Statistic, share: f64| {
            chi_square_ln_sf(verdict.statistic / (variance * wide * share * share), verdict.dof) < level
        };
        // The neighbours can only excuse a measurement: they are asked where its point has one to reject or one to take back.
        let in_question = |j: &usize| {
            self.measurements_of(*j).any(|k| {
                let own = local[k].as_ref().and_then(|local| Some(local.weight?.verdict(local.residual)));
                !self.seen[k].active || own.is_some_and(|own| beyond(own, 1.0))
            })
        };
        let in_question: Vec<usize> = (0..self.starts.len() - 1).filter(in_question).collect();
        self.judge_neighbours(&in_question, &local, variance);
        let points = 0..self.starts.len() - 1;
        let of_points = points.clone().filter_map(|j| self.worst(j)).map(|(_, verdict)| verdict);
        let worst = of_points.max_by(|a, b| a.statistic.total_cmp(&b.statistic));
        let largest = worst.map_or(0.0, |worst| worst.statistic);
        // A fit that is bent altogether has large residuals everywhere: they are no measure of what is large then, the stated precision is.
        let bent = worst.is_some_and(|worst| beyond(worst, variance.min(1.0).sqrt() / (BENT * variance.sqrt())));
        let may_be_bent = |verdict: Statistic| verdict.statistic < BENT * BENT * largest;
        let normalised = |verdict: Statistic| (verdict.statistic / variance).sqrt();
        let mut round = Round { rejected: 0, returned: 0, held_back: 0, bent, sigma0: variance.sqrt() };
        let mut out = Vec::new();
        for j in points {
            if self.lost[j] {
                let revived = self.revive(j, |sight, j| {
                    let worst = sight.worst(j).filter(|(_, verdict)| beyond(*verdict, RETURN));
                    worst.map(|(k, verdict)| (k, normalised(verdict)))
                });
                round.returned += revived.returned;
                out.extend(revived.rejected);
                // Now it is known which of them are wrong, and by how much.
                for (k, normalised) in revived.still_out {
                    let Seen { kind, measurement, .. } = self.seen[k];
                    let is_it = |r: &&mut Rejected| (r.kind, r.measurement) == (kind, measurement);
                    rejected.iter_mut().filter(is_it).for_each(|r| r.normalised = normalised);
                }
                continue;
            }
            while let Some((k, verdict)) = self.worst(j).filter(|(_, verdict)| beyond(*verdict, 1.0)) {
                if may_be_bent(verdict) {
                    round.held_back += 1;
                    break;
                }
                self.seen[k].active = false;
                out.push((k, normalised(verdict)));
            }
            while let Some((k, _)) = self.best_outside(j, &before).filter(|(_, verdict)| !beyond(*verdict, RETURN)) {
                self.seen[k].active = true;
                round.returned += 1;
            }
        }
        round.rejected = out.len();
        rejected.extend(out.into_iter().map(|(k, normalised)| {
            let Seen { kind, measurement, row, .. } = self.seen[k];
            Rejected { kind, measurement, image: row.image, point: row.point, normalised, round: number }
        }));
        let returned: HashSet<_> = (self.seen.iter().zip(&before))
            .filter(|(seen, before)| seen.active && !**before)
            .map(|(seen, _)| (seen.kind as u32, seen.measurement))
            .collect();
        rejected.retain(|rejected| !returned.contains(&(rejected.kind as u32, rejected.measurement)));
        round
    }

    /// Positions in `seen` of the measurements of point `j`.
    pub(super) fn measurements_of(&self, j: usize) -> std::ops::Range<usize> {
        self.starts[j]..self.starts[j + 1]
    }

    /// Covariance of point `j` and its shift by the measurements that are in; `None` where they do not determine it.
    fn intersect(&self, j: usize) -> Option<(Matrix3<f64>, Vector3<f64>)> {
        let mut normal = self.surveyed[j];
        let mut gradient = Vector3::zeros();
        let mut rays = 0;
        for seen in self.seen[self.starts[j]..self.starts[j + 1]].iter().filter(|seen| seen.active) {
            normal += seen.by_point.transpose() * seen.by_point;
            gradient += seen.by_point.transpose() * seen.residual;
            rays += 1;
        }
        let known = self.surveyed[j] != Matrix3::zeros();
        let covariance = (rays >= FEWEST_RAYS || known).then(|| normal.try_inverse())??;
        Some((covariance, covariance * gradient))
    }

    /// The worst measurement of a point among those that are in.
    fn worst(&self, j: usize) -> Option<(usize, Statistic)> {
        let (covariance, shift) = self.intersect(j)?;
        let active = (self.starts[j]..self.starts[j + 1]).filter(|k| self.seen[*k].active);
        let verdicts = active.filter_map(|k| {
            let seen = &self.seen[k];
            let redundancy = Matrix2::identity() - seen.by_point * covariance * seen.by_point.transpose();
            let residual = seen.residual - seen.by_point * shift;
            seen.verdict(residual, redundancy).map(|verdict| (k, verdict))
        });
        verdicts.max_by(|(_, a), (_, b)| a.statistic.total_cmp(&b.statistic))
    }

    /// The best measurement of a point among those that were out at the begin of the round and still are.
    fn best_outside(&self, j: usize, before: &[bool]) -> Option<(usize, Statistic)> {
        let (covariance, shift) = self.intersect(j)?;
        let outside = (self.starts[j]..self.starts[j + 1]).filter(|k| !self.seen[*k].active && !before[*k]);
        let verdicts = outside.filter_map(|k| {
            let seen = &self.seen[k];
            // Prediction from the others; the redundancy that it would have, and the residual, once it is back in.
            let predicted = Matrix2::identity() + seen.by_point * covariance * seen.by_point.transpose();
            let redundancy = predicted.try_inverse()?;
            let residual = redundancy * (seen.residual - seen.by_point * shift);
            seen.verdict(residual, redundancy).map(|verdict| (k, verdict))
        });
        verdicts.min_by(|(_, a), (_, b)| a.statistic.total_cmp(&b.statistic))
    }

    /// All measurements that are in; `None` where nothing is tested.
    fn local(&self) -> Vec<Option<Intersected>> {
        let mut all = vec![None; self.seen.len()];
        for j in 0..self.starts.len() - 1 {
            let Some((covariance, shift)) = self.intersect(j) else { continue };
            for k in (self.starts[j]..self.starts[j + 1]).filter(|k| self.seen[*k].active) {
                let by_point = &self.seen[k].by_point;
                let redundancy = Matrix2::identity() - by_point * covariance * by_point.transpose();
                let residual = self.seen[k].residual - by_point * shift;
                all[k] = Some(Intersected { residual, redundancy, weight: Weight::of(redundancy) });
            }
        }
        all
    }

    /// Robust mean displacement of the neighbours of every measurement of some points: the `d` that `R_k d` fits their residuals best.
    fn judge_neighbours(&mut self, points: &[usize], local: &[Option<Intersected>], variance: f64) {
        if points.is_empty() {
            return;
        }
        let active: Vec<usize> = (0..self.seen.len()).filter(|k| local[*k].is_some()).collect();
        // Those left out look for neighbours too, but are none.
        let outside = (0..self.seen.len()).filter(|k| local[*k].is_none());
        let order: Vec<usize> = active.iter().copied().chain(outside).collect();
        let place = |k: &usize| (self.seen[*k].row.image.index(), [self.seen[*k].row.x, self.seen[*k].row.y]);
        let near = Neighbours::new(order.iter().map(place), self.images);
        let mut positions = vec![0; order.len()];
        order.iter().enumerate().for_each(|(position, k)| positions[*k] = position);
        let judged: Vec<usize> = points.iter().flat_map(|j| self.measurements_of(*j)).collect();
        let displacements: Vec<Option<Vector2<f64>>> = judged
            .par_iter()
            .map(|k| {
                let position = positions[*k];
                let point = self.seen[order[position]].row.point;
                let around: Vec<Intersected> = near
                    .nearest(position, NEIGHBOURS)
                    .filter(|other| self.seen[order[*other]].row.point != point)
                    .filter_map(|other| local[order[other]])
                    .collect();
                robust_displacement(&around, variance)
            })
            .collect();
        for (k, displacement) in judged.into_iter().zip(displacements) {
            self.seen[k].neighbours = displacement;
        }
    }
}

impl Seen {
    fn verdict(&self, residual: Vector2<f64>, redundancy: Matrix2<f64>) -> Option<Statistic> {
        let weight = Weight::of(redundancy)?;
        let own = weight.verdict(residual);
        let Some(displacement) = self.neighbours else { return Some(own) };
        let apart = weight.verdict(residual - redundancy * displacement);
        Some(if apart.statistic < own.statistic { apart } else { own })
    }
}

/// Variance factor from the median statistic; 1 where nothing can be tested.
fn variance(local: &[Option<Intersected>]) -> f64 {
    let verdicts = |local: &Intersected| local.weight.map(|weight| weight.verdict(local.residual));
    let verdicts: Vec<Statistic> = local.iter().flatten().filter_map(verdicts).collect();
    let statistics = |dof: f64| -> Vec<f64> {
        verdicts.iter().filter(|verdict| verdict.dof == dof).map(|verdict| verdict.statistic).collect()
    };
    let (one, two) = (statistics(1.0), statistics(2.0));
    let (sample, dof) = if two.len() >= one.len() { (two, 2.0) } else { (one, 1.0) };
    let variance = median(&sample) / chi_square_quantile(0.5, dof);
    if variance > 0.0 { variance } else { 1.0 }
}

/// A measurement that is in, its point intersected with the cameras held.
#[derive(Clone, Copy)]
struct Intersected {
    residual: Vector2<f64>,
    redundancy: Matrix2<f64>,
    weight: Option<Weight>,
}

/// `R^-1` over the directions that have redundancy.
#[derive(Clone, Copy)]
struct Weight {
    inverse: Matrix2<f64>,
    dof: f64,
}

impl Weight {
    /// `None` where no direction has redundancy.
    fn of(redundancy: Matrix2<f64>) -> Option<Self> {
        let eigen = redundancy.symmetric_eigen();
        let mut weight = Self { inverse: Matrix2::zeros(), dof: 0.0 };
        for k in (0..2).filter(|k| eigen.eigenvalues[*k] > SMALLEST_REDUNDANCY) {
            let direction = eigen.eigenvectors.column(k);
            weight.inverse += direction * direction.transpose() / eigen.eigenvalues[k];
            weight.dof += 1.0;
        }
        (weight.dof > 0.0).then_some(weight)
    }

    /// `v' R^-1 v`.
    fn verdict(&self, residual: Vector2<f64>) -> Statistic {
        Statistic { statistic: residual.dot(&(self.inverse * residual)), dof: self.dof }
    }
}

/// Iteratively reweighted, from the medians of the components.
fn robust_displacement(around: &[Intersected], variance: f64) -> Option<Vector2<f64>> {
    if around.len() < FEWEST_NEIGHBOURS {
        return None;
    }
    let component = |k: usize| -> f64 { median(&around.iter().map(|local| local.residual[k]).collect::<Vec<_>>()) };
    let mean = around.iter().map(|local| local.redundancy).sum::<Matrix2<f64>>() / around.len() as f64;
    let mut displacement = mean.try_inverse()? * Vector2::new(component(0), component(1));
    for _ in 0..REWEIGHTINGS {
        let (mut normal, mut sum) = (Matrix2::zeros(), Vector2::zeros());
        for Intersected { residual, redundancy, weight } in around {
            let apart = weight.map_or(0.0, |weight| weight.verdict(residual - redundancy * displacement).statistic);
            let weight = 1.0 / (1.0 + apart / (variance * HALF_WEIGHT * HALF_WEIGHT));
            normal += redundancy * weight;
            sum += residual * weight;
        }
        displacement = normal.try_inverse()? * sum;
    }
    Some(displacement)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::problem::Problem;
    use crate::scenario::{Scenario, add_noise, simulate};
    use std::collections::BTreeMap;

    /// px.
    const NOISE: f64 = 0.3;

    /// One round at the true cameras and points, measurement 7 left out before: what came back, and is it in?
    fn round_with_one_left_out(error_px: f64) -> (Round, bool) {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 60.0)])).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        add_noise(&mut block, NOISE, 1).expect("noise");
        block.ties[7].x += error_px;
        let problem = Problem::new(&block, &Model::default()).expect("a problem");
        let state = problem.start.clone();
        let mut left = Kept::all(&block);
        left.ties[7] = false;
        let mut sight = Sight::new(&block, &left, &[], &Solved { problem, state }).expect("a solution");
        let round = sight.round(SnoopingOptions::default(), 2, &mut Vec::new());
        let back =
            sight.seen.iter().any(|seen| seen.kind == MeasurementKind::Tie && seen.measurement == 7 && seen.active);
        (round, back)
    }

    #[test]
    fn what_fits_again_comes_back() {
        let (round, back) = round_with_one_left_out(0.0);
        assert!(back && round.returned == 1 && round.rejected == 0, "{round:?}");
        let (round, back) = round_with_one_left_out(20.0 * NOISE);
        assert!(!back && round.returned == 0 && round.rejected == 0, "{round:?}");
    }

    #[test]
    fn a_direction_without_redundancy_is_not_tested() {
        let one = Weight::of(Matrix2::new(0.5, 0.0, 0.0, 0.01)).expect("one direction");
        let verdict = one.verdict(Vector2::new(3.0, 100.0));
        assert!((verdict.statistic - 18.0).abs() < 1e-12 && verdict.dof == 1.0);
        assert!(Weight::of(Matrix2::zeros()).is_none());
    }
}
