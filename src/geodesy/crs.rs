//! Coordinate systems by the names that programs give them, taken to latitude, longitude and height.
//!
//! Heights go through as they are: no program says in its files which geoid, if any, they stand on.

use super::geographic::Geographic;
use proj4rs::Proj;
use proj4rs::transform::transform;

/// A system of longitude and latitude, or a projected one.
pub struct Crs {
    /// Boxed: it is large beside what stands with it in enums.
    proj: Box<Proj>,
}

impl Crs {
    /// `WGS84`, `WGS84 UTM 32N`, `EPSG:n`, `+proj=...`, or WKT that has an EPSG code.
    ///
    /// # Errors
    /// What was expected, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let known = if text.starts_with('+') {
            Proj::from_proj_string(text).ok()
        } else if let Some(code) = epsg(text) {
            Proj::from_epsg_code(code).ok()
        } else {
            let is_utm = |zone: &str| zone.parse().is_ok_and(|zone: u32| (1..=60).contains(&zone));
            let south = |letter: &str| if letter == "S" { " +south" } else { "" };
            let words = text.to_uppercase();
            match words.split_whitespace().collect::<Vec<_>>()[..] {
                ["WGS84"] => Proj::from_proj_string("+proj=longlat +datum=WGS84").ok(),
                ["WGS84", "UTM", zone] if zone.is_ascii() && !zone.is_empty() => {
                    let (number, letter) = zone.split_at(zone.len() - 1);
                    let utm = format!("+proj=utm +zone={number}{} +datum=WGS84 +units=m", south(letter));
                    (is_utm(number) && matches!(letter, "N" | "S")).then(|| Proj::from_proj_string(&utm).ok()).flatten()
                }
                _ => None,
            }
        };
        known.map(|proj| Self { proj: Box::new(proj) }).ok_or_else(|| {
            format!("expected WGS84, WGS84 UTM 32N, EPSG:n or +proj=..., as this program knows them, found {text:?}")
        })
    }

    /// Is it a map in metres?
    pub fn is_projected(&self) -> bool {
        !self.proj.is_latlong() && !self.proj.is_geocent()
    }

    /// Are its coordinates longitude and latitude?
    pub fn is_geographic(&self) -> bool {
        self.proj.is_latlong()
    }

    /// The place of easting, northing and height, or of longitude, latitude (degrees) and height.
    ///
    /// # Errors
    /// Coordinates that the system does not have.
    pub fn place(&self, [x, y, height]: [f64; 3]) -> Result<Geographic, String> {
        let outside = || format!("the coordinate system has no place {x}, {y}");
        let mut point = (x, y, height);
        if self.proj.is_latlong() {
            if x.abs() > 360.0 || y.abs() > 90.0 {
                return Err(outside());
            }
            point = (x.to_radians(), y.to_radians(), height);
        }
        let geographic = Proj::from_proj_string("+proj=longlat +datum=WGS84").map_err(|error| error.to_string())?;
        transform(&self.proj, &geographic, &mut point).map_err(|_| outside())?;
        let (longitude, latitude, height) = (point.0.to_degrees(), point.1.to_degrees(), point.2);
        match [longitude, latitude, height].iter().all(|value| value.is_finite()) {
            // A point may lie at 0, 0; who reads what receivers recorded asks before.
            true => Ok(Geographic::checked(latitude, normal(longitude), height)?.unwrap_or(Geographic {
                latitude,
                longitude,
                height,
            })),
            false => Err(outside()),
        }
    }

    /// Easting, northing and height of a place, m.
    ///
    /// # Errors
    /// A system of degrees, in which no block is; a place that the system does not have.
    pub fn coordinates(&self, place: &Geographic) -> Result<[f64; 3], String> {
        if self.proj.is_latlong() {
            return Err("a block is in metres, not in degrees".into());
        }
        let geographic = Proj::from_proj_string("+proj=longlat +datum=WGS84").map_err(|error| error.to_string())?;
        let mut point = (place.longitude.to_radians(), place.latitude.to_radians(), place.height);
        transform(&geographic, &self.proj, &mut point).map_err(|error| error.to_string())?;
        let coordinates = [point.0, point.1, point.2];
        match coordinates.iter().all(|value| value.is_finite()) {
            true => Ok(coordinates),
            false => Err(format!(
                "latitude {}, longitude {} are not in the coordinate system",
                place.latitude, place.longitude
            )),
        }
    }
}

/// Between -180 and 180 degrees.
fn normal(longitude: f64) -> f64 {
    match longitude.abs() <= 180.0 {
        true => longitude,
        false => (longitude + 540.0).rem_euclid(360.0) - 180.0,
    }
}

