//! A scenario whose images are those of a mission.

use super::super::course::course;
use super::super::description::{Scenario, Terrain};
use super::super::image_sets::{Flight, Route};
use super::super::strips::strip_base;
use super::super::validate::MAX_TILT_DEG;
use super::{Given, Mission, MissionError, Place};
use crate::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::{Vector2, Vector3};

/// Part of an image on the ground that the terrain has at least: a single strip has no width.
const LEAST: f64 = 0.5;

impl Given {
    /// What a scenario says of the images along a line: its first flight's.
    pub fn of(scenario: &Scenario, ground_m: Option<f64>) -> Self {
        let base = |flight: &Flight| strip_base(scenario, flight).map(|base| base / flight.height_m);
        Self { ground_m, base_to_height: scenario.flights.first().and_then(base) }
    }
}

/// Puts the images of a mission in the place of the flights and rings of `base`, and a plain below them in the place of
/// its terrain. `scenario` is `base` with additions, which stay, or `base` itself. Gives also what people have to know.
///
/// # Errors
/// What the mission and the scenario leave open: the speed; a terrain that is no ground; images that look at none.
pub fn apply(
    file: &str,
    mission: &Mission,
    scenario: Scenario,
    base: &Scenario,
) -> Result<(Scenario, Vec<String>), MissionError> {
    let refuse = |problem: String| MissionError::new(file, Place::File, problem);
    let mut notes = mission.notes.clone();
    let (Terrain::Dike { margin_m, relief_m, wavelength_m, roughness_m, .. }
    | Terrain::Plain { margin_m, relief_m, wavelength_m, roughness_m, .. }) = scenario.terrain
    else {
        return Err(refuse("expected a scenario whose terrain is a plain or a dike".into()));
    };
    let first = base.flights.first();
    let speed_mps = match (mission.speed_mps, first) {
        (Some(speed), _) => speed,
        (None, Some(flight)) => {
            notes.push(format!("The mission says no speed: {} m/s, as `{}`.", flight.speed_mps, flight.name));
            flight.speed_mps
        }
        (None, None) => return Err(refuse("neither the mission nor a flight of the scenario says the speed".into())),
    };
    let mut exposures = local(mission, &mut notes).map_err(refuse)?;
    let [middle, size] = ground(&exposures);
    for own in &mut exposures {
        own[0] -= middle.x;
        own[1] -= middle.y;
    }
    let route = Route {
        name: mission.name.clone(),
        camera: first.and_then(|flight| flight.camera.clone()),
        speed_mps,
        exposure_s: first.and_then(|flight| flight.exposure_s),
        long_side: first.map(|flight| flight.long_side).unwrap_or_default(),
        crab_sigma_deg: first.map_or(0.0, |flight| flight.crab_sigma_deg),
        position_sigma_m: first.map_or(0.0, |flight| flight.position_sigma_m),
        attitude_sigma_deg: first.map_or(0.0, |flight| flight.attitude_sigma_deg),
        angular_rate_sigma_deg_s: first.and_then(|flight| flight.angular_rate_sigma_deg_s),
        exposures,
    };
    if route.camera.is_none() && base.cameras.len() > 1 {
        return Err(refuse("the scenario has several cameras: expected a first flight that names one".into()));
    }
    let least = LEAST * image_width(&scenario, &route);
    let [width_m, length_m] = [size.x.max(least), size.y.max(least)];
    notes.push(format!(
        "The ground is a plain of {length_m:.0} m (north) by {width_m:.0} m (east) where the images look, with a \
         margin of {margin_m} m."
    ));
    let mut flown = scenario;
    flown.name = mission.name.clone();
    flown.crs = "local".into();
    flown.terrain = Terrain::Plain { length_m, width_m, margin_m, relief_m, wavelength_m, roughness_m };
    // The mission replaces flights, rings and routes of the scenario; those that additions bring stay.
    flown.flights.drain(..base.flights.len().min(flown.flights.len()));
    flown.rings.retain(|ring| !base.rings.contains(ring));
    flown.routes.retain(|route| !base.routes.contains(route));
    flown.routes.insert(0, route);
    flown.validate().map_err(|error| refuse(error.to_string()))?;
    Ok((flown, notes))
}

