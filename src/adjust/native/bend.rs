//! Steps along a valley that bends.
//!
//! Where a step brings less than was predicted, though the damping made it small, the cost has a narrow valley that
//! bends: coefficients of an unflat sensor beside a free centre of distortion, whose product counts. Along a step `d`
//! the predicted measurements then leave the straight line by `h^2/2 c''` for a share `h` of it. The step that takes
//! this into account is that of measurements that are shifted by `-c''/2`: geodesic acceleration. Source: Transtrum and
//! Sethna (2012), arXiv:1201.5885, eq. 11, with a central difference for `c''`.

use super::point::Prepared;
use super::side_by_side::{Eights, Workspace};
use super::step::move_images_and_border;
use crate::math::vectors::dispatch;
use crate::measure;
use crate::problem::{Problem, State};
use nalgebra::Vector3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Share of the step over which the bend is measured: far below one, so that it is that at the start, and far above
/// rounding (a difference of 1e-12 of some thousand pixels over its square is 1e-7 px). Source: as above, sec. 4.
const SHARE: f64 = 0.1;

/// What a state predicts: image measurements (px) and antennas (m), in the order of the problem.
struct Predicted {
    points: Vec<[f64; 2]>,
    antennas: Vec<Vector3<f64>>,
}

/// The problem whose step from `at` follows the bend: the measurements are shifted by what the predictions leave the
/// straight line by along the step `increments`, which led to `straight`. `None` where a state on the way cannot be
/// predicted. Runs in the pool of its caller.
pub fn shifted_by_bend(
    at: &Prepared<'_>,
    straight: &State,
    (images, border): &(Vec<f64>, Vec<f64>),
) -> Option<Problem> {
    let Prepared { problem, structure, state: from, .. } = *at;
    let whole = move_images_and_border(problem, structure, &mut from.clone(), images, border);
    let along = |share: f64| -> Option<Predicted> {
        let [images, border] = [images, border].map(|step| step.iter().map(|x| share * x).collect::<Vec<f64>>());
        let mut state = from.clone();
        let part = move_images_and_border(problem, structure, &mut state, &images, &border);
        for (point, (before, after)) in state.points.iter_mut().zip(from.points.iter().zip(&straight.points)) {
            *point = part.position(before, &(share * whole.increment(before, after)));
        }
        let frames = measure::frames(problem, &structure.stages, &state).ok()?;
        predicted(&Prepared { problem, structure, state: &state, frames: &frames })
    };
    let (here, ahead, behind) = (predicted(at)?, along(SHARE)?, along(-SHARE)?);
    let half_bend = |ahead: f64, here: f64, behind: f64| 0.5 * (ahead + behind - 2.0 * here) / SHARE.powi(2);
    let mut shifted: Problem = problem.clone();
    let observations = Arc::make_mut(&mut shifted.observations).iter_mut();
    for (((observation, a), h), b) in observations.zip(&ahead.points).zip(&here.points).zip(&behind.points) {
        observation.x -= half_bend(a[0], h[0], b[0]);
        observation.y -= half_bend(a[1], h[1], b[1]);
    }
    for (k, observation) in shifted.gnss.iter_mut().enumerate() {
        let [a, h, b] = [&ahead, &here, &behind].map(|predicted| &predicted.antennas[k]);
        for axis in 0..3 {
            observation.position[axis] -= half_bend(a[axis], h[axis], b[axis]);
        }
    }
    Some(shifted)
}

fn predicted(at: &Prepared<'_>) -> Option<Predicted> {
    let Prepared { problem, structure, frames, .. } = *at;
    let stages = &structure.stages;
    let of_chunk = |points: &Range<usize>| dispatch(PredictPoints { at, points: points.clone() });
    let points: Vec<Vec<[f64; 2]>> = structure.chunks.par_iter().map(of_chunk).collect::<Option<_>>()?;
    let antenna = |image: usize| Some(measure::predict_antenna(problem, stages, &frames[image], image)?.position);
    let antennas = problem.gnss.iter().map(|observation| antenna(observation.index as usize)).collect::<Option<_>>()?;
    Some(Predicted { points: points.concat(), antennas })
}

/// The image measurements of some points, in their order. `None`: one that cannot be predicted.
struct PredictPoints<'a> {
    at: &'a Prepared<'a>,
    points: Range<usize>,
}

impl WithSimd for PredictPoints<'_> {
    type Output = Option<Vec<[f64; 2]>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { at, points } = self;
        let starts = &at.problem.point_start;
        let mut predicted = Vec::with_capacity(starts[points.end] - starts[points.start]);
        let (cameras, mut work) = (at.cameras(), Workspace::new(&at.structure.stages));
        let mut eights = Eights::new(cameras, &at.state.points[points.clone()], points, &mut work.views);
        while work.predict(simd, cameras, &mut eights)? {
            let [x, y] = &work.predictions.point;
            predicted.extend((0..work.eight.numbers.len()).map(|lane| [x[lane], y[lane]]));
        }
        Some(predicted)
    }
}