/// The code of `EPSG:n`, or of the outermost horizontal system in WKT.
fn epsg(text: &str) -> Option<u16> {
    if let Some((_, code)) = text.split_once(':').filter(|(name, _)| name.eq_ignore_ascii_case("EPSG")) {
        return code.trim().parse().ok();
    }
    let start = ["PROJCS[", "GEOGCS["].iter().find_map(|name| text.find(name))?;
    let mut depth = 0;
    for (place, character) in text[start..].char_indices() {
        match character {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ => {}
        }
        let here = &text[start + place..];
        // Deeper ones are codes of the datum, the ellipsoid, the unit.
        if depth == 1
            && let Some(rest) = here.strip_prefix("AUTHORITY[\"EPSG\",\"")
        {
            return rest.split('"').next()?.parse().ok();
        }
        if depth == 0 && character == ']' {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A place that was converted by PROJ: Berlin, 52.518963 N 13.400377 E.
    const PLACE: [f64; 2] = [52.518_963, 13.400_377];

    #[test]
    fn the_same_place_in_every_spelling() {
        let wkt = r#"PROJCS["WGS 84 / UTM zone 33N",GEOGCS["WGS 84",DATUM["W",SPHEROID["W",6378137,298.257223563,AUTHORITY["EPSG","7030"]]],AUTHORITY["EPSG","4326"]],UNIT["metre",1,AUTHORITY["EPSG","9001"]],AUTHORITY["EPSG","32633"]]"#;
        // By the series of Krueger for zone 33 (central meridian 15 degrees), m.
        let utm = utm_of(PLACE[0], PLACE[1], 15.0);
        for text in ["WGS84 UTM 33N", "epsg:32633", "+proj=utm +zone=33 +datum=WGS84", wkt] {
            let place = Crs::parse(text).unwrap().place([utm[0], utm[1], 34.0]).unwrap();
            assert!((place.latitude - PLACE[0]).abs() < 1e-8, "{text}: {place:?}");
            assert!((place.longitude - PLACE[1]).abs() < 1e-8, "{text}: {place:?}");
            assert_eq!(place.height, 34.0);
            let back = Crs::parse(text).unwrap().coordinates(&place).unwrap();
            assert!((back[0] - utm[0]).hypot(back[1] - utm[1]) < 1e-3, "{text}: {back:?}");
        }
        let place = Crs::parse("WGS84").unwrap().place([PLACE[1], PLACE[0], 0.0]).unwrap();
        assert!((place.latitude - PLACE[0]).abs() < 1e-12, "{place:?}");
    }

    /// Transverse Mercator on WGS84 by the series of Krueger to third order in n, good to a tenth of a millimetre.
    fn utm_of(latitude: f64, longitude: f64, meridian: f64) -> [f64; 2] {
        let (a, f): (f64, f64) = (6_378_137.0, 1.0 / 298.257_223_563);
        let n = f / (2.0 - f);
        let radius = a / (1.0 + n) * (1.0 + n.powi(2) / 4.0 + n.powi(4) / 64.0);
        let alpha = [
            n / 2.0 - 2.0 * n.powi(2) / 3.0 + 5.0 * n.powi(3) / 16.0,
            13.0 * n.powi(2) / 48.0 - 3.0 * n.powi(3) / 5.0,
            61.0 * n.powi(3) / 240.0,
        ];
        let (phi, lambda) = (latitude.to_radians(), (longitude - meridian).to_radians());
        let e = 2.0 * n.sqrt() / (1.0 + n);
        let t = (phi.sin().atanh() - e * (e * phi.sin()).atanh()).sinh();
        let xi = t.atan2(lambda.cos());
        let eta = (lambda.sin() / t.hypot(lambda.cos())).asinh();
        let (mut north, mut east) = (xi, eta);
        for (k, alpha) in alpha.iter().enumerate() {
            let order = 2.0 * (k + 1) as f64;
            north += alpha * (order * xi).sin() * (order * eta).cosh();
            east += alpha * (order * xi).cos() * (order * eta).sinh();
        }
        [500_000.0 + 0.9996 * radius * east, 0.9996 * radius * north]
    }

    #[test]
    fn what_is_not_understood_is_refused() {
        for text in ["", "WGS84 UTM 61N", "WGS84 UTM 3", "EPSG:1", "LOCAL_CS[\"x\"]", "WGS84 UTM é"] {
            assert!(Crs::parse(text).is_err(), "{text}");
        }
        assert!(Crs::parse("WGS84").unwrap().place([500_000.0, 5_000_000.0, 0.0]).is_err());
    }
}
