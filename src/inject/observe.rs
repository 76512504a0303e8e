//! How a measurement comes about: the chain from a world point to the pixel on which it falls.
//!
//! ```text
//! P --medium--> where the arriving ray points to (air, window)
//! instant: rows of a rolling shutter are exposed one after the other; an open shutter averages
//! pose at that instant (trajectory, vibration) --interior of that image--> lens --sensor--> pixel
//! ```
//!
//! Every cause is an [`Action`] that takes part where it likes and is the identity elsewhere; several compose.

use super::World;
use super::world::project;
use crate::block::{Block, Measurement, Pose};
use crate::camera::Interior;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

/// A cause at work. Each method is one place in the chain; as given here it changes nothing.
pub trait Action: Send + Sync {
    /// Changes what is recorded beside the measurements: starting values, temperatures.
    fn record(&self, _block: &mut Block) {}
    /// The camera's true interior orientation when an image is taken.
    fn interior(&self, _image: usize, _interior: &mut Interior) {}
    /// Time (s) after the image's own at which a row is exposed; `row` is -1/2 at the top and +1/2 at the bottom.
    fn row_delay(&self, _row: f64) -> f64 {
        0.0
    }
    /// How long the shutter is open, s, from the image's time on.
    fn exposure(&self, _image: usize) -> f64 {
        0.0
    }
    /// The camera's pose `dt` seconds after the image's time, beyond the trajectory.
    fn motion(&self, _image: usize, _dt: f64, _pose: &mut Pose) {}
    /// A point on the straight line along which the light of `point` arrives; `None` if none does.
    fn medium(&self, _pose: &Pose, point: Vector3<f64>) -> Option<Vector3<f64>> {
        Some(point)
    }
    /// The pixel position that is read for light which the lens sends to `xy`; `None` if there is none.
    fn sensor(&self, _camera: usize, _interior: &Interior, xy: [f64; 2]) -> Option<[f64; 2]> {
        Some(xy)
    }
    /// The antenna position that the receiver reports.
    fn antenna(&self, _image: usize, _antenna: &mut Vector3<f64>) {}
    /// Errors of the measurements themselves, after everything has been observed.
    fn measured(&mut self, _world: &World, _observations: &mut Observations) {}
    /// Tie-point measurements that the cause made wrong one by one: places in [`World::ties`].
    fn outliers(&self) -> &[usize] {
        &[]
    }
    /// What the cause drew at random or derived, for the report: name and value with unit.
    fn notes(&self) -> Vec<(String, String)> {
        Vec::new()
    }
}

/// Why a measurement is no longer there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// The point is behind the camera.
    Behind,
    /// It falls off the sensor.
    OffSensor,
    /// No light path, or no instant of exposure, was found.
    NoSolution,
}

/// How many measurements were lost, and why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Dropped {
    /// Points behind the camera.
    pub behind: usize,
    /// Points off the sensor.
    pub off_sensor: usize,
    /// No light path, or no instant of exposure.
    pub no_solution: usize,
    /// Tie-point measurements left alone in one image because the others were lost.
    pub left_alone: usize,
}

impl Dropped {
    pub(super) fn count(&mut self, loss: Loss) {
        match loss {
            Loss::Behind => self.behind += 1,
            Loss::OffSensor => self.off_sensor += 1,
            Loss::NoSolution => self.no_solution += 1,
        }
    }

    /// All of them.
    pub fn total(&self) -> usize {
        self.behind + self.off_sensor + self.no_solution + self.left_alone
    }
}

/// Everything that is measured anew, parallel to the block's lists.
pub struct Observations {
    /// Tie-point measurements, px.
    pub ties: Vec<Result<[f64; 2], Loss>>,
    /// Marks, px.
    pub marks: Vec<Result<[f64; 2], Loss>>,
    /// Antenna positions, m, where the block has them.
    pub antennas: Vec<Option<Vector3<f64>>>,
    /// Surveyed coordinates, m.
    pub surveyed: Vec<Vector3<f64>>,
}

/// Instants and weights over an open shutter, as parts of its time: Gauss-Legendre with five nodes, exact for an image
/// path that is a polynomial of degree nine in time.
const SHUTTER: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// The row on which a point falls is found when it moves by less than this, px: a thousand times the rounding of a
/// pixel coordinate.
const ROW_TOLERANCE_PX: f64 = 1e-9;
/// Each step gains the ratio of image motion to readout, 1/100 or less on a platform that takes usable pictures.
const ROW_STEPS: usize = 60;

