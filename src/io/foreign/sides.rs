//! Width and height of images exchanged, so far that the block would be refused when it is read: why, before that.

use super::super::block::OUTSIDE_MARGIN;
use super::Note;
use crate::block::{Block, Measurement};

/// A measurement at the border of an image may lie that far beside it, px.
const BORDER_PX: f64 = 1.0;

/// Which sensors hold every measurement of a camera so far.
#[derive(Clone, Copy)]
struct Holds {
    /// That of the block, as its reader asks.
    stated: bool,
    /// The turned one.
    turned: bool,
    /// The turned one, after coordinates that were counted from the middle of the image are counted from its own
    /// middle.
    about_middle: bool,
}

/// Cameras some of whose measurements no block may have, while all of them fit the sensor with its sides exchanged.
pub fn sides_exchanged(block: &Block) -> Vec<Note> {
    let mut holds = vec![Holds { stated: true, turned: true, about_middle: true }; block.cameras.len()];
    for row in block.ties.iter().chain(&block.marks) {
        let camera = block.images[row.image.index()].camera.index();
        let own = &block.cameras[camera];
        let [width, height] = [f64::from(own.width_px), f64::from(own.height_px)];
        let is_in = |x: f64, y: f64, [width, height]: [f64; 2], margin: f64| {
            (-margin..=width + margin).contains(&x) && (-margin..=height + margin).contains(&y)
        };
        let (Measurement { x, y, .. }, half) = (*row, 0.5 * (height - width));
        let holds = &mut holds[camera];
        holds.stated &= is_in(x, y, [width, height], OUTSIDE_MARGIN * width.max(height));
        holds.turned &= is_in(x, y, [height, width], BORDER_PX);
        holds.about_middle &= is_in(x + half, y - half, [height, width], BORDER_PX);
    }
    let concerned = block.cameras.iter().zip(holds).filter(|(_, holds)| {
        let fits = holds.turned || holds.about_middle;
        !holds.stated && fits
    });
    let note = |(camera, _): (&crate::camera::Camera, Holds)| {
        let (id, width, height) = (&camera.id, camera.width_px, camera.height_px);
        Note::fact(format!(
            "camera {id}: width and height ({width} x {height} px) are exchanged; measurements lie beside this \
             sensor, and all fit {height} x {width} px"
        ))
    };
    concerned.map(note).collect()
}
