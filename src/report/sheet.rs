//! The sheet of a figure: title, legend above the plot, notes below it. Legends never cover data.

use super::style::{GREY, INK, Marker, VERMILLION};
use super::svg::{Font, Stroke, Svg, arrow, text_width};

const EDGE: f64 = 14.0;
const LEGEND_SIZE: f64 = 12.5;
const KEY: f64 = 26.0;

/// The sample beside a legend's text.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Key {
    /// A line, with a marker on it where one is given.
    Line { colour: String, dashed: bool, marker: Option<Marker> },
    /// A marker alone.
    Point { colour: String, marker: Marker },
    /// A filled patch.
    Patch { colour: String },
    /// Shades from the faintest to the strongest, as of [`Svg::shade`].
    Shades { opacities: [f64; 3] },
    /// An arrow to the right, of this length.
    Arrow { colour: String, dashed: bool, length: f64 },
    /// An arrow up or down.
    Upright { colour: String, up: bool },
    /// An open square, for framed cells.
    PlotFrame,
    /// A disc of radius 9, filled or open.
    Disc { colour: String, open: bool },
    /// A vertical bar with caps.
    Whisker,
    /// A short text, such as a sign used in the plot.
    Sign { text: String },
}

impl Key {
    fn width(&self) -> f64 {
        match self {
            Key::Arrow { length, .. } => length.max(KEY),
            Key::Shades { .. } => 36.0,
            Key::Line { .. } => KEY,
            Key::Sign { text } => text_width(text, LEGEND_SIZE),
            Key::Disc { .. } => 18.0,
            _ => 14.0,
        }
    }

    fn draw(&self, svg: &mut Svg, x: f64, y: f64) {
        match self {
            Key::Line { colour, dashed, marker } => {
                svg.line([x, y], [x + KEY, y], Stroke::new(colour, 2.0).dashed(*dashed));
                if let Some(m) = marker {
                    svg.marker([x + KEY / 2.0, y], *m, 4.0, colour);
                }
            }
            Key::Point { colour, marker } => svg.marker([x + 7.0, y], *marker, 4.5, colour),
            Key::Patch { colour } => svg.rect([x, y - 6.0], [12.0, 12.0], colour, Some(Stroke::new(GREY, 0.5))),
            Key::Shades { opacities } => {
                for (left, opacity) in [0.0, 12.0, 24.0].into_iter().zip(opacities) {
                    svg.shade([[x + left, y - 6.0], [x + left + 12.0, y + 6.0]], *opacity, "");
                }
            }
            Key::Arrow { colour, dashed, length } => {
                svg.path(&arrow([x, y], [x + length, y]), Stroke::new(colour, 1.6).dashed(*dashed));
            }
            Key::Upright { colour, up } => {
                let (from, to) = if *up { (y + 8.0, y - 8.0) } else { (y - 8.0, y + 8.0) };
                svg.path(&arrow([x + 7.0, from], [x + 7.0, to]), Stroke::new(colour, 1.6));
            }
            Key::PlotFrame => svg.rect([x + 1.0, y - 6.0], [12.0, 12.0], "none", Some(Stroke::new(INK, 2.0))),
            Key::Disc { colour, open } => {
                svg.dots(&[[x + 9.0, y]], 18.0, colour);
                if *open {
                    svg.dots(&[[x + 9.0, y]], 15.0, "#FFFFFF");
                }
            }
            Key::Whisker => whisker(svg, x + 7.0, [y - 7.0, y + 7.0], INK),
            Key::Sign { text } => svg.text([x, y + 4.5], text, Font::new(LEGEND_SIZE).bold()),
        }
    }
}

/// A vertical error bar with caps.
pub(super) fn whisker(svg: &mut Svg, x: f64, ends: [f64; 2], colour: &str) {
    let cap = |y: f64| {
        format!(
            "M{0} {2}L{1} {2}",
            super::svg::coordinate(x - 2.5),
            super::svg::coordinate(x + 2.5),
            super::svg::coordinate(y)
        )
    };
    svg.path(&(cap(ends[0]) + &cap(ends[1])), Stroke::new(colour, 1.0));
    svg.line([x, ends[0]], [x, ends[1]], Stroke::new(colour, 1.0));
}

