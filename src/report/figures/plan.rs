//! Maps in plan: one scale, east to the right, north up.

use super::super::axes::{Axis, extent};
use super::super::frame::{Margin, PlotFrame};
use super::super::scale::Scale;
use super::super::style::INK;
use super::super::svg::{Font, Stroke, Svg, arrow};
use std::collections::BTreeSet;

/// Width of a plan figure, pixels.
pub(super) const WIDTH: f64 = 860.0;
const MAX_HEIGHT: f64 = 600.0;
/// Pictures narrower than this stand beside another one, and are no towers.
const SMALL_PAGE: f64 = 420.0;
const MAX_HEIGHT_OF_SMALL: f64 = 300.0;
/// Least width and height of the plotting area: ticks have room, and a corridor is no thread.
const MIN_SIDE: f64 = 110.0;

/// What the horizontal coordinates of a map are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum MapFrame {
    /// X and Y of a system that names no directions.
    #[default]
    Local,
    /// Easting and northing: the map has a north arrow.
    EastNorth,
}

impl MapFrame {
    /// Names of the coordinates to the right and up.
    pub(super) fn names(self) -> [&'static str; 2] {
        match self {
            Self::Local => ["X", "Y"],
            Self::EastNorth => ["E", "N"],
        }
    }
}

/// Width of a picture in which a map of these places is as high as it may be, at most `widest`: a block that runs north
/// needs no wide one.
pub fn map_width(places: impl Iterator<Item = [f64; 2]> + Clone, widest: f64) -> f64 {
    let span = |k: usize| extent(places.clone().map(|p| p[k])).map_or(0.0, |[low, high]| high - low);
    let most = if widest < SMALL_PAGE { MAX_HEIGHT_OF_SMALL } else { MAX_HEIGHT };
    let width = LABELS + most * span(0) / span(1).max(1e-6);
    if width.is_finite() { width.clamp(LEAST_WIDTH.min(widest), widest) } else { widest }
}

/// Room for the labels of a map and the arrows at its edges, pixels.
const LABELS: f64 = 200.0;
/// Width that a title and a legend need, pixels.
const LEAST_WIDTH: f64 = 260.0;

/// A map from X, Y in metres to the page: X (east) to the right, Y (north) up, one scale.
pub(super) struct Plan {
    /// The plotting area.
    pub frame: PlotFrame,
    /// Axis to the right.
    pub along: Axis,
    /// Axis up.
    pub across: Axis,
    /// Room for labels.
    pub margin: Margin,
    kind: MapFrame,
}

impl Plan {
    /// A plan of these points, `page` pixels wide, at the height `top` on the page, with `border` pixels around them
    /// for arrows. `None` where no point can be drawn.
    pub fn fit(
        kind: MapFrame,
        points: impl Iterator<Item = [f64; 2]> + Clone,
        page: f64,
        top: f64,
        border: f64,
    ) -> Option<Self> {
        let x = extent(points.clone().map(|p| p[0]))?;
        let y = extent(points.map(|p| p[1]))?;
        let [along, across] = kind.names().map(|name| Axis::new(name, "m"));
        // A single point, or points on a line, still get an area.
        let largest = x.iter().chain(&y).fold(0.0, |largest: f64, v| largest.max(v.abs()));
        let least = (1e-9 * largest).max(1e-6);
        let size = [(x[1] - x[0]).max(least), (y[1] - y[0]).max(least)];
        let most = if page < SMALL_PAGE { MAX_HEIGHT_OF_SMALL } else { MAX_HEIGHT };
        let (mut left, mut margin) = (80.0, Margin::default());
        let mut frame = PlotFrame { x: Scale::linear(0.0, 1.0, 0.0, 1.0), y: Scale::linear(0.0, 1.0, 0.0, 1.0) };
        // Twice, since the width of the labels depends on the frame.
        for _ in 0..2 {
            let room = page - left - 20.0;
            let per_m = ((room - 2.0 * border) / size[0]).min((most - 2.0 * border) / size[1]);
            let width = (size[0] * per_m + 2.0 * border).max(MIN_SIDE.min(room));
            let height = (size[1] * per_m + 2.0 * border).max(MIN_SIDE);
            let (cx, cy) = (0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]));
            let (hx, hy) = (0.5 * width / per_m, 0.5 * height / per_m);
            frame.x = Scale::linear(cx - hx, cx + hx, left, left + width);
            frame.y = Scale::linear(cy - hy, cy + hy, top + height, top);
            margin = frame.margin(&along, &across, width);
            left = margin.left + 8.0;
        }
        Some(Self { frame, along, across, margin, kind })
    }

    /// Draws frame, axes and north arrow; returns where the next thing may begin.
    pub fn draw(&self, svg: &mut Svg) -> f64 {
        self.frame.draw(svg, &self.along, &self.across);
        if self.kind == MapFrame::EastNorth {
            let ([left, _], [top, _]) = (self.frame.x.ends(), self.frame.y.ends());
            let x = left + 13.0;
            svg.path(&arrow([x, top + 34.0], [x, top + 16.0]), Stroke::new(INK, 1.6));
            svg.text([x, top + 13.0], "N", Font::new(11.0).bold().middle());
        }
        self.frame.y.ends()[1] + self.margin.bottom
    }

    /// A point on the page.
    pub fn px(&self, p: [f64; 2]) -> [f64; 2] {
        self.frame.px(p)
    }

    /// A horizontal direction on the page, at the given pixels per unit.
    pub fn direction(&self, d: [f64; 2], scale: f64) -> [f64; 2] {
        [scale * d[0], -scale * d[1]]
    }

    /// Which of the points to draw so that about `limit` at most are, evenly spread: the first one in each cell of a
    /// grid on the page. All of them where they are not more than that.
    pub fn thinned(&self, points: &[[f64; 2]], limit: usize) -> Vec<usize> {
        if points.len() <= limit {
            return (0..points.len()).collect();
        }
        let ([left, right], [top, bottom]) = (self.frame.x.ends(), self.frame.y.ends());
        let cell = ((right - left) * (bottom - top) / limit.max(1) as f64).sqrt();
        let mut taken = BTreeSet::new();
        let mut free = |p: [f64; 2]| taken.insert(self.px(p).map(|v| (v / cell).floor() as i64));
        (0..points.len()).filter(|k| free(points[*k])).collect()
    }
}
