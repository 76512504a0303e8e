//! What an axis shows, and which values it can.

/// What an axis shows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Axis {
    /// The quantity.
    pub label: String,
    /// Its unit; empty where there is none.
    pub unit: String,
    /// Logarithmic; values that are not positive cannot be drawn and are counted in a note.
    pub log: bool,
    /// The axis reaches zero at least (bars, magnitudes). Ignored on a log axis.
    pub zero: bool,
    /// Ticks at whole numbers only (counts, steps).
    pub whole: bool,
    /// Shown range; `None` takes it from the data. Data outside widens it: nothing is cut off.
    pub range: Option<[f64; 2]>,
    /// Names that stand at 0, 1, 2, ... instead of numbers.
    pub names: Vec<String>,
}

impl Axis {
    /// A linear axis that takes its range from the data.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), ..Self::default() }
    }

    /// The same axis, logarithmic.
    pub fn log(self) -> Self {
        Self { log: true, ..self }
    }

    /// The same axis, reaching zero.
    pub fn from_zero(self) -> Self {
        Self { zero: true, ..self }
    }

    /// The same axis, with ticks at whole numbers.
    pub fn whole(self) -> Self {
        Self { whole: true, ..self }
    }

    /// The same axis, showing this range at least.
    pub fn range(self, from: f64, to: f64) -> Self {
        Self { range: Some([from, to]), ..self }
    }

    /// An axis of names at 0, 1, 2, ...
    pub fn named<S: Into<String>>(label: impl Into<String>, names: impl IntoIterator<Item = S>) -> Self {
        Self { label: label.into(), names: names.into_iter().map(Into::into).collect(), ..Self::default() }
    }

    /// Whether a value can be drawn on this axis.
    pub(super) fn shows(&self, v: f64) -> bool {
        drawable(v) && (!self.log || v > 0.0)
    }
}

/// Finite, and far enough from the ends of f64 that ranges do not overflow.
pub(super) fn drawable(v: f64) -> bool {
    v.is_finite() && v.abs() < 1e150
}

/// Smallest and largest of the drawable values.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values.into_iter().filter(|v| drawable(*v)).fold(None, |e, v| match e {
        None => Some([v, v]),
        Some([lo, hi]) => Some([lo.min(v), hi.max(v)]),
    })
}

/// The largest of 1, 2, 5 times a power of ten that is not above `v` (1 if `v` is not positive).
pub(super) fn round_below(v: f64) -> f64 {
    if !(v.is_finite() && v > 1e-150) {
        return 1.0;
    }
    let decade = 10f64.powi(v.log10().floor() as i32);
    // A hair of tolerance, so that 0.3 / 0.1 counts as 3.
    [5.0, 2.0, 1.0].into_iter().map(|m| m * decade).find(|s| *s <= v * (1.0 + 1e-12)).unwrap_or(decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_numbers() {
        assert_eq!(
            [round_below(7.0), round_below(0.3), round_below(0.2), round_below(1000.0)],
            [5.0, 0.2, 0.2, 1000.0]
        );
    }
}