/// Images as a route has them, about some place.
fn local(mission: &Mission, notes: &mut Vec<String>) -> Result<Vec<[f64; 5]>, String> {
    let place = |latitude: f64, longitude: f64| Geographic { latitude, longitude, height: 0.0 };
    let ground: Vec<_> = mission.exposures.iter().map(|own| place(own.latitude_deg, own.longitude_deg)).collect();
    let Some(system) = LocalSystem::about(&ground) else { return Err("the mission takes no image".into()) };
    let centres: Vec<Vector3<f64>> = ground
        .iter()
        .zip(&mission.exposures)
        .map(|(place, own)| {
            // The plain has no curvature, so heights stay above the ground.
            let east_north = system.local(place);
            Vector3::new(east_north.x, east_north.y, own.height_m)
        })
        .collect();
    let (mut by_path, mut nadir) = (0, 0);
    let mut exposures = Vec::with_capacity(centres.len());
    for ((own, centre), leg) in mission.exposures.iter().zip(&centres).zip(course(&centres)) {
        let number = exposures.len() + 1;
        let flown = || leg.direction.map(|step| step.x.atan2(step.y).to_degrees().rem_euclid(360.0));
        let heading = own.heading_deg.or_else(flown);
        let heading = heading.ok_or_else(|| format!("image {number}: expected a heading, or a path that gives it"))?;
        by_path += usize::from(own.follows_path);
        nadir += usize::from(own.tilt_deg.is_none());
        let tilt = own.tilt_deg.unwrap_or(0.0);
        if tilt.is_nan() || tilt.abs() > MAX_TILT_DEG {
            let pitches = format!("{} to {}", -90.0 - MAX_TILT_DEG, MAX_TILT_DEG - 90.0);
            return Err(format!("image {number}: pitch {:.1} degrees, expected {pitches}", tilt - 90.0));
        }
        if own.height_m.is_nan() || own.height_m <= 0.0 {
            return Err(format!("image {number}: {:.1} m above the ground, expected more than 0", own.height_m));
        }
        exposures.push([centre.x, centre.y, centre.z, heading, tilt]);
    }
    let all = exposures.len();
    if by_path > 0 {
        notes.push(format!("The mission says no heading of {by_path} of {all} images: that of the path."));
    }
    if nadir > 0 {
        notes.push(format!("The mission says no tilt of the camera in {nadir} of {all} images: straight down."));
    }
    Ok(exposures)
}

/// Middle and size (east, north, m) of where the principal rays meet the ground.
fn ground(exposures: &[[f64; 5]]) -> [Vector2<f64>; 2] {
    let mut range = [Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)];
    for [x, y, z, heading, tilt] in exposures {
        let (sin, cos) = heading.to_radians().sin_cos();
        let place = Vector2::new(*x, *y) + Vector2::new(sin, cos) * (z * tilt.to_radians().tan());
        range = [range[0].inf(&place), range[1].sup(&place)];
    }
    [(range[0] + range[1]) / 2.0, range[1] - range[0]]
}

/// The shorter side of an image on the ground, m, at the mean height.
fn image_width(scenario: &Scenario, route: &Route) -> f64 {
    let mean = route.exposures.iter().map(|[_, _, z, ..]| z).sum::<f64>() / route.exposures.len() as f64;
    let camera = scenario.camera_index(route.camera.as_deref()).and_then(|index| scenario.cameras.get(index));
    camera.map_or(0.0, |camera| f64::from(camera.width_px.min(camera.height_px)) / camera.f * mean)
}

#[cfg(test)]
mod tests {
    use super::super::Exposure;
    use super::*;
    use std::collections::BTreeMap;

