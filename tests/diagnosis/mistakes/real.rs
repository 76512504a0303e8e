//! Real blocks: an aerial one with two height systems (control above the ellipsoid, positions above the geoid:
//! `data/ign-borea`, reference.json), and published ones, of which nothing that is not so may be said.

use super::made::{expect, named};
use crate::beside::shared;
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

/// Published blocks were adjusted as they are. Of one, marks lie 1.65 px beside the tie points: its control points,
/// which take no part in that, are missed by 307 instead of 349 mm once it is taken off.
#[test]
fn published_blocks_have_no_mistake() {
    let Some(folder) = shared("data") else { return };
    let (mut count, other) = (0, ["dbat-sxb", "ign-borea"]);
    for entry in folder.read_dir().expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if !path.join("block.toml").is_file() || other.contains(&&*name) {
            continue;
        }
        let found = named(&read_block(&path).expect("a block").block);
        assert!(found.is_empty(), "{name}: {found:?}");
        count += 1;
    }
    assert!(count >= 5, "{count} blocks");
    let marks = named(&read_block(&folder.join("dbat-sxb")).expect("a block").block);
    let kinds: Vec<_> = marks.iter().map(|own| (&*own.kind, &*own.subject)).collect();
    assert_eq!(kinds, [("offset", "marks")]);
}
