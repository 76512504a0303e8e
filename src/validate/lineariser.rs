//! Measurements and their derivatives in double-double, and the normal equations that they sum to.

use super::forward::{ExtendedState, Forward, Given, PLAIN};
use super::normal::{CertifyError, MOST_LOCAL, Normal, Part};
use crate::camera::PARAMETER_COUNT;
use crate::effects::ImageContext;
use crate::math::DoubleDouble;
use crate::math::jet::Jet;
use crate::problem::{LOSS_SCALE, Loss, Problem};
use rayon::prelude::*;

/// Which curvature of a robust loss the normal equations have: that of its weights, which the covariance has, or all of
/// it, which a step has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curvature {
    /// `J' w J`.
    Weights,
    /// With the second derivative of the loss.
    Newton,
}

/// `rho(s)`, `rho'(s)` and `2 s rho'' / rho'`, `s` the squared normalised length.
fn rho(loss: Loss, s: DoubleDouble) -> (DoubleDouble, DoubleDouble, f64) {
    let one = DoubleDouble::ONE;
    let a = DoubleDouble::from(LOSS_SCALE);
    let a2 = a * a;
    match loss {
        Loss::None => (s, one, 0.0),
        Loss::Huber if s <= a2 => (s, one, 0.0),
        Loss::Huber => (a * s.sqrt() * 2.0 - a2, a / s.sqrt(), -1.0),
        Loss::Cauchy => {
            let t = one + s / a2;
            (a2 * t.ln(), one / t, ((a2 - s) / (a2 + s)).hi - 1.0)
        }
    }
}

/// What linearises a problem.
pub struct Lineariser<'a> {
    problem: &'a Problem,
    forward: Forward<'a>,
    /// Column of each unknown of the layout; `usize::MAX` where it is held.
    column: Vec<usize>,
    unknowns: Vec<usize>,
}

impl<'a> Lineariser<'a> {
    /// Prepares a problem.
    ///
    /// # Errors
    /// An effect that certificates do not know; too many of them.
    pub fn new(problem: &'a Problem) -> Result<Self, CertifyError> {
        let forward = Forward::new(problem)?;
        if forward.local > MOST_LOCAL {
            return Err(CertifyError::TooMany(forward.local));
        }
        let free = problem.free();
        let unknowns: Vec<usize> = (0..free.len()).filter(|u| free[*u]).collect();
        let mut column = vec![usize::MAX; free.len()];
        unknowns.iter().enumerate().for_each(|(k, unknown)| column[*unknown] = k);
        Ok(Self { problem, forward, column, unknowns })
    }

