//! Cameras and surveyed points of a run as GeoJSON (RFC 7946), for maps: longitude and latitude in WGS84. Where the
//! coordinate system of the block is known; a local system has no place on the globe.

use super::pictures::RunFolder;
use crate::geodesy::crs::Crs;
use crate::geodesy::geographic::{Geographic, LocalSystem};
use crate::run::folder::{CAMERAS_GEOJSON, POINTS_GEOJSON, write_atomically};
use anyhow::{Context, Result};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::path::Path;

/// The system of a block.
enum Globe {
    Map(Crs),
    Local(LocalSystem),
}

impl Globe {
    fn of(crs: &str) -> Option<Self> {
        match LocalSystem::parse(crs) {
            Some(system) => Some(Self::Local(system)),
            None => Crs::parse(crs).ok().filter(Crs::is_projected).map(Self::Map),
        }
    }

    /// Longitude, latitude (degrees) and height; `None` outside the system.
    fn position(&self, at: [f64; 3]) -> Option<[f64; 3]> {
        let Geographic { latitude, longitude, height } = match self {
            Self::Map(crs) => crs.place(at).ok()?,
            Self::Local(system) => system.place(&Vector3::from(at)),
        };
        let position = [longitude, latitude, height];
        position.iter().all(|value| value.is_finite()).then_some(position)
    }
}

/// Writes both files; removes those of an older run where the coordinate system is not known.
///
/// # Errors
/// A file that cannot be written or removed.
pub(super) fn write(run: &RunFolder, dir: &Path) -> Result<()> {
    let globe = Globe::of(run.provenance.crs.as_deref().unwrap_or_default());
    for (name, features) in
        [(CAMERAS_GEOJSON, cameras(run, globe.as_ref())), (POINTS_GEOJSON, points(run, globe.as_ref()))]
    {
        let path = dir.join(name);
        match (features.is_empty(), path.exists()) {
            (false, _) => {
                let all = json!({ "type": "FeatureCollection", "features": features });
                write_atomically(&path, format!("{all}\n").as_bytes())?;
            }
            (true, true) => std::fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?,
            (true, false) => {}
        }
    }
    Ok(())
}

fn feature(position: [f64; 3], properties: Value) -> Value {
    json!({ "type": "Feature", "geometry": { "type": "Point", "coordinates": position }, "properties": properties })
}

fn cameras(run: &RunFolder, globe: Option<&Globe>) -> Vec<Value> {
    let one = |globe: &Globe| {
        let features = run.images.iter().filter_map(|image| {
            let properties = json!({
                "image": image.image, "flight": image.flight, "x": image.x, "y": image.y, "z": image.z,
                "sigma_cx": image.sigma_cx, "sigma_cy": image.sigma_cy, "sigma_cz": image.sigma_cz,
            });
            Some(feature(globe.position([image.x, image.y, image.z])?, properties))
        });
        features.collect()
    };
    globe.map(one).unwrap_or_default()
}

fn points(run: &RunFolder, globe: Option<&Globe>) -> Vec<Value> {
    let one = |globe: &Globe| {
        let features = run.checks.iter().filter_map(|row| {
            let properties = json!({
                "point": row.point, "role": row.role, "x": row.x, "y": row.y, "z": row.z,
                "dx_mm": 1e3 * row.dx, "dy_mm": 1e3 * row.dy, "dz_mm": 1e3 * row.dz,
                "d3_mm": 1e3 * row.dx.hypot(row.dy).hypot(row.dz),
                "images": row.images, "rms_px": row.rms_px,
            });
            Some(feature(globe.position([row.x, row.y, row.z])?, properties))
        });
        features.collect()
    };
    globe.map(one).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_where_the_system_has_them() {
        let utm = Globe::of("EPSG:32633").expect("a map");
        // On the central meridian of zone 33: 15 degrees east, at the equator.
        let [longitude, latitude, height] = utm.position([500_000.0, 0.0, 12.0]).expect("a place");
        assert!((longitude - 15.0).abs() < 1e-9 && latitude.abs() < 1e-9 && height == 12.0);
        let system = LocalSystem { origin: Geographic { latitude: 48.0, longitude: 16.0, height: 200.0 } };
        let local = Globe::of(&system.crs()).expect("a local system");
        let [longitude, latitude, height] = local.position([0.0, 0.0, 0.0]).expect("a place");
        assert!((longitude - 16.0).abs() < 1e-6 && (latitude - 48.0).abs() < 1e-6 && (height - 200.0).abs() < 0.01);
        assert!(Globe::of("local").is_none() && Globe::of("EPSG:4326").is_none());
    }
}
