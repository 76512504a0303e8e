//! `focal-temperature`: the focal length follows the temperature of the lens, at once or with a lag.
//!
//! ```text
//! f' = f + a (T_lens - mean T)        a in px/K; positive: the focal length grows when it gets warmer
//! lag = 0:  T_lens = T, the temperature recorded with the image
//! lag > 0:  d T_lens / dt = (T - T_lens) / lag,  T_lens = T at the first recorded temperature,  T piecewise linear in time
//! ```
//!
//! `mean T` is the mean of the recorded temperatures, of the images that have one, with or without lag. Over a segment
//! of length h that ends with T higher by D, the lens falls behind by a further `D (1 - exp(-h/lag)) lag / h`, and
//! what it was behind decays by `exp(-h/lag)`: the solution is exact, and the sum over the segments needs no state.
//! Domain: `lag >= 0`, and with a lag the image's time and the block's temperatures known. The derivative by the lag
//! at `lag = 0` is the one from above, zero where there is no earlier temperature with a time.
//!
//! Source: Daakir et al. (2019), thermal effect on camera calibration.
//!
//! Worked numbers: f = 5000, a = 0.5, T = 24, mean T = 20 gives 5002. With temperatures 20 at 0 s and 30 at 100 s, lag
//! = 50 s, at 100 s the lens is at 30 - 5 (1 - exp(-2)) = 25.6766764162, so f = 5000, a = 0.5, mean T = 25 gives
//! 5000.3383382081.

use super::common::{estimated, hand_on, known, searched};
use super::{
    BlockContext, By, Context, Descriptor, Domain, Effect, ImageContext, Kind, Need, OutsideDomain, Picture, Scope,
    Stage, Words, fill_identity,
};
use crate::camera::F;
use std::sync::LazyLock;

/// See the [module](self).
pub struct FocalTemperature;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "focal-temperature".into(),
    stage: Stage::Interior,
    kind: Kind::Physical,
    summary: "The focal length follows the temperature of the lens, which may lag behind that of the camera.".into(),
    formula: "f += a (T - mean T); with a lag T is the lens's, T_lens' = (T - T_lens)/lag".into(),
    parameters: vec![
        estimated("a", "px/K", Scope::Global, 0.5).up_to(
            3.0,
            "an aluminium barrel has 23e-6 / K, 0.13 px/K at 5500 px; plastic and glass many times that (Daakir et al. \
            2019)",
        ),
        searched("lag", "s", 0.0, 100.0, Domain::Range(0.0, 600.0)),
    ],
    needs: vec![Need::Temperature],
    confused_with: "focal-time (when temperature follows time: it does not in a second flight), focal-flight".into(),
    source: "Daakir et al. 2019".into(),
    picture: Picture::Scale(By::Temperature),
    words: Some(Words {
        what: "The focal length follows the temperature: metal and glass expand, and the lens moves relative to the \
               sensor. A few micrometres are a part in ten thousand of the scale."
            .into(),
        remedy: "Record the camera's temperature and model it, or let the camera reach the outside temperature first."
            .into(),
        tell: "flights whose temperature does not simply rise with time".into(),
    }),
});

impl Effect for FocalTemperature {
    fn descriptor(&self) -> &Descriptor {
        &DESCRIPTOR
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let (a, lag) = (theta[0], theta[1]);
        let mean = known(context.block.mean_temperature_c)?;
        let (behind, behind_by_lag) = lens_behind(context.block, context.image, lag)?;
        let excess = known(context.image.temperature_c)? - behind - mean;
        hand_on(Stage::Interior, input, out);
        out[F] += a * excess;
        if let Some(matrix) = d_input {
            fill_identity(Stage::Interior, matrix);
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            matrix[0] = excess;
            matrix[1] = -a * behind_by_lag;
        }
        Ok(())
    }
}

