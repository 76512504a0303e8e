//! What was done to an image, in sentences.

use super::cause::Cause;
use crate::camera::Camera;
use crate::mistakes::Mistake;

/// One image whose measurements fit once something is undone.
pub struct Fitting<'a> {
    /// Its name.
    pub image: &'a str,
    /// Its camera.
    pub camera: &'a Camera,
    /// What was done to it.
    pub cause: Cause,
    /// Shift that was estimated, px.
    pub shift: [f64; 2],
    /// Measurements that fit, and all.
    pub fit: [usize; 2],
}

/// A mistake of one image.
pub fn altered(found: &Fitting<'_>) -> Mistake {
    let Fitting { image, camera, cause, shift, fit } = found;
    let (says, remedy) = match cause {
        Cause::Mirrored => ("mirrored, left to right".to_string(), "Replace x by width - x".to_string()),
        Cause::UpsideDown => ("mirrored, upside down".into(), "Replace y by height - y".into()),
        Cause::Turned(quarters) => (
            format!("turned by {} degrees clockwise", 90 * u32::from(*quarters)),
            "Turn the image back, without its orientation tag (EXIF), and measure again; or convert x and y".into(),
        ),
        Cause::Scaled(times) => (
            format!("reduced or enlarged to {:.4} times its size", 1.0 / times),
            format!("Multiply x and y by {times:.4}"),
        ),
        Cause::Cropped => (
            format!("cropped: the origin is shifted by {:.1}, {:.1} px (x, y)", shift[0], shift[1]),
            "Add the shift to x and y, or use the image before it was cropped".into(),
        ),
    };
    let [good, all] = fit;
    let mut sentence =
        format!("Image {image} was {says}: {good} of {all} measurements fit the other images once that is undone.");
    if matches!(cause, Cause::Turned(_)) {
        sentence += " Its approximate rotation may be turned instead.";
    }
    let made = Mistake::new(cause.kind(), "images", sentence, format!("{remedy} (ties.csv, marks.csv)."))
        .of(vec![image.to_string()])
        .tested(f64::NAN, f64::NEG_INFINITY)
        .undone_by(cause.edits(camera, image, *shift));
    match cause {
        Cause::Turned(quarters) => made.sized(90.0 * f64::from(*quarters), None, "deg"),
        Cause::Scaled(times) => made.sized(1.0 / times, None, "1"),
        Cause::Cropped => made.sized(shift[0].hypot(shift[1]), None, "px"),
        _ => made,
    }
}
