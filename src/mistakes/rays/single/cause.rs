//! What people do to one image: it is mirrored, turned, reduced or cropped before points are measured in it.

use crate::block::edit::{Change, Edit};
use crate::camera::Camera;

/// What was done to an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// Left and right.
    Mirrored,
    /// Upside down in a mirror.
    UpsideDown,
    /// Turned by quarters, clockwise.
    Turned(u8),
    /// Reduced or enlarged: true coordinates are so many times larger.
    Scaled(f64),
    /// Cropped.
    Cropped,
}

/// All that are tried.
pub const CAUSES: [Cause; 13] = [
    Cause::Mirrored,
    Cause::UpsideDown,
    Cause::Turned(2),
    Cause::Turned(1),
    Cause::Turned(3),
    Cause::Scaled(2.0),
    Cause::Scaled(4.0),
    Cause::Scaled(0.5),
    Cause::Scaled(0.25),
    Cause::Scaled(4.0 / 3.0),
    Cause::Scaled(1.5),
    Cause::Scaled(3.0),
    Cause::Cropped,
];

impl Cause {
    /// Are the columns exchanged first, and then by which factor and offset each coordinate becomes the true one?
    fn mapping(self, camera: &Camera) -> (bool, [(f64, f64); 2]) {
        let [width, height] = [f64::from(camera.width_px), f64::from(camera.height_px)];
        match self {
            Self::Cropped => (false, [(1.0, 0.0); 2]),
            Self::Mirrored => (false, [(-1.0, width), (1.0, 0.0)]),
            Self::UpsideDown => (false, [(1.0, 0.0), (-1.0, height)]),
            Self::Turned(1) => (true, [(1.0, 0.0), (-1.0, height)]),
            Self::Turned(2) => (false, [(-1.0, width), (-1.0, height)]),
            Self::Turned(_) => (true, [(-1.0, width), (1.0, 0.0)]),
            Self::Scaled(times) => (false, [(times, 0.0); 2]),
        }
    }

    /// True from measured coordinates.
    pub fn undo(self, camera: &Camera, [x, y]: [f64; 2]) -> [f64; 2] {
        let (exchange, [(fx, ox), (fy, oy)]) = self.mapping(camera);
        let [x, y] = if exchange { [y, x] } else { [x, y] };
        [fx * x + ox, fy * y + oy]
    }

    /// Edits of the measurements of an image, with a shift that was estimated.
    pub fn edits(self, camera: &Camera, image: &str, shift: [f64; 2]) -> Vec<Edit> {
        let (exchange, mut axes) = self.mapping(camera);
        if self == Self::Cropped {
            axes = shift.map(|shift| (1.0, shift));
        }
        let names = [image.to_string()];
        let mut edits = Vec::new();
        for table in ["ties.csv", "marks.csv"] {
            let mut edit = |change: Change| edits.push(Edit::all(table, change).of("image", &names));
            if exchange {
                edit(Change::ExchangeColumns { columns: ["x", "y"].map(String::from) });
            }
            for (column, (factor, offset)) in ["x", "y"].into_iter().zip(axes) {
                if (factor, offset) != (1.0, 0.0) {
                    edit(Change::Affine { column: column.into(), factor, offset });
                }
            }
        }
        edits
    }

    /// Key.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Mirrored | Self::UpsideDown => "mirrored",
            Self::Turned(_) => "turned",
            Self::Scaled(_) => "image-scale",
            Self::Cropped => "offset",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::made;
    use super::*;

    #[test]
    fn a_quarter_turn_and_its_opposite_undo_each_other() {
        let camera = made::camera();
        let turned = Camera { width_px: camera.height_px, height_px: camera.width_px, ..camera.clone() };
        let xy = [700.0, 2600.0];
        // Clockwise: the lower left corner comes to the upper left one.
        assert_eq!(Cause::Turned(1).undo(&camera, [0.0, 0.0]), [0.0, 3000.0]);
        let there = Cause::Turned(3).undo(&turned, xy);
        assert_eq!(Cause::Turned(1).undo(&camera, there), xy);
        assert_eq!(Cause::Turned(2).undo(&camera, Cause::Turned(2).undo(&camera, xy)), xy);
    }

    #[test]
    fn a_crop_is_undone_by_its_shift() {
        let edits = Cause::Cropped.edits(&made::camera(), "i3", [12.0, 0.0]);
        assert_eq!(edits.len(), 2, "x of two tables: {edits:?}");
    }
}
