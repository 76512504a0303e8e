//! What a campaign says: how often the diagnosis is right, whether its p-values are, and which factor matters.

mod anova;
mod calibration;
mod confusion;
mod page;
mod power;

pub use anova::{Anova, Source, anova};
pub use calibration::{Calibration, FalseAlarms, QUANTILES, calibration, false_alarms};
pub use confusion::{Confusion, confusion};
pub use page::{page, tables};
pub use power::{Power, power};

use super::gather::Row;
use super::outcome::Outcome;
use crate::math::statistics::normal_quantile;

/// Factor of repetitions, over which shares are taken.
pub const REPEATED: &str = "seed";

/// Level of an interval of a share.
const COVERED: f64 = 0.95;

/// Finished cases.
fn finished(rows: &[Row]) -> impl Iterator<Item = (&Row, &Outcome)> {
    rows.iter().filter_map(|row| Some((row, row.outcome.as_ref()?)))
}

/// A share of cases with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Cases that count.
    pub hits: usize,
    /// All.
    pub of: usize,
}

impl Share {
    /// Hits among all.
    pub fn value(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// The interval of Wilson (1927), which holds for shares near zero and one, too.
    pub fn interval(self) -> [f64; 2] {
        let (n, p) = (self.of as f64, self.value());
        let z = normal_quantile(0.5 + 0.5 * COVERED);
        let middle = p + z * z / (2.0 * n);
        let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [middle - half, middle + half].map(|end| (end / (1.0 + z * z / n)).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Newcombe (1998), Statistics in Medicine 17, table I: 81 of 263, and 0 of 20.
    #[test]
    fn an_interval_as_published() {
        let near = |share: Share, expected: [f64; 2]| {
            let found = share.interval();
            assert!(found.iter().zip(expected).all(|(own, known)| (own - known).abs() < 5e-5), "{found:?}");
        };
        near(Share { hits: 81, of: 263 }, [0.2553, 0.3662]);
        near(Share { hits: 0, of: 20 }, [0.0, 0.1611]);
    }
}
