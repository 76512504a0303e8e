//! Distributions as histograms.

use super::super::axes::{Axis, drawable, extent, round_below};
use super::super::frame::PlotFrame;
use super::super::numbers::significant;
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet};
use super::super::style::{CHOSEN, series_colour};
use super::super::svg::Stroke;
use super::{height_at, width_or};

/// Values of one kind.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// Name in the legend; may be empty where there is one sample.
    pub label: String,
    /// The values.
    pub values: Vec<f64>,
    /// What others stand out from: pale.
    pub dimmed: bool,
}

/// One or several samples in the same bins. One is drawn filled, several as outlines.
#[derive(Debug, Clone, Default)]
pub struct Histogram {
    /// Title.
    pub title: String,
    /// The quantity and its unit; its `log` is ignored.
    pub x: Axis,
    /// The samples.
    pub samples: Vec<Sample>,
    /// About how many bins; 0 counts as 40. Their width is a round number.
    pub bins: usize,
    /// Shown range of the counts at least; `None` takes it from the data.
    pub counts: Option<[f64; 2]>,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 280.0;
const PALE: &str = "#B5B5B5";

/// Draws a histogram.
pub fn histogram(histogram: &Histogram) -> String {
    let width = width_or(histogram.width, WIDTH);
    let height = height_at(histogram.width, HEIGHT);
    let mut sheet = Sheet::new(&histogram.title, width);
    let all = || histogram.samples.iter().flat_map(|s| &s.values).copied();
    sheet.left_out(all().filter(|v| !drawable(*v)).count(), "not finite");
    let Some([lo, hi]) = extent(all()) else {
        return sheet.finish_empty();
    };
    let wanted = if histogram.bins == 0 { 40 } else { histogram.bins.min(400) };
    let size = lo.abs().max(hi.abs());
    let range = hi - lo;
    let step = if range <= 1e-9 * size || range < 1e-140 {
        0.1 * size.max(1e-3)
    } else {
        round_below(range / wanted as f64 * 1.5)
    };
    let first = (lo / step).floor();
    let n = ((hi / step).floor() - first) as usize + 1;
    let counts: Vec<Vec<usize>> = histogram.samples.iter().map(|s| count(&s.values, step, first, n)).collect();

    let several = histogram.samples.len() > 1;
    let mut entries = Vec::new();
    for (i, s) in histogram.samples.iter().enumerate().filter(|(_, s)| several || !s.label.is_empty()) {
        let used = s.values.iter().filter(|v| drawable(**v)).count();
        let colour = colour(histogram, i).to_string();
        let key = if several { Key::Line { colour, dashed: i % 2 == 1, marker: None } } else { Key::Patch { colour } };
        entries.push((key, format!("{} (n = {used})", s.label)));
    }
    sheet.legend(&entries);

    let x = Axis { log: false, names: Vec::new(), ..histogram.x.clone() };
    let y = Axis { range: histogram.counts, ..Axis::new("count per bin", "").from_zero().whole() };
    let most = counts.iter().flatten().copied().max().unwrap_or(0) as f64;
    let top = sheet.y + 6.0;
    let edges = [first * step, (first + n as f64) * step];
    let scales = Scale::fit(&x, Some(edges), 0.0, width).zip(Scale::fit(&y, Some([0.0, most]), top + height, top));
    let Some((xs, ys)) = scales else {
        return sheet.finish_empty();
    };
    let margin = PlotFrame { x: xs, y: ys }.margin(&x, &y, width);
    let frame = PlotFrame { x: xs.on(margin.left + 6.0, width - 18.0), y: ys };
    frame.draw(&mut sheet.svg, &x, &y);
    for (i, counts) in counts.iter().enumerate() {
        let edge = |k: usize| (first + k as f64) * step;
        if several {
            let mut outline = vec![frame.px([edge(0), 0.0])];
            for (k, c) in counts.iter().enumerate() {
                outline.extend([frame.px([edge(k), *c as f64]), frame.px([edge(k + 1), *c as f64])]);
            }
            outline.push(frame.px([edge(n), 0.0]));
            let colour = colour(histogram, i);
            sheet.svg.polyline(&outline, Stroke::new(colour, 1.8).dashed(i % 2 == 1));
        } else {
            for (k, c) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
                let (a, b) = (frame.px([edge(k), 0.0]), frame.px([edge(k + 1), *c as f64]));
                let white = Some(Stroke::new("#FFFFFF", 0.8));
                sheet.svg.rect(a, [b[0] - a[0], b[1] - a[1]], series_colour(i), white);
            }
        }
    }
    sheet.y = top + height + margin.bottom;
    sheet.note(format!("Width of a bin: {} {}", significant(step, 1), x.unit));
    sheet.finish()
}

/// Colour of the i-th sample; what stands out from something dimmed has the colour that it has in every figure.
fn colour(histogram: &Histogram, i: usize) -> &'static str {
    match histogram.samples[i].dimmed {
        true => PALE,
        false if histogram.samples.iter().any(|sample| sample.dimmed) => CHOSEN,
        false => series_colour(i),
    }
}

fn count(values: &[f64], step: f64, first: f64, n: usize) -> Vec<usize> {
    let mut counts = vec![0; n];
    for v in values.iter().filter(|v| drawable(**v)) {
        let k = ((v / step).floor() - first) as usize;
        counts[k.min(n - 1)] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_counted_once() {
        assert_eq!(count(&[0.0, 0.5, 0.99, 1.0, 2.5, f64::NAN], 1.0, 0.0, 3), vec![3, 1, 1]);
    }
}
