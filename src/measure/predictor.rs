//! Predictions at a fixed state, for those who compare: image points, surveyed coordinates, antennas.

use super::chain::{self, Prediction};
use super::eight::{Answers, Predict, Wanted};
use super::eight_rays::Seen;
use super::frame::{self, Frame, Stages};
use super::lanes::{LANES, POINT, Predictions, Views};
use super::{MeasureError, position};
use crate::camera::undistort::viewing_ray;
use crate::math::pieces::each;
use crate::math::vectors::dispatch;
use crate::problem::{ImageObservation, MeasurementKind, Problem, State};
use nalgebra::{Matrix2x3, Matrix3x6, Vector3};
use pulp::{Simd, WithSimd};
use std::cell::RefCell;
use std::ops::Range;

thread_local! {
    /// Work space, which is dear to ask for at every measurement.
    static BUFFER: RefCell<Prediction> = RefCell::default();
    /// The same for eight of them.
    static EIGHT: RefCell<Eight> = RefCell::default();
}

/// Points whose measurements one thread predicts together.
const CHUNK: usize = 1024;
/// Points whose measurements are predicted before any of them is told.
const AHEAD: usize = 8 * CHUNK;

/// A world point as an image sees it.
#[derive(Debug, Clone, Copy)]
pub struct Sighted {
    /// The image.
    pub image: usize,
    /// The point, m.
    pub point: Vector3<f64>,
}

/// An image point (px) and its derivative by the world point (px/m).
pub type ImagePoint = ([f64; 2], Matrix2x3<f64>);

/// Predicts measurements at a state, effects included.
pub struct Predictor<'a> {
    problem: &'a Problem,
    state: &'a State,
    stages: Stages,
    frames: Vec<Frame>,
}

impl<'a> Predictor<'a> {
    /// Prepares every image. Errors: an interior effect outside its domain.
    pub fn new(problem: &'a Problem, state: &'a State) -> Result<Self, MeasureError> {
        let stages = Stages::acting(problem, state);
        let frames = frame::frames(problem, &stages, state)?;
        Ok(Self { problem, state, stages, frames })
    }

    /// Image point (px) of a world point, and its derivative by the point (px/m). `None`: behind the camera or
    /// outside an effect's domain.
    pub fn image_point(&self, image: usize, point: &Vector3<f64>) -> Option<ImagePoint> {
        BUFFER.with_borrow_mut(|p| {
            chain::predict(self.problem, &self.stages, &self.frames[image], image, point, p)?;
            Some((p.point, Matrix2x3::from_fn(|i, j| p.d_point[i][j])))
        })
    }

    /// [`Self::image_point`] of many, eight side by side: the same numbers.
    pub fn image_points(&self, sighted: impl IntoIterator<Item = Sighted>) -> Vec<Option<ImagePoint>> {
        let mut sighted = sighted.into_iter();
        let mut found = Vec::with_capacity(sighted.size_hint().0);
        EIGHT.with_borrow_mut(|eight| {
            loop {
                eight.sighted.clear();
                eight.sighted.extend(sighted.by_ref().take(LANES));
                if eight.sighted.is_empty() {
                    return;
                }
                eight.observations.clear();
                eight.observations.extend(eight.sighted.iter().map(|s| observation(s.image)));
                match dispatch(SideBySide { predictor: self, eight }) {
                    Some(()) => found.extend((0..eight.sighted.len()).map(|lane| Some(eight.image_point(lane)))),
                    // One of them has no image: which, and what of the others, shows one by one.
                    None => found.extend(eight.sighted.iter().map(|s| self.image_point(s.image, &s.point))),
                }
            }
        });
        found
    }

    /// Tells point, measurement and image point of every measurement of the problem, in its order. They are predicted
    /// on the threads of the current pool; outside of any on one.
    pub fn each_measurement(&self, mut tell: impl FnMut(usize, &ImageObservation, Option<ImagePoint>)) {
        let Problem { observations, point_start: starts, .. } = self.problem;
        for first in (0..self.state.points.len()).step_by(AHEAD) {
            let points = first..self.state.points.len().min(first + AHEAD);
            let mut predicted = vec![Vec::new(); points.len().div_ceil(CHUNK)];
            each(predicted.iter_mut().collect(), |number, of_chunk: &mut Vec<_>| {
                let first = first + number * CHUNK;
                *of_chunk = self.measurements_of(first..points.end.min(first + CHUNK));
            });
            let mut predicted = predicted.into_iter().flatten();
            for j in points {
                let of_point = &observations[starts[j]..starts[j + 1]];
                of_point.iter().zip(predicted.by_ref()).for_each(|(seen, predicted)| tell(j, seen, predicted));
            }
        }
    }

    /// Image points of all measurements of some points of the problem.
    fn measurements_of(&self, points: Range<usize>) -> Vec<Option<ImagePoint>> {
        let starts = &self.problem.point_start;
        self.image_points(points.flat_map(|j| {
            let point = self.state.points[j];
            let seen = self.problem.observations[starts[j]..starts[j + 1]].iter();
            seen.map(move |o| Sighted { image: o.image as usize, point })
        }))
    }

    /// Coordinates (m) that the survey would give of a point.
    pub fn surveyed(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        position::predict_surveyed(self.problem, &self.stages, &self.state.theta, point).map(|p| p.position)
    }

