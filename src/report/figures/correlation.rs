//! A matrix of correlations between named candidates.

use super::super::axes::{Axis, drawable};
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet};
use super::super::style::{INK, MISSING, diverging, is_dark};
use super::super::svg::{Font, Stroke, text_width};
use super::heat_map::colour_bar;

/// Correlations.
#[derive(Debug, Clone, Default)]
pub struct CorrelationMatrix {
    /// Title.
    pub title: String,
    /// Names of rows and columns.
    pub names: Vec<String>,
    /// `names.len()` squared values in -1..=1, row by row. NaN is a pair without a value.
    pub values: Vec<f64>,
    /// Pairs of at least this magnitude are framed; none for a value above 1.
    pub threshold: f64,
}

/// More names than this, and the numbers within the cells would not be legible.
const MOST_NUMBERS: usize = 24;
const LABEL: f64 = 12.0;

/// Draws a matrix of correlations.
pub fn correlation_matrix(matrix: &CorrelationMatrix) -> String {
    let n = matrix.names.len();
    let cell = if n <= 12 {
        44.0
    } else if n <= MOST_NUMBERS {
        34.0
    } else {
        16.0
    };
    let longest = matrix.names.iter().map(|s| text_width(s, LABEL)).fold(0.0, f64::max);
    let left = longest + 26.0;
    // Names above the columns lean to the right, and need room beyond the last one, or stand upright where columns are
    // narrow.
    let upright = n > MOST_NUMBERS;
    let lean = if upright { longest } else { 0.72 * longest };
    let width = (left + cell * n as f64 + lean.max(110.0) + 20.0).max(480.0);
    let mut sheet = Sheet::new(&matrix.title, width);
    let value = |i: usize, j: usize| matrix.values.get(i * n + j).copied().filter(|v| drawable(*v));
    let missing = (0..n * n).filter(|k| value(k / n, k % n).is_none()).count();
    if n == 0 || missing == n * n {
        return sheet.finish_empty();
    }
    let mut entries = Vec::new();
    if matrix.threshold <= 1.0 {
        entries.push((Key::PlotFrame, format!("framed: |r| ≥ {}", matrix.threshold)));
    }
    if missing > 0 {
        entries.push((Key::Patch { colour: MISSING.into() }, format!("cells without value: {missing}")));
    }
    sheet.legend(&entries);

    let top = sheet.y + lean + 14.0;
    for (i, name) in matrix.names.iter().enumerate() {
        let at = (i as f64 + 0.5) * cell;
        sheet.svg.text([left - 8.0, top + at + 4.0], name, Font::new(LABEL).end());
        let turn = if upright { [4.0, -90.0] } else { [2.0, -45.0] };
        sheet.svg.text([left + at + turn[0], top - 6.0], name, Font::new(LABEL).turned(turn[1]));
    }
    let mut framed = Vec::new();
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        let at = [left + j as f64 * cell, top + i as f64 * cell];
        let fill = value(i, j).map_or(MISSING.into(), diverging);
        sheet.svg.rect(at, [cell, cell], &fill, Some(Stroke::new("#FFFFFF", 1.0)));
        let Some(v) = value(i, j) else { continue };
        if n <= MOST_NUMBERS {
            let ink = if is_dark(&fill) { "#FFFFFF" } else { INK };
            let size = if n <= 12 { 12.0 } else { 10.0 };
            let text = super::super::numbers::fixed(v, 2).replace('-', "−");
            sheet.svg.text([at[0] + cell / 2.0, at[1] + cell / 2.0 + 4.0], &text, Font::new(size).middle().colour(ink));
        }
        if i != j && v.abs() >= matrix.threshold {
            framed.push(at);
        }
    }
    for at in framed {
        let inner = [at[0] + 1.5, at[1] + 1.5];
        sheet.svg.rect(inner, [cell - 3.0, cell - 3.0], "none", Some(Stroke::new(INK, 2.0)));
    }
    let bottom = top + cell * n as f64;
    let bar = Scale::linear(-1.0, 1.0, bottom.max(top + 120.0), top);
    let right = left + cell * n as f64 + 24.0;
    colour_bar(&mut sheet, &Axis::new("correlation r", ""), bar, right, &diverging);
    sheet.y = bottom.max(top + 120.0) + 8.0;
    sheet.finish()
}
