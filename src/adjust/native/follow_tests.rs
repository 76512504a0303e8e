use super::super::structure::Structure;
use super::*;
use crate::math::vectors::dispatch;
use crate::model::Model;
use crate::problem::Problem;
use crate::scenario::{Scenario, simulate};
use nalgebra::UnitQuaternion;

fn problem(preset: &str, overrides: &[(&str, f64)]) -> Problem {
    let overrides = overrides.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    let scenario = Scenario::preset(preset, &overrides).expect("a preset");
    let block = simulate(&scenario, 1).expect("a block").block;
    Problem::new(&block, &Model::default()).expect("a problem")
}

/// The points of `before` after their images have become those of `after`: carried along, and arrived.
fn followed(problem: &Problem, before: &State, after: &State) -> Vec<[Vector3<f64>; 2]> {
    let structure = Structure::new(problem);
    let frames = measure::frames(problem, &structure.stages, after).expect("images");
    let [mut work, mut work_before] = [(); 2].map(|()| Workspace::new(&structure.stages));
    let mut followers = Followers::default();
    let points = 0..before.points.len();
    let motions = motions(before, after);
    let frames_before = measure::frames(problem, &structure.stages, before).expect("images");
    let before = &Prepared { problem, structure: &structure, state: before, frames: &frames_before };
    let after = &Prepared { problem, structure: &structure, state: after, frames: &frames };
    let (work, curvature) = (&mut work, Curvature::Weights);
    let (work_before, motions, followers) = (&mut work_before, &motions, &mut followers);
    dispatch(Follow { before, after, motions, curvature, points, work, work_before, followers })
        .expect("in front of their cameras");
    let Followers { carried, rays } = followers;
    let arrived = |(carried, rays): (&Vector3<f64>, &Rays)| {
        [*carried, carried + rays.step(0.0, &Vector3::zeros()).expect("rays that meet")]
    };
    carried.iter().zip(rays.iter()).map(arrived).collect()
}

#[test]
fn points_of_a_block_that_moves_as_a_whole_move_with_it() {
    let problem = problem("closerange", &[("points", 60.0)]);
    let (before, mut after) = (&problem.start, problem.start.clone());
    let (turn, shift) = (UnitQuaternion::from_euler_angles(0.3, -0.2, 0.9), Vector3::new(5.0, -3.0, 2.0));
    for pose in &mut after.poses {
        *pose = Pose { rotation: pose.rotation * turn.inverse(), centre: turn * pose.centre + shift };
    }
    for (point, places) in before.points.iter().zip(followed(&problem, before, &after)) {
        for place in places {
            let off = (place - (turn * point + shift)).norm();
            assert!(off < 1e-7, "{off:e} m");
        }
    }
}

#[test]
fn a_point_that_is_too_near_arrives_along_its_rays_in_one_step() {
    let problem = problem("corridor", &[("length_m", 200.0), ("points", 800.0)]);
    let mut near = problem.start.clone();
    let centres = |j: usize| -> Vec<Vector3<f64>> {
        let observed = &problem.observations[problem.point_start[j]..problem.point_start[j + 1]];
        observed.iter().map(|o| problem.start.poses[o.image as usize].centre).collect()
    };
    for (j, point) in near.points.iter_mut().enumerate() {
        let centres = centres(j);
        let mean = centres.iter().sum::<Vector3<f64>>() / centres.len() as f64;
        *point = mean + 0.9 * (*point - mean);
    }
    let left: Vec<f64> = followed(&problem, &near, &near)
        .iter()
        .zip(near.points.iter().zip(&problem.start.points))
        .map(|([_, arrived], (near, point))| (arrived - point).norm() / (near - point).norm())
        .collect();
    let mean = left.iter().sum::<f64>() / left.len() as f64;
    // A step that is linear in the distance leaves a tenth.
    assert!(mean < 0.05, "{mean}");
}
