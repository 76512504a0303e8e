//! A grid of values as coloured cells.

use super::super::axes::{Axis, drawable, extent};
use super::super::frame::PlotFrame;
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet};
use super::super::style::{INK, MISSING, diverging, is_dark, sequential};
use super::super::svg::{Font, Stroke};

/// Colours of a heat map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Colours {
    /// Blue below zero, vermillion above, the same range on both sides.
    #[default]
    Signed,
    /// Light to dark from zero (or the smallest value, if that is below zero) to the largest.
    Magnitude,
}

/// A grid of values, over the sensor or over frequencies.
#[derive(Debug, Clone, Default)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Horizontal axis; its `range` is the outer edges of the grid, `None` counts cells.
    pub x: Axis,
    /// Vertical axis, likewise.
    pub y: Axis,
    /// Whether y points down the page, as on the sensor.
    pub y_down: bool,
    /// Cells in a row.
    pub columns: usize,
    /// Values row by row, the row of smallest y first. NaN is a cell without a value.
    pub values: Vec<f64>,
    /// Cells to be marked with a dot, such as significant ones; empty for none.
    pub marked: Vec<bool>,
    /// What the dot means.
    pub mark_means: String,
    /// The quantity and its unit.
    pub value: Axis,
    /// Colours.
    pub colours: Colours,
    /// Largest magnitude of the colour scale; `None` takes it from the values. Beyond it the end colour is used, and a
    /// note counts the cells.
    pub limit: Option<f64>,
}

const WIDTH: f64 = 800.0;
const MAX_HEIGHT: f64 = 560.0;
const BAR: f64 = 18.0;

