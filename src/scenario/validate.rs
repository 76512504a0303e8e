//! What the values of a scenario may be.

use super::description::{Detection, Scenario, Surveyed, Temperature, Terrain};
use super::image_sets::{Flight, Ring, Route};
use super::simulate::MIN_MARKS;
use super::strips::{image_count, strip_count};
use super::{Result, ScenarioError};
use crate::camera::{Camera, undistort::monotonic_radius};
use std::collections::HashSet;
use std::fmt::Debug;

/// Limits far beyond any real block: a slip of the pen ends in a message, not in a machine without memory.
const MAX_IMAGES: f64 = 1e6;
/// Beyond, the ground is far away and seen at a flat angle.
pub(super) const MAX_TILT_DEG: f64 = 60.0;
const MAX_TIES: usize = 100_000_000;
const MAX_CHECKS: usize = 10_000_000;
/// The choice of well distributed points takes time with the square of their number.
const MAX_CONTROL: usize = 10_000;

impl Scenario {
    /// Refuses values that no simulation can use, by name.
    pub(super) fn validate(&self) -> Result<()> {
        let check = Check(&self.name);
        check.that(!self.name.is_empty(), "name", &self.name, "a name")?;
        self.validate_sigma(&check)?;
        self.validate_cameras(&check)?;
        self.validate_terrain(&check)?;
        let names: Vec<_> = self.image_sets().collect();
        check.that(!names.is_empty(), "flight", "none", "at least one [[flight]], [[ring]] or [[route]]")?;
        check.unique("flight.name", &names)?;
        for (index, route) in self.routes.iter().enumerate() {
            self.validate_route(&check, &format!("route.{index}"), route)?;
        }
        for (index, flight) in self.flights.iter().enumerate() {
            self.validate_flight(&check, &format!("flight.{index}"), flight)?;
        }
        for (index, ring) in self.rings.iter().enumerate() {
            self.validate_ring(&check, &format!("ring.{index}"), ring)?;
        }
        check.at_least_zero("pause_s", self.pause_s)?;
        match (self.ties.count, self.ties.per_m2) {
            (Some(_), None) => {}
            (None, Some(density)) => check.positive("ties.per_m2", density)?,
            both => check.that(false, "ties.count, ties.per_m2", &both, "one of the two")?,
        }
        let count = self.tie_count();
        check.that((1..=MAX_TIES).contains(&count), "number of tie points", &count, "1 to 100 million")?;
        let Detection { best, decay } = self.ties.detection;
        check.that(best > 0.0 && best <= 1.0, "ties.detection.best", &best, "more than 0, at most 1")?;
        check.at_least_zero("ties.detection.decay", decay)?;
        let Surveyed { control, check: checks } = &self.surveyed;
        for (key, points, limit) in [("control", control, MAX_CONTROL), ("check", checks, MAX_CHECKS)] {
            let (count, marks) = (points.count, points.max_marks);
            check.that(count <= limit, &format!("surveyed.{key}.count"), &count, &format!("at most {limit}"))?;
            let enough = marks.is_none_or(|marks| marks >= MIN_MARKS);
            let expected = format!("at least {MIN_MARKS}");
            check.that(enough, &format!("surveyed.{key}.max_marks"), &marks, &expected)?;
        }
        if let Some(Temperature { start_c, rise_k, time_constant_s }) = self.temperature {
            check.that(start_c.is_finite(), "temperature.start_c", &start_c, "a number")?;
            check.that(rise_k.is_finite(), "temperature.rise_k", &rise_k, "a number")?;
            check.positive("temperature.time_constant_s", time_constant_s)?;
        }
        if let Some(gnss) = self.gnss {
            for (key, sigma) in [("gnss.sigma_xy_m", gnss.sigma_xy_m), ("gnss.sigma_z_m", gnss.sigma_z_m)] {
                sigma.map_or(Ok(()), |sigma| check.positive(key, sigma))?;
            }
        }
        Ok(())
    }

    fn validate_sigma(&self, check: &Check) -> Result<()> {
        let s = self.sigma;
        check.positive("sigma.tie_px", s.tie_px)?;
        check.positive("sigma.mark_px", s.mark_px)?;
        check.positive("sigma.control_xy_m", s.control_xy_m)?;
        check.positive("sigma.control_z_m", s.control_z_m)?;
        check.positive("sigma.gnss_xy_m", s.gnss_xy_m)?;
        check.positive("sigma.gnss_z_m", s.gnss_z_m)
    }

