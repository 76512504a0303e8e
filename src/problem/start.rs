//! Start values from an earlier solution.

use super::{PointSource, Problem, State};
use crate::camera::tie_centre;
use nalgebra::Vector3;
use std::collections::HashMap;
use std::sync::Arc;

impl Problem {
    /// Starts where `problem` ended: cameras, poses, and what both have of points and effect parameters. Both are of
    /// the same images and cameras; what is new keeps its own start value, and what is held stays where it is held.
    pub(super) fn start_from(&mut self, problem: &Problem, state: &State) {
        let State { interiors, theta, poses, points } = state;
        // Of millions of measurements one copy is enough.
        share(&mut self.observations, &problem.observations);
        share(&mut self.point_start, &problem.point_start);
        share(&mut self.point_sources, &problem.point_sources);
        share(&mut self.point_names, &problem.point_names);
        for ((own, free), from) in self.start.interiors.iter_mut().zip(&self.camera_free).zip(interiors) {
            (0..own.len()).filter(|k| free[*k]).for_each(|k| own[k] = from[k]);
        }
        self.start.poses.clone_from(poses);
        if self.tie_dc_to_pp {
            self.start.interiors.iter_mut().for_each(tie_centre);
        }
        let known: HashMap<&str, f64> =
            problem.theta.iter().zip(theta).map(|(entry, value)| (entry.name.as_str(), *value)).collect();
        for (entry, value) in self.theta.iter().zip(&mut self.start.theta).filter(|(entry, _)| entry.free) {
            *value = known.get(entry.name.as_str()).copied().unwrap_or(*value);
        }
        let known: HashMap<PointSource, Vector3<f64>> =
            problem.point_sources.iter().copied().zip(points.iter().copied()).collect();
        for (source, point) in self.point_sources.iter().zip(&mut self.start.points) {
            *point = known.get(source).copied().unwrap_or(*point);
        }
    }
}

/// One copy of what is equal.
fn share<T: PartialEq>(own: &mut Arc<T>, other: &Arc<T>) {
    if own == other {
        *own = other.clone();
    }
}
