//! Coordinates as they would be if latitude and longitude had been exchanged before somebody converted them.

use super::crs::Crs;
use super::geographic::{Geographic, LocalSystem};
use nalgebra::Vector3;

/// The coordinates (m) of the place with latitude and longitude exchanged, in the same system. `None` where the system
/// has no latitude and longitude that are known here, and where the exchanged ones are no place in it.
pub fn exchanged(crs: &str, coordinates: &Vector3<f64>) -> Option<Vector3<f64>> {
    let found = match LocalSystem::parse(crs) {
        Some(system) => system.local(&turned(&system.place(coordinates))?),
        None => {
            let crs = Crs::parse(crs).ok().filter(Crs::is_projected)?;
            crs.coordinates(&turned(&crs.place((*coordinates).into()).ok()?)?).ok()?.into()
        }
    };
    found.iter().all(|value| value.is_finite()).then_some(found)
}

/// The place with its two angles exchanged; a longitude beyond 90 degrees is no latitude.
fn turned(place: &Geographic) -> Option<Geographic> {
    let Geographic { latitude, longitude, height } = *place;
    let is_place = longitude.abs() <= 90.0 && latitude.is_finite();
    is_place.then_some(Geographic { latitude: longitude, longitude: latitude, height })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exchanged_twice_is_the_place_itself() {
        let system = LocalSystem { origin: Geographic { latitude: 52.5, longitude: 13.4, height: 0.0 } };
        let place = Geographic { latitude: 52.519, longitude: 13.401, height: 34.0 };
        let wrong = system.local(&Geographic { latitude: place.longitude, longitude: place.latitude, ..place });
        assert!(wrong.norm() > 1e6, "{wrong}");
        let right = exchanged(&system.crs(), &wrong).expect("a place");
        assert!((right - system.local(&place)).norm() < 1e-3, "{right}");
        let back = exchanged(&system.crs(), &right).expect("a place");
        assert!((back - wrong).norm() < 1e-2, "{back}");
    }

    #[test]
    fn systems_without_a_place_have_none() {
        assert_eq!(exchanged("local", &Vector3::zeros()), None);
        let west = LocalSystem { origin: Geographic { latitude: 40.0, longitude: -120.0, height: 0.0 } };
        assert_eq!(exchanged(&west.crs(), &Vector3::zeros()), None);
    }
}
