//! Routes, flights and rings as images: true poses, times, temperatures, velocities.

use super::course::{Leg, course};
use super::description::{GnssModel, Scenario, Temperature, Terrain};
use super::image_sets::{Flight, LongSide, Ring, Route};
use super::random::{Table, normal, normal3, stream};
use super::strips::{strip_count, strip_images, strip_length, strip_spacing};
use crate::block::{CameraId, FlightId, Gnss, Image, Pose};
use crate::math::rotation::exp;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// The true images of a scenario.
pub(super) struct Flown {
    /// In the order of time.
    pub images: Vec<Image>,
    /// Strip of each image, counted through the block; a ring is one strip.
    pub strip: Vec<usize>,
}

/// Flies the scenario.
pub(super) fn fly(scenario: &Scenario, seed: u64) -> Flown {
    let mut sortie =
        Sortie { scenario, seed, time_s: 0.0, flown: Flown { images: Vec::new(), strip: Vec::new() }, strips: 0 };
    // As `Scenario::image_sets` orders them.
    let mut ids = (0..).map(FlightId::from);
    for (route, id) in scenario.routes.iter().zip(&mut ids) {
        sortie.route(route, id);
        sortie.time_s += scenario.pause_s;
    }
    for (flight, id) in scenario.flights.iter().zip(&mut ids) {
        sortie.strips_of(flight, id);
        sortie.time_s += scenario.pause_s;
    }
    for (ring, id) in scenario.rings.iter().zip(&mut ids) {
        sortie.ring(ring, id);
        sortie.time_s += scenario.pause_s;
    }
    sortie.flown
}

/// Rotation world to camera of a camera that looks down and is tilted towards `heading` (unit, horizontal).
fn tilted_nadir(heading: Vector3<f64>, tilt: f64, long_side: LongSide) -> Matrix3<f64> {
    let up = Vector3::z();
    let right = heading.cross(&up);
    let (sin, cos) = tilt.sin_cos();
    let forward = heading * sin - up * cos;
    let (x, y) = match long_side {
        LongSide::Across => (right, forward.cross(&right)),
        LongSide::Along => (right.cross(&forward), right),
    };
    Matrix3::from_rows(&[x.transpose(), y.transpose(), forward.transpose()])
}

/// Rotation world to camera of a camera in `centre` that looks at `target`, its x axis horizontal before it is rolled
/// clockwise about the optical axis.
fn looking_at(centre: &Vector3<f64>, target: &Vector3<f64>, roll: f64) -> Matrix3<f64> {
    let forward = (target - centre).normalize();
    // Straight down there is no horizontal direction: x points east then.
    let right = forward.cross(&Vector3::z()).try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let level = Matrix3::from_rows(&[right.transpose(), forward.cross(&right).transpose(), forward.transpose()]);
    exp(&Vector3::new(0.0, 0.0, -roll)) * level
}

fn quaternion(rotation: Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
}

impl Temperature {
    fn at(&self, time_s: f64) -> f64 {
        self.start_c - self.rise_k * (-time_s / self.time_constant_s).exp_m1()
    }
}

/// The state while flying.
struct Sortie<'a> {
    scenario: &'a Scenario,
    seed: u64,
    time_s: f64,
    flown: Flown,
    strips: usize,
}

/// What an image has beyond its flight and time.
struct Exposure {
    pose: Pose,
    velocity: Option<Vector3<f64>>,
    angular_velocity: Option<Vector3<f64>>,
    exposure_s: Option<f64>,
}

