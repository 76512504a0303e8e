//! Two cameras under one name, from the base model alone: what a diagnosis looks at before its first step, for `mend`.

use super::added::Added;
use super::candidate::Candidate;
use super::catalogue;
use super::knowledge::with_known;
use super::linearised::{Questions, with_candidates};
use super::own_cameras::{OF_IMAGES, several_cameras};
use super::run::{Base, base};
use super::settings::Settings;
use crate::adjust::native::pool::Pool;
use crate::block::Block;
use crate::mistakes::Mistake;
use crate::model::Model;
use crate::run::RunError;

/// Two cameras under one name.
///
/// # Errors
/// A fit that fails.
pub fn under_one_name(whole: &Block, model: &Model, settings: &Settings<'_>) -> Result<Vec<Mistake>, RunError> {
    Pool::new(settings.options.threads)?.install(|| {
        let (model, _) = with_known(whole, model);
        let Base { search, fit, .. } = base(whole, &model, settings)?;
        let block = search.block(whole);
        let added = Added { own: fit.model.effects.len(), ..Default::default() };
        let is_of_images = |candidate: &Candidate| OF_IMAGES.iter().any(|(effect, _)| candidate.id == *effect);
        let (tested, untested) = catalogue::candidates(&block, &fit, &added, settings.plugins, is_of_images);
        let asked = Questions { tested, untested, ..Questions::nothing() };
        let linearised = with_candidates(&block, &fit, &added, asked, settings)?;
        Ok(several_cameras(&block, &linearised, settings.significance))
    })
}
