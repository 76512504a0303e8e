//! Other start values: an adjustment that starts where f is wrong by half or by twice, or with its images turned or its
//! base the other way round, may end in a minimum of its own, with a camera that is none, and both solvers agree on it.

use super::RunError;
use super::start_values::{doubtful_share_behind, doubts};
use crate::adjust::{CovarianceOf, Options, Solver};
use crate::block::Block;
use crate::camera::{Camera, F, Interior, PARAMETERS};
use crate::model::Model;
use crate::problem::{Problem, ProblemError, start_interiors};
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::HashSet;
use std::f64::consts::FRAC_PI_2;
use std::ops::ControlFlow;

/// Factors on the focal length that are tried: a minimum of its own begins where f is wrong by about 1.8, so that steps
/// of 1.4 miss none.
const FACTORS: [f64; 5] = [1.0, 0.7, 1.4, 0.5, 2.0];
/// Change of a focal length, as a share of it, beyond which its start value was none: a lens has the focal length that
/// is written on it within a few per cent, and a sensor the size.
const DOUBTFUL: f64 = 0.2;
/// Quarter turns about the optical axis that are tried.
const TURNS: [u8; 4] = [0, 1, 2, 3];

/// Block and model with the start values that end at the smallest variance factor; as they are where none ends. The
/// poses are others only where the block's put most points behind the images.
///
/// # Errors
/// A block of which no problem can be made.
pub fn best_start(
    block: &Block,
    model: &Model,
    solver: &dyn Solver,
    options: &Options,
    tell: &dyn Fn(&str),
) -> Result<(Block, Model), RunError> {
    let interiors = start_interiors(block, model)?;
    let mut search = Search { solver, options, tell, best: None };
    if doubts(block, &interiors).iter().any(|doubt| doubt.turns_block()) {
        for (name, posed) in other_poses(block, &interiors) {
            search.attempt(&name, posed, model.clone())?;
        }
    }
    let posed = search.best.as_ref().map_or_else(|| block.clone(), |best| best.block.clone());
    for factor in FACTORS {
        let scaled = scaled_focal_lengths(block, model, factor);
        search.attempt(&format!("{factor} times the focal length"), posed.clone(), scaled)?;
    }
    Ok(search.best.map_or_else(|| (block.clone(), model.clone()), |best| (best.block, best.model)))
}

/// The model with all cameras starting at so many times the focal lengths that they start with.
pub(super) fn scaled_focal_lengths(block: &Block, model: &Model, factor: f64) -> Model {
    let mut scaled = model.clone();
    for camera in &block.cameras {
        let values = scaled.camera_values.entry(camera.id.clone()).or_default();
        *values.entry(PARAMETERS[F].to_string()).or_insert(camera.interior[F]) *= factor;
    }
    scaled
}

struct Search<'a> {
    solver: &'a dyn Solver,
    options: &'a Options,
    tell: &'a dyn Fn(&str),
    best: Option<Ended>,
}

/// Start values that end somewhere.
struct Ended {
    variance: f64,
    block: Block,
    model: Model,
}

impl Search<'_> {
    fn attempt(&mut self, name: &str, block: Block, model: Model) -> Result<(), RunError> {
        (self.tell)(&format!("trying {name}"));
        let options = Options { covariance: CovarianceOf::Nothing, ..self.options.clone() };
        let problem = problem_of_what_meets(&block, &model)?;
        let Ok(solution) = self.solver.solve(&problem, &options, &mut |_| ControlFlow::Continue(())) else {
            return Ok(());
        };
        // Not the cost alone: fewer points may meet from one start than from another.
        let variance = solution.cost / problem.redundancy().2.max(1) as f64;
        if self.best.as_ref().is_none_or(|best| variance < best.variance) {
            self.best = Some(Ended { variance, block, model });
        }
        Ok(())
    }
}

/// The problem without tie points whose rays do not meet.
pub(super) fn problem_of_what_meets(block: &Block, model: &Model) -> Result<Problem, ProblemError> {
    let apart = match Problem::new(block, model) {
        Err(ProblemError::NoIntersection { points }) => points.into_iter().collect::<HashSet<_>>(),
        other => return other,
    };
    let mut left = block.clone();
    left.ties.retain(|row| !apart.contains(&block.tie_points[row.point.index()].name));
    Problem::new(&left, model)
}

/// The block with its images turned about their axes, and with its base the other way round, by which the same rays
/// meet in front that met behind: those of them that are not in doubt. Tie points are intersected anew.
fn other_poses(block: &Block, interiors: &[Interior]) -> Vec<(String, Block)> {
    let centroid = block.images.iter().map(|image| image.pose.centre).sum::<Vector3<f64>>() / block.images.len() as f64;
    let mut found = Vec::new();
    for reversed in [false, true] {
        for quarters in TURNS {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), f64::from(quarters) * FRAC_PI_2);
            let mut posed = block.clone();
            posed.tie_points.iter_mut().for_each(|point| point.position = None);
            for image in &mut posed.images {
                image.pose.rotation = turn * image.pose.rotation;
                if reversed {
                    image.pose.centre = 2.0 * centroid - image.pose.centre;
                }
            }
            let base = if reversed { " and the base reversed" } else { "" };
            let name = format!("the images turned by {} degrees{base}", 90 * u32::from(quarters));
            if doubtful_share_behind(&posed, interiors).is_none() {
                found.push((name, posed));
            }
        }
    }
    found
}

/// Cameras whose focal length (px) ended far from what the block says, in words.
pub fn doubtful_cameras(block: &Block, interiors: &[Interior]) -> Vec<String> {
    let far = |(camera, end): (&Camera, &Interior)| {
        let start = camera.interior[F];
        let text =
            || format!("f of camera {} is {:.0} px in the block and {:.0} px adjusted", camera.id, start, end[F]);
        ((end[F] / start - 1.0).abs() > DOUBTFUL).then(text)
    };
    block.cameras.iter().zip(interiors).filter_map(far).collect()
}