    /// Antenna position (m) of an image.
    pub fn antenna(&self, image: usize) -> Option<Vector3<f64>> {
        position::predict_antenna(self.problem, &self.stages, &self.frames[image], image).map(|p| p.position)
    }

    /// Derivatives of an image's antenna position by rotation `w` and projection centre, 3x6.
    pub fn antenna_by_pose(&self, image: usize) -> Option<Matrix3x6<f64>> {
        position::predict_antenna(self.problem, &self.stages, &self.frames[image], image).map(|p| p.derivative)
    }

    /// Projection centre (m) of an image.
    pub fn centre(&self, image: usize) -> Vector3<f64> {
        self.frames[image].centre
    }

    /// Approximate direction (world, unit length) of an image point: the camera's, effects of exposure, ray and image
    /// left out. For start values.
    pub fn ray(&self, image: usize, observed: [f64; 2]) -> Option<Vector3<f64>> {
        let frame = &self.frames[image];
        Some(frame.rotation.transpose() * viewing_ray(&frame.interior, observed)?)
    }
}

/// Whatever was measured: predictions know nothing of it.
fn observation(image: usize) -> ImageObservation {
    let unknown = f64::NAN;
    ImageObservation { image: image as u32, kind: MeasurementKind::Tie, x: unknown, y: unknown, inverse_sigma: 1.0 }
}

/// Work space for eight.
struct Eight {
    sighted: Vec<Sighted>,
    observations: Vec<ImageObservation>,
    views: Views,
    predictions: Predictions,
    answers: Answers,
}

impl Default for Eight {
    fn default() -> Self {
        // Room for the derivatives by the parameters of effects is made where they are asked for.
        let predictions = Predictions::new(0);
        let (views, answers) = (Views::default(), Answers::default());
        Self { sighted: Vec::new(), observations: Vec::new(), views, predictions, answers }
    }
}

impl Eight {
    fn image_point(&self, lane: usize) -> ImagePoint {
        let Predictions { point, rows, .. } = &self.predictions;
        (point.map(|coordinate| coordinate[lane]), Matrix2x3::from_fn(|i, j| rows[i][POINT + j][lane]))
    }
}

/// Predicts what is sighted of eight.
struct SideBySide<'a, 'b> {
    predictor: &'a Predictor<'b>,
    eight: &'a mut Eight,
}

impl WithSimd for SideBySide<'_, '_> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<()> {
        let Predictor { problem, stages, frames, .. } = self.predictor;
        let Eight { sighted, observations, views, predictions, answers } = self.eight;
        views.set_interior(None);
        predictions.fit(stages.row_len());
        for lane in 0..LANES {
            // Places that are left over see what the first sees.
            let Sighted { image, point, .. } = sighted.get(lane).unwrap_or(&sighted[0]);
            views.set(simd, lane, &frames[*image].numbers, point);
        }
        views.turn(simd);
        let seen = Seen { problem, stages, frames, observations };
        simd.vectorize(Predict { seen, views, out: predictions, answers, wanted: Wanted::ByPoint }).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::find;
    use crate::model::{Datum, EffectRef, EffectTerm, Model};
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    /// A block seen through effects of every stage that an image point goes through; one of two of the ray, one turns
    /// with the camera.
    fn problem() -> Problem {
        let scenario = Scenario::preset("closerange", &BTreeMap::from([("points".into(), 40.0)])).expect("a preset");
        let block = simulate(&scenario, 1).expect("a block").block;
        let sizes = [
            ("rolling-shutter", vec![("t", 0.02)]),
            ("refraction", vec![("kappa", 1e-6)]),
            ("earth-curvature", vec![]),
            ("focal-time", vec![("a", 1e-3)]),
            ("decentring-high", vec![("q1", 2e-15), ("q2", -1e-15)]),
        ];
        let term = |(id, values): (&str, Vec<(&str, f64)>)| {
            let effect = EffectRef::Builtin(find(id).expect("an effect"));
            let values = values.into_iter().map(|(name, value)| (name.to_string(), value)).collect();
            EffectTerm { effect, values, held: Vec::new() }
        };
        let effects = sizes.into_iter().map(term).collect();
        Problem::new(&block, &Model { effects, datum: Datum::All, ..Model::default() }).expect("a problem")
    }

    #[test]
    fn many_have_the_numbers_that_each_has_alone() {
        let problem = problem();
        let state = &problem.start;
        let predictor = Predictor::new(&problem, state).expect("a state");
        let mut told = 0;
        predictor.each_measurement(|j, seen, together| {
            let alone = predictor.image_point(seen.image as usize, &state.points[j]);
            assert!(alone.is_some());
            assert_eq!(together, alone, "measurement {told}");
            assert_eq!(*seen, problem.observations[told]);
            told += 1;
        });
        assert_eq!(told, problem.observations.len());
    }

    #[test]
    fn what_has_no_image_leaves_the_others_theirs() {
        let problem = problem();
        let state = &problem.start;
        let predictor = Predictor::new(&problem, state).expect("a state");
        let ahead = Sighted { image: 0, point: state.points[0] };
        let centre = predictor.centre(0);
        let behind = Sighted { point: centre - (state.points[0] - centre), ..ahead };
        let found = predictor.image_points([ahead, behind, ahead]);
        let alone = predictor.image_point(0, &ahead.point);
        assert!(alone.is_some());
        assert_eq!(found, [alone, None, alone]);
    }
}
