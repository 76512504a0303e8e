//! The suite as files, for any program: the block, what is estimated, and the same as a COLMAP model or a file of BAL
//! where these can express it.
//!
//! ```text
//! DIR/suite.json           what there is, and what each problem asks for
//! DIR/NAME/block           our block format
//! DIR/NAME/model.toml      what is estimated, as `misclosure adjust --model` takes it
//! DIR/NAME/colmap          a COLMAP model (text), where COLMAP has the same camera and frees the same parameters
//! DIR/NAME/bal             a file of BAL, where every image has a camera of its own: f, k1, k2
//! ```

use super::problems::BundleProblem;
use crate::block::Block;
use crate::camera::{Camera, F, K1, K2, PARAMETER_COUNT, PPX, PPY};
use crate::io::block::write_block;
use crate::io::foreign::{ExportOptions, registry};
use crate::io::model::write_model;
use crate::io::table::write_json;
use crate::model::{Datum, LOSS_SCALE, Loss, Model, TieWeights};
use crate::problem::Problem;
use anyhow::{Context, Result};
use serde::Serialize;
use std::path::Path;

/// What COLMAP's bundle adjustment is asked to refine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Refine {
    /// Focal length.
    pub refine_focal_length: bool,
    /// Principal point.
    pub refine_principal_point: bool,
    /// Distortion.
    pub refine_extra_params: bool,
}

/// A problem as `suite.json` has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// Name, and folder.
    pub name: String,
    /// What it is.
    pub about: String,
    /// Images, points, image measurements.
    pub sizes: [usize; 3],
    /// Standard deviation of an image coordinate, px.
    pub sigma_px: f64,
    /// Datum.
    pub datum: Datum,
    /// Loss, on the length of an image residual.
    pub loss: Loss,
    /// Its scale, px: the cost is `rho(s)`, `s` the squared length in px.
    pub loss_scale_px: f64,
    /// What COLMAP has to refine; absent: COLMAP cannot express the problem.
    pub colmap: Option<Refine>,
    /// Can BAL express it?
    pub bal: bool,
    /// Why neither can, where neither can.
    pub not_expressible: Option<String>,
}

/// What in a problem has no place in the formats of others: effects, priors, observed positions, weights.
fn beyond_images(model: &Model) -> Option<&'static str> {
    match model {
        Model { effects, .. } if !effects.is_empty() => Some("effects"),
        Model { priors, .. } if !priors.is_empty() => Some("observed camera parameters"),
        Model { datum, .. } if *datum != Datum::Free => Some("observed positions"),
        Model { tie_weights, .. } if *tie_weights != TieWeights::Unit => Some("weights by multiplicity"),
        _ => None,
    }
}

/// What COLMAP refines where it estimates the same parameters of the same cameras; else why it does not.
pub fn colmap(block: &Block, model: &Model) -> Result<Refine, &'static str> {
    if let Some(why) = beyond_images(model) {
        return Err(why);
    }
    if model.loss == Loss::Huber {
        // pycolmap offers Cauchy's and the soft L1.
        return Err("Huber's loss");
    }
    let camera = |camera: &Camera| {
        let [_, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = camera.interior;
        let refine = Refine {
            refine_focal_length: model.free[F],
            refine_principal_point: model.free[PPX],
            refine_extra_params: model.free[K1],
        };
        if (b1, b2) != (0.0, 0.0) || ((dcx, dcy) != (ppx, ppy) && [k1, k2, k3, p1, p2] != [0.0; 5]) {
            return Err("an affinity, or a centre of distortion of its own");
        }
        if model.free == [false; PARAMETER_COUNT] {
            return Ok(refine);
        }
        // SIMPLE_PINHOLE, SIMPLE_RADIAL, RADIAL: which one follows from the values that are not zero.
        let mut same = [false; PARAMETER_COUNT];
        (same[F], same[PPX], same[PPY]) = (model.free[F], model.free[PPX], model.free[PPX]);
        if model.free[K1] {
            (same[K1], same[K2]) = (k1 != 0.0, k2 != 0.0);
        }
        let tied = model.tie_dc_to_pp || !model.free[K1];
        let simple = [k3, p1, p2] == [0.0; 3];
        if model.free == same && tied && simple { Ok(refine) } else { Err("these camera parameters") }
    };
    let mut refines = block.cameras.iter().map(camera).collect::<Result<Vec<_>, _>>()?;
    refines.dedup();
    match refines.as_slice() {
        [refine] => Ok(*refine),
        _ => Err("cameras of several kinds"),
    }
}

/// Can BAL express the problem? Every image has its own camera, of which `f, k1, k2` are free.
pub fn bal(block: &Block, model: &Model) -> bool {
    let mut free = [false; PARAMETER_COUNT];
    (free[F], free[K1], free[K2]) = (true, true, true);
    let own = block.cameras.len() == block.images.len();
    beyond_images(model).is_none() && own && model.free == free && model.tie_dc_to_pp && model.loss == Loss::None
}

/// Writes a problem into its folder.
///
/// # Errors
/// A problem that cannot be made; what cannot be written.
pub fn write(bundle: &BundleProblem, folder: &Path) -> Result<Entry> {
    let (block, model) = (bundle.block()?, bundle.model()?);
    let laid_out = Problem::new(&block, &model).with_context(|| format!("problem `{}`", bundle.name))?;
    write_block(&block, &folder.join("block"))?;
    write_model(&model, &folder.join("model.toml"))?;
    let refine = colmap(&block, &model);
    let bal = bal(&block, &model);
    if refine.is_ok() {
        export("colmap-text", &block, &folder.join("colmap"))?;
    }
    if bal {
        export("bal", &block, &folder.join("bal"))?;
    }
    let layout = laid_out.layout();
    Ok(Entry {
        name: bundle.name.clone(),
        about: bundle.about.clone(),
        sizes: [layout.images, layout.points, laid_out.observations.len()],
        sigma_px: bundle.px,
        datum: model.datum,
        loss: model.loss,
        loss_scale_px: LOSS_SCALE * bundle.px,
        colmap: refine.ok(),
        bal,
        not_expressible: refine.err().map(Into::into),
    })
}

/// Writes the list of the problems.
///
/// # Errors
/// What cannot be written.
pub fn write_list(entries: &[Entry], folder: &Path) -> Result<()> {
    let list = serde_json::json!({ "format": 1, "problems": entries });
    Ok(write_json(&folder.join("suite.json"), &list)?)
}

fn export(format: &str, block: &Block, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot write", folder.display()))?;
    let format = registry().iter().find(|other| other.name() == format);
    let exporter = format.and_then(|format| format.exporter()).context("the format is not to be written")?;
    exporter.export(block, folder, &ExportOptions { approximate: false })?;
    Ok(())
}
