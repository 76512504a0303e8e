//! What each effect is, for somebody who flies drones and never heard the term; what to do about it; what would tell it
//! from its partners.

use crate::diagnose::verdict::FoundEntry;
use crate::effects::{self, Words};
use std::borrow::Cow;
use std::sync::LazyLock;

/// A camera parameter that was held and that the images ask for.
static FREED: LazyLock<Words> = LazyLock::new(|| Words {
    what: Cow::Borrowed(
        "A number of the camera was held at a value from elsewhere, and the images ask for another. A calibration of \
         another day, focus or mode does not fit this flight.",
    ),
    remedy: Cow::Borrowed("Leave the parameter free, or calibrate the camera as it flies."),
    tell: Cow::Borrowed("images at two heights, or turned by 90 degrees, determine it better"),
});

/// The words of an effect of the catalogue, or of a camera group that is set free; `None` of a plug-in's.
pub fn of(effect: &str) -> Option<&'static Words> {
    if effect.starts_with("free:") {
        return Some(&FREED);
    }
    effects::find(effect)?.descriptor().words.as_ref()
}

/// The words of an effect that was found: those that the diagnosis wrote, which has plug-ins at hand; else those of the
/// catalogue.
pub fn of_found(found: &FoundEntry) -> Option<&Words> {
    found.words.as_ref().or_else(|| of(&found.effect))
}

#[cfg(test)]
mod tests {
    use crate::effects::{Kind, catalogue};

    #[test]
    fn every_cause_of_the_catalogue_has_words() {
        for effect in catalogue() {
            let descriptor = effect.descriptor();
            assert_eq!(
                descriptor.words.is_some(),
                descriptor.kind == Kind::Physical,
                "{}: words belong to causes, and to all of them",
                descriptor.id
            );
        }
    }
}
