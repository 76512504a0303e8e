//! Series of points in one or several panels, and binned profiles.

use super::super::axes::{Axis, extent};
use super::super::frame::{Margin, PlotFrame};
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet, no_data, whisker};
use super::super::style::{CHOSEN, GREY, Marker, series_colour, series_marker};
use super::super::svg::{Font, Stroke};
use super::{height_at, width_or};

/// How a series is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum LineStyle {
    /// Markers joined by lines.
    #[default]
    LineAndMarkers,
    /// Lines alone.
    Line,
    /// Dashed lines alone, for fitted curves and expected values.
    Dashed,
    /// Markers alone.
    Markers,
    /// Small grey dots: a cloud behind other series.
    Cloud,
}

/// One series.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Name in the legend; series of the same name share colour and marker in all panels.
    pub label: String,
    /// The points, in the order of the line. A value that is not finite interrupts the line.
    pub points: Vec<[f64; 2]>,
    /// Half-length of an error bar per point, in units of y; empty where there are none.
    pub sigma: Vec<f64>,
    /// Lines, markers or both.
    pub style: LineStyle,
    /// What others stand out from: pale.
    pub dimmed: bool,
}

impl Series {
    /// A series of markers joined by lines.
    pub fn new(label: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), points, ..Self::default() }
    }

    /// The same series in another style.
    pub fn style(self, style: LineStyle) -> Self {
        Self { style, ..self }
    }

    /// The same series, dimmed.
    pub fn dimmed(self, dimmed: bool) -> Self {
        Self { dimmed, ..self }
    }

    /// The same series with error bars.
    pub fn sigma(self, sigma: Vec<f64>) -> Self {
        Self { sigma, ..self }
    }
}

/// One plotting area.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Title; may be empty.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series, drawn in order.
    pub series: Vec<Series>,
}

