//! Blocks of every kind with noise everywhere and start values that are not the truth.

use crate::common::{half_dike, preset};
use misclosure::block::{Block, CameraId};
use misclosure::scenario::{Perturbation, Simulation, SurveyNoise, add_noise, add_survey_noise};

/// Preset, overridden parameters, noise in px.
pub type Case = (&'static str, &'static [(&'static str, f64)], f64);

pub const PRESETS: [Case; 4] = [
    ("dike", &[("points", 1500.0), ("check", 20.0)], 0.3),
    ("corridor", &[("length_m", 200.0), ("points", 1500.0), ("check", 20.0)], 0.3),
    ("mapping", &[("points", 1500.0)], 0.3),
    ("closerange", &[("points", 80.0)], 0.05),
];

/// A preset with noise everywhere and start values that are not the truth.
pub fn noisy(name: &str, overrides: &[(&str, f64)], noise_px: f64) -> Simulation {
    let start = if name == "closerange" { 0.002 } else { 0.05 };
    disturbed(preset(name, overrides, 11), noise_px, start)
}

/// Half a dike of 500 tie points, as [`noisy`].
pub fn noisy_half_dike() -> Block {
    disturbed(half_dike(500.0, 10.0, 11), 0.3, 0.05).block
}

/// With noise everywhere, and projection centres of the start off by `position_m`.
fn disturbed(mut simulation: Simulation, noise_px: f64, position_m: f64) -> Simulation {
    add_noise(&mut simulation.block, noise_px, 12).expect("noise");
    add_survey_noise(&mut simulation.block, SurveyNoise { gnss: true, control: true, check: false }, 13);
    let start = Perturbation { focal_fraction: 0.002, position_m, angle_rad: 5e-4, points: true };
    simulation.perturb_start(start, 14).expect("a perturbation");
    for (i, image) in simulation.block.images.iter().enumerate() {
        let ties = simulation.block.ties.iter().filter(|row| row.image.index() == i).count();
        assert!(ties > 5, "{}: {ties} measurements do not orient it", image.name);
    }
    simulation
}

pub fn dike() -> Block {
    let (name, overrides, noise) = PRESETS[0];
    noisy(name, overrides, noise).block
}

pub fn closerange() -> Block {
    let (name, overrides, noise) = PRESETS[3];
    noisy(name, overrides, noise).block
}

/// The dike, every second image taken by a camera of its own with another focal length.
pub fn two_cameras() -> Block {
    let mut block = dike();
    let mut second = block.cameras[0].clone();
    second.id = "second".into();
    second.interior[0] *= 1.001;
    block.cameras.push(second);
    for image in block.images.iter_mut().skip(1).step_by(2) {
        image.camera = CameraId(1);
    }
    block
}
