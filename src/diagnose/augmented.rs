//! The base problem with every candidate in it, at which all are tested together.

use super::candidate::{Addition, Candidate};
use super::score::{Base, ScreenError};
use crate::effects::{Context, Role, Stage};
use crate::math::rotation;
use crate::model::EffectTerm;
use crate::problem::{Problem, State};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Base problem with every candidate in it at nominal values, and the candidate of each candidate unknown.
pub(super) fn augmented(
    base: &Base<'_>,
    candidates: &[Candidate],
) -> Result<(Problem, State, BTreeMap<usize, usize>), ScreenError> {
    let terms: Vec<EffectTerm> = candidates.iter().filter_map(Candidate::term).cloned().collect();
    let first = base.problem.theta.len();
    let (mut problem, state) = base.problem.with_effects(base.block, base.model.datum, &terms, base.state)?;
    let of_effect: Vec<usize> = (0..candidates.len()).filter(|c| candidates[*c].term().is_some()).collect();
    let first_effect = base.problem.effects.len();
    let mut owner = BTreeMap::new();
    for (t, entry) in problem.theta.iter_mut().enumerate().skip(first) {
        let candidate = of_effect[entry.effect as usize - first_effect];
        // A score test is made at the null: no prior; searched parameters are held where they stand.
        entry.prior_sigma = None;
        let role =
            &problem.effects[entry.effect as usize].effect.descriptor().parameters[entry.parameter as usize].role;
        entry.free &= !matches!(role, Role::Searched(_));
        if entry.free {
            owner.insert(base.problem.layout().theta(0) + t, candidate);
        }
    }
    for (c, candidate) in candidates.iter().enumerate() {
        if let Addition::Free(indices) = &candidate.addition {
            for camera in 0..problem.camera_free.len() {
                for k in indices {
                    problem.camera_free[camera][*k] = true;
                    owner.insert(problem.layout().camera(camera, *k), c);
                }
            }
        }
    }
    Ok((problem, state, owner))
}

/// Can a ray effect be computed for every measurement of the base? (Refraction has no meaning for a point above the camera.)
pub(super) fn in_domain(base: &Base<'_>, candidate: &Candidate) -> bool {
    let Some(term) = candidate.term().filter(|term| term.effect.descriptor().stage == Stage::Ray) else { return true };
    let theta: Vec<f64> = term
        .effect
        .descriptor()
        .parameters
        .iter()
        .map(|p| term.values.get(p.name.as_ref()).copied().unwrap_or(p.nominal))
        .collect();
    let vectors: Vec<Vector3<f64>> =
        base.state.poses.iter().map(|pose| rotation::log(pose.rotation.to_rotation_matrix().matrix())).collect();
    let problem = base.problem;
    (0..problem.point_sources.len()).all(|j| {
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
            input[3..6].copy_from_slice(base.state.poses[image].centre.as_slice());
            input[6..].copy_from_slice(base.state.points[j].as_slice());
            term.effect.eval(&context, &input, &theta, &mut [0.0; 3], None, None).is_ok()
        })
    })
}
