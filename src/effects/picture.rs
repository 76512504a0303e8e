//! How an effect is shown and told to a person.

use super::Stage;
use std::borrow::Cow;

/// In which picture an effect is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// Displacement by place on the sensor.
    Sensor,
    /// Displacement along the motion against the image row.
    Row,
    /// Radial displacement against the distance from the principal point.
    Radius,
    /// Scale of each image.
    Scale(By),
    /// Shift of each image.
    Shift(By),
    /// GNSS residuals along the track, across and up.
    Gnss(By),
    /// Residuals of surveyed coordinates, outward and up, against the distance from their centre.
    Surveyed,
}

/// What values of images are held against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// Time of exposure, s.
    Time,
    /// Temperature of the camera, degrees Celsius.
    Temperature,
    /// Heading of the track, degrees.
    Heading,
    /// Order of the block.
    Order,
}

impl Picture {
    /// The picture of an effect that states none, by the stage at which it acts.
    pub fn of_stage(stage: Stage) -> Self {
        match stage {
            Stage::Exposure => Picture::Row,
            Stage::Position => Picture::Gnss(By::Heading),
            Stage::Control | Stage::Frame => Picture::Surveyed,
            Stage::Ray | Stage::Interior | Stage::Image => Picture::Sensor,
        }
    }
}

/// An effect in words, for somebody who flies drones and never heard the term.
#[derive(Debug, Clone, PartialEq)]
pub struct Words {
    /// What it is, in two sentences.
    pub what: Cow<'static, str>,
    /// What to do about it.
    pub remedy: Cow<'static, str>,
    /// The flight, column or setting that would tell it from what looks like it.
    pub tell: Cow<'static, str>,
}