    fn mission(exposures: Vec<Exposure>) -> Mission {
        Mission { name: "planned".into(), speed_mps: None, exposures, notes: vec!["a note".into()] }
    }

    /// An image `north` metres north of 48 degrees: a degree of latitude has 111.2 km there.
    fn image(north: f64, heading_deg: Option<f64>, tilt_deg: Option<f64>) -> Exposure {
        let latitude_deg = 48.0 + north / 111_200.0;
        Exposure { latitude_deg, longitude_deg: 7.0, height_m: 50.0, heading_deg, follows_path: true, tilt_deg }
    }

    fn dike() -> Scenario {
        Scenario::preset("dike", &BTreeMap::new()).unwrap()
    }

    #[test]
    fn the_images_of_a_mission_take_the_place_of_the_flights() {
        let images = (0..5).map(|k| image(10.0 * f64::from(k), None, None)).collect();
        let (flown, notes) = apply("m.plan", &mission(images), dike(), &dike()).unwrap();
        assert_eq!((flown.flights.len(), flown.rings.len(), flown.name.as_str()), (0, 0, "planned"));
        let [first, .., last] = flown.routes[0].exposures.as_slice() else { panic!("five images") };
        assert!((last[1] - 20.0).abs() < 0.1 && (first[1] + 20.0).abs() < 0.1, "{first:?} {last:?}");
        assert_eq!([first[2], first[3].round(), first[4]], [50.0, 0.0, 0.0]);
        let Terrain::Plain { length_m, width_m, relief_m, .. } = flown.terrain else { panic!("a plain") };
        // Half of 3840 px at 50 m with f = 5510 px: 17.4 m.
        assert!(
            (length_m - 40.0).abs() < 0.1 && (width_m - 17.4).abs() < 0.1 && relief_m == 0.4,
            "{length_m} {width_m}"
        );
        assert_eq!(notes[0], "a note");
        let told = notes.join(" ");
        assert!(
            told.contains("no heading of 5 of 5") && told.contains("no tilt") && told.contains("no speed: 5 m/s"),
            "{told}"
        );
    }

    #[test]
    fn the_ground_lies_where_tilted_images_look() {
        let images = vec![image(0.0, Some(90.0), Some(45.0)), image(10.0, Some(90.0), Some(45.0))];
        let (flown, _) = apply("m.plan", &mission(images), dike(), &dike()).unwrap();
        // The rays meet the ground 50 m to the east, in the middle of the terrain.
        assert!(flown.routes[0].exposures.iter().all(|own| (own[0] + 50.0).abs() < 1e-6), "{:?}", flown.routes);
    }

    #[test]
    fn additions_follow_the_mission() {
        let mut with = dike();
        let extra = Flight { name: "extra".into(), ..with.flights[0].clone() };
        with.flights.push(extra);
        let (flown, _) = apply("m.plan", &mission(vec![image(0.0, Some(0.0), None)]), with, &dike()).unwrap();
        assert_eq!(flown.image_sets().collect::<Vec<_>>(), ["planned", "extra"]);
    }

    #[test]
    fn what_a_scenario_cannot_give_is_refused() {
        let error = |exposure: Exposure, scenario: &str| {
            let scenario = Scenario::preset(scenario, &BTreeMap::new()).unwrap();
            apply("m.plan", &mission(vec![exposure]), scenario.clone(), &scenario).unwrap_err().to_string()
        };
        let fine = image(0.0, Some(0.0), None);
        assert!(error(fine, "closerange").contains("terrain is a plain or a dike"));
        assert!(
            error(Exposure { heading_deg: None, ..fine }, "dike").starts_with("m.plan: image 1: expected a heading")
        );
        assert!(error(Exposure { height_m: -2.0, ..fine }, "dike").contains("-2.0 m above the ground"));
        let level = error(Exposure { tilt_deg: Some(80.0), ..fine }, "dike");
        assert!(level.contains("pitch -10.0 degrees, expected -150 to -30"), "{level}");
    }
}