/// A figure under construction, filled from the top down.
#[derive(Debug)]
pub(super) struct Sheet {
    /// The drawing so far.
    pub svg: Svg,
    /// Full width, pixels.
    pub width: f64,
    /// Where the next thing may begin.
    pub y: f64,
    title: String,
    notes: Vec<(String, &'static str)>,
}

impl Sheet {
    /// A sheet with its title, broken into lines where it is long.
    pub fn new(title: &str, width: f64) -> Self {
        let mut sheet = Self { svg: Svg::default(), width, y: 12.0, title: title.into(), notes: Vec::new() };
        for line in wrapped(title, 16.0 * 1.08, width - 2.0 * EDGE) {
            sheet.y += 16.0;
            sheet.svg.text([EDGE, sheet.y], &line, Font::new(16.0).bold());
            sheet.y += 6.0;
        }
        sheet
    }

    /// A legend below what is there, in as many rows as it needs.
    pub fn legend(&mut self, entries: &[(Key, String)]) {
        if entries.is_empty() {
            return;
        }
        let mut x = EDGE;
        self.y += 14.0;
        for (key, label) in entries {
            let room = self.width - 2.0 * EDGE - key.width() - 6.0;
            let lines = wrapped(label, LEGEND_SIZE, room);
            let text = lines.iter().map(|l| text_width(l, LEGEND_SIZE)).fold(0.0, f64::max);
            let need = key.width() + 6.0 + text;
            if x > EDGE && x + need > self.width - EDGE {
                x = EDGE;
                self.y += 20.0;
            }
            key.draw(&mut self.svg, x, self.y);
            for (i, line) in lines.iter().enumerate() {
                self.y += if i > 0 { 17.0 } else { 0.0 };
                self.svg.text([x + key.width() + 6.0, self.y + 4.5], line, Font::new(LEGEND_SIZE));
            }
            x += need + 20.0;
        }
        self.y += 12.0;
    }

    /// A remark below the plot.
    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push((text.into(), GREY));
    }

    /// A remark that data were not drawn, if there are any.
    pub fn left_out(&mut self, count: usize, why: &str) {
        if count > 0 {
            let values = if count == 1 { "value is" } else { "values are" };
            self.notes.push((format!("Not drawn: {count} {values} {why}."), VERMILLION));
        }
    }

    /// Says in the given area that there is nothing to draw.
    pub fn no_data(&mut self, top_left: [f64; 2], size: [f64; 2]) {
        no_data(&mut self.svg, top_left, size);
    }

    /// The finished picture.
    pub fn finish(mut self) -> String {
        for (note, colour) in std::mem::take(&mut self.notes) {
            for line in wrapped(&note, 12.0, self.width - 2.0 * EDGE) {
                self.y += 16.0;
                self.svg.text([EDGE, self.y], &line, Font::new(12.0).colour(colour));
            }
        }
        self.svg.finish(&self.title, self.width, self.y + 12.0)
    }

    /// The finished picture of a figure that has nothing to show.
    pub fn finish_empty(mut self) -> String {
        self.y += 8.0;
        self.no_data([EDGE, self.y], [self.width - 2.0 * EDGE, 120.0]);
        self.y += 124.0;
        self.finish()
    }
}

/// An empty frame that says "no data".
pub(super) fn no_data(svg: &mut Svg, top_left: [f64; 2], size: [f64; 2]) {
    svg.rect(top_left, size, "#FAFAFA", Some(Stroke::new(GREY, 1.0)));
    let centre = [top_left[0] + size[0] / 2.0, top_left[1] + size[1] / 2.0 + 5.0];
    svg.text(centre, "no data", Font::new(15.0).middle().colour(GREY));
}

/// Words in lines of at most `room` pixels; a longer word gets a line of its own.
fn wrapped(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(line, size) + text_width(word, size) + 0.4 * size <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_titles_are_broken() {
        let lines = wrapped("one two three four five six", 10.0, 60.0);
        assert!(lines.len() > 1);
        assert_eq!(lines.join(" "), "one two three four five six");
    }

    #[test]
    fn what_is_left_out_is_said() {
        let mut s = Sheet::new("t", 300.0);
        s.left_out(0, "not finite");
        s.left_out(1, "not finite");
        let text = s.finish();
        assert_eq!(text.matches("Not drawn").count(), 1);
        assert!(text.contains("1 value is not finite"));
    }
}
