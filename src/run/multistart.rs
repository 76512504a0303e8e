//! Other start values of the focal length: an adjustment that starts where f is wrong by half or by twice may end in a minimum of its own, with a
//! camera that is none, and both solvers agree on it.

use super::RunError;
use crate::adjust::{CovarianceOf, Options, Solver};
use crate::block::Block;
use crate::camera::{Camera, F, Interior, PARAMETERS};
use crate::model::Model;
use crate::problem::Problem;
use std::ops::ControlFlow;

/// Factors on the focal length that are tried: a minimum of its own begins where f is wrong by about 1.8, so that steps of 1.4 miss none.
const FACTORS: [f64; 5] = [1.0, 0.7, 1.4, 0.5, 2.0];
/// Change of a focal length, as a share of it, beyond which its start value was none: a lens has the focal length that is written on it within a
/// few per cent, and a sensor the size.
const DOUBTFUL: f64 = 0.2;

/// The model with the start values of f that end at the smallest `v'Pv`; as it is where none ends.
///
/// # Errors
/// A block of which no problem can be made.
pub fn best_start(
    block: &Block,
    model: &Model,
    solver: &dyn Solver,
    options: &Options,
    tell: &dyn Fn(&str),
) -> Result<Model, RunError> {
    let options = Options { covariance: CovarianceOf::Nothing, ..options.clone() };
    let mut best: Option<(f64, Model)> = None;
    for factor in FACTORS {
        tell(&format!("trying {factor} times the focal length"));
        let mut scaled = model.clone();
        for camera in &block.cameras {
            let values = scaled.camera_values.entry(camera.id.clone()).or_default();
            *values.entry(PARAMETERS[F].to_string()).or_insert(camera.interior[F]) *= factor;
        }
        let problem = Problem::new(block, &scaled)?;
        let Ok(solution) = solver.solve(&problem, &options, &mut |_| ControlFlow::Continue(())) else { continue };
        if best.as_ref().is_none_or(|(cost, _)| solution.cost < *cost) {
            best = Some((solution.cost, scaled));
        }
    }
    Ok(best.map_or_else(|| model.clone(), |(_, model)| model))
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
