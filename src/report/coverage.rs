//! How well a place is covered: number of images, ground sampling distance and error ellipses of the tie points.

use super::figures::{Axis, Colours, HeatMap, MapFrame, PlanEllipses, heat_map, plan_ellipses};
use super::html::Page;
use super::pictures::{self, RunFolder};
use crate::run::folder::{PointRow, read_points};
use anyhow::Result;
use std::path::Path;

/// Cells along the longer side of a map.
const CELLS: f64 = 48.0;
/// Fewer tie points make no map.
const FEWEST: usize = 20;

/// What the maps are made from.
pub struct Coverage {
    /// Place X, Y, number of images and ground sampling distance (m) of each tie point; NaN where not known.
    points: Vec<[f64; 4]>,
    /// Place, standard deviations in X, Y and Z (m) and correlation of X and Y.
    ellipses: Vec<([f64; 2], [f64; 3], f64)>,
}

impl Coverage {
    /// From the folder of a run.
    ///
    /// # Errors
    /// A table that cannot be read.
    pub fn read(dir: &Path) -> Result<Self> {
        let mut coverage = Self { points: Vec::new(), ellipses: Vec::new() };
        for row in read_points(dir)? {
            let PointRow { x, y, sigma_x, sigma_y, sigma_z, images, gsd_m, correlation_xy, .. } = row;
            let images = images.map_or(f64::NAN, |images| images as f64);
            coverage.points.push([x, y, images, gsd_m.unwrap_or(f64::NAN)]);
            if let (Some(sx), Some(sy), Some(sz), Some(r)) = (sigma_x, sigma_y, sigma_z, correlation_xy) {
                coverage.ellipses.push(([x, y], [sx, sy, sz], r));
            }
        }
        Ok(coverage)
    }

    /// Mean of a value in cells; `None` where no point has it.
    fn cells(&self, value: impl Fn(&[f64; 4]) -> f64) -> Option<(Vec<f64>, usize, [[f64; 2]; 2])> {
        let known = || self.points.iter().filter(|point| value(point).is_finite());
        let range = |k: usize| {
            known().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[k]), high.max(p[k])])
        };
        let [x, y] = [range(0), range(1)];
        let side = (x[1] - x[0]).max(y[1] - y[0]) / CELLS;
        if known().count() < FEWEST || !(side.is_finite() && side > 0.0) {
            return None;
        }
        let [columns, rows] = [x, y].map(|range| (((range[1] - range[0]) / side).ceil() as usize).max(1));
        let (mut sums, mut counts) = (vec![0.0; columns * rows], vec![0.0; columns * rows]);
        for point in known() {
            let place = |k: usize, low: f64, n: usize| (((point[k] - low) / side) as usize).min(n - 1);
            let cell = place(1, y[0], rows) * columns + place(0, x[0], columns);
            sums[cell] += value(point);
            counts[cell] += 1.0;
        }
        let means = sums.iter().zip(&counts).map(|(sum, n)| if *n > 0.0 { sum / n } else { f64::NAN }).collect();
        let ends = |low: f64, n: usize| [low, low + side * n as f64];
        Some((means, columns, [ends(x[0], columns), ends(y[0], rows)]))
    }
}

/// The section; nothing where the folder is of before the columns were written.
pub(super) fn section(page: &mut Page, run: &RunFolder, coverage: &Coverage) {
    let frame = pictures::frame(run);
    let scaled = run.summary.has_scale();
    let images = coverage.cells(|point| point[2]);
    let gsd = coverage.cells(|point| 1e3 * point[3]).filter(|_| scaled);
    if images.is_none() && gsd.is_none() && coverage.ellipses.is_empty() {
        return;
    }
    page.section("Coverage and precision");
    let names: [&str; 2] = if frame == MapFrame::EastNorth { ["E", "N"] } else { ["X", "Y"] };
    let map = |title: &str, value: Axis, (values, columns, [x, y]): (Vec<f64>, usize, [[f64; 2]; 2])| HeatMap {
        title: title.into(),
        x: Axis::new(names[0], "m").range(x[0], x[1]),
        y: Axis::new(names[1], "m").range(y[0], y[1]),
        columns,
        values,
        value,
        colours: Colours::Magnitude,
        ..HeatMap::default()
    };
    if let Some(cells) = images {
        let drawn = heat_map(&map("Images that see a tie point", Axis::new("images", ""), cells));
        page.figure(
            "overlap",
            drawn,
            "Mean of the tie points of each cell. Two images intersect a point, the third checks it.",
        );
    }
    if let Some(cells) = gsd {
        let drawn = heat_map(&map("Ground sampling distance", Axis::new("mm per px", ""), cells));
        page.figure("gsd", drawn, "Depth of a tie point over the focal length, mean of its images and of the cell.");
    }
    if scaled && !coverage.ellipses.is_empty() {
        let mm = |sigma: &[f64; 3]| sigma.map(|sigma| 1e3 * sigma);
        let ellipses = coverage.ellipses.iter().map(|(at, sigma, r)| (*at, mm(sigma), *r)).collect();
        let plan = PlanEllipses { title: "Error ellipses of tie points".into(), ellipses, frame, unit: "mm".into() };
        page.figure("ellipses", plan_ellipses(&plan), "1 sigma in plan; the stroke upwards is 1 sigma in height.");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_the_means_of_their_points() {
        let points = (0..100).map(|k| [f64::from(k % 10), f64::from(k / 10), f64::from(k % 10), f64::NAN]).collect();
        let coverage = Coverage { points, ellipses: Vec::new() };
        let (means, columns, [x, _]) = coverage.cells(|point| point[2]).expect("a map");
        assert_eq!((means.len() / columns, x[0]), (48, 0.0));
        assert_eq!((means[0], means[columns - 1]), (0.0, 9.0));
        assert!(coverage.cells(|point| point[3]).is_none(), "no point has a ground sampling distance");
    }
}
