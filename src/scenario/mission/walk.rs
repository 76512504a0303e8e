//! The images of a path: waypoints, what the camera does on the way, and when it is triggered.

use super::Exposure;
use crate::geodesy::geographic::{Geographic, LocalSystem};
use nalgebra::Vector3;

/// Images of a mission, at most.
const MOST_IMAGES: usize = 1_000_000;
/// Part of the trigger distance that a leg may lack for its last image: places are rounded to about a centimetre.
const TOLERANCE: f64 = 0.01;

/// A place on the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Waypoint {
    /// Latitude and longitude, degrees.
    pub place: [f64; 2],
    /// Above the ground, m.
    pub height_m: f64,
    /// Where the nose points.
    pub nose: Nose,
}

/// Where the nose of the aircraft points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Nose {
    /// Along the path.
    Path,
    /// In a direction, degrees clockwise from north, on the whole leg that leads to the waypoint.
    Held(f64),
    /// In a direction at the waypoint; it turns evenly on the leg that leads there.
    Turning(f64),
    /// To a place (latitude and longitude, degrees).
    Towards([f64; 2]),
}

/// Where the camera points about the vertical.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Yaw {
    /// Degrees to the right of the nose.
    OfNose(f64),
    /// Degrees clockwise from north.
    OfNorth(f64),
}

/// What happens one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    /// A straight leg.
    Fly(Waypoint),
    /// Pitch of the camera from here on, degrees; 0 is level, -90 down.
    Pitch(f64),
    /// The pitch to which the camera turns on the next leg.
    PitchAlong(f64),
    /// Yaw of the camera from here on.
    Yaw(Yaw),
    /// The aircraft turns on the spot, degrees clockwise from north.
    Turn(f64),
    /// Images by distance along the path from here on; `now`: also one here.
    Every {
        /// m.
        metres: f64,
        /// Does the first one come here?
        now: bool,
    },
    /// No further images by distance.
    Stop,
    /// An image.
    Shoot,
}

impl Step {
    fn waypoint(&self) -> Option<Waypoint> {
        match self {
            Step::Fly(waypoint) => Some(*waypoint),
            _ => None,
        }
    }
}

/// The images of a mission.
///
/// # Errors
/// What was expected in place of a waypoint that is no place, or of a distance that makes too many images.
pub(super) fn walk(steps: &[Step]) -> Result<Vec<Exposure>, String> {
    let waypoints = steps.iter().filter_map(Step::waypoint);
    let places: Vec<Geographic> = waypoints.map(|waypoint| geographic(&waypoint)).collect::<Result<_, _>>()?;
    let Some(system) = LocalSystem::about(&places) else { return Ok(Vec::new()) };
    let mut walker = Walker {
        system,
        here: None,
        nose: None,
        course: None,
        pitch: None,
        pitch_to: None,
        yaw: Yaw::OfNose(0.0),
        every: None,
        exposures: Vec::new(),
    };
    for (k, step) in steps.iter().enumerate() {
        let next = || steps[k + 1..].iter().find_map(Step::waypoint);
        walker.step(step, next)?;
    }
    Ok(walker.exposures)
}

/// The place of a waypoint, on the ground.
fn geographic(waypoint: &Waypoint) -> Result<Geographic, String> {
    let [latitude, longitude] = waypoint.place;
    let place = Geographic::checked(latitude, longitude, 0.0)?;
    place.ok_or_else(|| "expected a latitude and a longitude, found 0 and 0".into())
}

struct Walker {
    system: LocalSystem,
    here: Option<Waypoint>,
    /// Direction of the nose here; `None`: that of the path.
    nose: Option<f64>,
    course: Option<f64>,
    pitch: Option<f64>,
    pitch_to: Option<f64>,
    yaw: Yaw,
    /// Trigger distance, and the way since the last image, m.
    every: Option<[f64; 2]>,
    exposures: Vec<Exposure>,
}

impl Walker {
    fn step(&mut self, step: &Step, next: impl Fn() -> Option<Waypoint>) -> Result<(), String> {
        match *step {
            Step::Fly(to) => self.fly(to, next()),
            Step::Pitch(pitch) => {
                self.pitch = Some(pitch);
                Ok(())
            }
            Step::PitchAlong(pitch) => {
                self.pitch_to = Some(pitch);
                Ok(())
            }
            Step::Yaw(yaw) => {
                self.yaw = yaw;
                Ok(())
            }
            Step::Turn(nose) => {
                self.nose = Some(nose);
                Ok(())
            }
            Step::Every { metres, .. } if !(metres.is_finite() && metres > 0.0) => {
                Err(format!("expected a distance of more than 0 m between images, found {metres}"))
            }
            Step::Every { metres, now } => {
                // Before the first waypoint, the first image comes there.
                let due = now && self.here.is_none();
                self.every = Some([metres, if due { metres } else { 0.0 }]);
                if now && !due { self.shoot() } else { Ok(()) }
            }
            Step::Stop => {
                self.every = None;
                Ok(())
            }
            Step::Shoot => self.shoot(),
        }
    }

