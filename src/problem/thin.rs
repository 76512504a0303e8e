//! A smaller problem with the same unknown cameras, effects and poses, for comparisons that need not see every point.

use super::{Layout, Problem, State};
use std::sync::Arc;

impl Problem {
    /// The problem and a state of it with every `n`-th point, so that at most about `measurements` image measurements
    /// are left; whole where it is small enough. Control points stay.
    pub fn thinned(&self, state: &State, measurements: usize) -> (Problem, State) {
        let stride = self.observations.len().div_ceil(measurements.max(1)).max(1);
        let Layout { points, .. } = self.layout();
        let controls: Vec<usize> = self.control.iter().map(|observation| observation.index as usize).collect();
        let kept: Vec<usize> = (0..points).filter(|j| j % stride == 0 || controls.binary_search(j).is_ok()).collect();
        self.with_points(state, &kept)
    }

    /// The problem and a state of it with the given points alone (ascending).
    pub fn with_points(&self, state: &State, kept: &[usize]) -> (Problem, State) {
        let mut part = Problem {
            point_sources: Arc::new(kept.iter().map(|j| self.point_sources[*j]).collect()),
            point_names: Arc::new(kept.iter().map(|j| self.point_names[*j].clone()).collect()),
            point_start: Arc::default(),
            observations: Arc::default(),
            control: Vec::new(),
            start: State {
                points: kept.iter().map(|j| self.start.points[*j]).collect(),
                interiors: self.start.interiors.clone(),
                theta: self.start.theta.clone(),
                poses: self.start.poses.clone(),
            },
            camera_names: self.camera_names.clone(),
            camera_free: self.camera_free.clone(),
            camera_scales: self.camera_scales.clone(),
            camera_domains: self.camera_domains.clone(),
            tie_dc_to_pp: self.tie_dc_to_pp,
            image_names: self.image_names.clone(),
            image_contexts: self.image_contexts.clone(),
            image_ranks: self.image_ranks.clone(),
            block_context: self.block_context.clone(),
            pose_free: self.pose_free.clone(),
            gnss: self.gnss.clone(),
            effects: self.effects.clone(),
            theta: self.theta.clone(),
            camera_priors: self.camera_priors.clone(),
            loss: self.loss,
            datum_defect: self.datum_defect,
        };
        let (mut observations, mut point_start) = (Vec::new(), vec![0]);
        for (position, j) in kept.iter().enumerate() {
            observations.extend_from_slice(&self.observations[self.point_start[*j]..self.point_start[*j + 1]]);
            point_start.push(observations.len());
            if let Ok(c) = self.control.binary_search_by_key(&(*j as u32), |observation| observation.index) {
                let mut observation = self.control[c];
                observation.index = position as u32;
                part.control.push(observation);
            }
        }
        (part.observations, part.point_start) = (observations.into(), point_start.into());
        let state = State { points: kept.iter().map(|j| state.points[*j]).collect(), ..state.clone() };
        (part, state)
    }
}
