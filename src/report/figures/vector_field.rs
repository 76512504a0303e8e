//! Displacements over the sensor, as arrows.

use super::super::axes::{Axis, drawable};
use super::super::frame::PlotFrame;
use super::super::scale::Scale;
use super::super::sheet::{Key, Sheet};
use super::super::style::{BLUE, CHOSEN, GREY, INK, VERMILLION, series_colour, series_marker};
use super::super::svg::Stroke;
use super::{scale_entry, width_or};

/// Place and displacement, `([x, y], [dx, dy])`. Over the sensor x points right and y down, place in px.
pub type Arrow = ([f64; 2], [f64; 2]);

/// Arrows that belong together.
#[derive(Debug, Clone, Default)]
pub struct ArrowSet {
    /// Name in the legend; may be empty where there is one set.
    pub label: String,
    /// The arrows.
    pub arrows: Vec<Arrow>,
    /// Per arrow, whether it is significant; empty where that was not tested.
    pub significant: Vec<bool>,
    /// What others stand out from: pale and thin.
    pub dimmed: bool,
    /// A colour of its own, undashed unless it is not the first.
    pub colour: Option<&'static str>,
}

/// A cell of the sensor, of whose measurements an arrow is the mean.
#[derive(Debug, Clone, Default)]
pub struct Cell {
    /// Middle, px.
    pub centre: [f64; 2],
    /// Width and height, px. What reaches beyond the sensor is not drawn.
    pub size: [f64; 2],
    /// Number of measurements: the more, the stronger its shade.
    pub n: usize,
    /// What it says to whoever points at it.
    pub words: String,
}

/// A vector map over the sensor. The first of several sets is drawn solid, the others dashed above it.
#[derive(Debug, Clone, Default)]
pub struct VectorField {
    /// Title.
    pub title: String,
    /// Sensor width, px.
    pub width_px: f64,
    /// Sensor height, px.
    pub height_px: f64,
    /// Arrows, one or several sets.
    pub sets: Vec<ArrowSet>,
    /// Cells that the arrows are means of, below the arrows; may be empty.
    pub cells: Vec<Cell>,
    /// Places named in the legend, such as the principal point, px.
    pub marks: Vec<(String, [f64; 2])>,
    /// Unit of the displacements.
    pub unit: String,
    /// Figure pixels per unit of displacement; `None` fits the longest arrow. Pictures to be compared share one: the
    /// smaller of their [`VectorField::natural_scale`].
    pub scale: Option<f64>,
    /// Width of the picture, pixels; `None` is that of a page. Text keeps its size.
    pub width: Option<f64>,
}

const WIDTH: f64 = 660.0;
const MAX_HEIGHT: f64 = 600.0;
/// Least room around the sensor, as a part of the longer side.
const BORDER: f64 = 0.02;
const LEFT: f64 = 80.0;
/// What others stand out from.
const PALE: &str = "#B5B5B5";
/// Opacity of the shade of a cell with one measurement, and of the one with most.
const SHADES: [f64; 2] = [0.03, 0.18];

impl VectorField {
    /// A field of one set of arrows.
    pub fn single(title: &str, sensor_px: [f64; 2], arrows: Vec<Arrow>, unit: &str) -> Self {
        Self {
            title: title.into(),
            width_px: sensor_px[0],
            height_px: sensor_px[1],
            sets: vec![ArrowSet { arrows, ..ArrowSet::default() }],
            unit: unit.into(),
            ..Self::default()
        }
    }

    /// Figure pixels per unit at which the longest arrow is about 1.4 times as long as arrows stand apart. `None`
    /// where no arrow has a length.
    pub fn natural_scale(&self) -> Option<f64> {
        let n = self.sets.iter().map(|s| s.arrows.len()).max().unwrap_or(0).max(1) as f64;
        let longest = self.drawn().map(|(_, d)| d[0].hypot(d[1])).fold(0.0, f64::max);
        let width = self.page();
        let area = width * width * (self.height_px / self.width_px).clamp(0.2, 1.0);
        (longest > 1e-140).then(|| (1.4 * (area / n).sqrt()).clamp(22.0, 90.0) / longest)
    }

