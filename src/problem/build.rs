//! From a block and a model to the problem.

use super::cameras::{camera_priors, free_parameters, start_interiors};
use super::context::{block_context, image_contexts, survey_centre};
use super::datum::datum_parts;
use super::intersection::start_position;
use super::observations::{collect_points, control_observations, gnss_observations, point_name};
use super::order::ranks_along_block;
use super::unoriented::set_aside_unoriented;
use super::{PointSource, Problem, ProblemError, State};
use crate::block::{Block, Pose};
use crate::camera::Camera;
use crate::model::Model;
use std::sync::Arc;

impl Problem {
    /// Lays out the least-squares problem. Tie points with fewer than two rays, and images without any measurement, do
    /// not take part.
    pub fn new(block: &Block, model: &Model) -> Result<Self, ProblemError> {
        Self::near(block, model, None)
    }

    /// As [`Problem::new`], with the start values of a solution of the same images and cameras, where there is one. A
    /// point whose rays do not meet from the block's approximations has its position from there, and so have velocities
    /// that were not measured.
    pub fn near(block: &Block, model: &Model, near: Option<(&Problem, &State)>) -> Result<Self, ProblemError> {
        let (uses_control, uses_gnss) = datum_parts(block, model.datum)?;
        let (interiors, camera_free) = (start_interiors(block, model)?, free_parameters(block, model));
        let poses: Vec<_> = block.images.iter().map(|image| image.pose).collect();
        let centres = |poses: &[Pose]| poses.iter().map(|pose| pose.centre).collect::<Vec<_>>();
        let ranks = ranks_along_block(&centres(&poses));
        let contexts = image_contexts(block, &centres(near.map_or(&poses, |(_, state)| &state.poses)));

        check_flights(block, model)?;
        let mut points = collect_points(block, model, uses_control, &ranks);
        set_aside_unoriented(block, uses_gnss, &mut points);
        if points.iter().all(|(_, rows)| rows.len() < 2) {
            return Err(ProblemError::Empty);
        }
        let mut positions = Vec::with_capacity(points.sources.len());
        let mut apart = Vec::new();
        let solved = |source: PointSource| {
            let (problem, state) = near?;
            Some(state.points[problem.point_sources.iter().position(|other| *other == source)?])
        };
        for (source, rows) in points.iter() {
            match start_position(block, &interiors, source, rows).or_else(|| solved(source)) {
                Some(position) => positions.push(position),
                None => apart.push(point_name(block, source)),
            }
        }
        if !apart.is_empty() {
            return Err(ProblemError::NoIntersection { points: apart });
        }

        let control =
            if uses_control { control_observations(block, &points.sources, &model.sigma_factors) } else { Vec::new() };
        let mut problem = Problem {
            camera_names: block.cameras.iter().map(|camera| camera.id.clone()).collect(),
            camera_free,
            camera_scales: block.cameras.iter().map(Camera::scales).collect(),
            camera_domains: block.cameras.iter().map(Camera::domains).collect(),
            tie_dc_to_pp: model.tie_dc_to_pp,
            image_names: block.images.iter().map(|image| image.name.clone()).collect(),
            image_contexts: contexts,
            image_ranks: ranks,
            block_context: block_context(block),
            pose_free: vec![[true; 6]; block.images.len()],
            point_names: Arc::new(points.sources.iter().map(|source| point_name(block, *source)).collect()),
            point_sources: points.sources.into(),
            point_start: points.starts.into(),
            observations: points.observations.into(),
            control,
            gnss: Vec::new(),
            effects: Vec::new(),
            theta: Vec::new(),
            camera_priors: camera_priors(block, model)?,
            loss: model.loss,
            start: State { interiors, theta: Vec::new(), poses, points: positions },
            datum_defect: 0,
        };
        problem.hold_unmeasured_images();
        if uses_gnss {
            problem.gnss = gnss_observations(block, &problem.pose_free, model);
        }
        problem.block_context.survey_centre = survey_centre(&problem.control, &problem.gnss);
        if uses_control || uses_gnss {
            let pairs = problem.observed_pairs(block);
            problem.align_start(&pairs);
        } else {
            problem.hold_datum();
        }
        for term in &model.effects {
            problem.add_effect(block, model.datum, term)?;
        }
        if let Some((solved, state)) = near {
            problem.start_from(solved, state);
        }
        Ok(problem)
    }
}

/// Errors: factors on the standard deviations of a flight that the block does not have.
fn check_flights(block: &Block, model: &Model) -> Result<(), ProblemError> {
    match model.flight_factors.keys().find(|name| !block.flights.contains(name)) {
        None => Ok(()),
        Some(name) => {
            let hint = format!("; it has {}", block.flights.join(", "));
            Err(ProblemError::Unknown { kind: "flight", name: name.clone(), hint })
        }
    }
}
