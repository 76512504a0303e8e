//! A framed plotting area: grid, ticks and labels.

use super::axes::Axis;
use super::scale::{Scale, TICK_SIZE};
use super::style::{FAINT, GREY, INK};
use super::svg::{Font, Stroke, Svg, arrow_within, text_width};

/// Size of axis labels, pixels.
const LABEL_SIZE: f64 = 13.0;

/// A framed plotting area.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlotFrame {
    pub x: Scale,
    pub y: Scale,
}

/// Pixels that the labels need left of and below the plotting area.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Margin {
    pub left: f64,
    pub bottom: f64,
}

const X_GAP: f64 = 80.0;
const Y_GAP: f64 = 42.0;

impl PlotFrame {
    /// Room for the labels of these axes, when the plotting area measures about `width` pixels.
    pub fn margin(&self, x: &Axis, y: &Axis, width: f64) -> Margin {
        let names_turned = turned(x, width);
        let names = if names_turned { 0.6 * self.x.ticks(x, X_GAP).width() + 4.0 } else { TICK_SIZE };
        let label = if x.label.is_empty() { 0.0 } else { LABEL_SIZE + 8.0 };
        let side = if y.label.is_empty() { 0.0 } else { LABEL_SIZE + 10.0 };
        // Sloping names reach to the left of their ticks.
        let slot = width / x.names.len().max(1) as f64;
        let reach = |(i, n): (usize, &String)| 0.82 * text_width(n, TICK_SIZE) - (i as f64 + 0.5) * slot;
        let overhang = x.names.iter().enumerate().filter(|_| names_turned).map(reach).fold(0.0, f64::max);
        let left = (self.y.ticks(y, Y_GAP).width() + side + 10.0).max(overhang);
        Margin { left, bottom: names + label + 12.0 }
    }

    /// Draws the line y = 0 where it lies inside.
    pub fn zero_line(&self, svg: &mut Svg) {
        if self.y.crosses_zero() {
            let ([left, right], y) = (self.x.ends(), self.y.px(0.0));
            svg.line([left, y], [right, y], Stroke::new(GREY, 1.0));
        }
    }

    /// Pixel of a data point.
    pub fn px(&self, p: [f64; 2]) -> [f64; 2] {
        [self.x.px(p[0]), self.y.px(p[1])]
    }

    /// Path data of an arrow between two pixels; what lies beyond the axes is cut off.
    pub fn arrow(&self, from: [f64; 2], to: [f64; 2]) -> String {
        let ([left, right], [top, bottom]) = (self.x.ends(), self.y.ends());
        arrow_within(from, to, [[left, top], [right, bottom]])
    }

    /// Draws grid, frame, ticks and labels.
    pub fn draw(&self, svg: &mut Svg, x: &Axis, y: &Axis) {
        let ([left, right], [top, bottom]) = (self.x.ends(), self.y.ends());
        let grid = Stroke::new(FAINT, 1.0);
        let (xt, yt) = (self.x.ticks(x, X_GAP), self.y.ticks(y, Y_GAP));
        let slope = turned(x, right - left);
        for (v, label) in xt.at.iter().zip(&xt.labels) {
            let px = self.x.px(*v);
            svg.line([px, top], [px, bottom], grid);
            svg.line([px, bottom], [px, bottom + 4.0], Stroke::new(INK, 1.0));
            if slope {
                svg.text([px + 4.0, bottom + 15.0], label, Font::new(TICK_SIZE).end().turned(-35.0));
            } else {
                svg.text([px, bottom + 17.0], label, Font::new(TICK_SIZE).middle());
            }
        }
        for (v, label) in yt.at.iter().zip(&yt.labels) {
            let px = self.y.px(*v);
            svg.line([left, px], [right, px], grid);
            svg.line([left - 4.0, px], [left, px], Stroke::new(INK, 1.0));
            svg.text([left - 8.0, px + 4.0], label, Font::new(TICK_SIZE).end());
        }
        svg.rect([left, top], [right - left, bottom - top], "none", Some(Stroke::new(INK, 1.0)));
        svg.area(&self.x.side(&x.label), &self.y.side(&y.label));
        let margin = self.margin(x, y, right - left);
        if !x.label.is_empty() {
            let at = [(left + right) / 2.0, bottom + margin.bottom - 5.0];
            svg.text(at, &xt.axis_label(x), Font::new(LABEL_SIZE).middle());
        }
        if !y.label.is_empty() {
            let at = [left - margin.left + LABEL_SIZE, (top + bottom) / 2.0];
            svg.text(at, &yt.axis_label(y), Font::new(LABEL_SIZE).middle().turned(-90.0));
        }
    }
}

/// Whether the names of an axis are too wide to stand upright side by side.
fn turned(axis: &Axis, width: f64) -> bool {
    let slot = width / axis.names.len().max(1) as f64;
    axis.names.iter().any(|n| text_width(n, TICK_SIZE) > slot - 8.0)
}
