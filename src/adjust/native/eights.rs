//! The measurements of consecutive points, eight at a time.

use super::point::Prepared;
use crate::effects::Stage;
use crate::measure::Frame;
use crate::measure::lanes::{LANES, Views};
use crate::problem::Problem;
use nalgebra::Vector3;
use std::ops::Range;

/// Goes through them.
pub struct Eights<'a> {
    problem: &'a Problem,
    frames: &'a [Frame],
    objects: &'a [Vector3<f64>],
    first_point: usize,
    point: usize,
    rest: Range<usize>,
    points: [usize; LANES],
    one_interior: bool,
}

impl<'a> Eights<'a> {
    /// The measurements of the points of a range, images being where `frames` says, and these points where `objects` does.
    pub fn new(
        at: &Prepared<'a>,
        frames: &'a [Frame],
        objects: &'a [Vector3<f64>],
        points: Range<usize>,
        views: &mut Views,
    ) -> Self {
        let problem = at.problem;
        let one_interior = problem.camera_free.len() == 1 && at.structure.stages.of(Stage::Interior).is_empty();
        if let (true, Some(frame)) = (one_interior, frames.first()) {
            views.set_interiors(&frame.interior);
        }
        let rest = problem.point_start[points.start]..problem.point_start[points.end];
        let first = points.start;
        Self { problem, frames, objects, first_point: first, point: first, rest, points: [0; LANES], one_interior }
    }

    /// Puts the next ones into `views`; gives the number of the first, and the point of each.
    #[inline(always)]
    pub fn next(&mut self, views: &mut Views) -> Option<(usize, &[usize])> {
        let first = self.rest.start;
        let count = LANES.min(self.rest.len());
        if count == 0 {
            return None;
        }
        for lane in 0..LANES {
            // Places that the last group leaves empty see what its first sees.
            let number = if lane < count { first + lane } else { first };
            while lane < count && self.problem.point_start[self.point + 1] <= number {
                self.point += 1;
            }
            self.points[lane] = if lane < count { self.point } else { self.points[0] };
            let frame = &self.frames[self.problem.observations[number].image as usize];
            views.set(lane, frame, &self.objects[self.points[lane] - self.first_point]);
            if !self.one_interior {
                views.set_interior(lane, &frame.interior);
            }
        }
        self.rest.start += count;
        Some((first, &self.points[..count]))
    }
}
