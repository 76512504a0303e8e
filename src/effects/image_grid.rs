//! `image-grid`: a smooth displacement of image points over the sensor or a part of it, whatever its cause.
//!
//! ```text
//! x' = x + sum_ij gx_i_j B(s - i) B(t - j)        y' = y + sum_ij gy_i_j B(s - i) B(t - j)
//! s = 5 x / w, t = 3 y / h                                                   cell = 0: the sensor
//! s = (x - centre_x) / cell + 2.5, t = (y - centre_y) / cell + 1.5           cell > 0: a part of it
//! ```
//!
//! `B` is the uniform cubic B-spline over `-3 .. 1` (the file `spline.rs`), i = 0..7 and j = 0..5. Coefficients in
//! pixels; order `gx_0_0, gx_0_1, ...`, then `gy`. Over five by three cells all functions are there, so that any smooth
//! field can be formed: these are the sensor, some 1000 px each on 20 megapixels, or cells of `cell` px around a
//! centre. Beyond, the field fades to zero over three cells. `cell`, `centre_x` and `centre_y` are given, not
//! estimated: a fault is found only by cells about as large as itself, and so fine a grid over the whole sensor would
//! have thousands of coefficients.
//!
//! Empirical: it takes the shape away and names no cause. It contains what the camera already has (shifts, scale, much
//! of the distortion); projecting that out and smoothing the rest is the estimator's business, by its score directions
//! and priors, not the formula's.
//!
//! Source: B-splines after de Boor (1978); finite-element correction grids after Munjy (1986).
//!
//! Worked numbers, sensor 5000 x 3000: all gx = 2 and all gy = -1 move any point of the sensor by (2, -1); gx_0_0 = 36
//! alone moves (0, 0) by (1, 0). With cell 100 around (1000, 1000), gx_3_2 = 36 alone moves (950, 950) by (16, 0) and
//! (1050, 1050) by (1, 0).

use super::answer::{Answer, Inputs, Thetas};
use super::common::{IMAGE_COLUMNS, estimated, given, hand_on, known};
use super::{Context, Descriptor, Effect, Kind, OutsideDomain, Picture, Scope, Stage, fill_identity, spline};
use crate::math::lane::{LANES, Lane};
use std::sync::LazyLock;

/// Coefficients along x, per component.
const ACROSS: usize = 8;
/// Coefficients along y, per component.
const DOWN: usize = 6;
/// Coefficients in all.
const NODES: usize = ACROSS * DOWN;

/// See the [module](self).
pub struct ImageGrid;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "image-grid".into(),
    stage: Stage::Image,
    kind: Kind::Empirical,
    summary: "A smooth displacement field over the sensor or a part of it, without a named cause.".into(),
    formula:
        "(x, y) += sum_ij (gx_i_j, gy_i_j) B_i(5x/w) B_j(3y/h), 8 x 6 uniform cubic B-splines; cell > 0: cells of that \
              size around the centre"
            .into(),
    parameters: ["gx", "gy"]
        .into_iter()
        .flat_map(|component| (0..ACROSS).flat_map(move |i| (0..DOWN).map(move |j| format!("{component}_{i}_{j}"))))
        .map(|name| estimated(name, "px", Scope::Global, 0.2))
        .chain(["centre_x", "centre_y"].map(|name| given(name, "px", 0.0, &[])))
        .chain([given("cell", "px", 0.0, &[("sensor", 0.0)])])
        .collect(),
    needs: vec![],
    confused_with:
        "every image-stage effect: it covers them all down to its cells and explains none; finer structure it \
                    misses"
            .into(),
    source: "de Boor 1978; Munjy 1986".into(),
    picture: Picture::Sensor,
    words: None,
});

impl Effect for ImageGrid {
    fn descriptor(&self) -> &Descriptor {
        &DESCRIPTOR
    }

