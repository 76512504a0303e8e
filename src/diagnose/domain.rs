//! Can an effect be computed for every measurement? (Refraction has no meaning for a point above the camera.)

use super::candidate::Candidate;
use crate::effects::{Context, Stage};
use crate::math::rotation;
use crate::problem::{Problem, State};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Points that one thread looks at together.
const TOGETHER: usize = 1024;

/// Is every ray inside the domain of a candidate of the ray stage? Other stages have no domain.
pub(super) fn holds(problem: &Problem, state: &State, candidate: &Candidate) -> bool {
    let Some(term) = candidate.term().filter(|term| term.effect.descriptor().stage == Stage::Ray) else { return true };
    let value = |p: &crate::effects::Parameter| term.values.get(p.name.as_ref()).copied().unwrap_or(p.nominal);
    let theta: Vec<f64> = term.effect.descriptor().parameters.iter().map(value).collect();
    let vectors: Vec<Vector3<f64>> =
        state.poses.iter().map(|pose| rotation::log(pose.rotation.to_rotation_matrix().matrix())).collect();
    (0..problem.point_sources.len()).into_par_iter().with_min_len(TOGETHER).all(|j| {
        problem.observations[problem.point_start[j]..problem.point_start[j + 1]].iter().all(|observation| {
            let image = observation.image as usize;
            let context = Context {
                block: &problem.block_context,
                image: &problem.image_contexts[image],
                column_px: observation.x,
                row_px: observation.y,
                surveyed: None,
            };
            let mut input = [0.0; 9];
            input[..3].copy_from_slice(vectors[image].as_slice());
            input[3..6].copy_from_slice(state.poses[image].centre.as_slice());
            input[6..].copy_from_slice(state.points[j].as_slice());
            term.effect.eval(&context, &input, &theta, &mut [0.0; 3], None, None).is_ok()
        })
    })
}
