//! The few SVG elements that the figures are made of. No ids and no clip paths, so that figures can share one page.

use super::style::{GREY, INK, Marker};
use std::fmt::Write;

/// Text made safe for XML and HTML, in element content and in quoted attributes. Control characters, which XML 1.0
/// forbids, become U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}') => out.push('\u{FFFD}'),
            c => out.push(c),
        }
    }
    out
}

/// A coordinate with two decimals at most: a hundredth of a pixel is finer than any screen or printer.
pub(super) fn coordinate(v: f64) -> String {
    let text = format!("{v:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Width of a text in pixels, estimated for a wide sans-serif face, so that what fits here fits in any.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    text.chars().map(|c| if "ijlI.,:;|'()[] ".contains(c) { 0.38 } else { 0.63 }).sum::<f64>() * size
}

/// A side of a plotting area.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side<'a> {
    /// Pixels of its two ends.
    pub pixels: [f64; 2],
    /// Values there.
    pub values: [f64; 2],
    pub is_log: bool,
    pub label: &'a str,
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke<'a> {
    pub colour: &'a str,
    pub width: f64,
    pub dashed: bool,
}

impl<'a> Stroke<'a> {
    pub fn new(colour: &'a str, width: f64) -> Self {
        Self { colour, width, dashed: false }
    }

    pub fn dashed(self, dashed: bool) -> Self {
        Self { dashed, ..self }
    }
}

/// Which part of a text stands at its coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// How a text is set.
#[derive(Debug, Clone, Copy)]
pub(super) struct Font<'a> {
    pub size: f64,
    pub anchor: Anchor,
    pub bold: bool,
    pub colour: &'a str,
    pub turn_deg: f64,
}

impl<'a> Font<'a> {
    pub fn new(size: f64) -> Self {
        Self { size, anchor: Anchor::Start, bold: false, colour: INK, turn_deg: 0.0 }
    }

    pub fn middle(self) -> Self {
        Self { anchor: Anchor::Middle, ..self }
    }

    pub fn end(self) -> Self {
        Self { anchor: Anchor::End, ..self }
    }

    pub fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub fn colour(self, colour: &'a str) -> Self {
        Self { colour, ..self }
    }

    pub fn turned(self, turn_deg: f64) -> Self {
        Self { turn_deg, ..self }
    }
}

/// A growing SVG drawing. Coordinates are pixels, x right, y down.
#[derive(Debug, Default)]
pub(super) struct Svg {
    body: String,
    /// Plotting areas, which lie above everything else and are transparent.
    areas: String,
    /// Pixels per unit of what is drawn as arrows.
    scale: Option<f64>,
}

impl Svg {
    /// Straight line.
    pub fn line(&mut self, a: [f64; 2], b: [f64; 2], stroke: Stroke) {
        self.path(&format!("M{}L{}", pair(a), pair(b)), stroke);
    }

    /// Connected straight lines.
    pub fn polyline(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        if points.len() < 2 {
            return;
        }
        let d: Vec<String> = points.iter().map(|p| pair(*p)).collect();
        self.path(&format!("M{}", d.join("L")), stroke);
    }

    /// Open path from path data.
    pub fn path(&mut self, d: &str, stroke: Stroke) {
        if d.is_empty() {
            return;
        }
        let dash = if stroke.dashed { " stroke-dasharray=\"6 3\"" } else { "" };
        self.put(format_args!(
            "<path d=\"{d}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\" \
             stroke-linejoin=\"round\"{dash}/>",
            stroke.colour,
            coordinate(stroke.width)
        ));
    }