impl Sortie<'_> {
    fn strips_of(&mut self, flight: &Flight, id: FlightId) {
        let spacing = strip_spacing(self.scenario, flight);
        let length = strip_length(self.scenario, flight);
        let angle = flight.heading_deg.to_radians();
        let first = Vector3::new(angle.sin(), angle.cos(), 0.0);
        let right = first.cross(&Vector3::z());
        let tilt = flight.tilt_deg.to_radians();
        let middle = Vector3::new(flight.centre_m[0], flight.centre_m[1], flight.height_m);
        let strips = strip_count(self.scenario, flight);
        for strip in 0..strips {
            let heading = if flight.alternate && strip % 2 == 1 { -first } else { first };
            let mut rng = stream(self.seed, Table::Strip, self.strips);
            let crab = flight.crab_sigma_deg.to_radians() * normal(&mut rng);
            let nose = exp(&Vector3::new(0.0, 0.0, -crab)) * heading;
            let nominal = tilted_nadir(nose, tilt, flight.long_side);
            let across = (strip as f64 - 0.5 * (strips - 1) as f64) * spacing;
            let axis = middle + right * across - heading * (flight.height_m * tilt.tan());
            let count = strip_images(self.scenario, flight, strip);
            let base = if count > 1 { length / (count - 1) as f64 } else { 0.0 };
            for number in 0..count {
                let mut rng = stream(self.seed, Table::Image, self.flown.images.len());
                let along = (number as f64 - 0.5 * (count - 1) as f64) * base;
                let centre = axis + heading * along + normal3(&mut rng) * flight.position_sigma_m;
                let attitude = normal3(&mut rng) * flight.attitude_sigma_deg.to_radians();
                let rates = normal3(&mut rng);
                if number > 0 {
                    self.time_s += base / flight.speed_mps;
                }
                let exposure = Exposure {
                    pose: Pose { rotation: quaternion(exp(&attitude) * nominal), centre },
                    velocity: Some(heading * flight.speed_mps),
                    angular_velocity: flight.angular_rate_sigma_deg_s.map(|sigma| rates * sigma.to_radians()),
                    exposure_s: flight.exposure_s,
                };
                self.expose(id, &flight.name, flight.camera.as_deref(), exposure);
            }
            self.strips += 1;
            self.time_s += flight.turn_s;
        }
    }

    fn route(&mut self, route: &Route, id: FlightId) {
        let places: Vec<_> = route.exposures.iter().map(|[x, y, z, ..]| Vector3::new(*x, *y, *z)).collect();
        let (first, mut crab) = (self.strips, None);
        for (number, Leg { strip, direction }) in course(&places).into_iter().enumerate() {
            let mut rng = stream(self.seed, Table::Image, self.flown.images.len());
            if self.strips != first + strip {
                (self.strips, crab) = (first + strip, None);
            }
            let draw = || normal(&mut stream(self.seed, Table::Strip, self.strips));
            let crab = *crab.get_or_insert_with(draw) * route.crab_sigma_deg;
            let [.., heading, tilt] = route.exposures[number];
            let (sin, cos) = (heading + crab).to_radians().sin_cos();
            let nose = Vector3::new(sin, cos, 0.0);
            let centre = places[number] + normal3(&mut rng) * route.position_sigma_m;
            let attitude = normal3(&mut rng) * route.attitude_sigma_deg.to_radians();
            let rates = normal3(&mut rng);
            if number > 0 {
                self.time_s += (places[number] - places[number - 1]).norm() / route.speed_mps;
            }
            let nominal = tilted_nadir(nose, tilt.to_radians(), route.long_side);
            let exposure = Exposure {
                pose: Pose { rotation: quaternion(exp(&attitude) * nominal), centre },
                velocity: Some(direction.unwrap_or(nose) * route.speed_mps),
                angular_velocity: route.angular_rate_sigma_deg_s.map(|sigma| rates * sigma.to_radians()),
                exposure_s: route.exposure_s,
            };
            self.expose(id, &route.name, route.camera.as_deref(), exposure);
        }
        self.strips += 1;
    }

    fn ring(&mut self, ring: &Ring, id: FlightId) {
        let target_height = match self.scenario.terrain {
            Terrain::Targets { height_m, .. } => 0.5 * height_m,
            Terrain::Dike { .. } | Terrain::Plain { .. } => 0.0,
        };
        for number in 0..ring.images {
            let mut rng = stream(self.seed, Table::Image, self.flown.images.len());
            let azimuth = ring.start_deg.to_radians() + std::f64::consts::TAU * number as f64 / ring.images as f64;
            let nominal = Vector3::new(ring.radius_m * azimuth.sin(), ring.radius_m * azimuth.cos(), ring.height_m);
            let centre = nominal + normal3(&mut rng) * ring.position_sigma_m;
            let target = Vector3::new(0.0, 0.0, target_height) + normal3(&mut rng) * ring.aim_sigma_m;
            let roll = ring.rolls_deg[number % ring.rolls_deg.len()].to_radians();
            let pose = Pose { rotation: quaternion(looking_at(&centre, &target, roll)), centre };
            let exposure = Exposure { pose, velocity: None, angular_velocity: None, exposure_s: None };
            self.expose(id, &ring.name, ring.camera.as_deref(), exposure);
            self.time_s += ring.interval_s;
        }
        self.strips += 1;
    }

    fn expose(&mut self, flight: FlightId, name: &str, camera: Option<&str>, exposure: Exposure) {
        let Exposure { pose, velocity, angular_velocity, exposure_s } = exposure;
        let number = 1 + self.flown.images.iter().rev().take_while(|image| image.flight == flight).count();
        self.flown.images.push(Image {
            name: format!("{name}_{number:04}"),
            // Validated: the camera exists.
            camera: CameraId::from(self.scenario.camera_index(camera).unwrap_or(0)),
            flight,
            time_s: Some(self.time_s),
            temperature_c: self.scenario.temperature.map(|model| model.at(self.time_s)),
            pose,
            gnss: self.scenario.gnss.map(|GnssModel { sigma_xy_m, sigma_z_m }| Gnss {
                position: pose.centre,
                sigma_xy: sigma_xy_m,
                sigma_z: sigma_z_m,
            }),
            velocity,
            angular_velocity,
            exposure_s,
            focus_m: None,
        });
        self.flown.strip.push(self.strips);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn nadir_camera_has_x_right_of_the_heading_and_y_backwards() {
        let east = Vector3::x();
        let r = tilted_nadir(east, 0.0, LongSide::Across);
        // Heading east, a point ahead is at the top of the image, one to the south at its right.
        assert_relative_eq!(r * east, Vector3::new(0.0, -1.0, 0.0), epsilon = 1e-15);
        assert_relative_eq!(r * -Vector3::y(), Vector3::new(1.0, 0.0, 0.0), epsilon = 1e-15);
        assert_relative_eq!(r * -Vector3::z(), Vector3::z(), epsilon = 1e-15);
        let along = tilted_nadir(east, 0.0, LongSide::Along);
        assert_relative_eq!(along * east, Vector3::new(1.0, 0.0, 0.0), epsilon = 1e-15);
        for rotation in [r, along, tilted_nadir(Vector3::y(), 0.7, LongSide::Along)] {
            assert_relative_eq!(rotation.determinant(), 1.0, epsilon = 1e-14);
        }
    }

    #[test]
    fn tilted_camera_looks_ahead() {
        let r = tilted_nadir(Vector3::y(), 30.0_f64.to_radians(), LongSide::Across);
        assert_relative_eq!(r * Vector3::new(0.0, 0.5, -(0.75_f64.sqrt())), Vector3::z(), epsilon = 1e-15);
    }

    #[test]
    fn rolled_camera_still_looks_at_its_target() {
        let (centre, target) = (Vector3::new(1.0, -2.0, 2.0), Vector3::new(0.1, 0.0, 0.2));
        for roll in [0.0, 90.0_f64, 180.0] {
            let r = looking_at(&centre, &target, roll.to_radians());
            assert_relative_eq!((r * (target - centre)).normalize(), Vector3::z(), epsilon = 1e-14);
            assert_relative_eq!(r.determinant(), 1.0, epsilon = 1e-14);
            // Up in the world is up in the level image: against y.
            assert!((roll == 0.0) == ((r * Vector3::z()).y < -0.1));
        }
    }

    #[test]
    fn a_route_is_flown_first_with_its_own_places_and_times() {
        let text = super::super::preset_text("dike").unwrap().to_owned()
            + "\n[[route]]\nname = \"planned\"\nspeed_mps = 5.0\n\
               exposures = [[0, 0, 50, 0, 0], [0, 10, 50, 90, 45.0], [20, 10, 50, 90, 0]]\n";
        let scenario = Scenario::from_toml(&text, "s.toml").unwrap();
        let Flown { images, strip } = fly(&scenario, 1);
        assert_eq!(images.len(), 3 + 113);
        assert_eq!(images[..3].iter().map(|own| own.time_s.unwrap()).collect::<Vec<_>>(), [0.0, 2.0, 6.0]);
        assert_eq!((images[2].name.as_str(), images[3].name.as_str()), ("planned_0003", "oblique50_0001"));
        assert_eq!(strip[..4], [0, 0, 1, 2]);
        assert_eq!(images[1].pose.centre, Vector3::new(0.0, 10.0, 50.0));
        let ahead = images[1].pose.rotation * Vector3::new(0.5_f64.sqrt(), 0.0, -(0.5_f64.sqrt()));
        assert_relative_eq!(ahead, Vector3::z(), epsilon = 1e-14);
        assert_relative_eq!(images[2].velocity.unwrap(), Vector3::new(5.0, 0.0, 0.0), epsilon = 1e-14);
        for (old, new, named) in [
            ("[0, 0, 50, 0, 0]", "[0, 0, -1, 0, 0]", "route.0.exposures.0, z = -1.0: expected more than 0"),
            ("90, 45.0]", "90, 75.0]", "route.0.exposures.1, tilt = 75.0: expected -60 to 60"),
            ("speed_mps = 5.0\nexposures", "speed_mps = 0.0\nexposures", "route.0.speed_mps"),
            (
                "[[0, 0, 50, 0, 0], [0, 10, 50, 90, 45.0], [20, 10, 50, 90, 0]]",
                "[]",
                "route.0.exposures = 0: expected 1",
            ),
        ] {
            let error = Scenario::from_toml(&text.replace(old, new), "s.toml").unwrap_err().to_string();
            assert!(error.contains(named), "{error}");
        }
    }
}
