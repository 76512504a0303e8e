use super::*;
use crate::adjust::native::Native;
use crate::adjust::{CovarianceOf, Options};
use crate::block::Role;
use crate::effects::find;
use crate::model::{Datum, EffectRef, EffectTerm, Model};
use crate::null_model::SharedBase;
use crate::problem::{Problem, State};
use crate::residuals::check_points::alignment;
use crate::residuals::check_points::patterns::Patterns;
use crate::run::{self, Run};
use crate::scenario::{Scenario, SurveyNoise, add_survey_noise, simulate};
use nalgebra::{DVector, UnitQuaternion};
use std::ops::ControlFlow;

/// A block adjusted with effects of lens, exposure and frame. Its points have errors, its images and antennas have
/// none: an intersection leaves out the residuals of its marks times the curvature of a projection.
fn adjusted(datum: Datum) -> (crate::block::Block, Model, Run) {
    let parameters = [("points".to_string(), 300.0), ("check".to_string(), 30.0)].into();
    let mut block = simulate(&Scenario::preset("dike", &parameters).expect("a preset"), 1).expect("a block").block;
    add_survey_noise(&mut block, SurveyNoise { control: true, check: true, gnss: false }, 1);
    let ids = match datum {
        // Without observed positions nothing tells a scale of the map.
        Datum::Free => &["rolling-shutter", "focal-flight"][..],
        _ => &["rolling-shutter", "focal-flight", "map-scale"][..],
    };
    let term = |id: &&str| {
        let effect = EffectRef::Builtin(find(id).expect("an effect"));
        EffectTerm { effect, values: Default::default(), held: Vec::new() }
    };
    let model = Model { datum, effects: ids.iter().map(term).collect(), ..Model::default() };
    let options = Options { covariance: CovarianceOf::Nothing, ..Options::default() };
    let run = run::adjust(&block, &model, &[&Native], &options, &mut |_, _| ControlFlow::Continue(()));
    (block, model, run.expect("a run"))
}

/// The state with one unknown changed.
fn moved(problem: &Problem, state: &State, unknown: usize, by: f64) -> State {
    let (layout, mut state) = (problem.layout(), state.clone());
    if let Some((camera, k)) = layout.camera_parameter(unknown) {
        state.interiors[camera][k] += by;
    } else if unknown < layout.pose(0, 0) {
        state.theta[unknown - layout.theta(0)] += by;
    } else {
        let (image, k) = ((unknown - layout.pose(0, 0)) / 6, (unknown - layout.pose(0, 0)) % 6);
        let pose = &mut state.poses[image];
        match k {
            0..3 => {
                let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|i, _| if i == k { by } else { 0.0 }));
                pose.rotation = turn * pose.rotation;
            }
            _ => pose.centre[k - 3] += by,
        }
    }
    state
}

/// A step of an unknown that moves measurements by a few pixels: differences then have six digits and more.
fn step(problem: &Problem, unknown: usize) -> f64 {
    let layout = problem.layout();
    match layout.camera_parameter(unknown) {
        Some((camera, k)) => problem.camera_scales[camera][k],
        None if unknown < layout.pose(0, 0) => problem.theta[unknown - layout.theta(0)].scale,
        None if (unknown - layout.pose(0, 0)) % 6 < 3 => 1e-4,
        None => 1e-2,
    }
}

#[test]
fn gradients_are_those_of_the_compared_heights() {
    for datum in [Datum::Free, Datum::Control, Datum::Gnss, Datum::All] {
        let (block, model, run) = adjusted(datum);
        let (problem, state) = (&run.problem, &run.solution().state);
        let comparison = run.comparison.as_ref().expect("compared");
        let checks = |comparison: &Comparison, of: fn(&crate::evaluate::CheckRow) -> Vector3<f64>| -> Vec<_> {
            comparison.rows.iter().filter(|row| row.role == Role::Check).map(of).collect()
        };
        let patterns = Patterns::new(&checks(comparison, |row| row.position)).expect("patterns");
        let coefficients = |state: &State| {
            let comparison = run::compare_state(&block, problem, state).expect("compared").expect("compared");
            let heights = checks(&comparison, |row| row.d);
            patterns.functions.transpose() * DVector::from_iterator(heights.len(), heights.iter().map(|d| d.z))
        };
        let shares = alignment::of_rows(&block, comparison, &patterns.functions).expect("a similarity");
        let base = SharedBase::default();
        let adjusted =
            Adjusted { block: &block, model: &model, problem, state, comparison: Some(comparison), null_base: &base };
        let propagation = propagate(&adjusted, comparison, &shares).expect("a state").expect("points");

        let layout = problem.layout();
        let poses = (0..layout.images).step_by(7).flat_map(|image| (0..6).map(move |k| layout.pose(image, k)));
        let unknowns: Vec<usize> = (0..layout.pose(0, 0)).chain(poses).collect();
        let free = problem.free();
        let mut compared = 0;
        for unknown in unknowns.into_iter().filter(|unknown| free[*unknown]) {
            let by = step(problem, unknown);
            let [up, down] = [by, -by].map(|by| coefficients(&moved(problem, state, unknown, by)));
            let numeric = (up - down) / (2.0 * by);
            let ours = propagation.gradients.row(unknown).transpose();
            let error = (&numeric - &ours).norm();
            let name = problem.unknown_name(unknown);
            let size = numeric.norm().max(1e-7 / by);
            // The errors of control bend the block a little: its marks have residuals of hundredths of a pixel still.
            assert!(error < 1e-3 * size, "{datum:?} {name}: {numeric} differenced, {ours} propagated");
            compared += 1;
        }
        assert!(compared > 30, "{compared}");
    }
}
