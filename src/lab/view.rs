//! A node as it is shown: what its folder says, and its measurements as columns.

use super::columns::Columns;
use crate::block::Block;
use crate::report::run::RunFolder;
use crate::run::folder::{OutlierRow, PointRow, read_outliers, read_points};
use anyhow::Result;
use std::path::Path;

/// A node as it is shown.
pub struct View {
    /// Its folder; residuals are in `columns` instead.
    pub run: RunFolder,
    /// Its measurements.
    pub columns: Columns,
    /// Its tie points.
    pub points: Vec<PointRow>,
    /// What was set aside.
    pub outliers: Vec<OutlierRow>,
}

impl View {
    /// Reads the folder of a node of `block`.
    ///
    /// # Errors
    /// A file that is missing or cannot be read.
    pub fn read(dir: &Path, block: &Block) -> Result<Self> {
        let mut run = RunFolder::read(dir)?;
        let points = read_points(dir)?;
        let outliers = read_outliers(dir)?.map_or(Vec::new(), |(_, rows)| rows);
        let lines = std::mem::take(&mut run.residuals);
        let columns = Columns::of_block(block, &run.images, &points).with_lines(block, &lines);
        Ok(Self { run, columns, points, outliers })
    }
}
