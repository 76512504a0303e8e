//! Priors on the cameras of a diagnosis: what lenses and sensors have. A block that determines its camera does not feel
//! them. Where nothing determines a parameter, a distortion that the model lacks would drive it far away, and the
//! linearisation there would say nothing.
//!
//! A plain adjustment stays least squares without them; the model that a diagnosis hands on states each one.

use super::{ProblemError, start_interiors};
use crate::block::Block;
use crate::camera::{Interior, PARAMETERS};
use crate::model::{Model, Prior};

/// Standard deviation of each interior parameter as a share of its domain ([`crate::camera::Camera::domains`]: the
/// focal length, the sensor, and half the diagonal at a corner).
///
/// - `f`: nominal focal lengths of lenses are rounded and change with focus by some per cent.
/// - `pp`: play of mounts and cropping leave less than a fiftieth of the sensor (Luhmann et al., Close-Range
///   Photogrammetry, ch. 3).
/// - `dc`: lenses are centred to a tenth of a millimetre, a hundredth of a sensor.
/// - `k1, k2, k3`: a tenth of half the diagonal at a corner; wide angles reach three tenths.
/// - `p1, p2`: a tenth of that (Brown 1971).
/// - `b1, b2`: pixels are square to a part in a thousand.
pub const PRIOR_SHARES: Interior = [0.05, 0.02, 0.02, 0.01, 0.01, 0.1, 0.1, 0.1, 0.01, 0.01, 1e-3, 1e-3];

/// `model` with a prior on every free camera parameter that has none of its own, at its start value.
///
/// # Errors
/// A camera or a parameter of the model that the block does not have.
pub fn with_priors(block: &Block, model: &Model) -> Result<Model, ProblemError> {
    let mut model = model.clone();
    let interiors = start_interiors(block, &model)?;
    for (camera, interior) in block.cameras.iter().zip(interiors) {
        let domains = camera.domains();
        for (k, parameter) in PARAMETERS.iter().enumerate() {
            let is_free = model.free[k] && !(model.tie_dc_to_pp && matches!(k, 3 | 4));
            let stated = |prior: &Prior| prior.camera == camera.id && prior.parameter == *parameter;
            if is_free && !model.priors.iter().any(stated) {
                let (camera, parameter) = (camera.id.clone(), parameter.to_string());
                model.priors.push(Prior { camera, parameter, value: interior[k], sigma: PRIOR_SHARES[k] * domains[k] });
            }
        }
    }
    Ok(model)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Scenario, simulate};

    #[test]
    fn free_parameters_have_a_prior_and_held_or_stated_ones_none() {
        let scenario = Scenario::preset("dike", &[("points".to_string(), 100.0)].into()).expect("a preset");
        let block = simulate(&scenario, 1).expect("a block").block;
        let camera = &block.cameras[0];
        let own = Prior { camera: camera.id.clone(), parameter: "f".into(), value: 5000.0, sigma: 1.0 };
        let mut model = Model { priors: vec![own.clone()], tie_dc_to_pp: true, ..Model::default() };
        model.free[10] = false;
        let with = with_priors(&block, &model).expect("priors");
        let names: Vec<&str> = with.priors.iter().map(|prior| prior.parameter.as_str()).collect();
        assert_eq!(names, ["f", "ppx", "ppy", "k1", "k2", "k3", "p1", "p2", "b2"]);
        assert_eq!(with.priors[0], own);
        // A radial term of one standard deviation moves a corner by a tenth of half the diagonal.
        let h = camera.half_diagonal_px();
        assert!((with.priors[3].sigma * h.powi(3) - 0.1 * h).abs() < 1e-9 * h);
    }
}