    /// Open paths of one colour, each with what it says to whoever points at it; nameless ones make one element.
    pub fn named_paths<'n>(&mut self, paths: impl Iterator<Item = (String, &'n str)>, stroke: Stroke) {
        let mut nameless = String::new();
        let mut named = String::new();
        for (d, name) in paths {
            match name {
                "" => nameless += &d,
                name => {
                    let _ = write!(named, "<path d=\"{d}\"><title>{}</title></path>", escape(name));
                }
            }
        }
        self.path(&nameless, stroke);
        if !named.is_empty() {
            self.put(format_args!(
                "<g fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\" \
                 stroke-linejoin=\"round\">{named}</g>",
                stroke.colour,
                coordinate(stroke.width)
            ));
        }
    }

    /// What `draw` adds says `name` to whoever points at it; nothing where it is empty.
    pub fn named(&mut self, name: &str, draw: impl FnOnce(&mut Self)) {
        if name.is_empty() {
            return draw(self);
        }
        self.put(format_args!("<g><title>{}</title>", escape(name)));
        draw(self);
        self.put(format_args!("</g>"));
    }

    /// Many round dots of one colour as one element, some 12 bytes each.
    pub fn dots(&mut self, points: &[[f64; 2]], diameter: f64, colour: &str) {
        let d: String = points.iter().map(|p| format!("M{}h0", pair(*p))).collect();
        self.path(&d, Stroke::new(colour, diameter));
    }

    /// Filled rectangle, with an outline if one is given. Negative sizes are turned round.
    pub fn rect(&mut self, at: [f64; 2], size: [f64; 2], fill: &str, outline: Option<Stroke>) {
        let (x, y) = (at[0] + size[0].min(0.0), at[1] + size[1].min(0.0));
        let line = outline
            .map_or(String::new(), |s| format!(" stroke=\"{}\" stroke-width=\"{}\"", s.colour, coordinate(s.width)));
        self.put(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{fill}\"{line}/>",
            coordinate(x),
            coordinate(y),
            coordinate(size[0].abs()),
            coordinate(size[1].abs())
        ));
    }

    /// A filled rectangle that stands for an image of the block.
    pub fn bar(&mut self, at: [f64; 2], size: [f64; 2], fill: &str, image: Option<usize>) {
        let (x, y) = (at[0] + size[0].min(0.0), at[1] + size[1].min(0.0));
        let image = image.map_or(String::new(), |image| format!(" data-image=\"{image}\""));
        self.put(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{fill}\"{image}/>",
            coordinate(x),
            coordinate(y),
            coordinate(size[0].abs()),
            coordinate(size[1].abs())
        ));
    }

    /// A faintly shaded rectangle that says something to whoever points at it.
    pub fn shade(&mut self, [at, opposite]: [[f64; 2]; 2], opacity: f64, words: &str) {
        self.put(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{GREY}\" \
             fill-opacity=\"{}\"><title>{}</title></rect>",
            coordinate(at[0]),
            coordinate(at[1]),
            coordinate(opposite[0] - at[0]),
            coordinate(opposite[1] - at[1]),
            coordinate(opacity),
            escape(words)
        ));
    }

    /// A data point with a thin white rim, so that neighbours stay apart.
    pub fn marker(&mut self, at: [f64; 2], shape: Marker, radius: f64, colour: &str) {
        let (x, y, r) = (at[0], at[1], radius);
        let corners: Vec<[f64; 2]> = match shape {
            Marker::Circle => {
                return self.put(format_args!(
                    "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{colour}\" stroke=\"#FFFFFF\" stroke-width=\"0.6\"/>",
                    coordinate(x),
                    coordinate(y),
                    coordinate(r)
                ));
            }
            Marker::Plus => {
                let d = format!("M{}L{}M{}L{}", pair([x - r, y]), pair([x + r, y]), pair([x, y - r]), pair([x, y + r]));
                return self.path(&d, Stroke::new(colour, 0.6 * r));
            }
            Marker::Square => {
                let h = 0.88 * r;
                vec![[x - h, y - h], [x + h, y - h], [x + h, y + h], [x - h, y + h]]
            }
            Marker::Triangle => vec![[x, y - 1.2 * r], [x + 1.1 * r, y + 0.8 * r], [x - 1.1 * r, y + 0.8 * r]],
            Marker::Wedge => vec![[x, y + 1.2 * r], [x + 1.1 * r, y - 0.8 * r], [x - 1.1 * r, y - 0.8 * r]],
            Marker::Diamond => vec![[x, y - 1.25 * r], [x + 1.25 * r, y], [x, y + 1.25 * r], [x - 1.25 * r, y]],
        };
        let d: Vec<String> = corners.into_iter().map(pair).collect();
        self.put(format_args!(
            "<path d=\"M{}Z\" fill=\"{colour}\" stroke=\"#FFFFFF\" stroke-width=\"0.6\"/>",
            d.join("L")
        ));
    }

    /// One line of text; `at` is on its baseline. Turned clockwise about `at` for positive degrees.
    pub fn text(&mut self, at: [f64; 2], text: &str, font: Font) {
        let anchor = match font.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let bold = if font.bold { " font-weight=\"bold\"" } else { "" };
        let (x, y) = (coordinate(at[0]), coordinate(at[1]));
        let turn = if font.turn_deg == 0.0 {
            String::new()
        } else {
            format!(" transform=\"rotate({} {x} {y})\"", coordinate(font.turn_deg))
        };
        self.put(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"{anchor}{bold}{turn}>{}</text>",
            coordinate(font.size),
            font.colour,
            escape(text)
        ));
    }

    /// Says of a plotting area which values lie at its edges, for whoever points into it.
    pub fn area(&mut self, x: &Side<'_>, y: &Side<'_>) {
        let data = |name: &str, side: &Side<'_>| {
            let ([from, to], [low, high]) = (side.pixels, side.values);
            format!(
                "data-{name}=\"{low} {high}\" data-p{name}=\"{} {}\" data-{name}log=\"{}\" data-{name}name=\"{}\"",
                coordinate(from),
                coordinate(to),
                u8::from(side.is_log),
                escape(side.label)
            )
        };
        let ends = |[from, to]: [f64; 2]| [from.min(to), from.max(to)];
        let ([left, right], [top, bottom]) = (ends(x.pixels), ends(y.pixels));
        let _ = writeln!(
            self.areas,
            "<rect class=\"plot\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" {} {}/>",
            coordinate(left),
            coordinate(top),
            coordinate(right - left),
            coordinate(bottom - top),
            data("x", x),
            data("y", y)
        );
    }

    /// Says how many pixels a unit of the arrows has.
    pub fn scaled(&mut self, scale: Option<f64>) {
        self.scale = scale;
    }

    /// The finished document of the given size.
    pub fn finish(self, title: &str, width: f64, height: f64) -> String {
        let (w, h) = (coordinate(width), coordinate(height));
        let title = escape(title);
        let scale = self.scale.map_or(String::new(), |scale| format!(" data-scale=\"{scale}\""));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
             font-family=\"sans-serif\"{scale} role=\"img\" aria-label=\"{title}\">\n\
             <title>{title}</title>\n<rect width=\"{w}\" height=\"{h}\" fill=\"#FFFFFF\"/>\n{}{}</svg>\n",
            self.body, self.areas
        )
    }

    fn put(&mut self, element: std::fmt::Arguments) {
        let _ = writeln!(self.body, "{element}"); // writing to a String cannot fail
    }
}