    fn validate_cameras(&self, check: &Check) -> Result<()> {
        check.that(!self.cameras.is_empty(), "camera", "none", "at least one [[camera]]")?;
        check.unique("camera.id", &self.cameras.iter().map(|camera| &camera.id).collect::<Vec<_>>())?;
        for (index, model) in self.cameras.iter().enumerate() {
            let key = |name: &str| format!("camera.{index}.{name}");
            let camera = Camera::from(model);
            check.that(model.width_px >= 16, &key("width_px"), &model.width_px, "at least 16")?;
            check.that(model.height_px >= 16, &key("height_px"), &model.height_px, "at least 16")?;
            check.positive(&key("f"), model.f)?;
            for (name, value) in crate::camera::PARAMETERS.iter().zip(camera.interior) {
                check.that(value.is_finite(), &key(name), &value, "a number")?;
            }
            let radius = monotonic_radius(&camera.interior, camera.half_diagonal_px());
            check.that(radius > 0.0, &key("b1, b2"), &(model.b1, model.b2), "a camera that does not fold the image")?;
        }
        Ok(())
    }

    fn validate_terrain(&self, check: &Check) -> Result<()> {
        let [length, width, margin] = self.terrain.extent();
        check.positive("terrain.length_m", length)?;
        check.positive("terrain.width_m", width)?;
        check.at_least_zero("terrain.margin_m", margin)?;
        match self.terrain {
            Terrain::Dike { crest_width_m, crest_height_m, slope_run, relief_m, wavelength_m, roughness_m, .. } => {
                check.at_least_zero("terrain.dike.crest_width_m", crest_width_m)?;
                check.at_least_zero("terrain.dike.crest_height_m", crest_height_m)?;
                check.positive("terrain.dike.slope_run", slope_run)?;
                check.at_least_zero("terrain.dike.relief_m", relief_m)?;
                check.positive("terrain.dike.wavelength_m", wavelength_m)?;
                check.at_least_zero("terrain.dike.roughness_m", roughness_m)
            }
            Terrain::Plain { relief_m, wavelength_m, roughness_m, .. } => {
                check.at_least_zero("terrain.plain.relief_m", relief_m)?;
                check.positive("terrain.plain.wavelength_m", wavelength_m)?;
                check.at_least_zero("terrain.plain.roughness_m", roughness_m)
            }
            Terrain::Targets { height_m, .. } => check.at_least_zero("terrain.targets.height_m", height_m),
        }
    }

    fn validate_flight(&self, check: &Check, path: &str, flight: &Flight) -> Result<()> {
        let key = |name: &str| format!("{path}.{name}");
        self.validate_camera_of(check, &key("camera"), flight.camera.as_deref())?;
        check.positive(&key("height_m"), flight.height_m)?;
        check.positive(&key("speed_mps"), flight.speed_mps)?;
        check.that(flight.strips != Some(0), &key("strips"), &0, "at least 1")?;
        for (name, value) in [("centre_m", flight.centre_m[0]), ("centre_m", flight.centre_m[1])] {
            check.that(value.is_finite(), &key(name), &value, "a number")?;
        }
        check.that(flight.heading_deg.is_finite(), &key("heading_deg"), &flight.heading_deg, "a number")?;
        check.that(flight.tilt_deg.abs() <= MAX_TILT_DEG, &key("tilt_deg"), &flight.tilt_deg, "-60 to 60")?;
        if let Some(length) = flight.length_m {
            check.positive(&key("length_m"), length)?;
        }
        match (flight.strip_spacing_m, flight.side_overlap) {
            (Some(spacing), None) => check.positive(&key("strip_spacing_m"), spacing)?,
            (None, Some(overlap)) => check.overlap(&key("side_overlap"), overlap)?,
            (None, None) if flight.strips.is_none_or(|strips| strips == 1) => {}
            both => check.that(false, &key("strip_spacing_m, side_overlap"), &both, "one of the two")?,
        }
        match (&flight.images, flight.forward_overlap) {
            (Some(images), None) => {
                let strips = strip_count(self, flight);
                let usable = images.len() == strips && images.iter().all(|n| (1..=1_000_000).contains(n));
                check.that(usable, &key("images"), images, &format!("{strips} numbers from 1 to a million"))?;
            }
            (None, Some(overlap)) => check.overlap(&key("forward_overlap"), overlap)?,
            both => check.that(false, &key("images, forward_overlap"), &both, "one of the two")?,
        }
        let count = image_count(self, flight);
        check.that(count <= MAX_IMAGES, &key("images"), &count, "at most a million")?;
        check.at_least_zero(&key("turn_s"), flight.turn_s)?;
        if let Some(exposure) = flight.exposure_s {
            check.at_least_zero(&key("exposure_s"), exposure)?;
        }
        check.at_least_zero(&key("crab_sigma_deg"), flight.crab_sigma_deg)?;
        check.at_least_zero(&key("position_sigma_m"), flight.position_sigma_m)?;
        check.at_least_zero(&key("attitude_sigma_deg"), flight.attitude_sigma_deg)?;
        flight.angular_rate_sigma_deg_s.map_or(Ok(()), |s| check.at_least_zero(&key("angular_rate_sigma_deg_s"), s))
    }

