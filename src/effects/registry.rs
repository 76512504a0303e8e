//! The ordered registry of built-in effects: catalogue, help and screening follow its order.

use super::Effect;

/// Every built-in effect, in catalogue order.
pub fn catalogue() -> &'static [&'static dyn Effect] {
    &[]
}

/// The built-in effect of an id.
pub fn find(id: &str) -> Option<&'static dyn Effect> {
    catalogue().iter().copied().find(|effect| effect.descriptor().id == id)
}