/// Path data of an arrow. The head shrinks with the arrow; below a twentieth of a pixel it is a dot.
pub(super) fn arrow(from: [f64; 2], to: [f64; 2]) -> String {
    let d = [to[0] - from[0], to[1] - from[1]];
    let length = d[0].hypot(d[1]);
    if length < 0.05 {
        return format!("M{}h0", pair(from));
    }
    let head = (0.4 * length).min(6.0);
    let u = [d[0] / length * head, d[1] / length * head];
    let barb = |side: f64| pair([to[0] - u[0] - side * 0.5 * u[1], to[1] - u[1] + side * 0.5 * u[0]]);
    format!("M{}L{}M{}L{}L{}", pair(from), pair(to), barb(1.0), pair(to), barb(-1.0))
}

/// Path data of an arrow that ends at the edge of the area between two corners. One that is cut off has no head: its
/// tip is elsewhere.
pub(super) fn arrow_within(from: [f64; 2], to: [f64; 2], [low, high]: [[f64; 2]; 2]) -> String {
    let is_inside = |p: [f64; 2]| (0..2).all(|k| p[k] >= low[k] && p[k] <= high[k]);
    if !is_inside(from) {
        return String::new();
    }
    if is_inside(to) {
        return arrow(from, to);
    }
    let d = [to[0] - from[0], to[1] - from[1]];
    let edge = |k: usize| if d[k] > 0.0 { high[k] } else { low[k] };
    let part = (0..2).filter(|k| d[*k] != 0.0).map(|k| (edge(k) - from[k]) / d[k]).fold(1.0, f64::min);
    format!("M{}L{}", pair(from), pair([from[0] + part * d[0], from[1] + part * d[1]]))
}