/// One or several panels under one title and one legend.
#[derive(Debug, Clone, Default)]
pub struct LineChart {
    /// Title.
    pub title: String,
    /// Panels, filled row by row.
    pub panels: Vec<Panel>,
    /// Panels per row; 0 counts as 1 (stacked).
    pub columns: usize,
    /// Remark below the plot; may be empty.
    pub note: String,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

/// Mean and sigma in bins, over the single values they come from.
#[derive(Debug, Clone, Default)]
pub struct BinnedProfile {
    /// Title.
    pub title: String,
    /// What the values are held against.
    pub x: Axis,
    /// The values.
    pub y: Axis,
    /// Single values behind the bins; may be empty.
    pub cloud: Vec<[f64; 2]>,
    /// Named rows of bins, each `[x, mean, sigma of the mean]`.
    pub bins: Vec<(String, Vec<[f64; 3]>)>,
    /// The first so many rows are dimmed: the others stand out from them.
    pub dimmed: usize,
    /// What the error bars mean, such as "± 2 sigma of the mean".
    pub bars: String,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

const PANEL_HEIGHT: f64 = 250.0;
/// What lies behind other series.
const PALE: &str = "#B5B5B5";

/// Draws mean and error bar in bins (time, temperature, row, radius, height, ...).
pub fn profile(profile: &BinnedProfile) -> String {
    let mut series = Vec::new();
    if !profile.cloud.is_empty() {
        series.push(Series::new("single values", profile.cloud.clone()).style(LineStyle::Cloud));
    }
    for (k, (label, bins)) in profile.bins.iter().enumerate() {
        let points = bins.iter().map(|b| [b[0], b[1]]).collect();
        let bars = bins.iter().map(|b| b[2]).collect();
        series.push(Series::new(label.clone(), points).sigma(bars).dimmed(k < profile.dimmed));
    }
    let panel = Panel { x: profile.x.clone(), y: profile.y.clone(), series, ..Panel::default() };
    let note = if profile.bars.is_empty() { String::new() } else { format!("Bars: {}.", profile.bars) };
    line_chart(&LineChart { title: profile.title.clone(), panels: vec![panel], columns: 1, note, width: profile.width })
}

/// Draws series in panels.
pub fn line_chart(chart: &LineChart) -> String {
    let columns = chart.columns.clamp(1, chart.panels.len().max(1));
    let mut sheet = Sheet::new(&chart.title, width_or(chart.width, [820.0, 920.0, 1080.0][columns.min(3) - 1]));
    let labels = labels(chart);
    sheet.legend(&legend(chart, &labels));
    for panel in &chart.panels {
        count_left_out(&mut sheet, panel);
    }
    if chart.panels.is_empty() {
        return sheet.finish_empty();
    }
    let slot = (sheet.width - 14.0) / columns as f64;
    // A single panel may be tall, three in a stack should fit a screen.
    let height = PANEL_HEIGHT * if columns > 1 { 1.0 } else { [1.4, 1.0, 0.75][chart.panels.len().min(3) - 1] };
    let height = height_at(chart.width, height);
    let frames: Vec<Option<PlotFrame>> = chart.panels.iter().map(|p| fit(p, slot, height)).collect();
    let margins: Vec<Margin> = chart
        .panels
        .iter()
        .zip(&frames)
        .map(|(p, f)| f.map_or(Margin { left: 60.0, bottom: 40.0 }, |f| f.margin(&p.x, &p.y, slot - 90.0)))
        .collect();
    // Panels of one column stand flush.
    let left = |c: usize| margins.iter().skip(c).step_by(columns).map(|m| m.left).fold(0.0, f64::max);
    for (first, row) in chart.panels.chunks(columns).enumerate().map(|(r, row)| (r * columns, row)) {
        let heading = if row.iter().any(|p| !p.title.is_empty()) { 22.0 } else { 8.0 };
        let top = sheet.y + heading;
        for (c, panel) in row.iter().enumerate() {
            let x0 = 4.0 + c as f64 * slot + left(c);
            let x1 = 4.0 + (c + 1) as f64 * slot - 14.0;
            sheet.svg.text([x0, top - 7.0], &panel.title, Font::new(13.0).bold());
            match frames[first + c] {
                Some(f) => {
                    let frame = PlotFrame { x: f.x.on(x0, x1), y: f.y.on(top + height, top) };
                    frame.draw(&mut sheet.svg, &panel.x, &panel.y);
                    frame.zero_line(&mut sheet.svg);
                    panel.series.iter().for_each(|s| draw(&mut sheet, frame, panel, s, look(chart, &labels, s)));
                }
                None => no_data(&mut sheet.svg, [x0, top], [x1 - x0, height]),
            }
        }
        let bottom = margins[first..first + row.len()].iter().map(|m| m.bottom).fold(0.0, f64::max);
        sheet.y = top + height + bottom;
    }
    if !chart.note.is_empty() {
        sheet.note(chart.note.clone());
    }
    sheet.finish()
}

/// Names in order of appearance, clouds left aside: they have their own grey.
fn labels(chart: &LineChart) -> Vec<&str> {
    let mut all: Vec<&str> = Vec::new();
    for s in chart.panels.iter().flat_map(|p| &p.series).filter(|s| s.style != LineStyle::Cloud) {
        if !all.contains(&s.label.as_str()) {
            all.push(&s.label);
        }
    }
    all
}

/// What tells a series from the others.
#[derive(Clone, Copy)]
struct Look {
    colour: &'static str,
    marker: Marker,
    dashed: bool,
}

/// The look of a series. What stands out from something dimmed has the colour that it has in every figure; each of
/// several has the marker of its dimmed counterpart, and every second one is dashed.
fn look(chart: &LineChart, labels: &[&str], series: &Series) -> Look {
    let all = || chart.panels.iter().flat_map(|p| &p.series);
    let dimmed = |label: &str| all().find(|s| s.label == label).is_some_and(|s| s.dimmed);
    let any = all().any(|s| s.dimmed);
    let before = labels.iter().take_while(|label| **label != series.label);
    let i = before.filter(|label| dimmed(label) == series.dimmed).count();
    let colour = match (series.dimmed, any) {
        (true, _) => PALE,
        (false, true) => CHOSEN,
        (false, false) => series_colour(i),
    };
    Look { colour, marker: series_marker(i), dashed: series.style == LineStyle::Dashed || (any && i % 2 == 1) }
}

fn legend(chart: &LineChart, labels: &[&str]) -> Vec<(Key, String)> {
    let all = || chart.panels.iter().flat_map(|p| &p.series);
    let mut entries = Vec::new();
    for label in labels.iter().filter(|l| !l.is_empty()) {
        let Some(first) = all().find(|s| s.label == **label) else { continue };
        let Look { colour, marker, dashed } = look(chart, labels, first);
        let colour = colour.to_string();
        let key = match first.style {
            LineStyle::Markers => Key::Point { colour, marker },
            LineStyle::LineAndMarkers => Key::Line { colour, dashed, marker: Some(marker) },
            _ => Key::Line { colour, dashed, marker: None },
        };
        entries.push((key, label.to_string()));
    }
    if let Some(cloud) = all().find(|s| s.style == LineStyle::Cloud && !s.label.is_empty()) {
        entries.push((Key::Point { colour: GREY.into(), marker: Marker::Circle }, cloud.label.clone()));
    }
    entries
}

fn shown(panel: &Panel, p: &[f64; 2]) -> bool {
    panel.x.shows(p[0]) && panel.y.shows(p[1])
}

/// Ends of an error bar, cut at the axis where a log axis cannot show the lower one.
fn bar(panel: &Panel, series: &Series, k: usize) -> Option<[f64; 2]> {
    let (y, s) = (series.points[k][1], *series.sigma.get(k)?);
    let ends = [y - s, y + s];
    (s >= 0.0 && ends.iter().all(|v| panel.y.shows(*v))).then_some(ends)
}

fn fit(panel: &Panel, width: f64, height: f64) -> Option<PlotFrame> {
    let points = || panel.series.iter().flat_map(|s| s.points.iter().filter(|p| shown(panel, p)));
    let bars = panel.series.iter().flat_map(|s| {
        (0..s.points.len()).filter(|k| shown(panel, &s.points[*k])).filter_map(|k| bar(panel, s, k)).flatten()
    });
    points().next()?;
    Some(PlotFrame {
        x: Scale::fit(&panel.x, extent(points().map(|p| p[0])), 0.0, width)?,
        y: Scale::fit(&panel.y, extent(points().map(|p| p[1]).chain(bars)), height, 0.0)?,
    })
}

fn count_left_out(sheet: &mut Sheet, panel: &Panel) {
    use super::super::axes::drawable;
    let all = || panel.series.iter().flat_map(|s| &s.points);
    let broken = all().filter(|p| !p.iter().all(|v| drawable(*v))).count();
    let hidden = all().filter(|p| p.iter().all(|v| drawable(*v)) && !shown(panel, p)).count();
    let place = if panel.title.is_empty() { String::new() } else { format!(" in “{}”", panel.title) };
    sheet.left_out(broken, &format!("not finite{place}"));
    sheet.left_out(hidden, &format!("not positive, on a logarithmic axis{place}"));
    let bars = panel.series.iter().map(|s| {
        (0..s.sigma.len().min(s.points.len()))
            .filter(|k| shown(panel, &s.points[*k]) && bar(panel, s, *k).is_none())
            .count()
    });
    sheet.left_out(bars.sum(), &format!("error bars that reach below the axis or are not finite{place}"));
}

fn draw(sheet: &mut Sheet, frame: PlotFrame, panel: &Panel, series: &Series, look: Look) {
    let Look { colour, marker, dashed } = look;
    let style = series.style;
    let pixels = |p: &[f64; 2]| frame.px(*p);
    if style == LineStyle::Cloud {
        let dots: Vec<_> = series.points.iter().filter(|p| shown(panel, p)).map(pixels).collect();
        return sheet.svg.dots(&dots, 1.8, PALE);
    }
    if style != LineStyle::Markers {
        for run in series.points.split(|p| !shown(panel, p)) {
            let line: Vec<_> = run.iter().map(pixels).collect();
            sheet.svg.polyline(&line, Stroke::new(colour, 1.8).dashed(dashed));
        }
    }
    for k in (0..series.points.len()).filter(|k| shown(panel, &series.points[*k])) {
        if let Some([a, b]) = bar(panel, series, k) {
            whisker(&mut sheet.svg, frame.x.px(series.points[k][0]), [frame.y.px(a), frame.y.px(b)], colour);
        }
    }
    if matches!(style, LineStyle::LineAndMarkers | LineStyle::Markers) {
        let radius = if series.points.len() > 80 { 2.4 } else { 4.0 };
        for p in series.points.iter().filter(|p| shown(panel, p)) {
            sheet.svg.marker(frame.px(*p), marker, radius, colour);
        }
    }
}
