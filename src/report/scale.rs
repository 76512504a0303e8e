//! Scales from data to pixels, with round ticks whose labels stay short.

use super::axes::{Axis, extent, round_below};
use super::svg::{Side, text_width};

/// Size of tick labels, pixels.
pub(super) const TICK_SIZE: f64 = 12.0;

/// A map from data to pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    lo: f64,
    hi: f64,
    log: bool,
    from: f64,
    to: f64,
}

impl Scale {
    /// Covers the axis' range and the data with a margin, on the pixels `from..to`. `None` where there is nothing to
    /// show.
    pub fn fit(axis: &Axis, data: Option<[f64; 2]>, from: f64, to: f64) -> Option<Self> {
        let named = (!axis.names.is_empty()).then(|| [-0.5, axis.names.len() as f64 - 0.5]);
        let fixed = axis.range.filter(|r| axis.shows(r[0]) && axis.shows(r[1]) && r[0] < r[1]).or(named);
        let [lo, hi] = extent(data.into_iter().flatten().chain(fixed.into_iter().flatten()))?;
        if axis.log && lo <= 0.0 {
            return None;
        }
        let (mut lo, mut hi) = if axis.log { (lo.log10(), hi.log10()) } else { (lo, hi) };
        if axis.zero && !axis.log {
            (lo, hi) = (lo.min(0.0), hi.max(0.0));
        }
        let size = lo.abs().max(hi.abs());
        if hi - lo < (1e-12 * size).max(1e-150) {
            let half = if axis.log { 0.3 } else { (0.05 * size).max(if size < 1e-140 { 1.0 } else { 0.0 }) };
            (lo, hi) = (lo - half, hi + half);
        } else if fixed != Some([lo, hi]) {
            let margin = 0.04 * (hi - lo);
            let keeps_zero = axis.zero && !axis.log;
            (lo, hi) = (
                if keeps_zero && lo == 0.0 { 0.0 } else { lo - margin },
                if keeps_zero && hi == 0.0 { 0.0 } else { hi + margin },
            );
        }
        Some(Self { lo, hi, log: axis.log, from, to })
    }

    /// A linear scale over exactly this range.
    pub fn linear(lo: f64, hi: f64, from: f64, to: f64) -> Self {
        Self { lo, hi, log: false, from, to }
    }

    /// Pixel of a value.
    pub fn px(&self, v: f64) -> f64 {
        let v = if self.log { v.log10() } else { v };
        self.from + (v - self.lo) / (self.hi - self.lo) * (self.to - self.from)
    }

    /// Value at a pixel of a linear scale.
    pub fn value(&self, px: f64) -> f64 {
        self.lo + (px - self.from) / (self.to - self.from) * (self.hi - self.lo)
    }

    /// Pixels of both ends, smaller first.
    pub fn ends(&self) -> [f64; 2] {
        [self.from.min(self.to), self.from.max(self.to)]
    }

    /// The side of a plotting area that it belongs to.
    pub fn side<'a>(&self, label: &'a str) -> Side<'a> {
        let value = |v: f64| if self.log { 10f64.powf(v) } else { v };
        Side { pixels: [self.from, self.to], values: [value(self.lo), value(self.hi)], is_log: self.log, label }
    }

    /// Whether zero lies strictly inside.
    pub fn crosses_zero(&self) -> bool {
        !self.log && self.lo < 0.0 && self.hi > 0.0
    }

    /// The same range on other pixels.
    pub fn on(self, from: f64, to: f64) -> Self {
        Self { from, to, ..self }
    }

    /// Ticks about `gap` pixels apart.
    pub fn ticks(&self, axis: &Axis, gap: f64) -> Ticks {
        if !axis.names.is_empty() {
            return Ticks {
                at: (0..axis.names.len()).map(|i| i as f64).collect(),
                labels: axis.names.clone(),
                ..Ticks::default()
            };
        }
        let count = ((self.to - self.from).abs() / gap).max(2.0);
        if self.log { self.log_ticks(count) } else { self.linear_ticks(count, axis.whole) }
    }

    fn linear_ticks(&self, count: f64, whole: bool) -> Ticks {
        // The next round step above range / count.
        let step = 10.0 / round_below(10.0 * count / (self.hi - self.lo));
        let ends = |step: f64| {
            let tol = 1e-9 * (self.hi - self.lo) / step;
            ((self.lo / step - tol).ceil(), (self.hi / step + tol).floor())
        };
        // One tick alone tells no scale: two steps finer there are two of them.
        let finer = |step: f64| round_below(0.7 * step);
        let lone = |step: &f64| ends(*step).1 - ends(*step).0 < 1.0;
        let step = [step, finer(step), finer(finer(step))].into_iter().find(|step| !lone(step)).unwrap_or(step);
        let step = if whole { step.max(1.0) } else { step };
        let (first, last) = ends(step);
        let at: Vec<f64> = (0..=((last - first).clamp(0.0, 100.0) as i64)).map(|i| (first + i as f64) * step).collect();
        let size = self.lo.abs().max(self.hi.abs());
        let mut ticks = Ticks::default();
        // Labels of more than six digits, or far from zero (grid coordinates): a round number is taken off and named in
        // the axis label.
        if size / step > 1e6 || (size >= 1e5 && self.hi - self.lo < 0.2 * size) {
            let block = 10f64.powf((self.hi - self.lo).log10().ceil());
            ticks.offset = (self.lo / block).floor() * block;
        }
        let shown = at.iter().map(|v| (v - ticks.offset).abs()).fold(0.0, f64::max);
        if shown >= 1e5 || (shown < 1e-2 && shown > 0.0) {
            ticks.exponent = 3 * (shown.log10() / 3.0).floor() as i32;
        }
        let unit = 10f64.powi(ticks.exponent);
        let decimals = (-(step / unit).log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
        ticks.labels = at
            .iter()
            .map(|v| {
                let text = format!("{:.decimals$}", (v - ticks.offset) / unit);
                if text.trim_start_matches('-').chars().all(|c| "0.".contains(c)) {
                    "0".into()
                } else {
                    text.replace('-', "−")
                }
            })
            .collect();
        ticks.at = at;
        ticks
    }

    fn log_ticks(&self, count: f64) -> Ticks {
        let decades = self.hi - self.lo;
        let every = (decades / count).ceil().max(1.0) as i32;
        let digits: &[f64] = if decades < 0.5 * count && decades < 3.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let mut ticks = Ticks::default();
        for e in (self.lo.floor() as i32)..=(self.hi.ceil() as i32) {
            for d in digits {
                let v = d * 10f64.powi(e);
                let inside = v.log10() >= self.lo - 1e-9 && v.log10() <= self.hi + 1e-9;
                if e % every == 0 && inside {
                    ticks.at.push(v);
                    ticks.labels.push(log_label(*d, e));
                }
            }
        }
        if ticks.at.len() < 2 {
            // Less than a factor of two or so: ticks at both ends.
            ticks.at = vec![10f64.powf(self.lo), 10f64.powf(self.hi)];
            ticks.labels = ticks.at.iter().map(|v| super::numbers::significant(*v, 3)).collect();
        }
        ticks
    }
}

