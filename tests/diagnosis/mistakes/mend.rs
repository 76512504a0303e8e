//! What can be undone is undone: the copy of the block shows no mistake.

use super::made::{block, gnss, named, points};
use misclosure::block::edit::{Change, Edit};
use misclosure::block::edited as in_memory;
use misclosure::block::mended::mended as mended_in_memory;
use misclosure::block::{Block, Role};
use misclosure::io::block::{read_block, write_block};
use misclosure::io::edit as files;
use nalgebra::Vector3;

/// The block without what is named in it.
fn mended(block: &Block) -> Block {
    let [from, to] = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
    write_block(block, from.path()).expect("a block");
    let edits: Vec<_> = named(block).into_iter().flat_map(|mistake| mistake.mend).collect();
    assert!(!edits.is_empty(), "nothing to undo");
    files::edited(from.path(), to.path(), &edits).expect("a copy");
    read_block(to.path()).expect("a block").block
}

#[test]
fn the_copy_shows_no_mistake() {
    let foot = 0.3048;
    let sound = block("mapping", 3);
    let with = |change: &dyn Fn(&mut Block)| {
        let mut block = sound.clone();
        change(&mut block);
        block
    };
    let positions: Vec<_> = sound.images.iter().map(|image| image.gnss.expect("measured").position).collect();
    let all: [(&str, Block); 9] = [
        ("GNSS in feet", with(&|block| gnss(block, |_, p| p / foot))),
        (
            "heights of control in feet",
            with(&|block| points(block, Role::Control, |p| Vector3::new(p.x, p.y, p.z / foot))),
        ),
        ("heights of the wrong sign", with(&|block| points(block, Role::Control, |p| Vector3::new(p.x, p.y, -p.z)))),
        ("ellipsoid beside geoid", with(&|block| gnss(block, |_, p| p + Vector3::new(0.0, 0.0, 47.3)))),
        ("x and y of GNSS", with(&|block| gnss(block, |_, p| Vector3::new(p.y, p.x, p.z)))),
        ("the next position", with(&|block| gnss(block, |k, p| positions.get(k + 1).copied().unwrap_or(p)))),
        ("no fix", with(&|block| gnss(block, |k, p| if k % 9 == 0 { Vector3::zeros() } else { p }))),
        (
            "two points exchanged",
            with(&|block| {
                let (a, b) = (block.surveyed[1].position, block.surveyed[3].position);
                (block.surveyed[1].position, block.surveyed[3].position) = (b, a);
            }),
        ),
        (
            "y of marks upwards",
            with(&|block| {
                let height = f64::from(block.cameras[0].height_px);
                block.marks.iter_mut().for_each(|mark| mark.y = height - mark.y);
            }),
        ),
    ];
    for (what, wrong) in all {
        let left = named(&mended(&wrong));
        assert!(left.is_empty(), "{what}: {left:?}");
    }
}

#[test]
fn edits_in_memory_are_those_of_the_files() {
    let block = block("mapping", 3);
    let affine = |column: &str, factor: f64, offset: f64| Change::Affine { column: column.into(), factor, offset };
    let image = block.images[5].name.clone();
    let edits = [
        Edit::all("ties.csv", affine("y", -1.0, 3840.0)).of("image", std::slice::from_ref(&image)),
        Edit::all("marks.csv", affine("x", 0.5, 0.25)).of("image", &[image]),
        Edit::all("block.toml", affine("f", 0.5, 0.0)),
        Edit::all("images.csv", affine("vx", 3.6, 0.0)),
        Edit::all("images.csv", Change::ExchangeColumns { columns: ["x".into(), "y".into()] }),
        Edit::all(
            "images.csv",
            Change::Turn { inverse: true, after: [0.0, 1.0, 0.0, 0.0], before: [1.0, 0.0, 0.0, 0.0] },
        ),
    ];
    for edit in edits {
        let [from, to] = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
        write_block(&block, from.path()).expect("a block");
        files::edited(from.path(), to.path(), std::slice::from_ref(&edit)).expect("a copy");
        let of_files = read_block(to.path()).expect("a block").block;
        let of_memory = in_memory::edited(&block, std::slice::from_ref(&edit)).expect("an edit of conventions");
        assert_eq!(of_memory.ties, of_files.ties, "{edit:?}");
        assert_eq!(of_memory.marks, of_files.marks, "{edit:?}");
        assert_eq!(of_memory.cameras, of_files.cameras, "{edit:?}");
        for (one, other) in of_memory.images.iter().zip(&of_files.images) {
            assert_eq!((one.velocity, one.pose.centre), (other.velocity, other.pose.centre), "{edit:?}");
            assert!(one.pose.rotation.angle_to(&other.pose.rotation) < 1e-12, "{edit:?}");
        }
    }
}

