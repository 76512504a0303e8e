//! Conventions of measured image coordinates: in which system, unit or image people measured.

use super::scene::{Scene, Scope};
use crate::block::edit::{Change, Edit};
use crate::camera::{Camera, F, Interior, PPX, PPY, fraser};

/// How image coordinates are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coordinates {
    /// y counts upwards from the lower edge.
    YUp,
    /// x counts to the left from the right edge.
    Mirrored,
    /// y stands in the column x.
    Exchanged,
    /// The origin is the centre of the sensor.
    Centred {
        /// Does y count upwards?
        up: bool,
    },
    /// Millimetres on the sensor.
    Millimetres {
        /// Is the origin the centre of the sensor? Else a corner.
        centred: bool,
        /// Does y count upwards?
        up: bool,
    },
    /// Without unit.
    Normalised {
        /// Divided by that.
        by: Unit,
        /// Does y count upwards?
        up: bool,
    },
    /// Measured in an image that was reduced or enlarged: the true coordinates are so many times larger.
    Scaled(f64),
    /// Measured in images that were freed of the distortion, which the camera has.
    Undistorted,
}

/// What coordinates without unit are divided by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Width and height, from the corner.
    Sides,
    /// The longer side, from the centre.
    LongerSide,
    /// The focal length, from the principal point.
    Focal,
}

/// True from recorded coordinates.
enum Mapping {
    /// `factor * recorded + offset`, the columns exchanged before.
    Affine { exchange: bool, factor: [f64; 2], offset: [f64; 2] },
    /// The distortion of a camera.
    Distorted(Interior),
}

impl Mapping {
    fn of(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Affine { exchange, factor, offset } => {
                let [x, y] = if *exchange { [y, x] } else { [x, y] };
                [factor[0] * x + offset[0], factor[1] * y + offset[1]]
            }
            Self::Distorted(interior) => fraser::distort(interior, x, y),
        }
    }

    /// The same in a table.
    fn changes(&self) -> Vec<Change> {
        match self {
            Self::Affine { exchange, factor, offset } => {
                let exchanged = exchange.then(|| Change::ExchangeColumns { columns: ["x", "y"].map(String::from) });
                let moved = ["x", "y"].into_iter().zip(factor.iter().zip(offset));
                let moved = moved.filter(|(_, (factor, offset))| **factor != 1.0 || **offset != 0.0);
                let affine = |(column, (factor, offset)): (&str, (&f64, &f64))| Change::Affine {
                    column: column.into(),
                    factor: *factor,
                    offset: *offset,
                };
                exchanged.into_iter().chain(moved.map(affine)).collect()
            }
            Self::Distorted(interior) => vec![Change::Distort { interior: *interior }],
        }
    }
}

impl Coordinates {
    /// `None` where the camera lacks what it needs.
    fn mapping(self, camera: &Camera) -> Option<Mapping> {
        let [width, height] = [f64::from(camera.width_px), f64::from(camera.height_px)];
        let upwards = |up: bool| if up { -1.0 } else { 1.0 };
        let plain = |factor: [f64; 2], offset: [f64; 2]| Some(Mapping::Affine { exchange: false, factor, offset });
        let middle = [0.5 * width, 0.5 * height];
        match self {
            Self::YUp => plain([1.0, -1.0], [0.0, height]),
            Self::Mirrored => plain([-1.0, 1.0], [width, 0.0]),
            Self::Exchanged => Some(Mapping::Affine { exchange: true, factor: [1.0; 2], offset: [0.0; 2] }),
            Self::Centred { up } => plain([1.0, upwards(up)], middle),
            Self::Millimetres { centred, up } => {
                let px = 1e3 / camera.pixel_um?;
                let corner = [0.0, if up { height } else { 0.0 }];
                plain([px, upwards(up) * px], if centred { middle } else { corner })
            }
            Self::Normalised { by, up } => {
                let interior = &camera.interior;
                match by {
                    Unit::Sides => plain([width, upwards(up) * height], [0.0, if up { height } else { 0.0 }]),
                    Unit::LongerSide => plain([width.max(height), upwards(up) * width.max(height)], middle),
                    Unit::Focal => plain([interior[F], upwards(up) * interior[F]], [interior[PPX], interior[PPY]]),
                }
            }
            Self::Scaled(times) => plain([times; 2], [0.0; 2]),
            Self::Undistorted => Some(Mapping::Distorted(camera.interior)),
        }
    }

