//! Calibration: p-values of blocks in which nothing is wrong are uniform, and a cause is named as often as promised.

use super::super::gather::Row;
use super::{Share, finished};
use crate::math::statistics::kolmogorov_smirnov;
use std::collections::BTreeMap;

/// Probabilities whose quantiles are shown.
pub const QUANTILES: [f64; 7] = [0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9];
/// In the place of an effect: one p-value of each block, that of an effect drawn by the block's number.
const POOLED: &str = "one of each block";

/// p-values of an effect over blocks without it.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Its id.
    pub effect: String,
    /// Number of p-values.
    pub count: usize,
    /// Share of p-values below each of [`QUANTILES`].
    pub below: [f64; QUANTILES.len()],
    /// Largest distance from the uniform distribution, and its p-value.
    pub kolmogorov_smirnov: (f64, f64),
    /// The p-values, in order.
    pub sorted: Vec<f64>,
}

/// By effect, over the cases in which nothing is expected. The p-values of one block are of the same noise, and depend
/// on each other; the last row has one of each block.
pub fn calibration(rows: &[Row]) -> Vec<Calibration> {
    let mut values: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut pooled = Vec::new();
    let blocks = finished(rows).filter(|(row, _)| row.expected.is_empty());
    for (number, (_, outcome)) in blocks.enumerate() {
        for own in &outcome.candidates {
            values.entry(&own.effect).or_default().push(own.p_value);
        }
        if let Some(own) = outcome.candidates.get(number % outcome.candidates.len().max(1)) {
            pooled.push(own.p_value);
        }
    }
    let mut all: Vec<Calibration> = values.into_iter().map(|(effect, values)| of(effect, values)).collect();
    if !pooled.is_empty() {
        all.push(of(POOLED, pooled));
    }
    all
}

fn of(effect: &str, mut sorted: Vec<f64>) -> Calibration {
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    let below = QUANTILES.map(|q| sorted.partition_point(|p| *p <= q) as f64 / count as f64);
    let kolmogorov_smirnov = kolmogorov_smirnov(&sorted, |p| p.clamp(0.0, 1.0));
    Calibration { effect: effect.into(), count, below, kolmogorov_smirnov, sorted }
}

/// Blocks without anything to find in which something is named.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FalseAlarms {
    /// Share of them in which an effect or a mistake is named.
    pub named: Share,
    /// Share of them that are not adequate.
    pub not_adequate: Share,
}

/// `None` where every case has something to find.
pub fn false_alarms(rows: &[Row]) -> Option<FalseAlarms> {
    let blocks: Vec<_> = finished(rows).filter(|(row, _)| row.expected.is_empty()).map(|(_, own)| own).collect();
    let share = |hits: usize| Share { hits, of: blocks.len() };
    let named = share(blocks.iter().filter(|own| !own.said().is_empty()).count());
    let not_adequate = share(blocks.iter().filter(|own| own.verdict != "adequate").count());
    (!blocks.is_empty()).then_some(FalseAlarms { named, not_adequate })
}
