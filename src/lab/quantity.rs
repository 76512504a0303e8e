//! What residuals can be held against, and the components that they have.

use serde::{Deserialize, Serialize};

/// What residuals can be held against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Time of exposure.
    Time,
    /// Temperature of the camera.
    Temperature,
    /// Place of the image in the block's order.
    Order,
    /// Row of the sensor.
    Row,
    /// Column of the sensor.
    Column,
    /// Distance from the middle of the sensor.
    Radius,
    /// Depth of the point in front of the camera.
    Depth,
    /// Speed of the platform.
    Speed,
    /// Heading of the platform.
    Heading,
    /// Height of the camera.
    CameraHeight,
    /// Height of the point.
    PointHeight,
    /// East of the point.
    East,
    /// North of the point.
    North,
}

/// Component of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Component {
    /// To the right in the image.
    X,
    /// Down in the image.
    Y,
    /// Away from the middle of the sensor.
    Radial,
    /// Across that, clockwise.
    Tangential,
    /// Along the motion of the platform.
    Along,
    /// Across that.
    Across,
}

impl Quantity {
    /// Every quantity, with name and unit.
    pub const ALL: [(Self, &'static str, &'static str); 13] = [
        (Self::Time, "time", "s"),
        (Self::Temperature, "temperature", "degrees Celsius"),
        (Self::Order, "image, in the order of the block", ""),
        (Self::Row, "row", "px"),
        (Self::Column, "column", "px"),
        (Self::Radius, "distance from the middle of the sensor", "px"),
        (Self::Depth, "depth in front of the camera", "m"),
        (Self::Speed, "speed", "m/s"),
        (Self::Heading, "heading, from north to east", "degrees"),
        (Self::CameraHeight, "height of the camera", "m"),
        (Self::PointHeight, "height of the point", "m"),
        (Self::East, "east", "m"),
        (Self::North, "north", "m"),
    ];

    /// Name and unit.
    pub fn about(self) -> (&'static str, &'static str) {
        Self::ALL.iter().find(|(quantity, ..)| *quantity == self).map_or(("", ""), |(_, name, unit)| (*name, *unit))
    }
}
