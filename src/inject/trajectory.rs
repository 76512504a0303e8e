//! Where the camera is shortly before and after an exposure.

use crate::block::{Image, Pose};
use anyhow::{Result, bail};
use nalgebra::{UnitQuaternion, Vector3};

/// Two successive images belong to one strip when the mean velocity between them differs from that at either by less
/// than this part of the speed; beyond it the platform turned, or waited, and nothing is known about the way between.
const STRIP_TOLERANCE: f64 = 0.3;

/// The platform's motion: cubic in time between images of a strip (positions and velocities of both are met), straight
/// beyond it; the rotation turns at the measured angular velocity and stays where none was measured.
#[derive(Debug, Clone)]
pub struct Trajectory {
    images: Vec<Moving>,
}

#[derive(Debug, Clone)]
struct Moving {
    pose: Pose,
    velocity: Option<Vector3<f64>>,
    angular_velocity: Option<Vector3<f64>>,
    before: Option<Neighbour>,
    after: Option<Neighbour>,
}

/// Another image of the strip, `seconds` later (negative: earlier).
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    seconds: f64,
    centre: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl Trajectory {
    /// From the true images of a block. A velocity that an image lacks comes from the times and positions of its
    /// flight.
    pub fn new(images: &[Image]) -> Self {
        let mut moving: Vec<Moving> = images
            .iter()
            .map(|image| Moving {
                pose: image.pose,
                velocity: image.velocity,
                angular_velocity: image.angular_velocity,
                before: None,
                after: None,
            })
            .collect();
        let flights = flights_in_time(images);
        for flight in &flights {
            for (place, &(_, index)) in flight.iter().enumerate() {
                if moving[index].velocity.is_none() {
                    moving[index].velocity = derived_velocity(flight, place, images);
                }
            }
        }
        for flight in &flights {
            for pair in flight.windows(2) {
                let ((t0, i), (t1, j)) = (pair[0], pair[1]);
                let (Some(v0), Some(v1)) = (moving[i].velocity, moving[j].velocity) else { continue };
                let (c0, c1) = (moving[i].pose.centre, moving[j].pose.centre);
                let seconds = t1 - t0;
                let chord = (c1 - c0) / seconds;
                let even = |v: Vector3<f64>| (chord - v).norm() <= STRIP_TOLERANCE * v.norm();
                if even(v0) && even(v1) {
                    moving[i].after = Some(Neighbour { seconds, centre: c1, velocity: v1 });
                    moving[j].before = Some(Neighbour { seconds: -seconds, centre: c0, velocity: v0 });
                }
            }
        }
        Self { images: moving }
    }

    /// Pose of an image's camera `dt` seconds after its time; exactly the true pose at zero.
    pub fn pose(&self, image: usize, dt: f64) -> Pose {
        let moving = &self.images[image];
        if dt == 0.0 {
            return moving.pose;
        }
        let velocity = moving.velocity.unwrap_or_else(Vector3::zeros);
        let neighbour = if dt > 0.0 { moving.after } else { moving.before };
        let centre = match neighbour {
            Some(other) if dt.abs() <= other.seconds.abs() => hermite(moving.pose.centre, velocity, other, dt),
            _ => moving.pose.centre + velocity * dt,
        };
        let rotation = match moving.angular_velocity {
            // The camera turns by +w dt in its own axes, so the world turns by -w dt as seen from it.
            Some(w) => UnitQuaternion::from_scaled_axis(-w * dt) * moving.pose.rotation,
            None => moving.pose.rotation,
        };
        Pose { rotation, centre }
    }

    /// Velocity at an image, m/s.
    pub fn velocity(&self, image: usize) -> Option<Vector3<f64>> {
        self.images[image].velocity
    }

    /// # Errors
    /// An image whose velocity is neither given nor follows from times and positions of its flight.
    pub fn need_velocities(&self, images: &[Image]) -> Result<()> {
        match self.images.iter().position(|moving| moving.velocity.is_none()) {
            None => Ok(()),
            Some(index) => bail!(
                "image `{}` has no velocity, and none follows from the times and positions of its flight",
                images[index].name
            ),
        }
    }
}

/// Per flight its images with a time, `(time, index)`, in the order of time; of equal times only the first.
fn flights_in_time(images: &[Image]) -> Vec<Vec<(f64, usize)>> {
    let count = images.iter().map(|image| image.flight.index() + 1).max().unwrap_or(0);
    let mut flights = vec![Vec::new(); count];
    for (index, image) in images.iter().enumerate() {
        if let Some(time) = image.time_s {
            flights[image.flight.index()].push((time, index));
        }
    }
    for flight in &mut flights {
        flight.sort_by(|a: &(f64, usize), b| a.0.total_cmp(&b.0));
        flight.dedup_by(|later, earlier| later.0 == earlier.0);
    }
    flights
}

/// Velocity from the neighbours in time: of the parabola through the three positions where both sides agree (one
/// strip), else of the shorter side, shorter in time and then in length.
fn derived_velocity(flight: &[(f64, usize)], place: usize, images: &[Image]) -> Option<Vector3<f64>> {
    let chord = |a: usize, b: usize| {
        let seconds = flight[b].0 - flight[a].0;
        ((images[flight[b].1].pose.centre - images[flight[a].1].pose.centre) / seconds, seconds)
    };
    let before = (place > 0).then(|| chord(place - 1, place));
    let after = (place + 1 < flight.len()).then(|| chord(place, place + 1));
    match (before, after) {
        (Some((v0, h0)), Some((v1, h1))) => {
            if (v1 - v0).norm() <= STRIP_TOLERANCE * v0.norm().max(v1.norm()) {
                Some((v0 * h1 + v1 * h0) / (h0 + h1))
            } else if (h0, (v0 * h0).norm()) <= (h1, (v1 * h1).norm()) {
                Some(v0)
            } else {
                Some(v1)
            }
        }
        (Some((v, _)), None) | (None, Some((v, _))) => Some(v),
        (None, None) => None,
    }
}

/// Cubic through two positions with given velocities, at `dt` from the first.
fn hermite(c0: Vector3<f64>, v0: Vector3<f64>, other: Neighbour, dt: f64) -> Vector3<f64> {
    let h = other.seconds;
    let s = dt / h;
    let chord = (other.centre - c0) / h;
    // c0 + v0 dt + curvature terms, so that a straight and even flight stays exactly straight and even.
    c0 + v0 * dt
        + (chord * 3.0 - v0 * 2.0 - other.velocity) * (s * dt)
        + (v0 + other.velocity - chord * 2.0) * (s * s * dt)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hermite_meets_both_ends() {
        let c0 = Vector3::new(1.0, 2.0, 3.0);
        let v0 = Vector3::new(5.0, -1.0, 0.0);
        let other =
            Neighbour { seconds: -2.0, centre: Vector3::new(-8.0, 5.0, 3.0), velocity: Vector3::new(4.0, 0.0, 1.0) };
        let end = hermite(c0, v0, other, -2.0);
        assert!((end - other.centre).norm() < 1e-12, "{end}");
        let step = 1e-6;
        let slope = (hermite(c0, v0, other, -2.0 + step) - hermite(c0, v0, other, -2.0 - step)) / (2.0 * step);
        assert!((slope - other.velocity).norm() < 1e-8, "{slope}");
    }
}
