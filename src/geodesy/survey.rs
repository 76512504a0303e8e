//! Coordinates of a block in the system in which its survey came, where that is another one: east, north, up of a local
//! system back in the map that the surveyor works in.

use super::crs::Crs;
use super::geographic::{Geographic, LocalSystem};
use nalgebra::Vector3;

/// From the system of a block to that of its survey.
pub struct SurveySystem {
    from: From,
    to: Crs,
}

enum From {
    Local(LocalSystem),
    Map(Crs),
}

impl SurveySystem {
    /// `None` where the survey came in the system of the block, in no map, or where one of the two is not known here.
    pub fn of(block: &str, survey: &str) -> Option<Self> {
        if survey.is_empty() || survey == block {
            return None;
        }
        let to = Crs::parse(survey).ok().filter(Crs::is_projected)?;
        let from = match LocalSystem::parse(block) {
            Some(system) => From::Local(system),
            None => From::Map(Crs::parse(block).ok().filter(Crs::is_projected)?),
        };
        Some(Self { from, to })
    }

    /// Easting, northing and height (m) of coordinates of the block; `None` where the survey's system has no such
    /// place.
    pub fn coordinates(&self, at: &Vector3<f64>) -> Option<[f64; 3]> {
        let place: Geographic = match &self.from {
            From::Local(system) => system.place(at),
            From::Map(crs) => crs.place((*at).into()).ok()?,
        };
        self.to.coordinates(&place).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_come_back_as_they_were_surveyed() {
        let surveyed = [601_234.567, 5_345_678.901, 312.25];
        let utm = Crs::parse("EPSG:32633").expect("a map");
        let place = utm.place(surveyed).expect("a place");
        let local =
            LocalSystem::about(&[Geographic { latitude: 48.25, longitude: 16.37, height: 0.0 }]).expect("a place");
        let system = SurveySystem::of(&local.crs(), "EPSG:32633").expect("two systems");
        let back = system.coordinates(&local.local(&place)).expect("coordinates");
        for (was, is) in surveyed.iter().zip(back) {
            assert!((was - is).abs() < 1e-4, "{surveyed:?} {back:?}");
        }
    }

    #[test]
    fn one_system_needs_no_second_coordinates() {
        for (block, survey) in
            [("EPSG:32633", "EPSG:32633"), ("EPSG:32633", ""), ("local", "EPSG:32633"), ("EPSG:32633", "EPSG:4326")]
        {
            assert!(SurveySystem::of(block, survey).is_none(), "{block} {survey}");
        }
        assert!(SurveySystem::of("EPSG:32632", "EPSG:32633").is_some());
    }
}