/// The world with its causes, ready to be photographed.
pub(super) struct Observer<'a> {
    world: &'a World,
    actions: &'a [Box<dyn Action>],
    interiors: Vec<Interior>,
    exposures: Vec<f64>,
    rolling: bool,
}

impl<'a> Observer<'a> {
    pub fn new(world: &'a World, actions: &'a [Box<dyn Action>]) -> Self {
        let images = 0..world.images.len();
        let interior = |image: usize| {
            let mut interior = world.camera_of(image).interior;
            actions.iter().for_each(|action| action.interior(image, &mut interior));
            interior
        };
        let exposure = |image: usize| actions.iter().map(|action| action.exposure(image)).sum();
        Self {
            world,
            actions,
            interiors: images.clone().map(interior).collect(),
            exposures: images.map(exposure).collect(),
            // The delay is proportional to the row's distance from the middle.
            rolling: actions.iter().any(|action| action.row_delay(0.5) != 0.0),
        }
    }

    /// Measures everything.
    pub fn observe(&self) -> Observations {
        let image_points = |measurements: &[Measurement], position: &(dyn Fn(usize) -> Vector3<f64> + Sync)| {
            measurements
                .par_iter()
                .map(|measurement| self.image_point(measurement.image.index(), position(measurement.point.index())))
                .collect()
        };
        let antenna = |image: usize| {
            let mut antenna = self.world.images[image].gnss?.position;
            self.actions.iter().for_each(|action| action.antenna(image, &mut antenna));
            Some(antenna)
        };
        Observations {
            ties: image_points(&self.world.ties, &|point| self.world.tie_points[point]),
            marks: image_points(&self.world.marks, &|point| self.world.surveyed[point].position),
            antennas: (0..self.world.images.len()).map(antenna).collect(),
            surveyed: self.world.surveyed.iter().map(|point| point.position).collect(),
        }
    }

    /// Where a point is read in an image.
    fn image_point(&self, image: usize, point: Vector3<f64>) -> Result<[f64; 2], Loss> {
        let exposure = self.exposures[image];
        if exposure == 0.0 {
            return self.row_by_row(image, &point, 0.0);
        }
        // A moving point leaves a trail; what is measured is its centroid.
        let mut centroid = [0.0; 2];
        for (part, weight) in SHUTTER {
            let xy = self.row_by_row(image, &point, part * exposure)?;
            centroid[0] += weight * xy[0];
            centroid[1] += weight * xy[1];
        }
        Ok(centroid)
    }

    /// Solves for the row on which the point falls at the instant when that very row is exposed.
    fn row_by_row(&self, image: usize, point: &Vector3<f64>, offset: f64) -> Result<[f64; 2], Loss> {
        let height = f64::from(self.world.camera_of(image).height_px);
        let mut xy = self.at_instant(image, point, offset)?;
        if !self.rolling {
            return Ok(xy);
        }
        for _ in 0..ROW_STEPS {
            let row = xy[1] / height - 0.5;
            let delay: f64 = self.actions.iter().map(|action| action.row_delay(row)).sum();
            let next = self.at_instant(image, point, offset + delay)?;
            let moved = (next[1] - xy[1]).abs();
            xy = next;
            if moved < ROW_TOLERANCE_PX {
                return Ok(xy);
            }
        }
        Err(Loss::NoSolution)
    }

    /// Where the point is read if its row is exposed `dt` seconds after the image's time.
    fn at_instant(&self, image: usize, point: &Vector3<f64>, dt: f64) -> Result<[f64; 2], Loss> {
        let mut pose = self.world.trajectory.pose(image, dt);
        self.actions.iter().for_each(|action| action.motion(image, dt, &mut pose));
        let mut seen = *point;
        for action in self.actions {
            seen = action.medium(&pose, seen).ok_or(Loss::NoSolution)?;
        }
        let interior = &self.interiors[image];
        let camera = self.world.images[image].camera.index();
        let mut xy = project(interior, &pose, &seen).ok_or(Loss::Behind)?;
        for action in self.actions {
            xy = action.sensor(camera, interior, xy).ok_or(Loss::NoSolution)?;
        }
        if xy[0].is_finite() && xy[1].is_finite() { Ok(xy) } else { Err(Loss::NoSolution) }
    }
}
