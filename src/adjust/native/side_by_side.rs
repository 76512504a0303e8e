//! The measurements of consecutive points, eight at a time: predicted side by side and weighed.

use super::loss::{Curvature, LEAST_CURVATURE, curvature_along, rho};
use crate::effects::Stage;
use crate::measure::lanes::{CAMERA, LANES, Lane, MISCLOSURE, Predictions, Views};
use crate::measure::{Answers, Frame, MeasureError, Predict, Seen, Stages, Wanted};
use crate::problem::{Loss, Problem};
use nalgebra::Vector3;
use pulp::Simd;
use std::ops::Range;

/// Place in the rows of [`Predictions`] of what a step moves the image point by, where the points alone are asked for:
/// like a derivative.
const ALONG_STEP: usize = CAMERA;

/// The images of a problem at a state, and the effects that act in them.
#[derive(Clone, Copy)]
pub struct Cameras<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Its effects.
    pub stages: &'a Stages,
    /// Its images.
    pub frames: &'a [Frame],
}

/// Up to eight measurements.
#[derive(Debug, Default)]
pub struct Eight {
    /// Their numbers.
    pub numbers: Range<usize>,
    /// The point of each.
    pub points: [usize; LANES],
    /// Observed x and y, px, and the inverse of their standard deviation, px^-1; zeros in places that are left over.
    observed: [Lane; 3],
    /// Weights; zeros in places that are left over.
    pub weights: Lane,
}

/// Goes through them.
pub struct Eights<'a> {
    problem: &'a Problem,
    frames: &'a [Frame],
    objects: &'a [Vector3<f64>],
    first_point: usize,
    point: usize,
    rest: Range<usize>,
}

impl<'a> Eights<'a> {
    /// The measurements of the points of a range, which are where `objects` says.
    pub fn new(cameras: Cameras<'a>, objects: &'a [Vector3<f64>], points: Range<usize>, views: &mut Views) -> Self {
        let Cameras { problem, stages, frames } = cameras;
        let one_interior = problem.camera_free.len() == 1 && stages.of(Stage::Interior).is_empty();
        views.set_interior(frames.first().filter(|_| one_interior).map(|frame| &frame.interior));
        let rest = problem.point_start[points.start]..problem.point_start[points.end];
        let first = points.start;
        Self { problem, frames, objects, first_point: first, point: first, rest }
    }

    /// Puts the next ones into `views` and `eight`; `false` where there are none.
    #[inline(always)]
    pub fn next<S: Simd>(&mut self, simd: S, views: &mut Views, eight: &mut Eight) -> bool {
        let first = self.rest.start;
        let count = LANES.min(self.rest.len());
        if count == 0 {
            return false;
        }
        eight.numbers = first..first + count;
        for lane in 0..LANES {
            // Places that the last group leaves empty see what its first sees.
            let number = if lane < count { first + lane } else { first };
            while lane < count && self.problem.point_start[self.point + 1] <= number {
                self.point += 1;
            }
            eight.points[lane] = if lane < count { self.point } else { eight.points[0] };
            let observation = &self.problem.observations[number];
            let frame = &self.frames[observation.image as usize];
            views.set(simd, lane, &frame.numbers, &self.objects[eight.points[lane] - self.first_point]);
            let weight = if lane < count { observation.inverse_sigma } else { 0.0 };
            let [x, y, inverse_sigma] = &mut eight.observed;
            (x[lane], y[lane], inverse_sigma[lane]) = (observation.x, observation.y, weight);
        }
        views.turn(simd);
        self.rest.start += count;
        true
    }
}

/// Work space for the measurements of one thread.
#[derive(Debug)]
pub struct Workspace {
    /// What the camera is given.
    pub views: Views,
    /// Which measurements these are.
    pub eight: Eight,
    /// What is predicted of them.
    pub predictions: Predictions,
    /// What effects answer.
    pub answers: Answers,
}

impl Workspace {
    /// Nothing is in it yet.
    pub fn new(stages: &Stages) -> Self {
        Self {
            views: Views::default(),
            eight: Eight::default(),
            predictions: Predictions::new(stages.row_len()),
            answers: Answers::default(),
        }
    }