    /// Half the sum of `rho` at a state.
    ///
    /// # Errors
    /// A measurement that cannot be predicted.
    pub fn cost(&self, state: &ExtendedState) -> Result<DoubleDouble, CertifyError> {
        let problem = self.problem;
        let points = 0..problem.point_sources.len();
        let of_point = |j: usize| -> Result<DoubleDouble, CertifyError> {
            let mut sum = DoubleDouble::ZERO;
            for observation in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
                let given = self.forward.numbers(state, Some(observation.image as usize), Some(j));
                let at = self.forward.image_point(observation.image as usize, &given).ok_or_else(|| self.outside(j))?;
                let v = [observation.x, observation.y];
                let v = [0, 1].map(|k| (DoubleDouble::from(v[k]) - at[k]) * observation.inverse_sigma);
                sum += rho(problem.loss, v[0] * v[0] + v[1] * v[1]).0;
            }
            Ok(sum)
        };
        let of_points: Vec<DoubleDouble> = points.into_par_iter().map(of_point).collect::<Result<_, _>>()?;
        let mut sum = of_points.into_iter().fold(DoubleDouble::ZERO, |sum, part| sum + part);
        for part in self.beside_points::<PLAIN>(state, true)? {
            sum += part.cost * 2.0;
        }
        Ok(sum * 0.5)
    }

    /// The normal equations at a state.
    ///
    /// # Errors
    /// A measurement that cannot be predicted.
    pub fn linearise(&self, state: &ExtendedState, curvature: Curvature) -> Result<Normal, CertifyError> {
        match self.forward.local {
            0 => self.with::<PLAIN>(state, curvature),
            1..=6 => self.with::<{ PLAIN + 6 }>(state, curvature),
            _ => self.with::<{ PLAIN + MOST_LOCAL }>(state, curvature),
        }
    }

    fn outside(&self, point: usize) -> CertifyError {
        CertifyError::Outside(format!("point `{}`", self.problem.point_names[point]))
    }

    fn with<const N: usize>(&self, state: &ExtendedState, curvature: Curvature) -> Result<Normal, CertifyError> {
        let points = 0..self.problem.point_sources.len();
        let of_point = |j: usize| self.point::<N>(state, curvature, j);
        let mut parts: Vec<Part> = points.into_par_iter().map(of_point).collect::<Result<_, _>>()?;
        parts.extend(self.beside_points::<N>(state, false)?);
        Ok(Normal::sum(self.unknowns.clone(), &parts))
    }

    /// Columns of what an image measurement depends on, by position in its jets.
    fn columns(&self, image: usize, point: usize) -> Vec<usize> {
        let layout = self.problem.layout();
        let context = &self.problem.image_contexts[image];
        let camera = (0..PARAMETER_COUNT).map(|k| layout.camera(context.camera as usize, k));
        let pose = (0..6).map(|k| layout.pose(image, k));
        let point = (0..3).map(|k| layout.point(point, k));
        let theta = self.forward.theta_indices(context).into_iter().map(|t| layout.theta(t));
        camera.chain(pose).chain(point).chain(theta).map(|unknown| self.column[unknown]).collect()
    }

    fn point<const N: usize>(
        &self,
        state: &ExtendedState,
        curvature: Curvature,
        j: usize,
    ) -> Result<Part, CertifyError> {
        let problem = self.problem;
        let observations = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
        let columns: Vec<Vec<usize>> = observations.iter().map(|o| self.columns(o.image as usize, j)).collect();
        let mut part = Part::new(columns.iter().flatten().copied().filter(|column| *column != usize::MAX).collect());
        for (observation, columns) in observations.iter().zip(&columns) {
            let numbers = self.forward.numbers(state, Some(observation.image as usize), Some(j));
            let at = self.forward.image_point(observation.image as usize, &self.forward.jets::<N>(&numbers));
            let at = at.ok_or_else(|| self.outside(j))?;
            let weight = observation.inverse_sigma;
            let observed = [observation.x, observation.y];
            let v = [0, 1].map(|k| (DoubleDouble::from(observed[k]) - at[k].value) * weight);
            let s = v[0] * v[0] + v[1] * v[1];
            let (value, slope, along) = rho(problem.loss, s);
            let rows: [Vec<(usize, DoubleDouble)>; 2] = [0, 1].map(|k| entries(columns, &at[k], weight));
            part.cost += value * 0.5;
            for k in 0..2 {
                part.add(&rows[k], v[k], slope, true);
            }
            if curvature == Curvature::Newton && along != 0.0 {
                // rho' (I + 2 s rho''/rho' u u'), u the direction of the residual.
                let length = s.sqrt();
                let row: Vec<(usize, DoubleDouble)> = rows[0]
                    .iter()
                    .zip(&rows[1])
                    .map(|((column, x), (_, y))| (*column, (*x * v[0] + *y * v[1]) / length))
                    .collect();
                part.add(&row, DoubleDouble::ZERO, slope * along, false);
            }
        }
        Ok(part)
    }

    /// Rows of control coordinates, antennas and priors; without derivatives where the cost alone is asked for.
    fn beside_points<const N: usize>(&self, state: &ExtendedState, cost: bool) -> Result<Vec<Part>, CertifyError> {
        let problem = self.problem;
        let layout = problem.layout();
        let mut parts = Vec::new();
        let position =
            |columns: &[usize], at: &[Jet<DoubleDouble, N>; 3], seen: &crate::problem::PositionObservation| {
                let mut part = Part::new(columns.iter().copied().filter(|column| *column != usize::MAX).collect());
                for k in 0..3 {
                    let sigma = DoubleDouble::from(seen.sigma[k]);
                    let v = (DoubleDouble::from(seen.position[k]) - at[k].value) / sigma;
                    part.cost += v * v * 0.5;
                    let row: Vec<_> = entries(columns, &at[k], 1.0).into_iter().map(|(c, a)| (c, a / sigma)).collect();
                    part.add(&row, v, DoubleDouble::ONE, true);
                }
                part
            };
        let constant = |given: Given<DoubleDouble>| Given::<Jet<DoubleDouble, N>> {
            interior: given.interior.map(Jet::constant),
            rotation: given.rotation.map(|row| row.map(Jet::constant)),
            centre: given.centre.map(Jet::constant),
            point: given.point.map(Jet::constant),
            theta: given.theta.into_iter().map(Jet::constant).collect(),
        };
        let prepare = |given: Given<DoubleDouble>| if cost { constant(given) } else { self.forward.jets::<N>(&given) };
        for seen in &problem.control {
            let j = seen.index as usize;
            let given = self.forward.numbers(state, None, Some(j));
            let at = self.forward.surveyed(&prepare(given)).ok_or_else(|| self.outside(j))?;
            let mut columns = vec![usize::MAX; PLAIN];
            (0..3).for_each(|k| columns[PARAMETER_COUNT + 6 + k] = self.column[layout.point(j, k)]);
            let theta = self.forward.theta_indices(&ImageContext::default());
            columns.extend(theta.into_iter().map(|t| self.column[layout.theta(t)]));
            parts.push(position(&columns, &at, seen));
        }
        for seen in &problem.gnss {
            let image = seen.index as usize;
            let given = self.forward.numbers(state, Some(image), None);
            let outside = || CertifyError::Outside(format!("the antenna of image `{}`", problem.image_names[image]));
            let at = self.forward.antenna(image, &prepare(given)).ok_or_else(outside)?;
            let mut columns = self.columns(image, 0);
            columns[PARAMETER_COUNT + 6..PLAIN].fill(usize::MAX);
            parts.push(position(&columns, &at, seen));
        }
        let mut prior = |unknown: usize, mean: f64, value: DoubleDouble, sigma: f64| {
            let sigma = DoubleDouble::from(sigma);
            let v = (DoubleDouble::from(mean) - value) / sigma;
            let column = self.column[unknown];
            let mut part = Part::new(if column == usize::MAX { Vec::new() } else { vec![column] });
            part.cost = v * v * 0.5;
            if column != usize::MAX {
                part.add(&[(column, DoubleDouble::ONE / sigma)], v, DoubleDouble::ONE, true);
            }
            parts.push(part);
        };
        for (t, entry) in problem.theta.iter().enumerate() {
            if let Some(sigma) = entry.prior_sigma {
                prior(layout.theta(t), entry.prior_mean, state.theta[t], sigma);
            }
        }
        for p in &problem.camera_priors {
            let (c, k) = (p.camera as usize, p.parameter as usize);
            prior(layout.camera(c, k), p.value, state.interiors[c][k], p.sigma);
        }
        Ok(parts)
    }

    /// Moves the free unknowns of a state.
    pub fn step(&self, state: &mut ExtendedState, step: &[DoubleDouble]) {
        let layout = self.problem.layout();
        let of = |unknown: usize| match self.column[unknown] {
            usize::MAX => DoubleDouble::ZERO,
            column => step[column],
        };
        for (c, interior) in state.interiors.iter_mut().enumerate() {
            (0..PARAMETER_COUNT).for_each(|k| interior[k] += of(layout.camera(c, k)));
        }
        state.theta.iter_mut().enumerate().for_each(|(t, value)| *value += of(layout.theta(t)));
        for i in 0..layout.images {
            let turn = std::array::from_fn(|k| of(layout.pose(i, k)));
            if turn.iter().any(|part| *part != DoubleDouble::ZERO) {
                state.rotations[i] = super::laws::turned(&turn, &state.rotations[i]);
            }
            (0..3).for_each(|k| state.centres[i][k] += of(layout.pose(i, 3 + k)));
        }
        for (j, point) in state.points.iter_mut().enumerate() {
            (0..3).for_each(|k| point[k] += of(layout.point(j, k)));
        }
    }
}

/// The derivatives of a prediction by what is free, weighted.
fn entries<const N: usize>(columns: &[usize], at: &Jet<DoubleDouble, N>, weight: f64) -> Vec<(usize, DoubleDouble)> {
    let free = columns.iter().zip(&at.slope).filter(|(column, _)| **column != usize::MAX);
    free.map(|(column, slope)| (*column, *slope * weight)).collect()
}
