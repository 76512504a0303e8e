//! A lens that warms up: the air's (or camera's) temperature drives that of the lens, which drives the focal length.
//!
//! `dT_lens/dt = (T - T_lens) / lag`, integrated in small steps through the recorded temperatures, linear between
//! images; the lens starts at the first temperature. `f += alpha (T_lens - T_reference)`.

use super::*;
use crate::block::Block;

pub(super) static CAUSE: Cause = Cause {
    id: "temperature-focal",
    summary: "focal length that follows the lens' temperature, which lags behind the recorded one",
    parameters: &[
        parameter("alpha", "px/K", DefaultValue::Number(0.5), "growth of the focal length with temperature"),
        parameter(
            "expansion",
            "ppm/K",
            DefaultValue::Optional("alpha"),
            "the same in parts of the focal length; in the place of alpha",
        ),
        parameter("lag", "s", DefaultValue::Number(0.0), "time in which the lens makes up 1 - 1/e of a step"),
        parameter(
            "from",
            "C",
            DefaultValue::Optional("the recorded temperatures"),
            "temperature at the first image; replaces the recorded one",
        ),
        parameter("to", "C", DefaultValue::Optional("the recorded temperatures"), "temperature at the last image"),
        parameter(
            "warm_up",
            "s",
            DefaultValue::Optional("an even rise"),
            "time constant of the way from `from` to `to`: fast at first, then ever slower",
        ),
        parameter(
            "reference",
            "C",
            DefaultValue::Optional("mean of the recorded temperatures"),
            "temperature of the calibration",
        ),
    ],
    prepare,
};

/// Steps per lag of the integration: with a Runge-Kutta step of fourth order the error is below 1e-7 of a change.
const STEPS_PER_LAG: f64 = 20.0;
/// After so many lags nothing is left of the start (exp(-40) < 1e-17), so a long pause need not be followed in full.
const MEMORY_LAGS: f64 = 40.0;

struct TemperatureFocal {
    /// Change of the focal length by image: px, and in parts of it.
    px: Vec<f64>,
    parts: Vec<f64>,
    /// Recorded temperatures, where they are made here.
    recorded: Option<Vec<f64>>,
    notes: Vec<(String, String)>,
}

fn prepare(setting: &mut Setting) -> Prepared {
    let (values, world) = (setting.values, setting.world);
    let lag = values.size("lag")?;
    let (temperatures, made) = match (values.optional("from"), values.optional("to")) {
        (Some(from), Some(to)) => {
            let rise = rise(world, values.optional("warm_up").map(|_| values.positive("warm_up")).transpose()?)?;
            (rise.into_iter().map(|part| from + (to - from) * part).collect::<Vec<_>>(), true)
        }
        (None, None) => {
            ensure!(values.optional("warm_up").is_none(), "`warm_up` needs `from` and `to`");
            let temperature = |image: &crate::block::Image| {
                image
                    .temperature_c
                    .ok_or_else(|| anyhow::anyhow!("image `{}` has no temperature; give `from` and `to`", image.name))
            };
            (world.images.iter().map(temperature).collect::<Result<Vec<_>>>()?, false)
        }
        _ => anyhow::bail!("give both of `from` and `to`, or none"),
    };
    let lens = if lag == 0.0 { temperatures.clone() } else { lagged(&world.times()?, &temperatures, lag) };
    let mean = temperatures.iter().sum::<f64>() / temperatures.len().max(1) as f64;
    let reference = values.optional("reference").unwrap_or(mean);
    let (alpha, expansion) = match values.optional("expansion") {
        Some(ppm) => (0.0, ppm * 1e-6),
        None => (values.number("alpha"), 0.0),
    };
    let range = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        format!("{low} to {high} C")
    };
    let action = TemperatureFocal {
        px: lens.iter().map(|lens| alpha * (lens - reference)).collect(),
        parts: lens.iter().map(|lens| expansion * (lens - reference)).collect(),
        notes: vec![("recorded".into(), range(&temperatures)), ("lens".into(), range(&lens))],
        recorded: made.then_some(temperatures),
    };
    unless(alpha == 0.0 && expansion == 0.0, action)
}

/// How far the temperature has come at each image, 0 at the first and 1 at the last.
fn rise(world: &World, warm_up: Option<f64>) -> Result<Vec<f64>> {
    let mut rise = progress(world, "time")?;
    if let Some(warm_up) = warm_up {
        let times = world.times()?;
        let first = times.iter().copied().fold(f64::INFINITY, f64::min);
        let last = times.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let gained = |seconds: f64| -(-seconds / warm_up).exp_m1();
        for (part, time) in rise.iter_mut().zip(times) {
            *part = gained(time - first) / gained(last - first);
        }
        ensure!(rise.iter().all(|part| part.is_finite()), "parameter `warm_up` is too long: {warm_up} s");
    }
    Ok(rise)
}

/// Temperature of the lens at each image.
fn lagged(times: &[f64], temperatures: &[f64], lag: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
    let mut lens = vec![0.0; times.len()];
    let Some(&first) = order.first() else { return lens };
    let mut now = temperatures[first];
    lens[first] = now;
    for pair in order.windows(2) {
        let (t0, t1) = (times[pair[0]], times[pair[1]]);
        let (air0, air1) = (temperatures[pair[0]], temperatures[pair[1]]);
        let span = t1 - t0;
        let air = |t: f64| if span > 0.0 { air0 + (air1 - air0) * ((t - t0) / span) } else { air1 };
        let mut t = t0;
        if span > MEMORY_LAGS * lag {
            t = t1 - MEMORY_LAGS * lag;
            now = air(t);
        }
        let steps = ((t1 - t) / lag * STEPS_PER_LAG).ceil().max(1.0);
        let h = (t1 - t) / steps;
        for _ in 0..steps as usize {
            let rate = |time: f64, lens: f64| (air(time) - lens) / lag;
            let k1 = rate(t, now);
            let k2 = rate(t + 0.5 * h, now + 0.5 * h * k1);
            let k3 = rate(t + 0.5 * h, now + 0.5 * h * k2);
            let k4 = rate(t + h, now + h * k3);
            now += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            t += h;
        }
        lens[pair[1]] = now;
    }
    lens
}

impl Action for TemperatureFocal {
    fn record(&self, block: &mut Block) {
        if let Some(recorded) = &self.recorded {
            for (image, temperature) in block.images.iter_mut().zip(recorded) {
                image.temperature_c = Some(*temperature);
            }
        }
    }

    fn interior(&self, image: usize, interior: &mut Interior) {
        interior[F] += self.px[image] + interior[F] * self.parts[image];
    }

    fn notes(&self) -> Vec<(String, String)> {
        self.notes.clone()
    }
}
