//! `image-grid`: a smooth displacement of image points over the sensor, whatever its cause.
//!
//! ```text
//! x' = x + sum_ij gx_i_j B_i(x / w) B_j(y / h)        y' = y + sum_ij gy_i_j B_i(x / w) B_j(y / h)
//! ```
//!
//! `B_i` (i = 0..7, along x) and `B_j` (j = 0..5, along y) are uniform cubic B-splines, knots not clamped (the file
//! `spline.rs`): five by three equal cells over the sensor, about 1000 px each on 20 megapixels. Coefficients in
//! pixels; order `gx_0_0, gx_0_1, ...`, then `gy`. Beyond the sensor the outer cells' cubics go on.
//!
//! Empirical: it takes the shape away and names no cause. It contains what the camera already has (shifts, scale, much
//! of the distortion); projecting that out and smoothing the rest is the estimator's business, by its score directions
//! and priors, not the formula's.
//!
//! Source: B-splines after de Boor (1978); finite-element correction grids after Munjy (1986).
//!
//! Worked numbers, sensor 5000 x 3000: all gx = 2 and all gy = -1 move any point by (2, -1); gx_0_0 = 36 alone moves
//! (0, 0) by (1, 0).

use super::common::{estimated, hand_on, known};
use super::{Context, Descriptor, Effect, Kind, OutsideDomain, Scope, Stage, fill_identity, spline};
use std::sync::LazyLock;

/// Coefficients along x, per component.
const ACROSS: usize = 8;
/// Coefficients along y, per component.
const DOWN: usize = 6;

/// See the [module](self).
pub struct ImageGrid;

static DESCRIPTOR: LazyLock<Descriptor> = LazyLock::new(|| Descriptor {
    id: "image-grid".into(),
    stage: Stage::Image,
    kind: Kind::Empirical,
    summary: "A smooth displacement field over the sensor, without a named cause.".into(),
    formula: "(x, y) += sum_ij (gx_i_j, gy_i_j) B_i(x/w) B_j(y/h), 8 x 6 uniform cubic B-splines".into(),
    parameters: ["gx", "gy"]
        .into_iter()
        .flat_map(|component| (0..ACROSS).flat_map(move |i| (0..DOWN).map(move |j| format!("{component}_{i}_{j}"))))
        .map(|name| estimated(name, "px", Scope::Global, 0.2))
        .collect(),
    needs: vec![],
    confused_with:
        "every image-stage effect: it covers them all down to its cells and explains none; finer structure it \
                    misses"
            .into(),
    source: "de Boor 1978; Munjy 1986".into(),
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
        let (width, height) = (known(context.image.width_px)?, known(context.image.height_px)?);
        let (first_i, across, across_slope) = spline::weights(input[0] / width, ACROSS);
        let (first_j, down, down_slope) = spline::weights(input[1] / height, DOWN);
        hand_on(Stage::Image, input, out);
        let mut slopes = [[0.0; 2]; 2];
        for a in 0..4 {
            for b in 0..4 {
                let node = (first_i + a) * DOWN + first_j + b;
                for axis in 0..2 {
                    let value = theta[axis * ACROSS * DOWN + node];
                    out[axis] += value * across[a] * down[b];
                    slopes[axis][0] += value * across_slope[a] * down[b] / width;
                    slopes[axis][1] += value * across[a] * down_slope[b] / height;
                }
            }
        }
        if let Some(matrix) = d_input {
            fill_identity(Stage::Image, matrix);
            for axis in 0..2 {
                matrix[axis * 14] += slopes[axis][0];
                matrix[axis * 14 + 1] += slopes[axis][1];
            }
        }
        if let Some(matrix) = d_theta {
            matrix.fill(0.0);
            let nodes = ACROSS * DOWN;
            for a in 0..4 {
                for b in 0..4 {
                    let node = (first_i + a) * DOWN + first_j + b;
                    for axis in 0..2 {
                        matrix[axis * 2 * nodes + axis * nodes + node] = across[a] * down[b];
                    }
                }
            }
        }
        Ok(())
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
        let mut theta = [2.0; 96];
        theta[48..].fill(-1.0);
        for (x, y) in [(0.0, 0.0), (1234.0, 2999.0), (5000.0, 3000.0), (2500.0, 777.0)] {
            let mut input = [0.0; 14];
            (input[0], input[1]) = (x, y);
            let moved = laws::value(&ImageGrid, &image, &input, &theta);
            assert_relative_eq!(moved[..], [x + 2.0, y - 1.0], epsilon = 1e-11);
        }
        let mut theta = [0.0; 96];
        theta[0] = 36.0;
        assert_eq!(DESCRIPTOR.parameters[0].name, "gx_0_0");
        assert_relative_eq!(laws::value(&ImageGrid, &image, &[0.0; 14], &theta)[..], [1.0, 0.0], epsilon = 1e-14);
    }

    #[test]
    fn order_of_the_names() {
        let names: Vec<_> = DESCRIPTOR.parameters.iter().map(|parameter| parameter.name.as_ref()).collect();
        assert_eq!((names.len(), names[1], names[6], names[48]), (96, "gx_0_1", "gx_1_0", "gy_0_0"));
    }
}
