//! Images that take no part: without measurements, or with too few to orient them.

use super::observations::Points;
use super::{ImageObservation, PointSource, Problem};
use crate::block::Block;
use crate::camera::PARAMETER_COUNT;

/// Unknowns of an exterior orientation.
const POSE_NUMBERS: f64 = 6.0;
/// Points that fix a rotation whatever else is known.
const POSE_POINTS: usize = 3;

/// Images whose measurements cannot orient them: each gives two numbers less its share of the point's three, a GNSS
/// position three more, and a pose wants six and three points.
fn unoriented<'a>(gnss: &[bool], points: impl Iterator<Item = (PointSource, &'a [ImageObservation])>) -> Vec<bool> {
    let mut numbers: Vec<f64> = gnss.iter().map(|gnss| if *gnss { 3.0 } else { 0.0 }).collect();
    let mut seen = vec![0; gnss.len()];
    for (source, observations) in points {
        let known = matches!(source, PointSource::Control(_));
        let share = if known { 2.0 } else { 2.0 - 3.0 / observations.len() as f64 };
        for observation in observations {
            numbers[observation.image as usize] += share;
            seen[observation.image as usize] += 1;
        }
    }
    seen.iter().zip(numbers).map(|(seen, numbers)| *seen < POSE_POINTS || numbers < POSE_NUMBERS).collect()
}

/// Takes the measurements of such images out. Their points may fall to one ray and go too, so it repeats. What is out
/// is known by [`Problem::images_without_part`].
pub(super) fn set_aside_unoriented(block: &Block, uses_gnss: bool, points: &mut Points) {
    let gnss: Vec<bool> = block.images.iter().map(|image| uses_gnss && image.gnss.is_some()).collect();
    loop {
        let unoriented = unoriented(&gnss, points.iter());
        let is_out = |row: &ImageObservation| unoriented[row.image as usize];
        if !points.observations.iter().any(is_out) {
            return;
        }
        points.keep(|row| !is_out(row));
    }
}

impl Problem {
    /// Names of the images that take no part: without measurements, or with too few to orient them. Their poses stay as
    /// they were given.
    pub fn images_without_part(&self) -> Vec<&str> {
        let mut measured = vec![false; self.image_names.len()];
        for observation in self.observations.iter() {
            measured[observation.image as usize] = true;
        }
        self.image_names.iter().zip(measured).filter(|(_, measured)| !measured).map(|(name, _)| name.as_str()).collect()
    }

    /// Images that its measurements cannot orient; those without any are among them.
    pub fn unoriented_images(&self) -> Vec<bool> {
        let mut gnss = vec![false; self.image_names.len()];
        self.gnss.iter().for_each(|observation| gnss[observation.index as usize] = true);
        let points = (0..self.point_sources.len())
            .map(|j| (self.point_sources[j], &self.observations[self.point_start[j]..self.point_start[j + 1]]));
        unoriented(&gnss, points)
    }

    /// Holds the poses of images that its measurements cannot orient, as where points were taken out. Which are they?
    pub fn hold_unoriented_images(&mut self) -> Vec<bool> {
        let unoriented = self.unoriented_images();
        for (free, _) in self.pose_free.iter_mut().zip(&unoriented).filter(|(_, unoriented)| **unoriented) {
            *free = [false; 6];
        }
        self.gnss.retain(|observation| !unoriented[observation.index as usize]);
        unoriented
    }

    /// Images without a measurement keep their approximate pose; a camera that none of the measured images used keeps
    /// its parameters.
    pub(super) fn hold_unmeasured_images(&mut self) {
        let mut measured = vec![false; self.pose_free.len()];
        for observation in self.observations.iter() {
            measured[observation.image as usize] = true;
        }
        let mut used = vec![false; self.camera_free.len()];
        for (image, measured) in measured.iter().enumerate() {
            if *measured {
                used[self.image_contexts[image].camera as usize] = true;
            } else {
                self.pose_free[image] = [false; 6];
            }
        }
        for (free, used) in self.camera_free.iter_mut().zip(used) {
            if !used {
                *free = [false; PARAMETER_COUNT];
            }
        }
    }
}
