//! What each effect is, for somebody who flies drones and never heard the term; what to do about it; what would tell it from its partners.

/// An effect in words.
#[derive(Debug, Clone, Copy)]
pub struct Words {
    /// Its id.
    pub effect: &'static str,
    /// What it is, in two sentences.
    pub what: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
    /// The flight, column or setting that would tell it from what looks like it.
    pub tell: &'static str,
}

const fn words(effect: &'static str, what: &'static str, remedy: &'static str, tell: &'static str) -> Words {
    Words { effect, what, remedy, tell }
}

/// A camera parameter that was held and that the images ask for.
const FREED: Words = words(
    "free",
    "A number of the camera was held at a value from elsewhere, and the images ask for another. A calibration of another day, focus or mode does not fit this flight.",
    "Leave the parameter free, or calibrate the camera as it flies.",
    "images at two heights, or turned by 90 degrees, determine it better",
);

/// Every effect of the catalogue that names a cause.
pub const WORDS: &[Words] = &[
    words(
        "rolling-shutter",
        "The sensor is read out row by row, and the aircraft flies on meanwhile. Points low in the image are seen from a place some centimetres further on than points high in it.",
        "Model it, fly slower, or use a camera with a mechanical or global shutter.",
        "flight lines at another speed, or flown in the opposite direction",
    ),
    words(
        "forward-motion",
        "While the shutter is open the aircraft moves, so that every point is smeared along the motion. The middle of the smear, not its beginning, is what is measured.",
        "Shorten the exposure, or model it; recording the exposure time helps.",
        "images of different exposure times or speeds",
    ),
    words(
        "focal-time",
        "The focal length changed steadily during the flight, as lenses do while they warm up or settle. Images from the beginning and the end then disagree on scale.",
        "Let the camera reach its temperature before the flight, and switch autofocus off; else model it.",
        "a recorded temperature, or a second flight with a warm camera",
    ),
    words(
        "focal-temperature",
        "The focal length follows the temperature: metal and glass expand, and the lens moves relative to the sensor. A few micrometres are a part in ten thousand of the scale.",
        "Record the camera's temperature and model it, or let the camera reach the outside temperature first.",
        "flights whose temperature does not simply rise with time",
    ),
    words(
        "focal-flight",
        "Each flight has a focal length of its own. Between flights the camera was switched off, focused anew or cooled down.",
        "Lock the focus for all flights, or calibrate each flight by itself.",
        "flights that overlap, and cross flights at another height",
    ),
    words(
        "focal-image",
        "The focal length jumps from image to image. That is what autofocus, a loose lens or image stabilisation does.",
        "Switch autofocus and stabilisation off and fix the lens; until then give each image its own focal length.",
        "GNSS positions of good height, which hold the distance to the ground",
    ),
    words(
        "pp-time",
        "The point where the optical axis meets the sensor wandered during the flight. A sagging mount or a lens that warms up on one side does this.",
        "Check lens and mount for play; model it.",
        "flights in opposite directions, and turned images",
    ),
    words(
        "pp-flight",
        "Each flight has a principal point of its own: lens and sensor stood differently to each other. The lens was taken off, or the camera was knocked in between.",
        "Do not touch the lens between flights; calibrate each flight by itself.",
        "flights that overlap, with turned images",
    ),
    words(
        "pp-image",
        "The optical axis moves from image to image, as with sensor-shift or lens-shift image stabilisation. Each image then has a principal point of its own.",
        "Switch the stabilisation off; until then give each image its own principal point.",
        "images with and without stabilisation over the same ground",
    ),
    words(
        "radial-high",
        "The lens distorts more at its edge than the usual three numbers can say. Wide lenses, and images already corrected by the camera, need a further one.",
        "Add the term; do not measure in the outermost corners; use images that the camera did not correct.",
        "measurements in the corners of the images",
    ),
    words(
        "decentring-high",
        "The elements of the lens are not exactly behind each other, and more than the usual two numbers describe. The distortion is stronger on one side of the image.",
        "Add the terms, or have the lens centred.",
        "images turned by 90 and 180 degrees, and measurements in all corners",
    ),
    words(
        "unflatness",
        "The sensor is not flat, by some hundredths of a millimetre. Where it bulges, points are imaged too far out or too far in.",
        "Model it; it belongs to this camera and comes again with every flight.",
        "oblique images: their rays meet the sensor at another angle",
    ),
    words(
        "local-flaw",
        "A spot of the sensor, of its cover glass or of the filter before the lens moves image points that fall on it. All images have it at the same place.",
        "Clean lens and filter where the spot is small; one as wide as a fifth of the sensor is in the glass itself, and is modelled, or its measurements are left out.",
        "images with another filter or lens, or turned ones",
    ),
    words(
        "gravity-sag",
        "Lens and mount give way under their weight. The principal point then depends on how the camera is held.",
        "Support the lens, or model it.",
        "images with the camera turned about its axis",
    ),
    words(
        "flat-port",
        "The camera looks through a flat pane, and rays are bent on entering the air or water behind it. The bend grows with the angle and depends on the distance.",
        "Model the port with its thickness and distance, or use a dome port.",
        "images at different distances",
    ),
    words(
        "refraction",
        "The air grows thinner with height and bends rays slightly. From some kilometres, or over hot ground, points move outwards in the image.",
        "Model it; record air pressure and temperature.",
        "images from two heights",
    ),
    words(
        "gnss-lever-arm",
        "The antenna is not where the camera is. The positions that GNSS gives are those of the antenna, and the offset turns with the aircraft.",
        "Measure the offset between antenna and camera and enter it; else model it.",
        "flight lines in opposite and in crossing directions at different speeds",
    ),
    words(
        "gnss-delay",
        "The time of the positions and the time of the exposures differ. Every position is then too far ahead or behind by the distance flown meanwhile.",
        "Use the camera's flash or event signal for the time tag; else model it.",
        "flight lines at different speeds",
    ),
    words(
        "gnss-shift",
        "All positions of a flight are off by the same amount. Usually a base station with wrong coordinates or another reference frame.",
        "Check the coordinates of the base and the reference frame.",
        "control points, or a second flight with another base",
    ),
    words(
        "gnss-drift",
        "The positions wander steadily during a flight. Positions without corrections, or a weak satellite geometry, do this.",
        "Use differential or kinematic processing; else model it.",
        "control points at both ends of the flight",
    ),
    words(
        "map-scale",
        "Coordinates of a map are not distances on the ground: the projection and the height change the scale by some tenths of a part in a thousand. The block is measured in true lengths.",
        "Work in a local system, or reduce the coordinates before the adjustment.",
        "the name of the coordinate system in block.toml",
    ),
    words(
        "earth-curvature",
        "Heights of a map are above a curved surface, and the images know of no such thing. At a kilometre from the centre that is 8 cm.",
        "Work in a local system of three dimensions, or correct the heights.",
        "the name of the coordinate system in block.toml, and control points over the whole area",
    ),
];

/// The words of an effect; `None` of a plug-in's.
pub fn of(effect: &str) -> Option<&'static Words> {
    if effect.starts_with("free:") {
        return Some(&FREED);
    }
    WORDS.iter().find(|words| words.effect == effect)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Kind, catalogue};

    #[test]
    fn every_cause_of_the_catalogue_has_words() {
        for effect in catalogue() {
            let descriptor = effect.descriptor();
            assert_eq!(
                of(&descriptor.id).is_some(),
                descriptor.kind == Kind::Physical,
                "{}: words belong to causes, and to all of them",
                descriptor.id
            );
        }
    }
}
