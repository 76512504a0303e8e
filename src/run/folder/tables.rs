//! The tables of a run as its folder has them, in memory.

use super::covariance;
use super::rows::{CheckRow, CovarianceRow, PointRow};
use super::solved::Solved;
use crate::block::Block;
use crate::model::Model;
use crate::run::Run;

/// Images, points and surveyed points of a run, in the survey's system where a similarity took the block there.
#[derive(Debug, Clone)]
pub struct Tables {
    /// The images with their adjusted poses; columns that `images.csv` has beside those of a block are extra columns.
    pub images: Block,
    /// Adjusted tie points.
    pub points: Vec<PointRow>,
    /// Surveyed points against the block.
    pub checks: Vec<CheckRow>,
    /// Covariance of cameras and effects, each pair of parameters once.
    pub covariance: Vec<CovarianceRow>,
}

impl Tables {
    /// Of a run of `block` under `model`.
    pub fn of(block: &Block, model: &Model, run: &Run) -> Self {
        let solved = Solved::of(block, model, run);
        let precision = solved.precision();
        let covariance = precision.map(|(covariance, sigma0)| covariance::rows(&run.problem, covariance, sigma0));
        Self {
            images: solved.adjusted_images(),
            points: solved.points().collect(),
            checks: solved.checks().collect(),
            covariance: covariance.unwrap_or_default(),
        }
    }
}
