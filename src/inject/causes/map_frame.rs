//! What `earth-curvature` and `map-scale` share: the coordinates of a survey that are given in a map.

use super::*;
use nalgebra::Vector3;

/// The option that says which coordinates are of the map.
pub(super) const COORDINATES: super::super::ParameterSpec = parameter(
    "in",
    "",
    DefaultValue::Choice("both", &["both", "control", "gnss"]),
    "coordinates given in the map: of control and check points, of antennas, or both where the block has them",
);

/// Which coordinates are of the map.
pub(super) struct Coordinates {
    surveyed: bool,
    antennas: bool,
}

impl Coordinates {
    /// As the option `in` says.
    ///
    /// # Errors
    /// A block without such coordinates.
    pub fn of(setting: &Setting) -> Result<Self> {
        let (word, world) = (setting.values.word("in"), setting.world);
        let coordinates = Self { surveyed: word != "gnss", antennas: word != "control" };
        match word {
            "gnss" => world.need_gnss()?,
            "control" => ensure!(!world.surveyed.is_empty(), "the block has no surveyed points"),
            _ => ensure!(
                !world.surveyed.is_empty() || world.need_gnss().is_ok(),
                "the block has neither surveyed points nor GNSS positions"
            ),
        }
        Ok(coordinates)
    }

    /// Draws what is of the map there.
    pub fn draw(&self, observations: &mut Observations, map: impl Fn(Vector3<f64>) -> Vector3<f64>) {
        if self.surveyed {
            observations.surveyed.iter_mut().for_each(|position| *position = map(*position));
        }
        if self.antennas {
            observations.antennas.iter_mut().flatten().for_each(|position| *position = map(*position));
        }
    }
}

/// Where the map touches: the mean of the surveyed points, control and check alike; without any, of the antennas.
pub(super) fn middle(world: &World) -> Vector3<f64> {
    let surveyed = world.surveyed.iter().map(|point| point.position);
    let antennas = world.images.iter().filter_map(|image| image.gnss).map(|gnss| gnss.position);
    mean(surveyed).or_else(|| mean(antennas)).unwrap_or_else(Vector3::zeros)
}

fn mean(points: impl Iterator<Item = Vector3<f64>>) -> Option<Vector3<f64>> {
    let (sum, count) = points.fold((Vector3::zeros(), 0.0), |(sum, count), point| (sum + point, count + 1.0));
    (count > 0.0).then(|| sum / count)
}