    fn validate_ring(&self, check: &Check, path: &str, ring: &Ring) -> Result<()> {
        let key = |name: &str| format!("{path}.{name}");
        self.validate_camera_of(check, &key("camera"), ring.camera.as_deref())?;
        check.that((1..=100_000).contains(&ring.images), &key("images"), &ring.images, "1 to 100000")?;
        check.positive(&key("radius_m"), ring.radius_m)?;
        check.that(ring.height_m.is_finite(), &key("height_m"), &ring.height_m, "a number")?;
        check.that(ring.start_deg.is_finite(), &key("start_deg"), &ring.start_deg, "a number")?;
        let usable = !ring.rolls_deg.is_empty() && ring.rolls_deg.iter().all(|roll| roll.is_finite());
        check.that(usable, &key("rolls_deg"), &ring.rolls_deg, "at least one angle")?;
        check.at_least_zero(&key("interval_s"), ring.interval_s)?;
        check.at_least_zero(&key("aim_sigma_m"), ring.aim_sigma_m)?;
        check.at_least_zero(&key("position_sigma_m"), ring.position_sigma_m)
    }

    fn validate_route(&self, check: &Check, path: &str, route: &Route) -> Result<()> {
        let key = |name: &str| format!("{path}.{name}");
        self.validate_camera_of(check, &key("camera"), route.camera.as_deref())?;
        check.positive(&key("speed_mps"), route.speed_mps)?;
        if let Some(exposure) = route.exposure_s {
            check.at_least_zero(&key("exposure_s"), exposure)?;
        }
        check.at_least_zero(&key("crab_sigma_deg"), route.crab_sigma_deg)?;
        check.at_least_zero(&key("position_sigma_m"), route.position_sigma_m)?;
        check.at_least_zero(&key("attitude_sigma_deg"), route.attitude_sigma_deg)?;
        let rate = route.angular_rate_sigma_deg_s;
        rate.map_or(Ok(()), |s| check.at_least_zero(&key("angular_rate_sigma_deg_s"), s))?;
        let count = route.exposures.len();
        check.that(count > 0 && count as f64 <= MAX_IMAGES, &key("exposures"), &count, "1 to a million")?;
        for (number, [x, y, z, heading, tilt]) in route.exposures.iter().enumerate() {
            let key = |name: &str| format!("{path}.exposures.{number}, {name}");
            for (name, value) in [("x", x), ("y", y), ("heading", heading)] {
                check.that(value.is_finite(), &key(name), value, "a number")?;
            }
            check.positive(&key("z"), *z)?;
            let limit = format!("-{MAX_TILT_DEG} to {MAX_TILT_DEG}");
            check.that(tilt.abs() <= MAX_TILT_DEG, &key("tilt"), tilt, &limit)?;
        }
        Ok(())
    }

    fn validate_camera_of(&self, check: &Check, key: &str, id: Option<&str>) -> Result<()> {
        let known: Vec<_> = self.cameras.iter().map(|camera| camera.id.as_str()).collect();
        check.that(self.camera_index(id).is_some(), key, &id, &format!("one of {}", known.join(", ")))
    }
}

/// Checks of values, each of which names the scenario and the key.
struct Check<'a>(&'a str);

impl Check<'_> {
    fn that(&self, holds: bool, key: &str, value: &(impl Debug + ?Sized), expected: &str) -> Result<()> {
        if holds {
            return Ok(());
        }
        let (scenario, key, expected) = (self.0.into(), key.into(), expected.into());
        Err(ScenarioError::Value { scenario, key, value: format!("{value:?}"), expected })
    }

    fn positive(&self, key: &str, value: f64) -> Result<()> {
        self.that(value > 0.0 && value.is_finite(), key, &value, "more than 0")
    }

    fn at_least_zero(&self, key: &str, value: f64) -> Result<()> {
        self.that(value >= 0.0 && value.is_finite(), key, &value, "at least 0")
    }

    fn overlap(&self, key: &str, value: f64) -> Result<()> {
        // Neighbours that share nothing hold nothing together.
        self.that(value > 0.0 && value <= 0.99, key, &value, "more than 0, at most 0.99")
    }

    fn unique(&self, key: &str, names: &[&String]) -> Result<()> {
        let mut seen = HashSet::new();
        match names.iter().find(|name| name.is_empty() || !seen.insert(**name)) {
            Some(name) => self.that(false, key, name, "a name that no other one has"),
            None => Ok(()),
        }
    }
}
