//! Maps in plan: equal scales along both axes, the long side of the block laid along the page.

use super::super::axes::{Axis, extent};
use super::super::frame::{Margin, PlotFrame};
use super::super::scale::Scale;
use super::super::svg::Svg;
use std::collections::BTreeSet;

/// Width of a plan figure, pixels.
pub(super) const WIDTH: f64 = 860.0;
const MAX_HEIGHT: f64 = 600.0;
const MIN_HEIGHT: f64 = 110.0;

/// A map from X, Y in metres to the page. A block that is longer in Y is turned by a right angle, so that Y runs to the
/// right and X down the page: a true rotation, never a mirror image.
pub(super) struct Plan {
    /// The plotting area.
    pub frame: PlotFrame,
    /// Axis along the page.
    pub along: Axis,
    /// Axis across the page.
    pub across: Axis,
    /// Room for labels.
    pub margin: Margin,
    /// Whether Y runs along the page.
    pub turned: bool,
    /// Scale across over scale along; 1 unless the block is a very long corridor.
    pub stretch: f64,
}

impl Plan {
    /// A plan of these points, `page` pixels wide, at the height `top` on the page, with `border` pixels around them for arrows. `None`
    /// where no point can be drawn.
    pub fn fit(points: impl Iterator<Item = [f64; 2]> + Clone, page: f64, top: f64, border: f64) -> Option<Self> {
        let x = extent(points.clone().map(|p| p[0]))?;
        let y = extent(points.map(|p| p[1]))?;
        let turned = y[1] - y[0] > x[1] - x[0];
        let (a, b) = if turned { (y, x) } else { (x, y) };
        let axis = |name: &str| Axis::new(name, "m");
        let (along, across) = if turned { (axis("Y"), axis("X")) } else { (axis("X"), axis("Y")) };
        // A single point, or points on a line, still get an area.
        let size = (a[1] - a[0]).max(1e-9 * a[0].abs().max(a[1].abs())).max(1e-6);
        let (mut left, mut margin) = (80.0, Margin::default());
        let mut frame = PlotFrame { x: Scale::linear(0.0, 1.0, 0.0, 1.0), y: Scale::linear(0.0, 1.0, 0.0, 1.0) };
        let mut stretch = 1.0;
        // Twice, since the width of the labels depends on the frame.
        for _ in 0..2 {
            let room = page - left - 20.0;
            let mut per_m = (room - 2.0 * border) / size;
            let wanted = (b[1] - b[0]) * per_m;
            per_m *= ((MAX_HEIGHT - 2.0 * border) / wanted.max(1e-9)).min(1.0);
            let natural = (b[1] - b[0]) * per_m;
            // A corridor of more than some 12 : 1 would be a thread: it is stretched across, and the figure says so.
            stretch = if natural > 0.0 && natural < 60.0 { round_up(60.0 / natural) } else { 1.0 };
            let width = size * per_m + 2.0 * border;
            let height = (natural * stretch + 2.0 * border).max(MIN_HEIGHT);
            let (ca, cb) = (0.5 * (a[0] + a[1]), 0.5 * (b[0] + b[1]));
            let (ha, hb) = (0.5 * width / per_m, 0.5 * height / (per_m * stretch));
            let (low, high) = if turned { (top, top + height) } else { (top + height, top) };
            frame.x = Scale::linear(ca - ha, ca + ha, left, left + width);
            frame.y = Scale::linear(cb - hb, cb + hb, low, high);
            margin = frame.margin(&along, &across, width);
            left = margin.left + 8.0;
        }
        Some(Self { frame, along, across, margin, turned, stretch })
    }

    /// Draws frame and axes; returns where the next thing may begin.
    pub fn draw(&self, svg: &mut Svg) -> f64 {
        self.frame.draw(svg, &self.along, &self.across);
        self.frame.y.ends()[1] + self.margin.bottom
    }

    /// A point on the page.
    pub fn px(&self, p: [f64; 2]) -> [f64; 2] {
        self.frame.px(if self.turned { [p[1], p[0]] } else { p })
    }

    /// A horizontal direction on the page, at the given pixels per unit.
    pub fn direction(&self, d: [f64; 2], scale: f64) -> [f64; 2] {
        if self.turned { [scale * d[1], scale * d[0]] } else { [scale * d[0], -scale * d[1]] }
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

    /// A remark where the scales differ.
    pub fn remark(&self) -> Option<String> {
        (self.stretch > 1.0).then(|| format!("Places are stretched {} times across the page.", self.stretch))
    }
}

fn round_up(v: f64) -> f64 {
    1.0 / super::round_below(1.0 / v)
}
