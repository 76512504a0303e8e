//! The models of the 27 sets, by name, with automatic derivatives.

use crate::math::jet::{Jet, Real};
use std::f64::consts::PI;

/// Most parameters of a model (ENSO).
pub const MOST: usize = 9;

/// A number with its derivatives by the parameters.
pub type Value = Jet<f64, MOST>;

/// Names of the sets, those of NIST's files.
pub const NAMES: [&str; 27] = [
    "Misra1a", "Chwirut2", "Chwirut1", "Lanczos3", "Gauss1", "Gauss2", "DanWood", "Misra1b", // lower
    "Kirby2", "Hahn1", "Nelson", "MGH17", "Lanczos1", "Lanczos2", "Gauss3", "Misra1c", "Misra1d", "Roszman1",
    "ENSO", // average
    "MGH09", "Thurber", "BoxBOD", "Rat42", "MGH10", "Eckerle4", "Rat43", "Bennett5", // higher
];

fn sine(x: Value) -> Value {
    x.chain(x.value.sin(), x.value.cos())
}

fn cosine(x: Value) -> Value {
    x.chain(x.value.cos(), -x.value.sin())
}

fn arctangent(x: Value) -> Value {
    x.chain(x.value.atan(), (1.0 + x.value * x.value).recip())
}

fn logarithm(x: Value) -> Value {
    x.chain(x.value.ln(), x.value.recip())
}

/// `base ^ exponent`.
fn power(base: Value, exponent: Value) -> Value {
    (exponent * logarithm(base)).exponential()
}

/// What a set's model predicts at the predictors `x` of a row. `None`: no set of this name.
pub fn predict(name: &str, b: &[Value], x: &[f64]) -> Option<Value> {
    let c = |value: f64| Value::constant(value);
    let at = x[0];
    let decay = |size: Value, rate: Value| size * (-(rate * at)).exponential();
    let bell = |size: Value, centre: Value, width: Value| {
        let t = (c(at) - centre) / width;
        size * (-(t * t)).exponential()
    };
    let wave = |period: Value, by_cosine: Value, by_sine: Value| {
        let phase = c(2.0 * PI * at) / period;
        by_cosine * cosine(phase) + by_sine * sine(phase)
    };
    let polynomial = |b: &[Value]| b.iter().rev().fold(c(0.0), |sum, b| sum * at + *b);
    Some(match name {
        "Misra1a" | "BoxBOD" => b[0] * (c(1.0) - (-(b[1] * at)).exponential()),
        "Misra1b" => {
            let t = c(1.0) + b[1] * (0.5 * at);
            b[0] * (c(1.0) - c(1.0) / (t * t))
        }
        "Misra1c" => b[0] * (c(1.0) - c(1.0) / (c(1.0) + b[1] * (2.0 * at)).root()),
        "Misra1d" => b[0] * b[1] * at / (c(1.0) + b[1] * at),
        "Chwirut1" | "Chwirut2" => (-(b[0] * at)).exponential() / (b[1] + b[2] * at),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => decay(b[0], b[1]) + decay(b[2], b[3]) + decay(b[4], b[5]),
        "Gauss1" | "Gauss2" | "Gauss3" => decay(b[0], b[1]) + bell(b[2], b[3], b[4]) + bell(b[5], b[6], b[7]),
        "DanWood" => b[0] * power(c(at), b[1]),
        "Kirby2" => polynomial(&b[..3]) / polynomial(&[c(1.0), b[3], b[4]]),
        "Hahn1" | "Thurber" => polynomial(&b[..4]) / polynomial(&[c(1.0), b[4], b[5], b[6]]),
        "Nelson" => b[0] - b[1] * at * (-(b[2] * x[1])).exponential(),
        "MGH17" => b[0] + decay(b[1], b[3]) + decay(b[2], b[4]),
        "Roszman1" => b[0] - b[1] * at - arctangent(b[2] / (c(at) - b[3])) * PI.recip(),
        "ENSO" => b[0] + wave(c(12.0), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8]),
        "MGH09" => b[0] * (c(at * at) + b[1] * at) / (c(at * at) + b[2] * at + b[3]),
        "Rat42" => b[0] / (c(1.0) + (b[1] - b[2] * at).exponential()),
        "MGH10" => b[0] * (b[1] / (c(at) + b[2])).exponential(),
        "Eckerle4" => {
            let t = (c(at) - b[2]) / b[1];
            b[0] / b[1] * (t * t * -0.5).exponential()
        }
        "Rat43" => b[0] / power(c(1.0) + (b[1] - b[2] * at).exponential(), c(1.0) / b[3]),
        "Bennett5" => b[0] * power(b[1] + c(at), c(-1.0) / b[2]),
        _ => return None,
    })
}

/// What is observed where a row states `y`: one set takes its logarithm.
pub fn observed(name: &str, y: f64) -> f64 {
    if name == "Nelson" { y.ln() } else { y }
}

/// Groups of parameters of terms of one form: exchanged, they predict the same. A far start may lead to either order.
pub fn exchangeable(name: &str) -> &'static [&'static [usize]] {
    match name {
        "Lanczos1" | "Lanczos2" | "Lanczos3" => &[&[0, 1], &[2, 3], &[4, 5]],
        "MGH17" => &[&[1, 3], &[2, 4]],
        "Gauss1" | "Gauss2" | "Gauss3" => &[&[2, 3, 4], &[5, 6, 7]],
        "ENSO" => &[&[3, 4, 5], &[6, 7, 8]],
        _ => &[],
    }
}
