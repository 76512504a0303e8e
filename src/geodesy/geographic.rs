//! Geographic coordinates in a local system: east, north, up at a point of the WGS84 ellipsoid.
//!
//! A block is Cartesian; latitude, longitude and ellipsoidal height go through the Earth-centred system, so that
//! nothing is flattened.

use map_3d::{Ellipsoid, ecef2enu, ecef2geodetic, geodetic2ecef, geodetic2enu};
use nalgebra::{Matrix3, Vector3};

/// Decimals, in degrees, of the place of a local system: about ten metres, so that it can be written down.
const DECIMALS: f64 = 1e4;

/// Heights above the ellipsoid that a camera or a point can have, m: from below the deepest sea to above any balloon.
const HEIGHTS_M: std::ops::RangeInclusive<f64> = -12_000.0..=100_000.0;
/// Largest standard deviation of a position, m: what is known no better is not known.
const LARGEST_SIGMA_M: f64 = 10_000.0;

/// A standard deviation that a file states; zero says that it is not known.
///
/// # Errors
/// What was expected: a negative one, or one that no position has.
pub fn stated_sigma(sigma: f64) -> Result<Option<f64>, String> {
    match (0.0..=LARGEST_SIGMA_M).contains(&sigma) {
        true => Ok((sigma > 0.0).then_some(sigma)),
        false => Err(format!("expected a standard deviation of 0 to {LARGEST_SIGMA_M} m, found {sigma:?}")),
    }
}

/// A place on or above the WGS84 ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geographic {
    /// Degrees, north.
    pub latitude: f64,
    /// Degrees, east.
    pub longitude: f64,
    /// Above the ellipsoid, m.
    pub height: f64,
}

impl Geographic {
    /// The place that a file states; `None` for 0, 0, which receivers and programs write where they know none.
    ///
    /// # Errors
    /// What was expected: numbers that are no latitude, longitude or height.
    pub fn checked(latitude: f64, longitude: f64, height: f64) -> Result<Option<Self>, String> {
        let is_place = latitude.abs() <= 90.0 && longitude.abs() <= 180.0 && HEIGHTS_M.contains(&height);
        match is_place {
            true if latitude == 0.0 && longitude == 0.0 => Ok(None),
            true => Ok(Some(Self { latitude, longitude, height })),
            false => Err(format!(
                "expected a latitude within ±90 degrees, a longitude within ±180 degrees, a height of {} to {} m, \
                 found {latitude:?}, {longitude:?}, {height:?}",
                HEIGHTS_M.start(),
                HEIGHTS_M.end()
            )),
        }
    }

    /// The place of Earth-centred coordinates, m.
    pub fn of_earth_centred(point: &Vector3<f64>) -> Self {
        let (latitude, longitude, height) = ecef2geodetic(point.x, point.y, point.z, Ellipsoid::WGS84);
        Self { latitude: latitude.to_degrees(), longitude: longitude.to_degrees(), height }
    }
}

/// East, north, up (m) at a place. Its height is zero where the system is made from places ([`LocalSystem::about`]):
/// heights above the ellipsoid stay what they are, but for the curvature (8 mm at 300 m from the place).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalSystem {
    /// The zero.
    pub origin: Geographic,
}

impl LocalSystem {
    /// About the mean of places, on the ellipsoid; `None` of none.
    pub fn about(places: &[Geographic]) -> Option<Self> {
        let first = places.first()?;
        let count = places.len() as f64;
        let latitude = places.iter().map(|place| place.latitude).sum::<f64>() / count;
        // By way of differences: a block may lie on both sides of the date line.
        let eastward = |place: &Geographic| (place.longitude - first.longitude + 540.0).rem_euclid(360.0) - 180.0;
        let longitude = first.longitude + places.iter().map(eastward).sum::<f64>() / count;
        let round = |degrees: f64| (degrees * DECIMALS).round() / DECIMALS;
        Some(Self { origin: Geographic { latitude: round(latitude), longitude: round(longitude), height: 0.0 } })
    }

    /// East, north, up of a place, m.
    pub fn local(&self, place: &Geographic) -> Vector3<f64> {
        let Geographic { latitude, longitude, height } = self.origin;
        let (east, north, up) = geodetic2enu(
            place.latitude.to_radians(),
            place.longitude.to_radians(),
            place.height,
            latitude.to_radians(),
            longitude.to_radians(),
            height,
            Ellipsoid::WGS84,
        );
        Vector3::new(east, north, up)
    }

    /// The place of east, north, up, m.
    pub fn place(&self, local: &Vector3<f64>) -> Geographic {
        let Geographic { latitude, longitude, height } = self.origin;
        let (x, y, z) = geodetic2ecef(latitude.to_radians(), longitude.to_radians(), height, Ellipsoid::WGS84);
        let from_origin = self.from_earth_centred_axes().transpose() * local;
        Geographic::of_earth_centred(&(Vector3::new(x, y, z) + from_origin))
    }

    /// East, north, up of Earth-centred coordinates, m.
    pub fn of_earth_centred(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let Geographic { latitude, longitude, height } = self.origin;
        let (latitude, longitude) = (latitude.to_radians(), longitude.to_radians());
        let (east, north, up) = ecef2enu(point.x, point.y, point.z, latitude, longitude, height, Ellipsoid::WGS84);
        Vector3::new(east, north, up)
    }

