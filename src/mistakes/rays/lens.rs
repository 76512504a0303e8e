//! Conventions of the camera: units of its numbers, sign of the distortion, size of the image that they belong to.

use super::scene::{Scene, Scope};
use crate::block::edit::{Change, Edit};
use crate::camera::{Camera, DCX, DCY, F, Interior, K1, K2, K3, P1, P2, PARAMETERS, PPX, PPY};

/// How the numbers of a camera are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// The focal length is millimetres.
    FocalMillimetres,
    /// The focal length is wrong by a factor: the true one is so many times longer.
    Focal(f64),
    /// The principal point is counted from the centre of the sensor.
    Centred,
    /// The principal point is millimetres.
    Millimetres {
        /// From the centre of the sensor? Else from its corner.
        centred: bool,
    },
    /// Distortion with the opposite sign: from the distorted to the ideal point.
    Sign,
    /// Distortion for lengths in another unit than pixels.
    Unit(Length),
    /// All numbers are those of an image of another size: the true one is so many times larger.
    OtherSize(f64),
    /// Sides of the sensor, and coordinates of the principal point, are exchanged.
    SidesExchanged,
}

/// Unit of the lengths in a distortion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// The focal length.
    Focal,
    /// Millimetres.
    Millimetre,
    /// Half the diagonal of the sensor.
    HalfDiagonal,
}

/// Coefficients of the distortion and the power of a length in each: `k1 r^2`, `k2 r^4`, `k3 r^6`, `p1 r`, `p2 r`.
const POWERS: [(usize, i32); 5] = [(K1, 2), (K2, 4), (K3, 6), (P1, 1), (P2, 1)];

/// Converts the principal point, and the centre of distortion where it has the same unit: where it lies in the same
/// corner of the sensor.
fn in_pixels(interior: &mut Interior, px: f64, offset: [f64; 2]) {
    let has_the_unit = [DCX, DCY].iter().zip(offset).all(|(centre, offset)| {
        // Half of half the side, or of the pixels in a millimetre.
        interior[*centre].abs() < 0.5 * offset.max(px)
    });
    let pairs: &[[usize; 2]] = if has_the_unit { &[[PPX, PPY], [DCX, DCY]] } else { &[[PPX, PPY]] };
    for pair in pairs {
        for (parameter, offset) in pair.iter().zip(offset) {
            interior[*parameter] = interior[*parameter] * px + offset;
        }
    }
}

/// Divides lengths in the distortion by a length in px.
fn per_length(interior: &mut Interior, px: f64) {
    POWERS.iter().for_each(|(parameter, power)| interior[*parameter] /= px.powi(*power));
}

impl Lens {
    /// The camera with numbers in the convention of a block; `None` where it lacks what that needs.
    pub fn camera(self, recorded: &Camera) -> Option<Camera> {
        let mut camera = recorded.clone();
        let interior = &mut camera.interior;
        let middle = [0.5 * f64::from(recorded.width_px), 0.5 * f64::from(recorded.height_px)];
        match self {
            Self::FocalMillimetres => interior[F] *= 1e3 / recorded.pixel_um?,
            Self::Focal(times) => interior[F] *= times,
            Self::Centred => in_pixels(interior, 1.0, middle),
            Self::Millimetres { centred } => {
                in_pixels(interior, 1e3 / recorded.pixel_um?, if centred { middle } else { [0.0; 2] });
            }
            Self::Sign => POWERS.iter().for_each(|(parameter, _)| interior[*parameter] = -interior[*parameter]),
            Self::Unit(length) => {
                let px = match length {
                    Length::Focal => interior[F],
                    Length::Millimetre => 1e3 / recorded.pixel_um?,
                    Length::HalfDiagonal => recorded.half_diagonal_px(),
                };
                per_length(interior, px);
            }
            Self::OtherSize(times) => {
                [F, PPX, PPY, DCX, DCY].iter().for_each(|parameter| interior[*parameter] *= times);
                per_length(interior, times);
            }
            Self::SidesExchanged => {
                interior.swap(PPX, PPY);
                interior.swap(DCX, DCY);
                (camera.width_px, camera.height_px) = (recorded.height_px, recorded.width_px);
            }
        }
        Some(camera)
    }

    /// The scene with cameras in the convention of a block.
    pub fn undo(self, scene: &mut Scene) -> Option<()> {
        scene.cameras = scene.cameras.iter().map(|camera| self.camera(camera)).collect::<Option<_>>()?;
        Some(())
    }

