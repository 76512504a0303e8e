//! The reader of blocks: what it takes can be written and reads back as it was, and is laid out or refused.

use super::folder::{said, with_files};
use misclosure::io::block::{read_block, write_block};
use misclosure::model::Model;
use misclosure::problem::Problem;

/// Files of a block, in the order in which an input has them.
pub const FILES: [&str; 6] = ["block.toml", "images.csv", "ties.csv", "points.csv", "control.csv", "marks.csv"];

/// One input.
pub fn run(data: &[u8]) {
    with_files(&FILES, data, |folder| {
        let block = match read_block(folder) {
            Ok(loaded) => loaded.block,
            Err(error) => return said(error),
        };
        let copy = folder.join("copy");
        write_block(&block, &copy).expect("what was read can be written");
        assert_eq!(read_block(&copy).expect("what was written can be read").block, block);
        if let Err(error) = Problem::new(&block.about_its_centre(), &Model::default()) {
            said(error);
        }
    });
}
