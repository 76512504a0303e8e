//! Anybody's results: read back from a block, a run or a COLMAP model, taken into the problem's own datum, and scored.

use super::certificate::{Certificate, refine};
use super::problems::BundleProblem;
use super::score::{Score, score};
use crate::block::{Block, Pose};
use crate::camera::PARAMETERS;
use crate::io::block::{is_block, read_block};
use crate::io::foreign::{ImportOptions, registry};
use crate::problem::{PointSource, Problem, State};
use crate::run::folder::{Adjusted, RunFolder, SUMMARY};
use crate::run::summary::Summary;
use anyhow::{Context, Result, bail, ensure};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A result of another program, by names.
struct Found {
    block: Block,
    /// Effect parameters by name (`focal-time.a`).
    theta: HashMap<String, f64>,
    /// A-priori standard deviations of the free camera and effect parameters that have one, by name (`cam.f`).
    sigmas: HashMap<String, f64>,
    /// Points of a COLMAP model have numbers: the tie points of the block that was written, in their order.
    numbered: bool,
}

/// Where in `folder` the result of a problem stands: `NAME`, or `NAME/result` beside the problem's own files.
pub fn result_of(bundle: &BundleProblem, folder: &Path) -> Option<PathBuf> {
    let own = folder.join(&bundle.name);
    let is_result = |path: &PathBuf| is_block(path) || path.join(SUMMARY).exists() || recognised(path);
    [own.join("result"), own].into_iter().find(is_result)
}

fn recognised(path: &Path) -> bool {
    registry().iter().any(|format| format.name() == "colmap" && format.recognises(path))
}

/// Scores the result of a problem that stands in a folder.
///
/// # Errors
/// A result that cannot be read, or that lacks something of the problem.
pub fn judge(bundle: &BundleProblem, folder: &Path) -> Result<Score> {
    ensure!(!bundle.is_deficient(), "problem `{}` has no solution, and no result to judge", bundle.name);
    let block = bundle.block()?;
    let problem = Problem::new(&block, &bundle.model()?)?;
    let result = read(block, folder)?;
    let certificate = bundle.certificate()?;
    let state = state_of(&problem, &result).with_context(|| folder.display().to_string())?;
    let state = in_datum(&problem, state).with_context(|| folder.display().to_string())?;
    let score = score(&problem, &certificate, &state, None).with_context(|| folder.display().to_string())?;
    Ok(Score { sigma: sigma_difference(&certificate, &result.sigmas), ..score })
}

fn read(block: Block, folder: &Path) -> Result<Found> {
    let without_effects = |block| Found { block, theta: HashMap::new(), sigmas: HashMap::new(), numbered: false };
    if folder.join(SUMMARY).exists() {
        let summary = RunFolder::<serde::de::IgnoredAny>::read(folder)?.summary;
        let block = Adjusted::read(block, folder)?.block;
        let theta = effects(&summary).map(|(name, value, _)| (name, value)).collect();
        return Ok(Found { theta, sigmas: sigmas(&summary), ..without_effects(block) });
    }
    if is_block(folder) {
        return Ok(without_effects(read_block(folder)?.block));
    }
    let format = registry().iter().find(|format| format.name() == "colmap" && format.recognises(folder));
    let format =
        format.with_context(|| format!("{}: neither a block nor a run nor a COLMAP model", folder.display()))?;
    let imported = format.import(&[folder.to_owned()], &ImportOptions { approximate: false, ..Default::default() })?;
    Ok(Found { numbered: true, ..without_effects(imported.block) })
}

/// Name, value and a-posteriori standard deviation of the effect parameters of a run.
fn effects(summary: &Summary) -> impl Iterator<Item = (String, f64, Option<f64>)> {
    summary.effects.0.iter().flat_map(|(effect, values)| {
        values.0.iter().map(move |(name, found)| (format!("{effect}.{name}"), found.value, found.sigma))
    })
}

fn sigmas(summary: &Summary) -> HashMap<String, f64> {
    let Some(sigma0) = summary.sigma0 else { return HashMap::new() };
    let of_cameras = summary.cameras.0.iter().flat_map(|(camera, values)| {
        let free = values.0.iter().filter(|(_, found)| found.free);
        free.filter_map(move |(name, found)| Some((format!("{camera}.{name}"), found.sigma?)))
    });
    let of_effects = effects(summary).filter_map(|(name, _, sigma)| Some((name, sigma?)));
    of_cameras.chain(of_effects).map(|(name, sigma)| (name, sigma / sigma0)).collect()
}

/// Largest relative difference of standard deviations from the certified ones; `None` where the result has none of
/// them.
fn sigma_difference(certificate: &Certificate, sigmas: &HashMap<String, f64>) -> Option<f64> {
    let of_cameras = certificate.cameras.iter().flat_map(|(camera, values)| {
        PARAMETERS.iter().zip(values).map(move |(parameter, (_, sigma))| (format!("{camera}.{parameter}"), *sigma))
    });
    let of_effects = certificate.effects.iter().map(|(name, _, sigma)| (name.clone(), *sigma));
    let certified = of_cameras.chain(of_effects).filter(|(_, sigma)| *sigma > 0.0);
    certified.filter_map(|(name, sigma)| Some((sigmas.get(&name)? / sigma - 1.0).abs())).reduce(f64::max)
}

