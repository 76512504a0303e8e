//! Can an effect be computed for every measurement? (Refraction has no meaning for a point above the camera.)

use super::candidate::Candidate;
use crate::camera::fraser;
use crate::effects::answer::{Answer, Thetas};
use crate::effects::{Context, Stage};
use crate::math::lane::{LANES, Lane};
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
    // A point and one of its measurements, for each lane.
    let hold = |seen: &[(usize, usize)]| {
        let mut input = [Lane::default(); Stage::Ray.inputs()];
        let contexts = std::array::from_fn(|lane| {
            // The last one stands for those that are too few.
            let (j, k) = seen[lane.min(seen.len() - 1)];
            let image = problem.observations[k].image as usize;
            let pose = &state.poses[image];
            let numbers = [&vectors[image], &pose.centre, &state.points[j]];
            input.iter_mut().zip(numbers.into_iter().flatten()).for_each(|(to, number)| to[lane] = *number);
            let context = &problem.image_contexts[image];
            let (interior, seen) =
                (&state.interiors[context.camera as usize], pose.rotation * (state.points[j] - pose.centre));
            // Near where the chain ends, and no derivative is taken there.
            let [column_px, row_px] = fraser::project(interior, seen.into()).unwrap_or([f64::NAN; 2]);
            Context { block: &problem.block_context, image: context, column_px, row_px, surveyed: None }
        });
        let answer = &mut Answer { out: &mut [Lane::default(); Stage::Ray.outputs()], d_input: None, d_theta: None };
        term.effect.eval_eight(&contexts, &input, &Thetas::Alike(&theta), answer).is_ok()
    };
    let all_of = |first: usize| {
        let points = first..(first + TOGETHER).min(problem.point_sources.len());
        let starts = &problem.point_start;
        let seen: Vec<_> = points.flat_map(|j| (starts[j]..starts[j + 1]).map(move |k| (j, k))).collect();
        seen.chunks(LANES).all(hold)
    };
    let firsts: Vec<usize> = (0..problem.point_sources.len()).step_by(TOGETHER).collect();
    firsts.into_par_iter().all(all_of)
}

#[cfg(test)]
mod tests {
    use super::super::candidate::candidates;
    use super::*;
    use crate::model::Model;
    use crate::scenario::{Scenario, simulate};
    use std::collections::BTreeMap;

    #[test]
    fn a_single_point_above_its_cameras_is_outside_the_domain_of_what_acts_on_rays() {
        let scenario = Scenario::preset("mapping", &BTreeMap::from([("points".into(), 100.0)])).expect("a preset");
        let block = simulate(&scenario, 1).expect("a block").block;
        let problem = Problem::new(&block, &Model::default()).expect("a problem");
        let outside = |state: &State| -> Vec<String> {
            let all = candidates(&block, &problem, &Model::default(), &[]).into_iter();
            all.filter(|candidate| !holds(&problem, state, candidate)).map(|candidate| candidate.id).collect()
        };
        assert!(outside(&problem.start).is_empty());
        for point in [0, problem.start.points.len() - 1] {
            let mut state = problem.start.clone();
            state.points[point].z += 1e4;
            assert_eq!(outside(&state), ["refraction", "flat-port"]);
        }
    }
}
