//! One value per image in order, coloured by flight.

use super::super::axes::{Axis, drawable, extent};
use super::super::frame::PlotFrame;
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet, whisker};
use super::super::style::{INK, VERMILLION, series_colour};
use super::super::svg::{Font, Stroke};
use super::{flight_name, height_at, width_or};
use std::collections::BTreeSet;

/// The value of one image.
#[derive(Debug, Clone, Default)]
pub struct ImageBar {
    /// The value, in the unit of [`ImageBars::y`].
    pub value: f64,
    /// Half-length of its error bar; `None` draws none.
    pub whisker: Option<f64>,
    /// Index into [`ImageBars::flights`].
    pub flight: usize,
    /// Whether it is significant; a star stands at such bars.
    pub significant: bool,
    /// What others stand out from: pale.
    pub dimmed: bool,
    /// A value of a part of the image, drawn over the bar; `None` draws none.
    pub part: Option<f64>,
    /// The image's number in its block, for whoever points at the bar; `None` where nobody does.
    pub image: Option<usize>,
    /// The image's name, likewise; may be empty.
    pub name: String,
}

/// Values of images.
#[derive(Debug, Clone, Default)]
pub struct ImageBars {
    /// Title.
    pub title: String,
    /// The order, such as "image in order of time".
    pub order: String,
    /// The quantity and its unit.
    pub y: Axis,
    /// Names of the flights.
    pub flights: Vec<String>,
    /// Images in order.
    pub bars: Vec<ImageBar>,
    /// What the error bars mean, such as "± 2 sigma".
    pub whisker_means: String,
    /// What the star means, such as "p < 0.001".
    pub star_means: String,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 280.0;
const PALE: &str = "#BDBDBD";

/// Draws one bar per image.
pub fn image_bars(chart: &ImageBars) -> String {
    let page = width_or(chart.width, WIDTH);
    let height = height_at(chart.width, HEIGHT);
    let mut sheet = Sheet::new(&chart.title, page);
    let bars: Vec<(usize, &ImageBar)> = chart.bars.iter().enumerate().filter(|(_, b)| drawable(b.value)).collect();
    sheet.left_out(chart.bars.len() - bars.len(), "not finite");
    let broken = bars.iter().filter(|(_, b)| b.whisker.is_some() && ends(b).is_none()).count();
    sheet.left_out(broken, "error bars that are not finite or negative");
    if bars.is_empty() {
        return sheet.finish_empty();
    }
    sheet.legend(&legend(chart, &bars));

    let x = Axis::new(if chart.order.is_empty() { "image" } else { &chart.order }, "").whole();
    let y = Axis { log: false, zero: true, names: Vec::new(), ..chart.y.clone() };
    let n = chart.bars.len() as f64;
    let top = sheet.y + 6.0;
    // A little more than the bars, so that stars stand clear of the frame.
    let room = |b: &ImageBar| {
        ends(b).unwrap_or([b.value, b.part.unwrap_or(b.value)]).map(|v| v + if b.significant { 0.06 * v } else { 0.0 })
    };
    let values = extent(bars.iter().flat_map(|(_, b)| room(b)));
    let Some(ys) = Scale::fit(&y, values, top + height, top) else {
        return sheet.finish_empty();
    };
    let whole = Scale::linear(0.5, n + 0.5, 0.0, page);
    let margin = PlotFrame { x: whole, y: ys }.margin(&x, &y, page);
    let frame = PlotFrame { x: whole.on(margin.left + 6.0, page - 18.0), y: ys };
    frame.draw(&mut sheet.svg, &x, &y);
    frame.zero_line(&mut sheet.svg);

    let slot = frame.x.px(2.0) - frame.x.px(1.0);
    let width = (0.8 * slot).min(40.0);
    for (i, bar) in bars {
        let (x, y) = (frame.x.px(i as f64 + 1.0), frame.y.px(bar.value));
        let zero = frame.y.px(0.0);
        let limits = ends(bar).map(|e| e.map(|v| frame.y.px(v)));
        // Where bars are narrow, whiskers before them would hide their colours: they stand behind, pale and without
        // caps.
        if let Some([a, b]) = limits.filter(|_| slot < 5.0) {
            sheet.svg.line([x, a], [x, b], Stroke::new(PALE, (0.8 * slot).min(1.0)));
        }
        let colour = if bar.dimmed { PALE } else { series_colour(bar.flight) };
        let corner = [x - width / 2.0, zero];
        sheet.svg.named(&bar.name, |svg| svg.bar(corner, [width, y - zero], colour, bar.image));
        if let Some(part) = bar.part.filter(|part| drawable(*part)) {
            let inner = 0.6 * width;
            sheet.svg.rect([x - inner / 2.0, zero], [inner, frame.y.px(part) - zero], VERMILLION, None);
        }
        if let Some(limits) = limits.filter(|_| slot >= 5.0) {
            whisker(&mut sheet.svg, x, limits, INK);
        }
        let tip = limits.map_or(y, |[low, high]| if bar.value < 0.0 { low } else { high });
        if bar.significant {
            let dy = if bar.value < 0.0 { 13.0 } else { -1.0 };
            let [top, bottom] = frame.y.ends();
            sheet.svg.text([x, (tip + dy).clamp(top + 10.0, bottom - 1.0)], "*", Font::new(13.0).bold().middle());
        }
    }
    sheet.y = top + height + margin.bottom;
    sheet.finish()
}

fn ends(bar: &ImageBar) -> Option<[f64; 2]> {
    let half = bar.whisker.filter(|w| *w >= 0.0)?;
    let ends = [bar.value - half, bar.value + half];
    ends.iter().all(|v| drawable(*v)).then_some(ends)
}

fn legend(chart: &ImageBars, bars: &[(usize, &ImageBar)]) -> Vec<(Key, String)> {
    let flights: BTreeSet<usize> = bars.iter().map(|(_, b)| b.flight).collect();
    let mut entries: Vec<(Key, String)> = flights
        .into_iter()
        .map(|f| {
            let name = flight_name(&chart.flights, f);
            (Key::Patch { colour: series_colour(f).into() }, name)
        })
        .collect();
    let or = |text: &str, other: &str| if text.is_empty() { other.to_string() } else { text.to_string() };
    if bars.iter().any(|(_, b)| ends(b).is_some()) {
        entries.push((Key::Whisker, or(&chart.whisker_means, "standard deviation")));
    }
    if bars.iter().any(|(_, b)| b.significant) {
        entries.push((Key::Sign { text: "*".into() }, or(&chart.star_means, "significant")));
    }
    entries
}
