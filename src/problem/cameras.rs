//! Interior orientations: start values, which parameters are free, priors.

use super::{CameraPrior, ProblemError};
use crate::block::Block;
use crate::camera::{self, DCX, DCY, Interior, PARAMETER_COUNT};
use crate::model::{Model, Prior};

/// Start values of the interior orientations: the block's, where the model has none of its own.
///
/// # Errors
/// A camera or a parameter of the model that the block does not have.
pub fn start_interiors(block: &Block, model: &Model) -> Result<Vec<Interior>, ProblemError> {
    let mut interiors: Vec<Interior> = block.cameras.iter().map(|camera| camera.interior).collect();
    for (id, values) in &model.camera_values {
        let camera = camera_position(block, id)?;
        for (name, value) in values {
            interiors[camera][parameter_position(name)?] = *value;
        }
    }
    if model.tie_dc_to_pp {
        interiors.iter_mut().for_each(camera::tie_centre);
    }
    Ok(interiors)
}

/// Which parameters of each camera are free.
pub(super) fn free_parameters(block: &Block, model: &Model) -> Vec<[bool; PARAMETER_COUNT]> {
    let mut free = model.free;
    if model.tie_dc_to_pp {
        (free[DCX], free[DCY]) = (false, false);
    }
    vec![free; block.cameras.len()]
}

pub(super) fn camera_priors(block: &Block, model: &Model) -> Result<Vec<CameraPrior>, ProblemError> {
    let prior = |prior: &Prior| {
        if prior.sigma.is_nan() || prior.sigma <= 0.0 {
            let text = format!("prior of `{}`: sigma is {}, expected above 0", prior.parameter, prior.sigma);
            return Err(ProblemError::Value(text));
        }
        Ok(CameraPrior {
            camera: camera_position(block, &prior.camera)? as u32,
            parameter: parameter_position(&prior.parameter)? as u32,
            value: prior.value,
            sigma: prior.sigma,
        })
    };
    model.priors.iter().map(prior).collect()
}

fn camera_position(block: &Block, id: &str) -> Result<usize, ProblemError> {
    block.cameras.iter().position(|camera| camera.id == id).ok_or_else(|| {
        let ids: Vec<&str> = block.cameras.iter().map(|camera| camera.id.as_str()).collect();
        ProblemError::Unknown { kind: "camera", name: id.into(), hint: format!("; it has {}", ids.join(", ")) }
    })
}

fn parameter_position(name: &str) -> Result<usize, ProblemError> {
    camera::PARAMETERS.iter().position(|parameter| *parameter == name).ok_or_else(|| ProblemError::Unknown {
        kind: "camera parameter",
        name: name.into(),
        hint: format!("; a camera has {}", camera::PARAMETERS.join(", ")),
    })
}