    fn page(&self) -> f64 {
        width_or(self.width, WIDTH)
    }

    fn drawn(&self) -> impl Iterator<Item = &Arrow> {
        self.sets.iter().flat_map(|s| &s.arrows).filter(|a| complete(a))
    }
}

fn complete((at, d): &Arrow) -> bool {
    at.iter().chain(d).all(|v| drawable(*v))
}

/// Draws a vector map over the sensor.
pub fn vector_field(field: &VectorField) -> String {
    let mut sheet = Sheet::new(&field.title, field.page());
    let total: usize = field.sets.iter().map(|s| s.arrows.len()).sum();
    sheet.left_out(total - field.drawn().count(), "not finite");
    let sensor = [field.width_px, field.height_px];
    if field.drawn().next().is_none() || sensor.iter().any(|s| !(drawable(*s) && *s > 0.0)) {
        return sheet.finish_empty();
    }
    let scale = field.scale.filter(|s| drawable(*s) && *s > 0.0).or_else(|| field.natural_scale());
    sheet.svg.scaled(scale);
    sheet.legend(&legend(field, scale));
    if scale.is_none() {
        sheet.note("All displacements are zero.");
    }

    let (x, y) = (Axis::new("x", "px"), Axis::new("y", "px"));
    let border = border(field, sensor, scale);
    let [w, h] = sensor.map(|s| s + 2.0 * border);
    let left = LEFT;
    let width = (field.page() - left - 20.0).min(MAX_HEIGHT * w / h);
    let (top, height) = (sheet.y + 4.0, width * h / w);
    let frame = PlotFrame {
        x: Scale::linear(-border, sensor[0] + border, left, left + width),
        y: Scale::linear(-border, sensor[1] + border, top, top + height),
    };
    frame.draw(&mut sheet.svg, &x, &y);
    let [corner, opposite] = [frame.px([0.0, 0.0]), frame.px(sensor)];
    let size = [opposite[0] - corner[0], opposite[1] - corner[1]];
    sheet.svg.rect(corner, size, "none", Some(Stroke::new(GREY, 1.0)));

    let most = field.cells.iter().map(|cell| cell.n).max().unwrap_or(0);
    for cell in &field.cells {
        let corner = |side: f64| -> [f64; 2] {
            let at = |k: usize| (cell.centre[k] + 0.5 * side * cell.size[k]).clamp(0.0, sensor[k]);
            frame.px([at(0), at(1)])
        };
        sheet.svg.shade([corner(-1.0), corner(1.0)], opacity(cell.n, most), &cell.words);
    }
    for (i, set) in field.sets.iter().enumerate() {
        // Not significant first, so that it lies below.
        for wanted in [false, true] {
            let mut d = String::new();
            for (k, (at, by)) in set.arrows.iter().enumerate().filter(|(_, a)| complete(a)) {
                if (*set.significant.get(k).unwrap_or(&true) && !set.dimmed) == wanted {
                    let from = frame.px(*at);
                    let s = scale.unwrap_or(0.0);
                    d += &frame.arrow(from, [from[0] + s * by[0], from[1] + s * by[1]]);
                }
            }
            let (colour, dashed) = match (wanted, set.dimmed) {
                (_, true) => (PALE, false),
                (true, _) => style(field, i),
                // What stands out keeps its colour, thin.
                (false, _) if field.sets.iter().any(|set| set.dimmed) => (style(field, i).0, false),
                (false, _) => (GREY, false),
            };
            // The first of several sets is broad, so that it shows below the next one.
            let width = if !wanted {
                0.8
            } else if i == 0 && drawn_out(field) > 1 && set.colour.is_none() {
                3.0
            } else {
                1.5
            };
            sheet.svg.path(&d, Stroke::new(colour, width).dashed(dashed));
        }
    }
    for (k, (_, at)) in field.marks.iter().enumerate().filter(|(_, m)| m.1.iter().all(|v| drawable(*v))) {
        sheet.svg.marker(frame.px(*at), series_marker(k + 5), 6.0, INK);
    }
    sheet.y = top + height + frame.margin(&x, &y, width).bottom;
    sheet.finish()
}

