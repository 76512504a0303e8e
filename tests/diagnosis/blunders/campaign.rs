//! One case: a preset with noise and blunders, diagnosed and adjusted.

use crate::blunders::place::Place;
use crate::common;
use misclosure::adjust::native::Native;
use misclosure::adjust::{AdjustError, CovarianceOf, Options};
use misclosure::block::{Block, PointId};
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::settings::Settings;
use misclosure::model::Model;
use misclosure::run::{self, Run, RunError};
use misclosure::scenario::add_noise;
use misclosure::snooping::settle::settle;
use misclosure::snooping::{Snooping, Solved, Strictness, robust_fit, stand_alone};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::HashSet;
use std::fmt;
use std::ops::ControlFlow;

type Preset = (&'static str, &'static [(&'static str, f64)]);

/// Few points, so that a blunder weighs; in the last one an image has some eleven measurements.
pub const PRESETS: [Preset; 5] = [
    ("dike", &[("points", 800.0), ("check", 20.0)]),
    ("corridor", &[("length_m", 400.0), ("points", 800.0), ("check", 20.0)]),
    ("mapping", &[("points", 600.0)]),
    ("closerange", &[("points", 100.0)]),
    ("corridor", &[("length_m", 400.0), ("points", 220.0), ("check", 20.0)]),
];

/// px.
const NOISE: f64 = 0.3;
const SEED: u64 = 3;
/// Level at which an effect is found, as by default.
const SIGNIFICANCE: f64 = 1e-3;
/// A blunder stays on the sensor by as much, px.
const MARGIN_PX: f64 = 1.0;

#[derive(Debug, Clone, Copy)]
pub enum Count {
    Of(usize),
    /// Of the measurements.
    Share(f64),
}

#[derive(Debug, Clone, Copy)]
pub enum Size {
    Px(f64),
    /// To the opposite side of the sensor.
    Sensor,
}

#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Position in [`PRESETS`].
    pub preset: usize,
    pub count: Count,
    pub size: Size,
    pub place: Place,
}

impl fmt::Display for Case {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Case { preset, count, size, place } = self;
        write!(out, "{} {preset}, {count:?}, {size:?}, {place:?}", PRESETS[*preset].0)
    }
}

impl Case {
    /// What goes wrong, in words.
    pub fn failures(&self) -> Vec<String> {
        let (block, wrong) = self.block();
        let options = Options { covariance: CovarianceOf::Shared, ..Options::default() };
        let model = Model { datum: run::default_diagnosis_datum(&block), ..Model::default() };
        let settings = |significance: f64| Settings {
            plugins: &[],
            options: options.clone(),
            significance,
            snoop: true,
            tell: &|_| {},
        };
        let mut failures = Vec::new();
        match diagnose(&block, &model, &settings(SIGNIFICANCE)) {
            Err(error) => failures.push(format!("diagnose: {error}")),
            Ok(found) if !found.diagnosis.recommended.is_empty() => {
                failures.push(format!("diagnose: a false cause: {}", found.diagnosis.recommended.join(", ")));
            }
            Ok(_) => {}
        }
        let model = Model::default();
        let mut search = Snooping::new(&block, &model);
        failures.extend(plain(&search.block(&block), &wrong, &model, &options));
        // As `adjust --outliers snoop` does.
        let settings = settings(0.0);
        let snooped =
            settle(&block, &mut search, &model, None, Strictness::Loose, &settings.settling()).and_then(|rough| {
                settle(&block, &mut search, &model, Some(&rough), Strictness::Tight, &settings.settling())
            });
        let left = search.block(&block);
        failures.extend(snooped.err().map(|error| format!("snoop: {error}")));
        failures.extend(adjust(&left, &model, &options).err().map(|error| format!("adjust: {error}")));
        let measured = |block: &Block| block.ties.len() + block.marks.len();
        let (out, named) = (measured(&block) - measured(&left), search.outliers(&block).rejected.len());
        if out != named {
            failures.push(format!("snoop: {out} measurements are out, {named} are named"));
        }
        failures
    }

    /// The block, and the points of which a measurement is wrong.
    fn block(&self) -> (Block, HashSet<PointId>) {
        let (preset, overrides) = PRESETS[self.preset];
        let mut block = common::preset(preset, overrides, SEED).block;
        add_noise(&mut block, NOISE, SEED).expect("noise");
        (block.sigma.tie_px, block.sigma.mark_px) = (NOISE, NOISE);
        // As blocks of practice come: the points are intersected, blunders and all.
        block.tie_points.iter_mut().for_each(|point| point.position = None);
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let count = match self.count {
            Count::Of(count) => count,
            Count::Share(share) => (share * block.ties.len() as f64) as usize,
        };
        let chosen = self.place.choose(&block, count, &mut random);
        for k in &chosen {
            self.blunder(&mut block, *k, &mut random);
        }
        let wrong = chosen.into_iter().map(|k| block.ties[k].point).collect();
        (block, wrong)
    }

    fn blunder(&self, block: &mut Block, k: usize, random: &mut ChaCha8Rng) {
        let row = &mut block.ties[k];
        let camera = &block.cameras[block.images[row.image.index()].camera.index()];
        let [width, height] = [camera.width_px, camera.height_px].map(f64::from);
        let on_sensor = |x: f64, size: f64| (MARGIN_PX..=size - MARGIN_PX).contains(&x);
        let [x, y] = match self.size {
            Size::Sensor => {
                let opposite = |x: f64, size: f64| if x < 0.5 * size { size - MARGIN_PX } else { MARGIN_PX };
                [opposite(row.x, width), opposite(row.y, height)]
            }
            // Half the sensor's diagonal is longer than the size, so some direction ends on it.
            Size::Px(size) => loop {
                let angle: f64 = random.random_range(0.0..std::f64::consts::TAU);
                let [x, y] = [row.x + size * angle.cos(), row.y + size * angle.sin()];
                if on_sensor(x, width) && on_sensor(y, height) {
                    break [x, y];
                }
            },
        };
        (row.x, row.y) = (x, y);
    }
}

fn adjust(block: &Block, model: &Model, options: &Options) -> Result<Run, RunError> {
    run::adjust(block, model, &[&Native], options, &mut |_, _| ControlFlow::Continue(()))
}

/// As `adjust` does: least squares alone; where that fails, a robust adjustment names the worst measurement. What goes
/// wrong, in words.
fn plain(block: &Block, wrong: &HashSet<PointId>, model: &Model, options: &Options) -> Option<String> {
    let error = adjust(block, model, options).err()?;
    let named = || {
        let may_stay_unconverged = matches!(error, RunError::Adjust(AdjustError::NotConverged { .. }));
        let options = Options { may_stay_unconverged, ..options.clone() };
        let fit = robust_fit(block, model, None, &options).map_err(|robust| robust.to_string())?;
        if matches!(error, RunError::Adjust(AdjustError::Singular { .. })) && fit.model.free != model.free {
            return Err("the camera can only be held".to_string());
        }
        let solved = Solved { problem: &fit.problem, state: &fit.solution.state };
        let found = stand_alone(block, solved).map_err(|error| error.to_string())?;
        found.rejected.first().map(|worst| worst.point).ok_or_else(|| "nothing stands alone".to_string())
    };
    match named() {
        Ok(point) if wrong.contains(&point) => None,
        Ok(point) => Some(format!("plain: {error}; named is {}", block.tie_points[point.index()].name)),
        Err(text) => Some(format!("plain: {error}; the robust adjustment: {text}")),
    }
}