    /// The scene with coordinates in the convention of a block.
    pub fn undo(self, scene: &mut Scene) -> Option<()> {
        let mappings: Vec<Mapping> = scene.cameras.iter().map(|camera| self.mapping(camera)).collect::<Option<_>>()?;
        for sight in scene.points.iter_mut().flatten() {
            sight.xy = mappings[scene.views[sight.view].camera].of(sight.xy);
        }
        Some(())
    }

    /// Edits of tables of measurements that undo it.
    pub fn edits(self, scope: &Scope<'_>, tables: &[&str]) -> Vec<Edit> {
        let mut edits = Vec::new();
        let cameras = scope.cameras();
        for table in tables {
            for camera in &cameras {
                let Some(mapping) = self.mapping(&scope.scene.cameras[*camera]) else { return Vec::new() };
                let whole = cameras.len() == 1 && scope.is_everything();
                edits.extend(mapping.changes().into_iter().map(|change| match whole {
                    true => Edit::all(table, change),
                    false => Edit::all(table, change).of("image", &scope.images(*camera)),
                }));
            }
        }
        edits
    }

    /// Key.
    pub fn kind(self) -> &'static str {
        match self {
            Self::YUp => "y-up",
            Self::Mirrored => "mirrored",
            Self::Exchanged => "columns-exchanged",
            Self::Centred { .. } => "centred",
            Self::Millimetres { .. } => "millimetres",
            Self::Normalised { .. } => "normalised",
            Self::Scaled(_) => "image-scale",
            Self::Undistorted => "undistorted",
        }
    }

    /// For a person: how the coordinates are recorded, and how to convert them.
    pub fn words(self) -> [String; 2] {
        let up = |up: bool| if up { ", y upwards" } else { "" };
        match self {
            Self::YUp => ["y counts upwards from the lower edge".into(), "Replace y by height - y".into()],
            Self::Mirrored => {
                ["the images are mirrored, x counts from the right edge".into(), "Replace x by width - x".into()]
            }
            Self::Exchanged => {
                ["the columns x and y (column and row) are exchanged".into(), "Exchange the two columns".into()]
            }
            Self::Centred { up: y } => [
                format!("the origin is the centre of the image{}", up(y)),
                "Convert to pixels from the top-left corner, y downwards: add half the width and height".into(),
            ],
            Self::Millimetres { centred, up: y } => [
                format!("in millimetres from {}{}", if centred { "the centre" } else { "a corner" }, up(y)),
                "Convert to pixels from the top-left corner, y downwards, with the pixel size".into(),
            ],
            Self::Normalised { by, up: y } => {
                let by = match by {
                    Unit::Sides => "the width and height",
                    Unit::LongerSide => "the longer side, from the centre",
                    Unit::Focal => "the focal length, from the principal point",
                };
                [
                    format!("normalised, divided by {by}{}", up(y)),
                    "Convert to pixels from the top-left corner, y downwards".into(),
                ]
            }
            Self::Scaled(times) => [
                format!("measured in images of {:.4} times the size of the sensor", 1.0 / times),
                format!("Multiply x and y by {times:.4}, or describe the camera for images of this size"),
            ],
            Self::Undistorted => [
                "measured in undistorted images, and the camera has the distortion of the original ones".into(),
                "Measure in the original images, or apply the distortion to x and y".into(),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::made;
    use super::*;

    #[test]
    fn edits_do_to_the_table_as_the_scene_was_changed() {
        let scene = made::scene();
        let scope = Scope { scene: &scene, camera: None };
        let height = f64::from(scene.cameras[0].height_px);
        let expected = Edit::all("ties.csv", Change::Affine { column: "y".into(), factor: -1.0, offset: height });
        assert_eq!(Coordinates::YUp.edits(&scope, &["ties.csv"]), [expected]);
        assert_eq!(Coordinates::Exchanged.edits(&scope, &["ties.csv", "marks.csv"]).len(), 2);
        let mut twice = scene.clone();
        assert_eq!(Coordinates::YUp.undo(&mut twice), Some(()));
        assert_eq!(twice.points[0][0].xy[1], height - scene.points[0][0].xy[1]);
        let mut none = Scene { cameras: vec![Camera { pixel_um: None, ..scene.cameras[0].clone() }], ..scene };
        assert_eq!(Coordinates::Millimetres { centred: true, up: true }.undo(&mut none), None, "no pixel size");
    }
}