    /// Linearises and weighs the next of `eights`, which begin with the measurements of a state; adds their `rho` to
    /// `costs`. `false` where there are none. Errors: a measurement that cannot be predicted.
    #[inline(always)]
    pub fn linearise<S: Simd>(
        &mut self,
        simd: S,
        cameras: Cameras<'_>,
        curvature: Curvature,
        eights: &mut Eights<'_>,
        costs: &mut Lane,
    ) -> Result<bool, MeasureError> {
        let Self { views, eight, predictions, answers } = self;
        let Cameras { problem, stages, frames } = cameras;
        if !eights.next(simd, views, eight) {
            return Ok(false);
        }
        if stages.plain_image() {
            views.predict(simd, predictions);
            if let Some(lane) = eight.behind(&predictions.depth) {
                return Err(eight.error(problem, lane));
            }
            if problem.tie_dc_to_pp {
                predictions.tie_centre();
            }
        } else {
            let observations = &problem.observations[eight.numbers.clone()];
            let seen = Seen { problem, stages, frames, observations };
            simd.vectorize(Predict { seen, views, out: predictions, answers, wanted: Wanted::Everything })
                .map_err(|lane| eight.error(problem, lane))?;
        }
        eight.weigh(simd, problem.loss, curvature, predictions, costs);
        Ok(true)
    }
}

impl Workspace {
    /// Predicts the next of `eights`, without derivatives. `Some(false)` where there are none, `None` where one cannot
    /// be predicted.
    #[inline(always)]
    pub fn predict<S: Simd>(&mut self, simd: S, cameras: Cameras<'_>, eights: &mut Eights<'_>) -> Option<bool> {
        let Self { views, eight, predictions, answers } = self;
        let Cameras { problem, stages, frames } = cameras;
        if !eights.next(simd, views, eight) {
            return Some(false);
        }
        if stages.plain_image() {
            views.project(simd, predictions);
            return eight.behind(&predictions.depth).is_none().then_some(true);
        }
        let observations = &problem.observations[eight.numbers.clone()];
        let seen = Seen { problem, stages, frames, observations };
        simd.vectorize(Predict { seen, views, out: predictions, answers, wanted: Wanted::Nothing }).ok()?;
        Some(true)
    }

    /// Linearises and weighs the next of `eights` by the object points alone. A robust loss, whose weights are those of
    /// the state that a step comes from, is told what was `predicted` there. `Some(false)` where there are none, `None`
    /// where one cannot be predicted.
    #[inline(always)]
    pub fn linearise_by_point<S: Simd>(
        &mut self,
        simd: S,
        cameras: Cameras<'_>,
        curvature: Curvature,
        eights: &mut Eights<'_>,
        predicted: Option<&[Lane; 2]>,
    ) -> Option<bool> {
        let Self { views, eight, predictions, answers } = self;
        let Cameras { problem, stages, frames } = cameras;
        if !eights.next(simd, views, eight) {
            return Some(false);
        }
        if stages.plain_image() {
            views.predict_by_point(simd, predictions);
            if eight.behind(&predictions.depth).is_some() {
                return None;
            }
        } else {
            let observations = &problem.observations[eight.numbers.clone()];
            let seen = Seen { problem, stages, frames, observations };
            simd.vectorize(Predict { seen, views, out: predictions, answers, wanted: Wanted::ByPoint }).ok()?;
        }
        if let Some(predicted) = predicted {
            for i in 0..2 {
                predictions.rows[i][ALONG_STEP] = difference(simd, &predictions.point[i], &predicted[i]);
            }
            predictions.point = *predicted;
        }
        eight.weigh(simd, problem.loss, curvature, predictions, &mut Lane::default());
        if predicted.is_some() {
            for row in &mut predictions.rows {
                row[MISCLOSURE] = difference(simd, &row[MISCLOSURE], &row[ALONG_STEP]);
            }
        }
        Some(true)
    }
}

