//! Blocks that came in two ways are adjusted to the same.

use super::common::solve_both;
use super::{beside, import, sample};
use misclosure::block::Block;
use misclosure::io::block::read_block;
use misclosure::model::{Datum, Model};

/// Standard deviation of unit weight of the marks alone, camera held.
fn sigma0_of_marks(mut block: Block) -> f64 {
    block.tie_points.clear();
    block.ties.clear();
    block.sigma.mark_px = 1.0;
    let held = Model { datum: Datum::Control, free: [false; 12], ..Model::default() };
    solve_both(&block, &held).sigma0()
}

/// Of the marks, as the tie points of the two come from different matchings. A camera of half a pixel beside the
/// other's is all that differs.
#[test]
fn metashape_project_and_its_conversion_by_others() {
    let Some(project) = sample("metashape-sxb/sxb.psz") else { return };
    let reference = read_block(&beside::shared("data/dbat-sxb").expect("beside the sample")).unwrap().block;
    let sigmas = [import("metashape", &[project]).0, reference].map(sigma0_of_marks);
    println!("sigma0 {} and {}", sigmas[0], sigmas[1]);
    assert!((sigmas[0] / sigmas[1] - 1.0).abs() < 0.01, "{sigmas:?}");
}
