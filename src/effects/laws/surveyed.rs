//! Surveyed points belong to no image.

use super::sample::output;
use super::{Violation, samples, violation};
use crate::effects::abi::NO_IMAGE;
use crate::effects::{Effect, ImageContext, Scope, Stage};

/// Surveyed: effects of the control and frame stages have global parameters alone, and give the same values where all
/// of an image is unknown.
pub fn surveyed(effect: &dyn Effect, seed: u64) -> Result<(), Violation> {
    let descriptor = effect.descriptor();
    if !matches!(descriptor.stage, Stage::Control | Stage::Frame) {
        return Ok(());
    }
    let fail = |detail: String| Err(violation(effect, "surveyed", detail));
    if let Some(parameter) = descriptor.parameters.iter().find(|parameter| parameter.scope != Scope::Global) {
        return fail(format!("{}: surveyed points belong to no image: its parameters are global", parameter.name));
    }
    for place in samples(effect, seed) {
        let mut bare = place.clone();
        let unknown = ImageContext::default();
        bare.image = ImageContext { image: NO_IMAGE, flight: NO_IMAGE, camera: NO_IMAGE, ..unknown };
        bare.place = [f64::NAN; 2];
        if output(effect, &place) != output(effect, &bare) {
            return fail(format!("it reads something of an image, at {place}"));
        }
    }
    Ok(())
}
