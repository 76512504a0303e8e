//! Surveyed points that one image alone sees.

use super::Note;
use crate::block::{Block, Role};

/// Most of the control points have marks in one image only, which is said; `None` where they do not. Such a point holds
/// the block by one ray, and nothing tells whether its mark is on it.
pub fn single_marks(block: &Block) -> Option<Note> {
    let mut marks = vec![0usize; block.surveyed.len()];
    block.marks.iter().for_each(|mark| marks[mark.point.index()] += 1);
    let control = block.surveyed.iter().zip(&marks).filter(|(point, _)| point.role == Role::Control);
    let (all, single) = control.fold((0, 0), |(all, single), (_, marks)| (all + 1, single + usize::from(*marks == 1)));
    (2 * single > all).then(|| {
        let which = if single == all { format!("all {all}") } else { format!("{single} of {all}") };
        Note::fact(format!(
            "{which} control points have marks in one image only. Their position cannot be intersected, and a wrong \
             mark does not show: mark them in more images"
        ))
    })
}