/// The values of a result in the numbering of the problem.
fn state_of(problem: &Problem, result: &Found) -> Result<State> {
    let Found { block, theta, numbered, .. } = result;
    let mut state = problem.start.clone();
    let images: HashMap<&str, usize> =
        block.images.iter().enumerate().map(|(k, image)| (image.name.as_str(), k)).collect();
    let mut seen = vec![false; state.interiors.len()];
    for (i, name) in problem.image_names.iter().enumerate() {
        let Some(k) = images.get(name.as_str()) else { bail!("the result has no image `{name}`") };
        state.poses[i] = block.images[*k].pose;
        // Cameras by what was taken with them: other programs have names of their own.
        let camera = problem.image_contexts[i].camera as usize;
        let interior = block.cameras[block.images[*k].camera.index()].interior;
        let same = !seen[camera] || state.interiors[camera] == interior;
        ensure!(same, "image `{name}` has another camera than others of `{}`", problem.camera_names[camera]);
        (state.interiors[camera], seen[camera]) = (interior, true);
    }
    for (entry, value) in problem.theta.iter().zip(&mut state.theta).filter(|(entry, _)| entry.free) {
        let found = theta.get(&entry.name);
        *value = *found
            .with_context(|| format!("the result has no `{}`: a run folder has it, a block has not", entry.name))?;
    }
    let points: HashMap<&str, usize> =
        block.tie_points.iter().enumerate().map(|(k, point)| (point.name.as_str(), k)).collect();
    let mut elsewhere = Vec::new();
    for (j, source) in problem.point_sources.iter().enumerate() {
        let name = match source {
            PointSource::Tie(id) if *numbered => (id.index() + 1).to_string(),
            PointSource::Tie(_) => problem.point_names[j].clone(),
            // No format has adjusted control points: they follow from the rest.
            PointSource::Control(_) => {
                elsewhere.push(j);
                continue;
            }
        };
        let position = points.get(name.as_str()).and_then(|k| block.tie_points[*k].position);
        state.points[j] = position.with_context(|| format!("the result has no point `{name}`"))?;
    }
    if !elsewhere.is_empty() {
        let held = held_but_points(problem);
        let (refined, _) = refine(&held, &state)?;
        for j in elsewhere {
            state.points[j] = refined.points[j].map(|value| value.hi).into();
        }
    }
    Ok(state)
}

/// The problem with everything held but its points.
fn held_but_points(problem: &Problem) -> Problem {
    let mut held = problem.clone();
    held.camera_free.iter_mut().for_each(|free| *free = Default::default());
    held.pose_free.iter_mut().for_each(|free| *free = [false; 6]);
    held.theta.iter_mut().for_each(|entry| entry.free = false);
    held
}

/// Takes the datum out: where the problem holds seven coordinates of its poses, the similarity that gives the result
/// the same.
fn in_datum(problem: &Problem, mut state: State) -> Result<State> {
    if problem.datum_defect == 0 {
        return Ok(state);
    }
    let whole = |free: &[bool; 6]| *free == [false; 6];
    let base = problem.pose_free.iter().position(whole).context("the problem holds no pose")?;
    let far = problem.pose_free.iter().enumerate().find_map(|(i, free)| {
        let held = (3..6).find(|k| !free[*k])?;
        (!whole(free)).then_some((i, held - 3))
    });
    let (far, axis) = far.context("the problem holds no scale")?;
    let (from, to) = (state.poses[base], problem.start.poses[base]);
    let rotation = |pose: &Pose| pose.rotation.to_rotation_matrix().into_inner();
    let turn: Matrix3<f64> = rotation(&to).transpose() * rotation(&from);
    let length = (turn * (state.poses[far].centre - from.centre))[axis];
    let scale = (problem.start.poses[far].centre - to.centre)[axis] / length;
    ensure!(
        scale.is_finite() && scale > 0.0,
        "the result has no scale: images {base} and {far} stand in one place, or the block is mirrored"
    );
    for pose in &mut state.poses {
        let turned = Rotation3::from_matrix_unchecked(rotation(pose) * turn.transpose());
        *pose = Pose {
            rotation: UnitQuaternion::from_rotation_matrix(&turned),
            centre: turn * (pose.centre - from.centre) * scale + to.centre,
        };
    }
    for point in &mut state.points {
        *point = turn * (*point - from.centre) * scale + to.centre;
    }
    Ok(state)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::problems;
    use nalgebra::Vector3;

    /// A similarity of a whole result changes nothing.
    #[test]
    fn the_datum_is_taken_out() -> Result<()> {
        let bundle = problems::find("strip")?;
        let problem = Problem::new(&bundle.block()?, &bundle.model()?)?;
        let mut moved = problem.start.clone();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.8, 1.9));
        let there = |at: &Vector3<f64>| turn * at * 0.3 + Vector3::new(7.0, -40.0, 11.0);
        for pose in &mut moved.poses {
            *pose = Pose { rotation: pose.rotation * turn.inverse(), centre: there(&pose.centre) };
        }
        moved.points.iter_mut().for_each(|point| *point = there(point));
        let back = in_datum(&problem, moved)?;
        let largest = back.points.iter().zip(&problem.start.points).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(largest < 1e-11, "{largest} m");
        Ok(())
    }
}
