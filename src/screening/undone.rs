//! A block in which conventions are right.

use crate::block::Block;
use crate::block::edited::edited;
use crate::mistakes::Mistake;
use std::borrow::Cow;

/// The block with right conventions of measurements, cameras, orientations and records of the platform, as far as
/// they can be undone.
pub fn with_conventions<'a>(block: &'a Block, mistakes: &[Mistake]) -> Cow<'a, Block> {
    mistakes.iter().filter(|mistake| !mistake.mend.is_empty()).fold(
        Cow::Borrowed(block),
        |block, mistake| match edited(&block, &mistake.mend) {
            Some(edited) => Cow::Owned(edited),
            None => block,
        },
    )
}
