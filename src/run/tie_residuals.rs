//! What the page of a run shows of its residuals, which may be millions.

use super::folder::{ImageRow, each_residual};
use super::{MeanSquares, ResidualKind, ResidualRow};
use crate::block::Block;
use crate::io::Error;
use std::collections::HashMap;
use std::path::Path;

/// Residuals of the tie points of a run.
pub struct TieResiduals {
    /// RMS of each image per coordinate, px; `None` where it has no tie point.
    pub rms: Vec<Option<f64>>,
    /// Every residual in x, px.
    pub x: Vec<f64>,
    /// In y.
    pub y: Vec<f64>,
}

impl TieResiduals {
    /// From the residuals of a run of `block`.
    pub fn of(block: &Block, rows: &[ResidualRow]) -> Self {
        let ties = || rows.iter().filter(|row| row.kind == ResidualKind::Tie);
        let mut squares = MeanSquares::new(block.images.len());
        ties().for_each(|row| squares.add(row.image.index(), row.residual));
        let component = |k: usize| {
            let mut values = Vec::with_capacity(rows.len());
            values.extend(ties().map(|row| row.residual[k]));
            values
        };
        Self { rms: squares.rms(), x: component(0), y: component(1) }
    }

    /// From the folder of a run with these images.
    ///
    /// # Errors
    /// A file that is missing, cannot be read or has no rows.
    pub fn read(dir: &Path, images: &[ImageRow]) -> Result<Self, Error> {
        let position: HashMap<&str, usize> =
            images.iter().enumerate().map(|(i, row)| (row.image.as_str(), i)).collect();
        let mut squares = MeanSquares::new(images.len());
        let (mut x, mut y) = (Vec::new(), Vec::new());
        each_residual(dir, |row| {
            if row.kind == "tie" {
                if let Some(image) = position.get(row.image) {
                    squares.add(*image, [row.rx, row.ry]);
                }
                x.push(row.rx);
                y.push(row.ry);
            }
        })?;
        Ok(Self { rms: squares.rms(), x, y })
    }
}
