//! What a map projection does to Cartesian coordinates at a place: its scale, and whether it is a map at all.

use super::crs::Crs;
use super::geographic::Geographic;
use map_3d::{Ellipsoid, geodetic2ecef};
use nalgebra::Vector3;

/// Length over which the scale is measured, m: short beside the Earth, long beside rounding.
const STEP_M: f64 = 100.0;

/// Scale less one of horizontal distances at a place (easting, northing, height, m): what the map draws over what a
/// tape measures at that height. The mean over the two directions of the map. `None` where the system is unknown, or no
/// projection in metres.
///
/// A projection draws the ellipsoid; what stands at height `h` above it is drawn smaller by `h / R`. So the scale has
/// both parts.
pub fn scale(crs: &str, [x, y, height]: [f64; 3]) -> Option<f64> {
    let crs = Crs::parse(crs).ok().filter(Crs::is_projected)?;
    let at = |x: f64, y: f64| crs.place([x, y, height]).ok().map(earth_centred);
    let length = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm();
    let east = length(at(x + STEP_M, y)?, at(x - STEP_M, y)?);
    let north = length(at(x, y + STEP_M)?, at(x, y - STEP_M)?);
    let drawn = 2.0 * STEP_M;
    Some(0.5 * (drawn / east + drawn / north) - 1.0).filter(|scale| scale.is_finite())
}

fn earth_centred(place: Geographic) -> Vector3<f64> {
    let Geographic { latitude, longitude, height } = place;
    let (x, y, z) = geodetic2ecef(latitude.to_radians(), longitude.to_radians(), height, Ellipsoid::WGS84);
    Vector3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_of_utm_on_its_central_meridian_and_at_a_height() {
        // 0.9996 by definition; the ellipsoid's mean radius of curvature at the equator, in the prime vertical and
        // the meridian, is 6357 km.
        let at_sea = scale("EPSG:32632", [500_000.0, 0.0, 0.0]).expect("UTM");
        assert!((at_sea + 4e-4).abs() < 1e-8, "{at_sea}");
        let above = scale("EPSG:32632", [500_000.0, 0.0, 1000.0]).expect("UTM");
        assert!((above - at_sea + 1000.0 / 6_357_000.0).abs() < 1e-6, "{above}");
    }

    #[test]
    fn local_systems_and_degrees_have_none() {
        for crs in ["local", "", "EPSG:4326", "unknown"] {
            assert_eq!(scale(crs, [0.0, 0.0, 0.0]), None, "{crs}");
        }
    }
}
