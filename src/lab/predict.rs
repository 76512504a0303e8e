//! What the residuals would be with an effect in the model, from the null model of the node: before any refit.

use super::live::Live;
use super::predicted::Predicted;
use super::state::{Lab, locked};
use crate::block::Role;
use crate::diagnose::select::{Nature, Taken};
use crate::math::intersect::PointSystem;
use crate::measure::{MeasureError, Predictor};
use crate::problem::{Problem, State};
use crate::run::folder::{CheckRow, gnss_rows};
use crate::run::{compare_state, gnss_residuals, gnss_rms_m, residual_rows, tie_rms_px};
use anyhow::{Result, bail};
use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;
use std::sync::Arc;

/// An effect explains something: residuals that grow by more than this with it are no prediction.
const MOST_GROWTH: f64 = 1.1;
/// Steps of an intersection; from where a point nearly is two suffice.
const STEPS: usize = 2;

/// The points where their rays meet: cameras that move take them along.
fn intersected(problem: &Problem, state: &State) -> Result<Vec<Vector3<f64>>, MeasureError> {
    let predictor = Predictor::new(problem, state)?;
    let step = |j: usize, point: &Vector3<f64>| -> Option<Vector3<f64>> {
        let mut system = PointSystem::default();
        for row in &problem.observations[problem.point_start[j]..problem.point_start[j + 1]] {
            let (computed, by_point) = predictor.image_point(row.image as usize, point)?;
            let residual = Vector2::new(row.x - computed[0], row.y - computed[1]);
            system.add(residual, by_point, row.inverse_sigma.powi(2));
        }
        if let Ok(c) = problem.control.binary_search_by_key(&(j as u32), |observation| observation.index) {
            let control = &problem.control[c];
            let weight = control.sigma.map(|sigma| sigma.powi(-2));
            system.matrix += Matrix3::from_diagonal(&weight);
            system.right += weight.component_mul(&(control.position - predictor.surveyed(point)?));
        }
        Some(point + system.step()?)
    };
    let meet = |j: usize| (0..STEPS).fold(state.points[j], |point, _| step(j, &point).unwrap_or(point));
    Ok((0..state.points.len()).into_par_iter().map(meet).collect())
}

/// The prediction of a candidate of a node.
///
/// # Errors
/// An effect that is no candidate of the node, or that changes more than a prediction of first order can tell; a state
/// that cannot be projected.
pub fn predicted(lab: &Lab, id: u32, effect: &str) -> Result<Arc<Predicted>> {
    let live = lab.live(id)?;
    // All figures of a page ask at once: one computes, the others wait for it.
    let mut known = locked(&live.predicted);
    let found = known.entry(effect.to_string()).or_insert_with(|| {
        let found = compute(lab, id, &live, effect);
        found.map(Arc::new).map_err(|error| format!("{error:#}"))
    });
    found.clone().map_err(anyhow::Error::msg)
}

fn compute(lab: &Lab, id: u32, live: &Live, effect: &str) -> Result<Predicted> {
    let stop = Default::default();
    let settings = lab.settings(&stop, false, &|_| {});
    let linearised = &live.linearised;
    let situation = linearised.situation(&settings);
    let judged = situation.judge_all(&situation.beside());
    let Some(judged) = judged.iter().find(|judged| linearised.sets[judged.set].id == effect) else {
        bail!("{effect} is no candidate of step {id} that could be tested");
    };
    let mut with = situation.clone();
    with.taken.push(Taken { set: judged.set, variance: 0.0 });
    if linearised.sets[judged.set].nature == Nature::Chance {
        let variance = linearised.variance(&with, judged.set);
        if let Some(last) = with.taken.last_mut() {
            last.variance = variance;
        }
    }
    let mut state = linearised.moved(&linearised.solution(&with));
    let problem = linearised.null.problem();
    let block = &live.block;
    state.points = intersected(problem, &state)?;
    let comparison = compare_state(block, problem, &state)?;
    let rows = residual_rows(block, problem, &state, comparison.as_ref())?;
    let gnss = gnss_residuals(block, problem, &state, comparison.as_ref())?;
    let check = |row: &crate::evaluate::CheckRow| CheckRow {
        point: block.surveyed[row.point.index()].name.clone(),
        role: if row.role == Role::Check { "check" } else { "control" }.into(),
        dx: row.d.x,
        dy: row.d.y,
        dz: row.d.z,
        x: row.position.x + block.origin.x,
        y: row.position.y + block.origin.y,
        z: row.position.z + block.origin.z,
        sigma_dx: None,
        sigma_dy: None,
        sigma_dz: None,
        images: None,
        rms_px: None,
        easting: None,
        northing: None,
        height: None,
    };
    let tie_rms_px = tie_rms_px(block, problem, &state)?;
    if let Some(now) = lab.saved(id)?.figures.tie_rms_px.filter(|now| tie_rms_px > MOST_GROWTH * now) {
        bail!(
            "{effect} would move the block too far for a prediction of first order (tie points {now:.3} → \
             {tie_rms_px:.3} px). Add a step with it in the model instead"
        );
    }
    Ok(Predicted {
        columns: lab.view(id)?.columns.with_rows(&rows),
        checks: comparison.iter().flat_map(|comparison| &comparison.rows).map(check).collect(),
        gnss_rms_m: gnss_rms_m(&gnss),
        gnss: gnss_rows(block, &gnss).collect(),
        tie_rms_px,
        check_rms_m: comparison.and_then(|comparison| comparison.check).map(|check| check.rms_m.xyz),
    })
}