    fn eval(
        &self,
        context: &Context<'_>,
        input: &[f64],
        theta: &[f64],
        out: &mut [f64],
        d_input: Option<&mut [f64]>,
        d_theta: Option<&mut [f64]>,
    ) -> Result<(), OutsideDomain> {
        let cell = Cell::of(context, [input[0], input[1]], theta)?;
        hand_on(Stage::Image, input, out);
        let mut slopes = [[0.0; 2]; 2];
        cell.add(theta, |axis, moved, by_input| {
            out[axis] += moved;
            slopes[axis] = [0, 1].map(|k| slopes[axis][k] + by_input[k]);
        });
        if let Some(matrix) = d_input {
            fill_identity(Stage::Image, matrix);
            for axis in 0..2 {
                matrix[axis * IMAGE_COLUMNS] += slopes[axis][0];
                matrix[axis * IMAGE_COLUMNS + 1] += slopes[axis][1];
            }
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            cell.weights(|node, weight| {
                for axis in 0..2 {
                    matrix[axis * (theta.len() + NODES) + node] = weight;
                }
            });
        }
        Ok(())
    }

    /// Of the many parameters each sees a few: what is theirs is written where it belongs, measurement by measurement.
    fn eval_eight(
        &self,
        contexts: &[Context<'_>; LANES],
        input: &[Lane],
        thetas: &Thetas<'_>,
        answer: &mut Answer<'_, Lane>,
    ) -> Result<Inputs, usize> {
        let Answer { out, d_input, d_theta } = answer;
        out.copy_from_slice(&input[..2]);
        if let Some(matrix) = d_theta {
            matrix.fill(Lane::default());
        }
        let mut slopes = [[Lane::default(); 2]; 2];
        for lane in 0..LANES {
            let theta = thetas.of(lane);
            let cell = Cell::of(&contexts[lane], [input[0][lane], input[1][lane]], theta).map_err(|_| lane)?;
            if theta[..2 * NODES].iter().any(|coefficient| *coefficient != 0.0) {
                cell.add(theta, |axis, moved, by_input| {
                    out[axis][lane] += moved;
                    (0..2).for_each(|k| slopes[axis][k][lane] += by_input[k]);
                });
            }
            if let Some(matrix) = d_theta {
                cell.weights(|node, weight| {
                    for axis in 0..2 {
                        matrix[axis * (theta.len() + NODES) + node][lane] = weight;
                    }
                });
            }
        }
        let mut inputs = Inputs::NONE;
        let Some(matrix) = d_input.as_mut().filter(|_| slopes != [[Lane::default(); 2]; 2]) else { return Ok(inputs) };
        for k in 0..2 {
            inputs.insert(k);
            for axis in 0..2 {
                let identity = if axis == k { 1.0 } else { 0.0 };
                matrix[axis * IMAGE_COLUMNS + k] = Lane(slopes[axis][k].map(|slope| identity + slope));
            }
        }
        Ok(inputs)
    }
}

/// Where an image point stands in the grid.
struct Cell {
    along: GridPlace,
    down: GridPlace,
}

impl Cell {
    fn of(context: &Context<'_>, point: [f64; 2], theta: &[f64]) -> Result<Self, OutsideDomain> {
        let size = [known(context.image.width_px)?, known(context.image.height_px)?];
        let [centre_x, centre_y, cell] = [theta[2 * NODES], theta[2 * NODES + 1], theta[2 * NODES + 2]];
        let along = GridPlace::of(point[0], size[0], centre_x, cell, ACROSS)?;
        Ok(Self { along, down: GridPlace::of(point[1], size[1], centre_y, cell, DOWN)? })
    }

    /// Gives what each coefficient moves an axis by, and what that changes by with the point.
    fn add(&self, theta: &[f64], mut sum: impl FnMut(usize, f64, [f64; 2])) {
        let Self { along, down } = self;
        for (i, a) in along.functions() {
            for (j, b) in down.functions() {
                let by_point = [along.slopes[a] * down.weights[b], along.weights[a] * down.slopes[b]];
                for axis in 0..2 {
                    let coefficient = theta[axis * NODES + i * DOWN + j];
                    sum(
                        axis,
                        coefficient * (along.weights[a] * down.weights[b]),
                        by_point.map(|slope| coefficient * slope),
                    );
                }
            }
        }
    }

