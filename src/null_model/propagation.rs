//! Covariance of functions of cameras, effects and poses.

use super::NullModel;
use faer::Mat;
use nalgebra::DMatrix;

impl NullModel {
    /// `G'N^-1 G` for unit weight: what the fit's errors make of functions with the derivatives `gradients` (a column
    /// each, by unknown of the layout in its raw unit, points left out). Unknowns that are held have no error.
    ///
    /// Points are eliminated: the functions depend on none of the fit.
    pub fn covariance_of(&self, gradients: &DMatrix<f64>) -> DMatrix<f64> {
        let structure = &self.structure;
        let images = structure.image_unknowns.iter().zip(&structure.image_scales);
        let reduced: Vec<(usize, f64)> = images
            .chain(structure.border.iter().zip(&structure.border_scale))
            .map(|(unknown, scale)| (*unknown, *scale))
            .collect();
        let columns = Mat::from_fn(reduced.len(), gradients.ncols(), |row, column| match reduced[row] {
            (usize::MAX, _) => 0.0,
            (unknown, scale) => gradients[(unknown, column)] * scale,
        });
        let mut solved = columns.clone();
        self.pool.install(|| self.base.normal.solve_columns(solved.as_mut()));
        let product = columns.transpose() * &solved;
        // Rounding alone tells the two halves apart.
        DMatrix::from_fn(gradients.ncols(), gradients.ncols(), |i, j| 0.5 * (product[(i, j)] + product[(j, i)]))
    }
}
