//! Rows of many measurements side by side: the plain camera is linearised for eight at a time.

use super::super::eights::Eights;
use super::super::point::Prepared;
use super::Rows;
use crate::measure::lanes::{LANES, Predictions};
use crate::measure::{self, MeasureError};
use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Rows of measurements that no effect touches, eight at a time.
pub(super) struct FillPlain<'a, 'b> {
    pub rows: &'a mut Rows,
    pub at: &'a Prepared<'b>,
    pub points: Range<usize>,
}

impl WithSimd for FillPlain<'_, '_> {
    type Output = Result<(), MeasureError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { rows, at, points } = self;
        let mut views = std::mem::take(&mut rows.views);
        let mut predictions = std::mem::take(&mut rows.predictions);
        let (start, width) = (at.problem.point_start[points.start], rows.width);
        let mut eights = Eights::new(at, at.frames, &at.state.points[points.clone()], points, &mut views);
        while let Some((first, objects)) = eights.next(&mut views) {
            views.predict(simd, &mut predictions);
            if at.problem.tie_dc_to_pp {
                tie_centre(&mut predictions);
            }
            let mut weights = [0.0; LANES];
            let mut shrink = [None; LANES];
            for (lane, object) in objects.iter().enumerate() {
                let observation = &at.problem.observations[first + lane];
                if predictions.depth[lane] <= 0.0 {
                    return Err(MeasureError::image_point(at.problem, *object, observation.image as usize));
                }
                let point = [predictions.point[0][lane], predictions.point[1][lane]];
                let pair = first + lane - start;
                let weighed = rows.weigh(at, observation, pair, point);
                (weights[lane], shrink[lane]) = (weighed.weight, weighed.shrink);
                for i in 0..2 {
                    rows.shared[(2 * pair + i + 1) * width - 1] = weighed.v[i];
                }
            }
            predictions.weigh(simd, &weights);
            rows.spread(at, first..first + objects.len(), start, &predictions);
            for (lane, shrink) in shrink.iter().enumerate().take(objects.len()) {
                rows.finish(at.structure, first + lane - start, *shrink);
            }
        }
        (rows.views, rows.predictions) = (views, predictions);
        Ok(())
    }
}

/// Rows of measurements that no effect touches before the camera: the camera for eight at a time, what comes behind it for each.
pub(super) struct FillStraight<'a, 'b> {
    pub rows: &'a mut Rows,
    pub at: &'a Prepared<'b>,
    pub points: Range<usize>,
}

impl WithSimd for FillStraight<'_, '_> {
    type Output = Result<(), MeasureError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { rows, at, points } = self;
        let Prepared { problem, structure, frames, .. } = at;
        let mut views = std::mem::take(&mut rows.views);
        let mut predictions = std::mem::take(&mut rows.predictions);
        let mut prediction = std::mem::take(&mut rows.prediction);
        let start = problem.point_start[points.start];
        let mut eights = Eights::new(at, frames, &at.state.points[points.clone()], points, &mut views);
        while let Some((first, objects)) = eights.next(&mut views) {
            views.predict(simd, &mut predictions);
            for (lane, object) in objects.iter().enumerate() {
                let observation = &problem.observations[first + lane];
                let image = observation.image as usize;
                let (stages, seen) = (&structure.stages, (&predictions, lane));
                measure::predict_seen(problem, stages, &frames[image], observation, seen, &mut prediction)
                    .ok_or_else(|| MeasureError::image_point(problem, *object, image))?;
                rows.store(at, observation, first + lane - start, &prediction);
            }
        }
        (rows.views, rows.predictions, rows.prediction) = (views, predictions, prediction);
        Ok(())
    }
}

/// The centre of distortion follows the principal point.
fn tie_centre(predictions: &mut Predictions) {
    use crate::camera::{DCX, DCY, PPX, PPY};
    for row in &mut predictions.d_camera {
        for (to, from) in [(PPX, DCX), (PPY, DCY)] {
            let moved = row[from];
            row[to].iter_mut().zip(moved).for_each(|(to, from)| *to += from);
            row[from] = [0.0; LANES];
        }
    }
}