    /// Gives the coefficients of a component that the point sees, and their weights.
    fn weights(&self, mut take: impl FnMut(usize, f64)) {
        for (i, a) in self.along.functions() {
            for (j, b) in self.down.functions() {
                take(i * DOWN + j, self.along.weights[a] * self.down.weights[b]);
            }
        }
    }
}

/// Where a coordinate stands among the functions of one direction.
struct GridPlace {
    /// The first of the four functions that it sees, which need not be among the coefficients.
    first: i64,
    /// Coefficients there are.
    count: usize,
    weights: [f64; 4],
    /// Derivatives of the weights by the coordinate.
    slopes: [f64; 4],
}

impl GridPlace {
    fn of(coordinate: f64, size: f64, centre: f64, cell: f64, count: usize) -> Result<Self, OutsideDomain> {
        let cells = (count - 3) as f64;
        let (s, slope) = match cell {
            0.0 => (coordinate / size * cells, cells / size),
            cell if cell > 0.0 => ((coordinate - centre) / cell + 0.5 * cells, 1.0 / cell),
            _ => return Err(OutsideDomain),
        };
        let floor = known(s)?.floor();
        let (weights, slopes) = spline::piece(s - floor);
        Ok(Self { first: floor as i64, count, weights, slopes: slopes.map(|by_s| by_s * slope) })
    }

    /// Coefficients that it sees, and which of the four weights is theirs.
    fn functions(&self) -> impl Iterator<Item = (usize, usize)> {
        // Of a point that a bad step throws out of all bounds, the place is the last number that there is.
        let coefficient = |k: i64| usize::try_from(self.first.saturating_add(k)).ok().filter(|i| *i < self.count);
        (0..4).filter_map(move |k| coefficient(k as i64).map(|i| (i, k)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ImageContext, laws};
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn worked_numbers() {
        let image = ImageContext { width_px: 5000.0, height_px: 3000.0, ..Default::default() };
        let mut theta = [2.0; 99];
        theta[48..96].fill(-1.0);
        theta[96..].fill(0.0);
        for (x, y) in [(0.0, 0.0), (1234.0, 2999.0), (5000.0, 3000.0), (2500.0, 777.0)] {
            let mut input = [0.0; 14];
            (input[0], input[1]) = (x, y);
            let moved = laws::value(&ImageGrid, &image, &input, &theta);
            assert_relative_eq!(moved[..], [x + 2.0, y - 1.0], epsilon = 1e-11);
        }
        let mut theta = [0.0; 99];
        theta[0] = 36.0;
        assert_eq!(DESCRIPTOR.parameters[0].name, "gx_0_0");
        assert_relative_eq!(laws::value(&ImageGrid, &image, &[0.0; 14], &theta)[..], [1.0, 0.0], epsilon = 1e-14);
        let mut theta = [0.0; 99];
        (theta[3 * DOWN + 2], theta[96], theta[97], theta[98]) = (36.0, 1000.0, 1000.0, 100.0);
        assert_eq!(DESCRIPTOR.parameters[3 * DOWN + 2].name, "gx_3_2");
        for (place, moved) in [(950.0, 16.0), (1050.0, 1.0), (1150.0, 0.0), (5000.0, 0.0), (0.0, 0.0), (1e300, 0.0)] {
            let mut input = [0.0; 14];
            (input[0], input[1]) = (place, place);
            let [x, y] = laws::value(&ImageGrid, &image, &input, &theta)[..2].try_into().unwrap();
            assert_relative_eq!(x, place + moved, epsilon = 1e-11);
            assert_relative_eq!(y, place, epsilon = 1e-11);
        }
    }

    #[test]
    fn order_of_the_names() {
        let names: Vec<_> = DESCRIPTOR.parameters.iter().map(|parameter| parameter.name.as_ref()).collect();
        assert_eq!((names.len(), names[1], names[6], names[48]), (99, "gx_0_1", "gx_1_0", "gy_0_0"));
        assert_eq!(names[96..], ["centre_x", "centre_y", "cell"]);
    }
}