/// Draws a grid of values.
pub fn heat_map(map: &HeatMap) -> String {
    let mut sheet = Sheet::new(&map.title, WIDTH);
    let good = map.values.iter().filter(|v| drawable(**v)).count();
    let Some(largest) = map.values.iter().filter(|v| drawable(**v)).map(|v| v.abs()).reduce(f64::max) else {
        return sheet.finish_empty();
    };
    let columns = map.columns.min(map.values.len());
    if columns == 0 {
        return sheet.finish_empty();
    }
    let rows = map.values.len().div_ceil(columns);
    let limit = map.limit.filter(|l| drawable(*l) && *l > 0.0).unwrap_or(if largest > 1e-140 { largest } else { 1.0 });
    let least = extent(map.values.iter().copied()).map_or(0.0, |e| e[0]).min(0.0).max(-limit);
    let colour = |v: f64| match map.colours {
        Colours::Signed => diverging(v / limit),
        Colours::Magnitude => sequential((v - least) / (limit - least)),
    };
    let mut entries = Vec::new();
    if map.marked.contains(&true) {
        let text = if map.mark_means.is_empty() { "significant" } else { &map.mark_means };
        entries.push((Key::Sign { text: "•".into() }, text.to_string()));
    }
    if good < columns * rows {
        entries
            .push((Key::Patch { colour: MISSING.into() }, format!("cells without value: {}", columns * rows - good)));
    }
    sheet.legend(&entries);

    let [xr, yr] = [(&map.x, columns), (&map.y, rows)].map(|(axis, n)| {
        axis.range.filter(|r| r.iter().all(|v| drawable(*v)) && r[0] < r[1]).unwrap_or([0.0, n as f64])
    });
    let plain = |a: &Axis| Axis { log: false, names: Vec::new(), ..a.clone() };
    let (x, y, value) = (plain(&map.x), plain(&map.y), plain(&map.value));
    let top = sheet.y + 8.0;
    // Same scale on both axes where both have the same unit.
    let room = WIDTH - 80.0 - 150.0;
    let ratio = if x.unit == y.unit { (yr[1] - yr[0]) / (xr[1] - xr[0]) } else { 0.7 };
    let height = (room * ratio).clamp(120.0, MAX_HEIGHT);
    let width = if x.unit == y.unit { (height / ratio).clamp(60.0, room) } else { room };
    let (low, high) = if map.y_down { (top, top + height) } else { (top + height, top) };
    let mut frame = PlotFrame { x: Scale::linear(xr[0], xr[1], 0.0, width), y: Scale::linear(yr[0], yr[1], low, high) };
    let margin = frame.margin(&x, &y, width);
    frame.x = frame.x.on(margin.left + 6.0, margin.left + 6.0 + width);
    frame.draw(&mut sheet.svg, &x, &y);

    let (cw, ch) = ((xr[1] - xr[0]) / columns as f64, (yr[1] - yr[0]) / rows as f64);
    let mut beyond = 0;
    for k in 0..columns * rows {
        let v = map.values.get(k).copied().filter(|v| drawable(*v));
        let (c, r) = ((k % columns) as f64, (k / columns) as f64);
        let a = frame.px([xr[0] + c * cw, yr[0] + r * ch]);
        let b = frame.px([xr[0] + (c + 1.0) * cw, yr[0] + (r + 1.0) * ch]);
        let fill = v.map_or(MISSING.into(), colour);
        // A hairline of its own colour closes the seams between cells.
        sheet.svg.rect(a, [b[0] - a[0], b[1] - a[1]], &fill, Some(Stroke::new(&fill, 0.4)));
        beyond += usize::from(v.is_some_and(|v| v.abs() > limit * (1.0 + 1e-12)));
        if map.marked.get(k) == Some(&true) {
            let ink = if is_dark(&fill) { "#FFFFFF" } else { INK };
            let size = (0.35 * (b[0] - a[0]).abs().min((b[1] - a[1]).abs())).clamp(1.5, 5.0);
            sheet.svg.dots(&[[(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]], size, ink);
        }
    }
    let [left, right] = frame.x.ends();
    sheet.svg.rect([left, top], [right - left, height], "none", Some(Stroke::new(INK, 1.0)));
    let from = if map.colours == Colours::Signed { -limit } else { least };
    colour_bar(&mut sheet, &value, Scale::linear(from, limit, top + height, top), right + 24.0, &colour);
    sheet.y = top + height + margin.bottom;
    if beyond > 0 {
        sheet.note(format!("Beyond the colour scale: {beyond} cells, drawn in its end colour."));
    }
    sheet.finish()
}

/// A vertical bar of colours at `left`, with ticks to its right.
pub(super) fn colour_bar(sheet: &mut Sheet, axis: &Axis, scale: Scale, left: f64, colour: &dyn Fn(f64) -> String) {
    const STEPS: usize = 64;
    let [top, bottom] = scale.ends();
    let step = (bottom - top) / STEPS as f64;
    let ticks = scale.ticks(axis, 42.0);
    let range = [scale.value(bottom), scale.value(top)];
    for i in 0..STEPS {
        let at = (i as f64 + 0.5) / STEPS as f64;
        let fill = colour(range[1] + at * (range[0] - range[1]));
        // Each step reaches to the bottom, under the next one: no seams.
        let y = top + i as f64 * step;
        sheet.svg.rect([left, y], [BAR, bottom - y], &fill, None);
    }
    sheet.svg.rect([left, top], [BAR, bottom - top], "none", Some(Stroke::new(INK, 1.0)));
    for (v, label) in ticks.at.iter().zip(&ticks.labels) {
        let y = scale.px(*v);
        sheet.svg.line([left + BAR, y], [left + BAR + 4.0, y], Stroke::new(INK, 1.0));
        sheet.svg.text([left + BAR + 8.0, y + 4.0], label, Font::new(12.0));
    }
    let label = ticks.axis_label(axis);
    let x = left + BAR + 8.0 + ticks.width() + 16.0;
    sheet.svg.text([x, (top + bottom) / 2.0], &label, Font::new(13.0).middle().turned(-90.0));
}