fn pair(p: [f64; 2]) -> String {
    format!("{} {}", coordinate(p[0]), coordinate(p[1]))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Tags balanced, attributes quoted, entities known, no NaN or infinity in an attribute.
    pub fn assert_well_formed(xml: &str) {
        let mut open: Vec<&str> = Vec::new();
        let mut rest = xml;
        while let Some(start) = rest.find('<') {
            assert_entities(&rest[..start]);
            let end = start + rest[start..].find('>').expect("a tag is closed");
            let tag = &rest[start + 1..end];
            assert!(!tag.contains('<'), "a stray < before {tag}");
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name), "closing tag");
            } else if !tag.starts_with('!') {
                assert_eq!(tag.matches('"').count() % 2, 0, "quotes in {tag}");
                for bad in ["NaN", "inf"] {
                    let numbers = tag.split("aria-label").next().unwrap_or(tag);
                    assert!(!numbers.contains(bad), "{bad} in {tag}");
                }
                assert_entities(tag);
                let name = tag.split([' ', '/']).next().expect("a name");
                if !tag.ends_with('/') && !["meta", "br", "wbr"].contains(&name) {
                    open.push(name);
                }
            }
            rest = &rest[end + 1..];
        }
        assert!(open.is_empty(), "left open: {open:?}");
    }

    fn assert_entities(text: &str) {
        for part in text.split('&').skip(1) {
            let known = ["amp;", "lt;", "gt;", "quot;", "#39;"];
            assert!(known.iter().any(|e| part.starts_with(e)), "raw & before {part:.20}");
        }
    }

    #[test]
    fn hostile_text_is_escaped() {
        assert_eq!(escape("<a href='x'>\"&\u{1}"), "&lt;a href=&#39;x&#39;&gt;&quot;&amp;\u{FFFD}");
        let mut svg = Svg::default();
        svg.text([1.0, 2.0], "</text><script>", Font::new(10.0));
        let text = svg.finish("a \"b\" <c>", 10.0, 10.0);
        assert_well_formed(&text);
        assert!(!text.contains("<script"));
    }

    #[test]
    fn coordinates_are_short_and_have_no_negative_zero() {
        assert_eq!(coordinate(1.0), "1");
        assert_eq!(coordinate(-0.001), "0");
        assert_eq!(coordinate(100.0), "100");
    }

    #[test]
    fn an_arrow_ends_at_its_tip_and_a_null_arrow_is_a_dot() {
        assert_eq!(arrow([0.0, 0.0], [10.0, 0.0]), "M0 0L10 0M6 2L10 0L6 -2");
        assert_eq!(arrow([1.0, 1.0], [1.0, 1.0]), "M1 1h0");
    }

    #[test]
    fn an_arrow_beyond_the_axes_ends_at_them_without_a_head() {
        let area = [[0.0, 0.0], [20.0, 10.0]];
        assert_eq!(arrow_within([0.0, 0.0], [10.0, 0.0], area), arrow([0.0, 0.0], [10.0, 0.0]));
        assert_eq!(arrow_within([10.0, 5.0], [50.0, 25.0], area), "M10 5L20 10");
        assert_eq!(arrow_within([10.0, 5.0], [10.0, -5.0], area), "M10 5L10 0");
        assert_eq!(arrow_within([30.0, 5.0], [10.0, 5.0], area), "");
    }

    #[test]
    #[should_panic(expected = "closing tag")]
    fn the_checker_sees_unbalanced_tags() {
        assert_well_formed("<a><b></a></b>");
    }
}
