//! Comparison of an adjusted case with the truth.

use super::blocks::Blocks;
use super::case::Case;
use super::outcome::{Adjusted, Agreed, Judged, SolverRun};
use super::pictures;
use crate::adjust::Solution;
use crate::block::{Block, Role};
use crate::camera::{Interior, PARAMETER_COUNT};
use crate::evaluate::bowl::{self, BowlShape};
use crate::evaluate::distortion_field::{Grid, Part, compare as compare_cameras};
use crate::evaluate::{Alignment, Comparison, Method, Similarity, Statistics, checks};
use crate::measure::Predictor;
use crate::problem::Problem;
use crate::run::{self, FittedModel, Run};
use anyhow::{Context, Result};
use std::collections::HashMap;

/// Compares a run with the truth.
///
/// # Errors
/// No comparison is possible: too few points could be intersected, a camera that cannot be inverted.
pub fn judge(case: &Case, blocks: &Blocks<'_>, run: &Run) -> Result<Adjusted> {
    let solution = run.solution();
    let comparison = run.comparison.as_ref().context(NO_CONTROL)?;
    let fitted = FittedModel { predictor: Predictor::new(&run.problem, &solution.state)? };
    let compare = |block: &Block, solution: &Solution| {
        run::compare_state(block, &run.problem, &solution.state)?.context(NO_CONTROL)
    };
    let exact_check = compare(blocks.exact_check, solution)?;
    let exact_all = compare(blocks.exact_all, solution)?;
    let idle = run.problem.images_without_part();
    // The rays of an image are those of its camera alone: with effects in the model they say nothing, nor with an image
    // that nothing oriented.
    let has_rays = case.effects.is_empty() && idle.is_empty();
    let judged = |block: &Block, comparison: &Comparison| -> Result<Judged> {
        let rays = |block| checks::compare(&fitted, block, Alignment::FromControl, Method::Rays);
        judge_points(comparison, if has_rays { rays(block)?.check } else { None })
    };
    let mut solvers = Vec::with_capacity(run.solutions.len());
    for (name, solution) in &run.solutions {
        let comparison = compare(blocks.erroneous, solution)?;
        solvers.push(SolverRun {
            name: name.to_string(),
            iterations: solution.iterations,
            seconds: solution.seconds,
            check_rms_m: check(&comparison)?.rms_m.xyz,
            camera_height_change_m: camera_height_change(blocks, &idle, solution, &comparison)?,
        });
    }
    let camera = blocks.truth.cameras.first().context("the block has no camera")?;
    let size = [f64::from(camera.width_px), f64::from(camera.height_px)];
    let (before, after) = (camera.interior, solution.state.interiors[0]);
    let field = |part| compare_cameras(size, &before, &after, Grid::default(), part);
    let pictures =
        case.pictures.then(|| pictures::collect(blocks, comparison, &exact_check, &before, &after)).transpose()?;
    Ok(Adjusted {
        images: blocks.erroneous.images.len() - idle.len(),
        tie_points: run.problem.point_sources.len(),
        redundancy: run.problem.redundancy().2,
        tie_rms_px: run::tie_rms_px(blocks.erroneous, &run.problem, &solution.state)?,
        solvers,
        agreement: run.agreement.as_ref().map(|agreement| Agreed {
            agree: agreement.agree,
            residual_max_px: agreement.residual_max_px,
            jacobian_max_rel: agreement.jacobian_max_rel,
            parameter_max_sigma: Some(agreement.parameter_max_sigma).filter(|value| value.is_finite()),
            worst_unknown: agreement.worst_unknown.clone(),
        }),
        true_interior: before,
        interior: after,
        interior_sigma: interior_sigma(solution),
        effects: effects(&run.problem, solution),
        camera_height_change_m: camera_height_change(blocks, &idle, solution, comparison)?,
        whole_camera: field(Part::WholeCamera)?.statistics,
        camera_up_to_rotation: field(Part::WholeCameraUpToRotation).ok().map(|field| field.statistics),
        distortion: field(Part::Distortion)?.statistics,
        erroneous_marks: judged(blocks.erroneous, comparison)?,
        exact_check_marks: judged(blocks.exact_check, &exact_check)?,
        exact_marks: judged(blocks.exact_all, &exact_all)?,
        pictures,
    })
}

/// Why a case has no comparison.
const NO_CONTROL: &str = "the block has no control points to compare with";

fn check(comparison: &Comparison) -> Result<Statistics> {
    comparison.check.context("no check point could be intersected")
}

fn judge_points(comparison: &Comparison, rays: Option<Statistics>) -> Result<Judged> {
    Ok(Judged {
        check: check(comparison)?,
        control: comparison.control.context("no control point could be intersected")?,
        rays_rms_m: rays.map(|rays| rays.rms_m.xyz),
        bowl: bowl::of_rows(&comparison.rows, Role::Check, BowlShape::Corridor).ok(),
        failed: comparison.failed.len(),
    })
}

/// Standard deviations of the first camera; zero where held.
fn interior_sigma(solution: &Solution) -> Interior {
    let mut sigma = [0.0; PARAMETER_COUNT];
    if let Some(covariance) = &solution.covariance {
        for (row, unknown) in covariance.shared_unknowns.iter().enumerate().filter(|(_, u)| **u < PARAMETER_COUNT) {
            sigma[*unknown] = covariance.shared[(row, row)].sqrt();
        }
    }
    sigma
}

fn effects(problem: &Problem, solution: &Solution) -> Vec<(String, f64, f64)> {
    let variance = |t: usize| solution.covariance.as_ref().map_or(0.0, |covariance| covariance.theta_variances[t]);
    let entries = problem.theta.iter().enumerate().filter(|(_, entry)| entry.free);
    entries.map(|(t, entry)| (entry.name.clone(), solution.state.theta[t], variance(t).sqrt())).collect()
}

/// Mean over the images that took part of estimated minus true height of the projection centre.
fn camera_height_change(
    blocks: &Blocks<'_>,
    idle: &[&str],
    solution: &Solution,
    comparison: &Comparison,
) -> Result<f64> {
    let similarity = comparison.similarity.unwrap_or_else(Similarity::identity);
    let heights: HashMap<&str, f64> =
        blocks.truth.images.iter().map(|image| (image.name.as_str(), image.pose.centre.z)).collect();
    let mut sum = 0.0;
    let poses = blocks.erroneous.images.iter().zip(&solution.state.poses);
    for (image, pose) in poses.filter(|(image, _)| !idle.contains(&image.name.as_str())) {
        let height = heights.get(image.name.as_str()).with_context(|| format!("no true pose of `{}`", image.name))?;
        sum += similarity.apply(&pose.centre).z - height;
    }
    Ok(sum / (blocks.erroneous.images.len() - idle.len()) as f64)
}
