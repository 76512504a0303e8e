//! A node as it is shown: what its folder says, and its measurements as columns.

use super::columns::{Columns, Names};
use crate::block::Block;
use crate::report::pictures::RunFolder;
use crate::run::folder::{OutlierRow, each_residual, read_outliers, read_points};
use anyhow::Result;
use std::path::Path;

/// A node as it is shown.
pub struct View {
    /// Its folder; residuals are in `columns` instead.
    pub run: RunFolder,
    /// Its measurements.
    pub columns: Columns,
    /// What was set aside.
    pub outliers: Vec<OutlierRow>,
}

impl View {
    /// Reads the folder of a node of `block`.
    ///
    /// # Errors
    /// A file that is missing or cannot be read.
    pub fn read(dir: &Path, block: &Block) -> Result<Self> {
        let run = RunFolder::read(dir)?;
        let points = read_points(dir)?;
        let outliers = read_outliers(dir)?.map_or(Vec::new(), |(_, rows)| rows);
        let mut columns = Columns::of_block(block, &run.images, &points);
        let names = Names::of(block);
        each_residual(dir, |row| columns.take(&names, &row))?;
        Ok(Self { run, columns, outliers })
    }
}