/// How strongly a cell is shaded; one without measurements is not.
fn opacity(n: usize, most: usize) -> f64 {
    let [least, full] = SHADES;
    if n == 0 { 0.0 } else { least + (full - least) * n as f64 / most as f64 }
}

/// Room around the sensor that the arrows leaving it need, px of the sensor.
fn border(field: &VectorField, sensor: [f64; 2], scale: Option<f64>) -> f64 {
    let long = sensor[0].max(sensor[1]);
    let page = (field.page() - LEFT - 20.0).min(MAX_HEIGHT) * 0.85; // about the length of the longer side on the page
    let s = scale.unwrap_or(0.0) * long / page;
    let beyond = |(at, d): &Arrow| {
        let tip = [at[0] + s * d[0], at[1] + s * d[1]];
        (0..2).map(|k| (-tip[k]).max(tip[k] - sensor[k])).fold(0.0, f64::max)
    };
    field.drawn().map(beyond).fold(0.0, f64::max).min(0.3 * long) + BORDER * long
}

/// Number of sets that are not dimmed.
fn drawn_out(field: &VectorField) -> usize {
    field.sets.iter().filter(|set| !set.dimmed).count()
}

/// Colour of the i-th set, and whether it is dashed.
fn style(field: &VectorField, i: usize) -> (&'static str, bool) {
    if let Some(colour) = field.sets[i].colour {
        return (colour, i > 0 && !field.sets[i - 1].dimmed);
    }
    match (drawn_out(field), i) {
        _ if field.sets[i].dimmed => (PALE, false),
        // What stands out from something dimmed.
        (1, 1..) => (CHOSEN, false),
        (1, _) => (BLUE, false),
        (_, 0) => (VERMILLION, false),
        (_, 1) => (BLUE, true),
        _ => (series_colour(i), true),
    }
}

fn legend(field: &VectorField, scale: Option<f64>) -> Vec<(Key, String)> {
    let mut entries = Vec::new();
    for (i, set) in field.sets.iter().enumerate() {
        let (colour, dashed) = style(field, i);
        let tested = !set.significant.is_empty() && !set.dimmed;
        let text = [set.label.as_str(), if tested { "significant" } else { "" }];
        let text: Vec<&str> = text.into_iter().filter(|t| !t.is_empty()).collect();
        if !text.is_empty() {
            entries.push((Key::Arrow { colour: colour.into(), dashed, length: 26.0 }, text.join(", ")));
        }
    }
    if let Some(i) = field.sets.iter().position(|s| !s.dimmed && s.significant.contains(&false)) {
        let dimmed = field.sets.iter().any(|s| s.dimmed);
        let colour = if dimmed { style(field, i).0 } else { GREY };
        let key = Key::Arrow { colour: colour.into(), dashed: false, length: 26.0 };
        entries.push((key, "not significant (thin)".into()));
    }
    let counts = || field.cells.iter().map(|cell| cell.n).filter(|n| *n > 0);
    if let (Some(fewest), Some(most)) = (counts().min(), counts().max()) {
        let key = Key::Shades { opacities: [fewest, fewest.midpoint(most), most].map(|n| opacity(n, most)) };
        entries.push((key, format!("{fewest} to {most} measurements in a cell")));
    }
    for (k, (name, _)) in field.marks.iter().enumerate() {
        entries.push((Key::Point { colour: INK.into(), marker: series_marker(k + 5) }, name.clone()));
    }
    entries.extend(scale.map(|s| scale_entry(s, &field.unit)));
    entries
}