    /// Flies a leg with the images that its distance triggers.
    fn fly(&mut self, to: Waypoint, next: Option<Waypoint>) -> Result<(), String> {
        let from = self.here.unwrap_or(to);
        let leg = self.local(&to) - self.local(&from);
        // Where a path begins, its direction is that in which it goes on.
        let ahead = next.map_or_else(Vector3::zeros, |next| self.local(&next) - self.local(&to));
        self.course = azimuth(&leg).or(if self.here.is_some() { self.course } else { azimuth(&ahead) });
        let (pitch, pitch_to) = (self.pitch, self.pitch_to.take().or(self.pitch));
        let nose = self.nose;
        let length = leg.norm();
        if let Some([metres, since]) = self.every {
            let slack = TOLERANCE * metres;
            if (length + since) / metres > MOST_IMAGES as f64 {
                return Err(format!("expected at most {MOST_IMAGES} images"));
            }
            let mut way = metres - since;
            while way <= length + slack {
                let part = if length > 0.0 { (way / length).min(1.0) } else { 1.0 };
                let at = between(&from, &to, part);
                self.nose = self.pointed(&at, nose, part);
                self.pitch = pitch.zip(pitch_to).map(|(a, b)| a + part * (b - a)).or(pitch_to);
                self.here = Some(at);
                self.shoot()?;
                way += metres;
            }
            self.every = Some([metres, length - (way - metres)]);
        }
        self.here = Some(to);
        self.pitch = pitch_to;
        self.nose = self.pointed(&to, nose, 1.0);
        Ok(())
    }

    /// Direction of the nose at a part of the leg to a waypoint, from that where it began.
    fn pointed(&self, at: &Waypoint, began: Option<f64>, part: f64) -> Option<f64> {
        match at.nose {
            Nose::Path => None,
            Nose::Held(angle) => Some(angle),
            Nose::Turning(angle) => {
                let began = began.unwrap_or(angle);
                Some(began + part * ((angle - began + 540.0).rem_euclid(360.0) - 180.0))
            }
            Nose::Towards(place) => azimuth(&(self.local(&Waypoint { place, ..*at }) - self.local(at))),
        }
    }

    fn shoot(&mut self) -> Result<(), String> {
        let Some(Waypoint { place, height_m, .. }) = self.here else {
            return Err("expected a waypoint before the first image".into());
        };
        if self.exposures.len() >= MOST_IMAGES {
            return Err(format!("expected at most {MOST_IMAGES} images"));
        }
        let (heading_deg, follows_path) = match self.yaw {
            Yaw::OfNorth(angle) => (Some(angle), false),
            Yaw::OfNose(angle) => (self.nose.or(self.course).map(|nose| nose + angle), self.nose.is_none()),
        };
        self.exposures.push(Exposure {
            latitude_deg: place[0],
            longitude_deg: place[1],
            height_m,
            heading_deg: heading_deg.map(|angle| angle.rem_euclid(360.0)),
            follows_path,
            tilt_deg: self.pitch.map(|pitch| pitch + 90.0),
        });
        Ok(())
    }

    /// East, north, up, m.
    fn local(&self, waypoint: &Waypoint) -> Vector3<f64> {
        let [latitude, longitude] = waypoint.place;
        let ground = self.system.local(&Geographic { latitude, longitude, height: 0.0 });
        Vector3::new(ground.x, ground.y, waypoint.height_m)
    }
}

/// Direction of a step, degrees clockwise from north; `None` where it leads nowhere.
fn azimuth(step: &Vector3<f64>) -> Option<f64> {
    (step.xy().norm() > 1e-3).then(|| step.x.atan2(step.y).to_degrees())
}

fn between(from: &Waypoint, to: &Waypoint, part: f64) -> Waypoint {
    let eastward = (to.place[1] - from.place[1] + 540.0).rem_euclid(360.0) - 180.0;
    let latitude = from.place[0] + part * (to.place[0] - from.place[0]);
    let longitude = (from.place[1] + part * eastward + 540.0).rem_euclid(360.0) - 180.0;
    Waypoint {
        place: [latitude, longitude],
        height_m: from.height_m + part * (to.height_m - from.height_m),
        nose: to.nose,
    }
}