fn log_label(digit: f64, e: i32) -> String {
    if (-3..=4).contains(&e) {
        format!("{:.*}", (-e).max(0) as usize, digit * 10f64.powi(e))
    } else if digit == 1.0 {
        power_of_ten(e)
    } else {
        format!("{digit}·{}", power_of_ten(e))
    }
}

fn power_of_ten(e: i32) -> String {
    let up = |c: char| match c {
        '-' => '⁻',
        c => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][c.to_digit(10).unwrap_or(0) as usize],
    };
    format!("10{}", e.to_string().chars().map(up).collect::<String>())
}

/// Where ticks stand and what they say.
#[derive(Debug, Clone, Default)]
pub(super) struct Ticks {
    pub at: Vec<f64>,
    pub labels: Vec<String>,
    offset: f64,
    exponent: i32,
}

impl Ticks {
    /// Widest label, pixels.
    pub fn width(&self) -> f64 {
        self.labels.iter().map(|l| text_width(l, TICK_SIZE)).fold(0.0, f64::max)
    }

    /// The axis label with unit, and with what was taken off the tick labels.
    pub fn axis_label(&self, axis: &Axis) -> String {
        let taken = if self.offset == 0.0 {
            String::new()
        } else {
            format!(" {} {:.0}", if self.offset > 0.0 { '−' } else { '+' }, self.offset.abs())
        };
        let factor = if self.exponent == 0 { String::new() } else { power_of_ten(self.exponent) };
        let unit = [factor, axis.unit.clone()].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join(" ");
        if unit.is_empty() { format!("{}{taken}", axis.label) } else { format!("{}{taken} ({unit})", axis.label) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(lo: f64, hi: f64) -> (Vec<String>, String) {
        let axis = Axis::new("v", "m");
        let t = Scale::linear(lo, hi, 0.0, 400.0).ticks(&axis, 80.0);
        (t.labels.clone(), t.axis_label(&axis))
    }

    #[test]
    fn ticks_are_round_and_large_or_small_numbers_move_into_the_label() {
        assert_eq!(labels(0.0, 10.0), (["0", "2", "4", "6", "8", "10"].map(String::from).to_vec(), "v (m)".into()));
        assert_eq!(labels(-1.0, 1.0).0[0], "−1.0");
        assert_eq!(labels(0.0, 1e-5).1, "v (10⁻⁶ m)");
        assert_eq!(labels(654_300_010.0, 654_300_090.0).1, "v − 654300000 (m)");
        assert_eq!(labels(452_300.0, 457_300.0).1, "v − 450000 (m)");
        assert_eq!(labels(5510.0, 5510.5).0[1], "5510.1");
    }

    #[test]
    fn no_axis_has_a_lone_tick() {
        for end in [1.0, 1.3, 1.9, 2.4, 3.7, 4.9, 6.2, 9.9] {
            for (lo, hi) in [(-end, end), (-0.1 * end, end), (-end, 0.3 * end)] {
                let ticks = Scale::linear(lo, hi, 0.0, 90.0).ticks(&Axis::new("v", "px"), 42.0);
                assert!((2..8).contains(&ticks.at.len()), "{lo} to {hi}: {:?}", ticks.labels);
            }
        }
    }

    #[test]
    fn log_ticks_stand_at_decades() {
        let axis = Axis::new("v", "").log();
        let s = Scale::fit(&axis, Some([0.01, 1e6]), 0.0, 800.0).expect("a scale");
        let t = s.ticks(&axis, 80.0);
        assert_eq!(t.labels[0], "0.01");
        assert_eq!(t.labels.last().map(String::as_str), Some("10⁶"));
    }

    #[test]
    fn degenerate_ranges_still_make_finite_scales() {
        let axis = Axis::new("v", "");
        for data in [[0.0, 0.0], [5510.09; 2], [1e-200; 2], [-1e149, 1e149], [1.0, 1.0 + 1e-16]] {
            let s = Scale::fit(&axis, Some(data), 0.0, 100.0).expect("a scale");
            assert!((0.0..=100.0).contains(&s.px(data[0])), "{data:?}");
            assert!(s.ticks(&axis, 40.0).at.len() <= 101);
        }
        assert!(Scale::fit(&axis, None, 0.0, 1.0).is_none());
    }
}
