//! Random errors of the measurements, and wrong approximations to start from.

use super::random::{Table, normal, normal3, stream};
use super::{Result, ScenarioError, Simulation};
use crate::block::{Block, Measurement, Role};
use crate::camera::F;
use nalgebra::{UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;

/// How wrong the approximations are made; the default changes nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Perturbation {
    /// Every focal length is multiplied by one plus this.
    pub focal_fraction: f64,
    /// Standard deviation of each coordinate of a projection centre, m.
    pub position_m: f64,
    /// Standard deviation of each component of a small rotation (camera axes), rad.
    pub angle_rad: f64,
    /// The tie points lose their coordinates, so that they have to be intersected.
    pub points: bool,
}

/// Which surveyed values get random errors.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SurveyNoise {
    /// Antenna positions.
    pub gnss: bool,
    /// Control points.
    pub control: bool,
    /// Check points.
    pub check: bool,
}

impl Simulation {
    /// Makes the block's approximations wrong; measurements and truth stay.
    ///
    /// # Errors
    /// A standard deviation that is negative or no number; a focal length that would not stay positive.
    pub fn perturb_start(&mut self, perturbation: Perturbation, seed: u64) -> Result<()> {
        let Perturbation { focal_fraction, position_m, angle_rad, points } = perturbation;
        let usable = focal_fraction.is_finite() && focal_fraction > -1.0;
        let expected = "a fraction above -1";
        usable.then_some(()).ok_or(ScenarioError::Argument {
            what: "focal_fraction",
            value: focal_fraction,
            expected,
        })?;
        sigma_argument("position_m", position_m)?;
        sigma_argument("angle_rad", angle_rad)?;
        for camera in &mut self.block.cameras {
            camera.interior[F] *= 1.0 + focal_fraction;
        }
        for (index, image) in self.block.images.iter_mut().enumerate() {
            let mut rng = stream(seed, Table::StartPose, index);
            image.pose.centre += normal3(&mut rng) * position_m;
            let turn = UnitQuaternion::from_scaled_axis(normal3(&mut rng) * angle_rad);
            image.pose.rotation = UnitQuaternion::new_normalize((turn * image.pose.rotation).into_inner());
        }
        if points {
            self.block.tie_points.iter_mut().for_each(|point| point.position = None);
        }
        Ok(())
    }
}

/// Adds normal errors with the standard deviation `px` to tie points and marks, and states it as their precision: in
/// `sigma`, and no longer in the rows. Zero changes nothing.
///
/// # Errors
/// `px` negative or no number.
pub fn add_noise(block: &mut Block, px: f64, seed: u64) -> Result<()> {
    sigma_argument("noise_px", px)?;
    if px == 0.0 {
        return Ok(());
    }
    for (table, measurements) in [(Table::TieNoise, &mut block.ties), (Table::MarkNoise, &mut block.marks)] {
        disturb(measurements, px, &mut stream(seed, table, 0));
    }
    block.sigma.tie_px = px;
    block.sigma.mark_px = px;
    Ok(())
}

fn disturb(measurements: &mut [Measurement], px: f64, rng: &mut ChaCha8Rng) {
    for measurement in measurements {
        measurement.x += px * normal(rng);
        measurement.y += px * normal(rng);
        measurement.sigma = None;
    }
}

/// Adds normal errors to everything that is measured, of the size that its own or the block's standard deviations
/// state.
pub fn add_stated_noise(block: &mut Block, seed: u64) {
    let sigma = block.sigma;
    let tables =
        [(Table::TieNoise, &mut block.ties, sigma.tie_px), (Table::MarkNoise, &mut block.marks, sigma.mark_px)];
    for (table, measurements, of_block) in tables {
        let mut rng = stream(seed, table, 0);
        for measurement in measurements {
            let px = measurement.sigma.unwrap_or(of_block);
            measurement.x += px * normal(&mut rng);
            measurement.y += px * normal(&mut rng);
        }
    }
    add_survey_noise(block, SurveyNoise { gnss: true, control: true, check: true }, seed);
}

/// Adds normal errors to antenna positions and surveyed coordinates, of the size that their own or the block's standard
/// deviations state.
pub fn add_survey_noise(block: &mut Block, which: SurveyNoise, seed: u64) {
    let sigma = block.sigma;
    let error = |table: Table, index: usize, xy: f64, z: f64| {
        normal3(&mut stream(seed, table, index)).component_mul(&Vector3::new(xy, xy, z))
    };
    for (index, image) in block.images.iter_mut().enumerate() {
        if let Some(gnss) = image.gnss.as_mut().filter(|_| which.gnss) {
            let (xy, z) = (gnss.sigma_xy.unwrap_or(sigma.gnss_xy_m), gnss.sigma_z.unwrap_or(sigma.gnss_z_m));
            gnss.position += error(Table::GnssNoise, index, xy, z);
        }
    }
    for (index, point) in block.surveyed.iter_mut().enumerate() {
        let (table, wanted) = match point.role {
            Role::Control => (Table::ControlNoise, which.control),
            Role::Check => (Table::CheckNoise, which.check),
        };
        if wanted {
            let (xy, z) = (point.sigma_xy.unwrap_or(sigma.control_xy_m), point.sigma_z.unwrap_or(sigma.control_z_m));
            point.position += error(table, index, xy, z);
        }
    }
}

fn sigma_argument(what: &'static str, value: f64) -> Result<()> {
    let usable = value >= 0.0 && value.is_finite();
    usable.then_some(()).ok_or(ScenarioError::Argument { what, value, expected: "at least 0" })
}