#[test]
fn surveyed_coordinates_are_edited_in_memory_as_in_the_files() {
    let block = block("mapping", 3).about_its_centre();
    let affine = |column: &str, factor: f64, offset: f64| Change::Affine { column: column.into(), factor, offset };
    let columns = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    let gnss = ["gnss_x", "gnss_y", "gnss_z"];
    let role = |role: &str| vec![role.to_string()];
    let image = block.images[5].name.clone();
    let (first, second) = (block.surveyed[1].name.clone(), block.surveyed[3].name.clone());
    let exchanged = [first.clone(), second];
    let all = [
        vec![Edit::all("control.csv", affine("z", 0.3048, 0.0)).of("role", &role("control"))],
        vec![Edit::all("control.csv", affine("x", 1.0, 12.5)).of("role", &role("check"))],
        vec![Edit::all("control.csv", Change::ExchangeColumns { columns: ["x".into(), "y".into()] })],
        vec![Edit::all("control.csv", Change::ExchangeValues { column: "point".into(), values: exchanged })],
        vec![
            Edit::all("control.csv", Change::Set { column: "role".into(), value: "check".into() })
                .of("point", &[first]),
            Edit::all("control.csv", affine("y", 2.0, 0.0)).of("role", &role("check")),
        ],
        vec![Edit::all("images.csv", affine("gnss_z", 1.0, -47.3))],
        vec![Edit::all("images.csv", affine("gnss_x", 0.3048, 0.0))],
        vec![Edit::all("images.csv", Change::ExchangeColumns { columns: ["gnss_x".into(), "gnss_y".into()] })],
        vec![Edit::all("images.csv", Change::Clear { columns: columns(&gnss) }).of("image", &[image])],
        vec![Edit::all("images.csv", Change::Shift { columns: columns(&gnss), by: 1, within: "flight".into() })],
        vec![Edit::all("images.csv", Change::Shift { columns: columns(&gnss), by: -2, within: String::new() })],
    ];
    for edits in all {
        let [from, to] = [tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder")];
        write_block(&block, from.path()).expect("a block");
        files::edited(from.path(), to.path(), &edits).expect("a copy");
        let of_files = read_block(to.path()).expect("a block").block.about(block.origin);
        let of_memory = mended_in_memory(&block, &edits).expect("edits that the block can have");
        assert_ne!(of_memory, block, "{edits:?}");
        assert_eq!(of_memory.surveyed.len(), of_files.surveyed.len(), "{edits:?}");
        for one in &of_memory.surveyed {
            let same = of_files.surveyed.iter().find(|other| other.name == one.name);
            let other = same.unwrap_or_else(|| panic!("{edits:?}: no {}", one.name));
            assert_eq!((one.role, one.sigma_xy, one.sigma_z), (other.role, other.sigma_xy, other.sigma_z), "{edits:?}");
            assert!((one.position - other.position).norm() < 1e-7, "{edits:?}: {one:?}, {other:?}");
        }
        for (one, other) in of_memory.images.iter().zip(&of_files.images) {
            let positions = one.gnss.map(|own| own.position).zip(other.gnss.map(|own| own.position));
            assert_eq!(one.gnss.is_some(), other.gnss.is_some(), "{edits:?}: {}", one.name);
            assert!(positions.is_none_or(|(a, b)| (a - b).norm() < 1e-7), "{edits:?}: {}", one.name);
        }
    }
}