    /// Edits of `block.toml` that undo it; none of an estimate.
    pub fn edits(self, scope: &Scope<'_>) -> Vec<Edit> {
        if matches!(self, Self::Focal(_)) {
            return Vec::new();
        }
        let mut edits = Vec::new();
        for number in scope.cameras() {
            let recorded = &scope.scene.cameras[number];
            let Some(camera) = self.camera(recorded) else { return Vec::new() };
            let mut set = |column: &str, value: String| {
                let change = Change::Set { column: column.into(), value };
                edits.push(Edit::all("block.toml", change).of("id", std::slice::from_ref(&recorded.id)));
            };
            for (k, name) in PARAMETERS.into_iter().enumerate() {
                if camera.interior[k] != recorded.interior[k] {
                    set(name, format!("{:e}", camera.interior[k]));
                }
            }
            for (name, new, old) in
                [("width_px", camera.width_px, recorded.width_px), ("height_px", camera.height_px, recorded.height_px)]
            {
                if new != old {
                    set(name, new.to_string());
                }
            }
        }
        edits
    }

    /// Subject and key.
    pub fn kind(self) -> [&'static str; 2] {
        match self {
            Self::FocalMillimetres => ["camera", "focal-unit"],
            Self::Focal(_) => ["camera", "focal-wrong"],
            Self::Centred | Self::Millimetres { .. } => ["camera", "principal-point-unit"],
            Self::Sign => ["camera", "distortion-sign"],
            Self::Unit(_) => ["camera", "distortion-unit"],
            Self::OtherSize(_) | Self::SidesExchanged => ["camera", "sensor-size"],
        }
    }

    /// For a person: how the camera is recorded, and how to convert it.
    pub fn words(self) -> [String; 2] {
        let [says, remedy] = match self {
            Self::FocalMillimetres => {
                ["the focal length is given in millimetres", "Divide it by the pixel size: f is pixels"]
            }
            Self::Focal(times) => {
                return [
                    format!("the focal length is wrong; a focal length {times:.3} times as long fits"),
                    "Look at the focal length of the camera (f of block.toml, px) and at the pixel size".into(),
                ];
            }
            Self::Centred => [
                "the principal point is counted from the centre of the sensor",
                "Add half the width and height (ppx, ppy, dcx, dcy are counted from the top-left corner)",
            ],
            Self::Millimetres { centred: true } => [
                "the principal point is given in millimetres from the centre of the sensor",
                "Divide it by the pixel size and add half the width and height",
            ],
            Self::Millimetres { centred: false } => [
                "the principal point is given in millimetres",
                "Divide it by the pixel size (ppx, ppy, dcx, dcy are pixels)",
            ],
            Self::Sign => [
                "the distortion has the opposite sign",
                "Change the signs of k1, k2, k3, p1, p2 (they act from the ideal to the measured point)",
            ],
            Self::Unit(Length::Focal) => [
                "the distortion is normalised by the focal length",
                "Divide k1, k2, k3 by f^2, f^4, f^6, and p1, p2 by f (px)",
            ],
            Self::Unit(Length::Millimetre) => [
                "the distortion is given for millimetres",
                "Multiply k1, k2, k3 by s^2, s^4, s^6, and p1, p2 by s, the pixel size in mm",
            ],
            Self::Unit(Length::HalfDiagonal) => [
                "the distortion is normalised by half the diagonal of the sensor",
                "Divide k1, k2, k3 by h^2, h^4, h^6, and p1, p2 by h, half the diagonal in px",
            ],
            Self::OtherSize(times) => {
                return [
                    format!("its numbers belong to an image of {:.4} times the size", 1.0 / times),
                    format!("Multiply f, ppx, ppy, dcx, dcy by {times:.4}, and convert the distortion"),
                ];
            }
            Self::SidesExchanged => [
                "width and height, with the principal point, are exchanged",
                "Exchange width_px and height_px, ppx and ppy, dcx and dcy",
            ],
        };
        [says.into(), remedy.into()]
    }
}

#[cfg(test)]
mod tests {
    use super::super::made;
    use super::*;

    #[test]
    fn a_camera_of_half_the_size_projects_to_half_the_coordinates() {
        let camera = made::camera();
        let half = Lens::OtherSize(0.5).camera(&camera).expect("a camera");
        let point = [0.2, -0.1, 1.0];
        let [full, small] =
            [&camera, &half].map(|camera| crate::camera::fraser::project(&camera.interior, point).expect("in front"));
        assert!(
            (full[0] - 2.0 * small[0]).abs() < 1e-9 && (full[1] - 2.0 * small[1]).abs() < 1e-9,
            "{full:?} {small:?}"
        );
    }

    #[test]
    fn a_normalised_distortion_is_that_of_pixels_once_its_unit_is_undone() {
        let camera = made::camera();
        let mut normalised = camera.clone();
        per_length(&mut normalised.interior, 1.0 / camera.interior[F]);
        let back = Lens::Unit(Length::Focal).camera(&normalised).expect("a camera");
        assert!((back.interior[K1] / camera.interior[K1] - 1.0).abs() < 1e-12);
        assert!(Lens::FocalMillimetres.camera(&Camera { pixel_um: None, ..camera }).is_none());
    }
}