/// By how much the lens is behind the recorded temperature of the image (K), and the derivative by the lag (K/s).
fn lens_behind(block: &BlockContext, image: &ImageContext, lag: f64) -> Result<(f64, f64), OutsideDomain> {
    if lag.is_nan() || lag < 0.0 {
        return Err(OutsideDomain);
    }
    let earlier = block.temperature_history.partition_point(|row| row[0] <= image.time_s);
    if lag > 0.0 && (!image.time_s.is_finite() || earlier == 0) {
        return Err(OutsideDomain);
    }
    // From the image back in time; `age` is how long ago a segment ended, and `left` is what is left of it since.
    let (mut behind, mut by_lag, mut left) = (0.0, 0.0, 1.0);
    let (mut time, mut temperature) = (image.time_s, image.temperature_c);
    for &[start, at_start] in block.temperature_history[..earlier].iter().rev() {
        let (age, length, rise) = (image.time_s - time, time - start, temperature - at_start);
        (time, temperature) = (start, at_start);
        if lag == 0.0 {
            // From above: only the last segment is not forgotten.
            if length > 0.0 {
                return Ok((0.0, rise / length));
            }
            continue;
        }
        let x = length / lag;
        let decay = -(-x).exp_m1();
        let mean_decay = if x == 0.0 { 1.0 } else { decay / x };
        behind += rise * left * mean_decay;
        by_lag += rise * left / lag * ((1.0 + age / lag) * mean_decay - (1.0 - decay));
        left *= 1.0 - decay;
        if left == 0.0 {
            break;
        }
    }
    Ok((behind, by_lag))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::PARAMETER_COUNT;
    use approx::assert_relative_eq;

    fn focal(block: &BlockContext, image: &ImageContext, theta: [f64; 2]) -> f64 {
        let mut input = [0.0; Stage::Interior.inputs()];
        input[F] = 5000.0;
        let context = Context { block, image, column_px: 0.0, row_px: 0.0, surveyed: None };
        let mut out = [0.0; PARAMETER_COUNT];
        FocalTemperature.eval(&context, &input, &theta, &mut out, None, None).unwrap();
        out[F]
    }

    #[test]
    fn worked_numbers() {
        let mut block = BlockContext { mean_temperature_c: 20.0, ..Default::default() };
        let image = ImageContext { temperature_c: 24.0, ..Default::default() };
        assert_eq!(focal(&block, &image, [0.5, 0.0]), 5002.0);
        block.mean_temperature_c = 25.0;
        block.temperature_history = vec![[0.0, 20.0], [100.0, 30.0]];
        let image = ImageContext { temperature_c: 30.0, time_s: 100.0, ..Default::default() };
        assert_relative_eq!(focal(&block, &image, [0.5, 50.0]), 5_000.338_338_208_1, epsilon = 1e-9);
    }

    /// Against the differential equation integrated in small steps (midpoint rule).
    #[test]
    fn lag_solves_the_differential_equation() {
        let history = vec![[0.0, 20.0], [30.0, 26.0], [35.0, 22.0], [80.0, 22.0], [120.0, 18.0]];
        let (lag, steps, mut lens) = (25.0, 120_000, 20.0);
        let temperature = |t: f64| {
            let k = history.iter().rposition(|row: &[f64; 2]| row[0] <= t).unwrap().min(history.len() - 2);
            let ([t0, value0], [t1, value1]) = (history[k], history[k + 1]);
            value0 + (value1 - value0) * (t - t0) / (t1 - t0)
        };
        let step = 120.0 / f64::from(steps);
        for k in 0..steps {
            let middle = temperature((f64::from(k) + 0.5) * step);
            let half = lens + 0.5 * step * (middle - lens) / lag;
            lens += step * (middle - half) / lag;
        }
        let block = BlockContext { temperature_history: history, ..Default::default() };
        let image = ImageContext { time_s: 120.0, temperature_c: 18.0, ..Default::default() };
        let (behind, _) = lens_behind(&block, &image, lag).unwrap();
        assert_relative_eq!(18.0 - behind, lens, epsilon = 1e-6);
    }

    #[test]
    fn the_derivative_by_the_lag_is_continuous_at_zero() {
        let history = vec![[0.0, 20.0], [10.0, 22.0], [20.0, 21.0]];
        let block = BlockContext { temperature_history: history, ..Default::default() };
        let image = ImageContext { time_s: 20.0, temperature_c: 21.0, ..Default::default() };
        let (none, at_zero) = lens_behind(&block, &image, 0.0).unwrap();
        let (little, beyond) = lens_behind(&block, &image, 1e-3).unwrap();
        assert_eq!((none, at_zero), (0.0, -0.1));
        assert_relative_eq!(little, -1e-4, epsilon = 1e-15);
        assert_relative_eq!(beyond, at_zero, epsilon = 1e-12);
    }
}