impl Eight {
    /// The first measurement that lies behind its camera.
    #[inline(always)]
    pub fn behind(&self, depth: &Lane) -> Option<usize> {
        (0..LANES).find(|lane| depth[*lane] <= 0.0)
    }

    /// The same as an error.
    pub fn error(&self, problem: &Problem, lane: usize) -> MeasureError {
        let image = problem.observations[self.numbers.start + lane].image as usize;
        MeasureError::image_point(problem, self.points[lane], image)
    }

    /// Weighs them, `predictions` giving their places: misclosures go there. Adds `rho` of each to `costs`.
    #[inline(always)]
    pub fn weigh<S: Simd>(
        &mut self,
        simd: S,
        loss: Loss,
        curvature: Curvature,
        predictions: &mut Predictions,
        costs: &mut Lane,
    ) {
        let (misclosures, squares) = self.misclosures(simd, &predictions.point);
        for (row, misclosure) in predictions.rows.iter_mut().zip(misclosures) {
            row[MISCLOSURE] = misclosure;
        }
        add_costs(simd, loss, &squares, costs);
        if loss == Loss::None {
            self.weights = self.observed[2];
            return;
        }
        let mut shrinks = false;
        let (mut directions, mut shares) = ([Lane::default(); 2], Lane::splat(1.0));
        for lane in 0..LANES {
            let (s, inverse_sigma) = (squares[lane], self.observed[2][lane]);
            self.weights[lane] = inverse_sigma * rho(loss, s).1.sqrt();
            let along = if curvature == Curvature::Newton { curvature_along(loss, s) } else { 1.0 };
            if along < 1.0 {
                (shrinks, shares[lane]) = (true, along.max(LEAST_CURVATURE).sqrt());
                for i in 0..2 {
                    directions[i][lane] = misclosures[i][lane] * inverse_sigma / s.sqrt();
                }
            }
        }
        if shrinks {
            // Less curvature, the same gradient: the misclosure, which lies along the direction, grows by what the
            // derivatives shrink by.
            predictions.shrink_along(simd, &directions, &shares);
            for row in &mut predictions.rows {
                row[MISCLOSURE].iter_mut().zip(&*shares).for_each(|(v, share)| *v /= share);
            }
        }
    }

    /// Observed minus predicted, px, and their squared lengths over the variance.
    #[inline(always)]
    pub fn misclosures<S: Simd>(&self, simd: S, predicted: &[Lane; 2]) -> ([Lane; 2], Lane) {
        let (mut misclosures, mut squares) = ([Lane::default(); 2], Lane::default());
        for piece in 0..LANES / S::F64_LANES {
            let mut sum = simd.splat_f64s(0.0);
            for i in 0..2 {
                let misclosure = simd.sub_f64s(self.observed[i].get::<S>(piece), predicted[i].get::<S>(piece));
                let normalised = simd.mul_f64s(misclosure, self.observed[2].get::<S>(piece));
                misclosures[i].set::<S>(piece, misclosure);
                sum = simd.mul_add_f64s(normalised, normalised, sum);
            }
            squares.set::<S>(piece, sum);
        }
        (misclosures, squares)
    }
}

/// Adds `rho` of `squares`.
#[inline(always)]
pub fn add_costs<S: Simd>(simd: S, loss: Loss, squares: &Lane, costs: &mut Lane) {
    if loss != Loss::None {
        costs.iter_mut().zip(&**squares).for_each(|(cost, s)| *cost += rho(loss, *s).0);
        return;
    }
    for piece in 0..LANES / S::F64_LANES {
        costs.set::<S>(piece, simd.add_f64s(costs.get::<S>(piece), squares.get::<S>(piece)));
    }
}

#[inline(always)]
fn difference<S: Simd>(simd: S, a: &Lane, b: &Lane) -> Lane {
    let mut difference = Lane::default();
    for piece in 0..LANES / S::F64_LANES {
        difference.set::<S>(piece, simd.sub_f64s(a.get::<S>(piece), b.get::<S>(piece)));
    }
    difference
}
