//! Measurements that are rounded to whole pixels.

use super::tables::{Measured, Table};
use crate::mistakes::Mistake;

/// Fewest measurements: of values with one decimal, chance rounds so many to whole pixels never (1e-40).
const FEWEST: usize = 20;
/// Standard deviation of rounding to a pixel: `1 / sqrt(12)`.
const ROUNDING_PX: f64 = 0.29;
/// Stated standard deviation of marks of whose variance rounding is half. A person points to a pixel or so: above it
/// rounding is the lesser part.
const HALF_ROUNDING_PX: f64 = 0.41;
/// Stated standard deviation of tie points in whose variance rounding is less than a tenth: it is stated with it.
/// Programs state half a pixel whatever they round.
const WITH_ROUNDING_PX: f64 = 0.92;

/// Measurements that are all whole pixels, or all half ones: centres of pixels.
pub fn judge(table: &Table) -> Option<Mistake> {
    if table.rows < FEWEST {
        return None;
    }
    let all = |offset: f64| table.iter().all(|row| row.xy.iter().all(|value| (value + offset).fract() == 0.0));
    let least = if table.of == Measured::Ties { WITH_ROUNDING_PX } else { HALF_ROUNDING_PX };
    let precise = table.iter().any(|row| row.sigma < least);
    // Zeros are whole, too: they are no rounding.
    let vary = table.iter().any(|row| row.xy.iter().any(|value| value.abs() > 2.0));
    if !(precise && vary && (all(0.0) || all(0.5))) {
        return None;
    }
    let sentence = format!(
        "{}: all {} measurements are whole pixels; rounding alone has a standard deviation of {ROUNDING_PX} px.",
        table.of.words(),
        table.rows
    );
    let remedy = format!(
        "Export them with decimals, or state a standard deviation of at least {least} px ({}).",
        table.of.file()
    );
    Some(Mistake::new("whole-pixels", table.of.key(), sentence, remedy).sized(1.0, None, "px"))
}

#[cfg(test)]
mod tests {
    use super::super::tables::{Row, made};
    use super::*;

    fn judged(of: Measured, sigma: f64, change: impl Fn(f64) -> f64) -> Option<Mistake> {
        let rows = made::rows(2).into_iter().map(|row| Row { xy: row.xy.map(&change), sigma, ..row }).collect();
        judge(&made::table(of, rows))
    }

    #[test]
    fn whole_and_half_pixels_are_rounded() {
        let changes: [fn(f64) -> f64; 2] = [f64::round, |value| value.floor() + 0.5];
        for change in changes {
            let found = judged(Measured::Ties, 0.5, change).expect("rounded");
            assert_eq!((found.kind.as_str(), found.value), ("whole-pixels", Some(1.0)));
        }
    }

    #[test]
    fn measurements_may_be_whole_where_they_claim_no_more() {
        assert!(judged(Measured::Ties, 1.0, f64::round).is_none());
        assert!(judged(Measured::Marks, 0.3, f64::round).is_some());
        assert!(judged(Measured::Marks, 0.5, f64::round).is_none());
    }

    #[test]
    fn decimals_are_right() {
        assert!(judged(Measured::Ties, 0.5, |value| (10.0 * value).round() / 10.0).is_none());
        assert!(judged(Measured::Ties, 0.5, |_| 0.0).is_none());
        assert!(judge(&made::table(Measured::Ties, Vec::new())).is_none());
    }
}
