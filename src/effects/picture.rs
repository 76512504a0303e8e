//! How an effect is shown and told to a person.

use super::Stage;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

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

    /// Does it show residuals that an effect of this stage can move?
    pub fn suits(self, stage: Stage) -> bool {
        match self {
            Picture::Surveyed => matches!(stage, Stage::Control | Stage::Frame),
            Picture::Gnss(_) => matches!(stage, Stage::Position | Stage::Frame),
            _ => matches!(stage, Stage::Exposure | Stage::Ray | Stage::Interior | Stage::Image),
        }
    }
}

impl fmt::Display for Picture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Picture::Sensor => write!(f, "displacement by place on the sensor"),
            Picture::Row => write!(f, "displacement along the motion against the image row"),
            Picture::Radius => write!(f, "radial displacement against the distance from the principal point"),
            Picture::Scale(by) => write!(f, "scale of each image against {by}"),
            Picture::Shift(by) => write!(f, "shift of each image against {by}"),
            Picture::Gnss(by) => write!(f, "GNSS residuals against {by}"),
            Picture::Surveyed => write!(f, "residuals of surveyed coordinates against the distance from their centre"),
        }
    }
}

impl fmt::Display for By {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            By::Time => "the time",
            By::Temperature => "the temperature",
            By::Heading => "the heading",
            By::Order => "the order of the block",
        })
    }
}

/// An effect in words, for somebody who flies drones and never heard the term.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Words {
    /// What it is, in two sentences.
    pub what: Cow<'static, str>,
    /// What to do about it.
    pub remedy: Cow<'static, str>,
    /// The flight, column or setting that would tell it from what looks like it; without a full stop.
    pub tell: Cow<'static, str>,
}
