//! The focal length that a whole adjustment estimates beside the recorded one.

use crate::block::Block;
use crate::camera::{F, Interior};
use crate::mistakes::{BEYOND, Mistake};
use crate::run::fit::Fit;

/// Share by which a recorded focal length may be off. That of the name of a lens, of an EXIF header or of another focus
/// is off by a few hundredths; one that is off by a tenth belongs to another lens, sensor or image size.
const ANOTHER_LENS: f64 = 0.1;

/// What the rays of tie points call it, too.
const KIND: &str = "focal-wrong";

/// Cameras whose recorded focal length (px) is not that of their images. `recorded`: the block that was adjusted, with
/// the values of the file; `fit`: its adjustment, with the covariance of the cameras; `named`: mistakes known before.
pub fn of_focal_lengths(recorded: &Block, fit: &Fit, named: &[Mistake]) -> Vec<Mistake> {
    let Some(covariance) = &fit.solution.covariance else { return Vec::new() };
    if named.iter().any(|own| own.kind == KIND) {
        return Vec::new();
    }
    let of_camera = |(number, interior): (usize, &Interior)| {
        let unknown = fit.problem.layout().camera(number, F);
        let row = covariance.shared_unknowns.iter().position(|own| *own == unknown)?;
        let sigma = covariance.shared[(row, row)].sqrt();
        let camera = recorded.cameras.get(number)?;
        judge(&camera.id, camera.interior[F], interior[F], sigma)
    };
    fit.solution.state.interiors.iter().enumerate().filter_map(of_camera).collect()
}

/// Focal lengths and standard deviation in px.
fn judge(id: &str, recorded: f64, estimated: f64, sigma: f64) -> Option<Mistake> {
    let difference = (estimated - recorded).abs();
    // Not a number compares as false.
    if !(difference > ANOTHER_LENS * estimated.abs() && difference > BEYOND * sigma) {
        return None;
    }
    let sentence = format!(
        "Camera {id}: a focal length of {recorded:.1} px is recorded, and the measurements say {estimated:.1} \u{b1} \
         {sigma:.1} px."
    );
    let remedy = "Look at the calibration: it may be of another lens, of another image size, or of a lens in air for \
                  images in water.";
    let found = Mistake::new(KIND, "camera", sentence, remedy.into());
    Some(found.sized(recorded / estimated, Some(recorded * sigma / estimated.powi(2)), "1"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_lens_is_named_and_a_rough_value_is_not() {
        let found = judge("cam", 4132.5, 5510.0, 1.0).expect("another lens");
        assert_eq!((found.kind.as_str(), found.value), (KIND, Some(0.75)));
        assert!(judge("cam", 5250.0, 5510.0, 1.0).is_none(), "as an EXIF header has it");
        assert!(judge("cam", 4132.5, 5510.0, 200.0).is_none(), "the block does not tell it");
        assert!(judge("cam", 4132.5, 5510.0, f64::NAN).is_none());
    }
}
