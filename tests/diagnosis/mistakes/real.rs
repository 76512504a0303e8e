//! An aerial block with two height systems: control above the ellipsoid, positions above the geoid (`data/ign-borea`,
//! reference.json).

use super::made::{expect, named};
use misclosure::io::block::read_block;
use misclosure::io::edit::edited;
use std::path::Path;

/// Height of the geoid above the ellipsoid there, m.
const UNDULATION_M: f64 = 49.349;

#[test]
fn two_height_systems() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/ign-borea");
    let found = named(&read_block(&folder).expect("a block").block);
    let mistake = expect(&found, "height-offset", "control", "ign-borea");
    assert_eq!(found.len(), 1, "{found:?}");
    let value = mistake.value.expect("a size");
    assert!((value - UNDULATION_M).abs() < 0.1, "{value}");
    assert!(mistake.sentence.contains("geoid"), "{}", mistake.sentence);
    let copy = tempfile::tempdir().expect("a folder");
    edited(&folder, copy.path(), &mistake.mend).expect("a copy");
    let left = named(&read_block(copy.path()).expect("a block").block);
    assert!(left.is_empty(), "{left:?}");
}
