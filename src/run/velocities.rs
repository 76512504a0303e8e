//! Velocities that a model needs and a block lacks come from adjusted projection centres: from a quick fit without the
//! effects that multiply them. Positions of a file are off by up to half a metre, and such velocities by per cents.

use super::RunError;
use super::fit::{Fit, fit};
use crate::adjust::Options;
use crate::block::Block;
use crate::effects::Need;
use crate::model::Model;

/// A fit of `block` without the effects of `model` that need velocities; `None` where they are measured, where no effect
/// needs them, or where there is no such fit: then the positions of the block give them.
///
/// # Errors
/// A wish to stop.
pub fn fit_without_motion(block: &Block, model: &Model, options: &Options) -> Result<Option<Fit>, RunError> {
    if block.images.iter().all(|image| image.velocity.is_some()) {
        return Ok(None);
    }
    let mut without = model.clone();
    without.effects.retain(|term| !term.effect.descriptor().needs.contains(&Need::Velocity));
    if without.effects.len() == model.effects.len() {
        return Ok(None);
    }
    match fit(block, &without, None, options) {
        Ok(fit) => Ok(Some(fit)),
        Err(error) if options.stop.is_raised() => Err(error),
        Err(_) => Ok(None),
    }
}