    /// The rotation from Earth-centred axes to east, north, up.
    pub fn from_earth_centred_axes(&self) -> Matrix3<f64> {
        let (latitude, longitude) = (self.origin.latitude.to_radians(), self.origin.longitude.to_radians());
        let ((sin_b, cos_b), (sin_l, cos_l)) = (latitude.sin_cos(), longitude.sin_cos());
        Matrix3::new(-sin_l, cos_l, 0.0, -sin_b * cos_l, -sin_b * sin_l, cos_b, cos_b * cos_l, cos_b * sin_l, sin_b)
    }

    /// The system of a block's `crs`, where [`Self::crs`] wrote it.
    pub fn parse(crs: &str) -> Option<Self> {
        let numbers = crs.strip_prefix("local east, north, up at latitude ")?.strip_suffix(" m (WGS84)")?;
        let (latitude, rest) = numbers.split_once(", longitude ")?;
        let (longitude, height) = rest.split_once(", height ")?;
        let number = |text: &str| text.parse().ok().filter(|value: &f64| value.is_finite());
        let [latitude, longitude, height] = [number(latitude)?, number(longitude)?, number(height)?];
        Some(Self { origin: Geographic { latitude, longitude, height } })
    }

    /// As the `crs` of a block.
    pub fn crs(&self) -> String {
        let Geographic { latitude, longitude, height } = self.origin;
        format!("local east, north, up at latitude {latitude}, longitude {longitude}, height {height} m (WGS84)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_degree_is_as_long_as_on_the_ellipsoid() {
        // Published lengths of an arc of one degree at 45 degrees: 111 131.8 m of a meridian, 78 846.8 m of a parallel.
        let origin = Geographic { latitude: 45.0, longitude: 7.0, height: 0.0 };
        let system = LocalSystem { origin };
        let step = 1e-3;
        let north = system.local(&Geographic { latitude: origin.latitude + step, ..origin });
        let east = system.local(&Geographic { longitude: origin.longitude + step, ..origin });
        assert!((north.y / step - 111_131.8).abs() < 1.0 && north.x.abs() < 1e-6, "{north}");
        assert!((east.x / step - 78_846.8).abs() < 1.0, "{east}");
        assert_eq!(system.local(&origin).map(|c| (c * 1e6).round()), Vector3::zeros());
        let above = system.local(&Geographic { height: 120.0, ..origin });
        assert!((above - Vector3::new(0.0, 0.0, 120.0)).norm() < 1e-6, "{above}");
    }

    #[test]
    fn what_is_no_place_and_no_standard_deviation_is_told() {
        assert_eq!(Geographic::checked(0.0, 0.0, 5.0), Ok(None));
        assert!(Geographic::checked(0.0, 7.0, 5.0).unwrap().is_some());
        for [latitude, longitude, height] in
            [[95.0, 0.0, 0.0], [200.0, 7.0, 0.0], [48.0, 181.0, 0.0], [48.0, 7.0, 1e300], [f64::NAN, 7.0, 0.0]]
        {
            assert!(Geographic::checked(latitude, longitude, height).is_err(), "{latitude} {longitude} {height}");
        }
        assert_eq!([stated_sigma(0.0), stated_sigma(0.5)], [Ok(None), Ok(Some(0.5))]);
        for sigma in [-1.0, 1e300, f64::NAN] {
            assert!(stated_sigma(sigma).is_err(), "{sigma}");
        }
    }

    #[test]
    fn earth_centred_coordinates_are_the_same_places() {
        let system = LocalSystem { origin: Geographic { latitude: 48.0, longitude: 2.0, height: 100.0 } };
        let place = Geographic { latitude: 48.003, longitude: 1.998, height: 250.0 };
        let (x, y, z) = map_3d::geodetic2ecef(48.003f64.to_radians(), 1.998f64.to_radians(), 250.0, Ellipsoid::WGS84);
        let point = Vector3::new(x, y, z);
        let back = Geographic::of_earth_centred(&point);
        assert!((back.latitude - place.latitude).abs() < 1e-11 && (back.height - 250.0).abs() < 1e-6, "{back:?}");
        assert!((system.of_earth_centred(&point) - system.local(&place)).norm() < 1e-6);
        assert_eq!(LocalSystem::parse(&system.crs()), Some(system));
        assert_eq!(LocalSystem::parse("local"), None);
        let step = Vector3::new(10.0, -20.0, 5.0);
        let moved = system.of_earth_centred(&(point + step)) - system.of_earth_centred(&point);
        assert!((system.from_earth_centred_axes() * step - moved).norm() < 1e-6);
    }

    #[test]
    fn the_horizon_falls_with_the_square_of_the_distance() {
        let origin = Geographic { latitude: -33.0, longitude: 179.999, height: 0.0 };
        let place = Geographic { longitude: -179.991, ..origin };
        let system = LocalSystem { origin };
        let local = system.local(&place);
        // s^2 / 2R, R about 6 380 km.
        let fall = local.x * local.x / (2.0 * 6.38e6);
        assert!(local.x > 900.0 && (local.z + fall).abs() < 0.01 * fall, "{local}");
        let about = LocalSystem::about(&[origin, place]).unwrap().origin;
        assert!((about.longitude - 180.004).abs() < 1e-9, "{about:?}");
    }
}
