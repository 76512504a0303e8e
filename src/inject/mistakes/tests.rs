//! Every kind of mistake in a small block: it changes what it says and nothing else, and the block can still be read
//! where a reader has no reason to refuse it.

use super::{find, make, parse, registry};
use crate::block::{Block, CameraId, Role};
use crate::camera::Camera;
use crate::io::block::{read_block, write_block};
use crate::scenario::{Scenario, simulate};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Check points that are kept.
const CHECKS: usize = 20;

/// A block with everything that a mistake may concern.
fn block() -> &'static Block {
    static BLOCK: OnceLock<Block> = OnceLock::new();
    BLOCK.get_or_init(|| {
        let set = BTreeMap::from([("points".to_string(), 150.0)]);
        let scenario = Scenario::preset("mapping", &set).expect("a preset");
        let mut block = simulate(&scenario, 1).expect("a block").block;
        let kept = block.count(Role::Control) + CHECKS;
        block.surveyed.truncate(kept);
        block.marks.retain(|mark| mark.point.index() < kept);
        block
    })
}

fn written() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_block(block(), folder.path()).expect("a block");
    folder
}

/// The block after a mistake.
fn after(mistake: &str) -> Block {
    let folder = written();
    make(folder.path(), &[parse(mistake).expect(mistake)]).unwrap_or_else(|error| panic!("{mistake}: {error:#}"));
    read_block(folder.path()).unwrap_or_else(|error| panic!("{mistake}: {error}")).block
}

/// Why a mistake is refused.
fn refused(mistake: &str) -> String {
    let folder = written();
    let made = parse(mistake).and_then(|mistake| make(folder.path(), &[mistake]));
    format!("{:#}", made.expect_err(mistake))
}

fn text(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join(file)).unwrap_or_default()
}

fn positions(block: &Block, role: Role) -> Vec<Vector3<f64>> {
    block.surveyed.iter().filter(|point| point.role == role).map(|point| point.position).collect()
}

fn antennas(block: &Block) -> Vec<Vector3<f64>> {
    block.images.iter().filter_map(|image| image.gnss.map(|gnss| gnss.position)).collect()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs().max(1.0)
}

/// Asserts the relation of all positions before and after.
fn assert_moved(before: &[Vector3<f64>], after: &[Vector3<f64>], new: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(after) {
        let expected = new(*before);
        assert!((0..3).all(|k| near(after[k], expected[k])), "{before:?}: {after:?} instead of {expected:?}");
    }
}

/// Asserts the relation of all ties and marks before and after.
fn assert_measured(mistake: &str, new: impl Fn(f64, f64) -> [f64; 2]) {
    let changed = after(mistake);
    let rows = |block: &Block| block.ties.iter().chain(&block.marks).map(|row| [row.x, row.y]).collect::<Vec<_>>();
    for ([x, y], [found_x, found_y]) in rows(block()).into_iter().zip(rows(&changed)) {
        let [expected_x, expected_y] = new(x, y);
        assert!(near(found_x, expected_x) && near(found_y, expected_y), "{mistake}: {x}, {y}: {found_x}, {found_y}");
    }
}

#[test]
fn names_are_unique_and_every_kind_acts_at_its_defaults() {
    let mut ids: Vec<&str> = registry().map(super::Kind::id).collect();
    ids.sort_unstable();
    let count = ids.len();
    ids.dedup();
    assert_eq!(ids.len(), count);
    for kind in registry() {
        let folder = written();
        let mistake = parse(kind.id()).expect("a kind");
        let made = make(folder.path(), &[mistake]).unwrap_or_else(|error| panic!("{}: {error:#}", kind.id()));
        assert!(made[0].notes.iter().any(|(name, _)| name == "cells changed"), "{made:?}");
        // A reader refuses measurements far beyond the sensor, and nothing else of these.
        if let Err(error) = read_block(folder.path()) {
            let beyond = error.to_string().contains("is outside the sensor");
            assert!(
                beyond && ["centred", "columns-exchanged", "sensor-size"].contains(&kind.id()),
                "{}: {error}",
                kind.id()
            );
        }
    }
}

#[test]
fn every_subject_can_be_named() {
    for kind in registry() {
        let Some(of) = kind.parameters().iter().find(|spec| spec.name == "of") else { continue };
        for subject in kind.subjects() {
            let accepted = parse(&format!("{}:of={subject}", kind.id()));
            assert!(accepted.is_ok(), "{}: {subject} is not among {:?}", kind.id(), of.default);
        }
    }
}

#[test]
fn files_without_the_mistake_keep_their_bytes() {
    let (before, folder) = (written(), written());
    let mistakes = ["scale:of=control", "focal-wrong"].map(|text| parse(text).expect("a kind"));
    make(folder.path(), &mistakes).expect("mistakes");
    for file in ["images.csv", "ties.csv", "points.csv", "marks.csv"] {
        assert_eq!(text(before.path(), file), text(folder.path(), file), "{file}");
    }
    // Twice the same is twice as much.
    let lines = |folder: &Path| text(folder, "control.csv").lines().count();
    assert_eq!(lines(before.path()), lines(folder.path()));
    assert_eq!(read_block(folder.path()).expect("a block").block.cameras[0].interior[0], 0.75 * 5510.09);
}

#[test]
fn what_cannot_be_made_is_refused() {
    for (mistake, what) in [
        ("scal", "no mistake is called `scal`; nearest: scale"),
        ("scale:of=ties", "mistake `scale`: parameter `of`: `ties` is none of control, check, surveyed, gnss"),
        ("scale:foot=1", "mistake `scale`: no parameter `foot`; it has of, unit, factor"),
        ("scale:factor=x", "mistake `scale`: parameter `factor`: `x` is not a number"),
        ("scale:factor=1", "mistake `scale`: it changes nothing in this block"),
        ("inverse-rotation:of=images", "mistake `inverse-rotation`: no parameter `of`; it has none"),
        ("exchanged:a=gcp0001,b=nobody", "control.csv has no point `nobody`"),
        ("exchanged:a=gcp0001,b=gcp0001", "must differ"),
        ("exchanged:of=marks,shift=1", "goes with of=control"),
        ("mirrored:image=nadir80_0001", "goes with of=images"),
        ("flight-offset:flight=none", "no flight `none`"),
        ("collapsed:every=0.5", "must be 1, 2, 3"),
        ("paired-with-neighbour:by=1000", "below the number of images"),
        ("precision:factor=-1", "must be positive"),
    ] {
        let message = refused(mistake);
        assert!(message.contains(what), "{mistake}: {message}");
    }
    assert!(find("scale").is_some() && find("noise").is_none());
}

#[test]
fn whole_lists_move() {
    let (control, check) = (positions(block(), Role::Control), positions(block(), Role::Check));
    let gnss = antennas(block());
    let of = |mistake: &str| positions(&after(mistake), Role::Control);
    assert_moved(&control, &of("scale:unit=feet"), |p| p / 0.3048);
    assert_moved(&control, &of("scale:factor=2"), |p| 2.0 * p);
    assert_moved(&control, &of("height-scale:unit=mm"), |p| Vector3::new(p.x, p.y, 1000.0 * p.z));
    assert_moved(&control, &of("axes-exchanged"), |p| Vector3::new(p.y, p.x, p.z));
    assert_moved(&control, &of("axis-reversed"), |p| Vector3::new(p.x, p.y, -p.z));
    assert_moved(&check, &positions(&after("plan-offset"), Role::Check), |p| p + Vector3::new(3.0, -2.0, 0.0));
    let heights = after("height-offset:of=gnss,by=47.3");
    assert_moved(&gnss, &antennas(&heights), |p| p + Vector3::new(0.0, 0.0, 47.3));
    assert_moved(&control, &positions(&heights, Role::Control), |p| p);
    let both = after("scale:of=surveyed,unit=mm");
    assert_moved(&check, &positions(&both, Role::Check), |p| 1000.0 * p);
    let degrees = antennas(&after("geographic"));
    assert!(degrees.iter().all(|p| (p.x - 48.0).abs() < 0.01 && (p.y - 11.0).abs() < 0.01), "{degrees:?}");
    let zeros = antennas(&after("collapsed:every=9"));
    assert!(zeros.iter().step_by(9).all(|p| *p == Vector3::zeros()));
    assert_eq!(zeros[1], gnss[1]);
}

#[test]
fn a_turn_keeps_distances_and_the_middle() {
    let before = positions(block(), Role::Control);
    let mean = |list: &[Vector3<f64>]| list.iter().sum::<Vector3<f64>>() / list.len() as f64;
    for (mistake, axis) in [("rotation:degrees=30", 2), ("tilt:degrees=30", 0)] {
        let turned = positions(&after(mistake), Role::Control);
        assert!((mean(&turned) - mean(&before)).norm() < 1e-9, "{mistake}");
        assert!(near((turned[0] - turned[1]).norm(), (before[0] - before[1]).norm()), "{mistake}");
        assert!(turned.iter().zip(&before).all(|(new, old)| near(new[axis], old[axis])), "{mistake}");
        assert!((turned[0] - before[0]).norm() > 1.0, "{mistake}");
    }
}

#[test]
fn members_move_alone() {
    let before = positions(block(), Role::Control);
    let swapped = positions(&after("exchanged:of=control,a=gcp0001,b=gcp0003"), Role::Control);
    assert_eq!((swapped[0], swapped[2]), (before[2], before[0]));
    let first = positions(&after("exchanged"), Role::Control);
    assert_eq!((first[0], first[1]), (before[1], before[0]));
    let slipped = positions(&after("exchanged:shift=1"), Role::Control);
    assert_eq!((slipped[0], slipped[before.len() - 1]), (before[1], before[0]));
    let wrong = positions(&after("wrong-coordinate:name=gcp0002,axis=y,by=-3"), Role::Control);
    let moved: Vec<usize> = (0..before.len()).filter(|k| wrong[*k] != before[*k]).collect();
    assert_eq!(moved, [1]);
    assert!(near(wrong[1].y, before[1].y - 3.0));
    assert_eq!(after("too-few:keep=2").count(Role::Control), 2);
    let line = after("in-line:keep=3");
    assert_eq!((line.count(Role::Control), line.surveyed.len()), (3, block().surveyed.len()));
    let mark = after("wrong-mark:point=gcp0002");
    let moved: Vec<_> = block().marks.iter().zip(&mark.marks).filter(|(a, b)| a != b).collect();
    assert_eq!(moved.len(), 1);
    assert!(near(moved[0].1.x - moved[0].0.x, 20.0) && near(moved[0].1.y - moved[0].0.y, -15.0));
}

#[test]
fn antennas_of_other_images_instants_and_flights() {
    let before = antennas(block());
    let shifted = after("paired-with-neighbour");
    assert_eq!(antennas(&shifted), before[1..]);
    assert!(shifted.images.last().is_some_and(|image| image.gnss.is_none()));
    // Of images at equal distances in a strip the next one is one interval later.
    let interval = block().images[1].time_s.expect("a time") - block().images[0].time_s.expect("a time");
    let later = antennas(&after(&format!("clock-offset:seconds={interval}")));
    assert!((later[0] - before[1]).norm() < 1e-6, "{:?} {:?}", later[0], before[1]);
    let offset = antennas(&after("flight-offset:flight=cross90,z=15"));
    for (k, image) in block().images.iter().enumerate() {
        let expected = if block().flights[image.flight.index()] == "cross90" { 15.0 } else { 0.0 };
        assert!(near(offset[k].z - before[k].z, expected), "{}", image.name);
    }
}

#[test]
fn measurements_in_other_conventions() {
    assert_measured("y-up", |x, y| [x, 3840.0 - y]);
    assert_measured("mirrored", |x, y| [5120.0 - x, y]);
    assert_measured("image-scale:factor=0.5", |x, y| [0.5 * x, 0.5 * y]);
    assert_measured("offset:of=both", |x, y| [x + 0.5, y + 0.5]);
    assert_measured("millimetres", |x, y| [0.0064 * x, 0.0064 * y]);
    assert_measured("normalised", |x, y| [x / 5120.0, y / 3840.0]);
    assert_measured("whole-pixels", |x, y| [x.round(), y.round()]);
    let marks = after("y-up:of=marks");
    assert_eq!(marks.ties, block().ties);
    assert!(marks.marks.iter().zip(&block().marks).all(|(new, old)| near(new.y, 3840.0 - old.y)));
    let ideal = after("undistorted");
    assert_eq!(ideal.marks, block().marks);
    let largest = ideal.ties.iter().zip(&block().ties).map(|(new, old)| (new.x - old.x).hypot(new.y - old.y));
    assert!(largest.fold(0.0, f64::max) > 1.0);
}

#[test]
fn one_image_alone() {
    let name = "nadir80_0031";
    let image = block().images.iter().position(|own| own.name == name).expect("an image");
    for (mistake, at) in [("mirrored", [5120.0, 0.0]), ("turned", [5120.0, 3840.0]), ("offset", [0.5, 0.5])] {
        let of = if mistake == "turned" { "" } else { "of=images," };
        let changed = after(&format!("{mistake}:{of}image={name}"));
        for (new, old) in changed.ties.iter().chain(&changed.marks).zip(block().ties.iter().chain(&block().marks)) {
            let expected = match mistake {
                "mirrored" => [at[0] - old.x, old.y],
                "turned" => [at[0] - old.x, at[1] - old.y],
                _ => [old.x + at[0], old.y + at[1]],
            };
            let expected = if old.image.index() == image { expected } else { [old.x, old.y] };
            assert!(near(new.x, expected[0]) && near(new.y, expected[1]), "{mistake}");
        }
    }
    let twice = after(&format!("duplicated:of=images,image={name}"));
    let count = |block: &Block, image: usize| block.ties.iter().filter(|row| row.image.index() == image).count();
    assert_eq!(twice.images.last().map(|own| own.name.as_str()), Some("nadir80_0031-copy"));
    assert_eq!(count(&twice, twice.images.len() - 1), count(block(), image));
    let exchanged = after("exchanged:of=images,a=nadir80_0001,b=nadir80_0002");
    assert_eq!([count(&exchanged, 0), count(&exchanged, 1)], [count(block(), 1), count(block(), 0)]);
}

#[test]
fn tracks_merge_split_and_double() {
    let merged = after("false-match");
    assert_eq!(merged.tie_points.len(), block().tie_points.len() - 1);
    assert_eq!(merged.ties.len(), block().ties.len());
    let double = after("duplicated");
    assert_eq!((double.ties.len(), double.tie_points.len()), (2 * block().ties.len(), 2 * block().tie_points.len()));
    assert_eq!(after("duplicated:of=marks").surveyed.len(), 2 * block().surveyed.len());
    let parts = after("unconnected");
    let from = block().images.len() / 2;
    for of_point in [false, true] {
        let rows = if of_point { &parts.marks } else { &parts.ties };
        let mut sides: BTreeMap<usize, [bool; 2]> = BTreeMap::new();
        rows.iter().for_each(|row| {
            sides.entry(row.point.index()).or_default()[usize::from(row.image.index() >= from)] = true;
        });
        assert!(sides.values().all(|sides| sides[0] != sides[1]));
    }
    assert_eq!(parts.surveyed.len(), block().surveyed.len());
}

#[test]
fn orientations_in_other_conventions() {
    let (before, image) = (&block().images[5].pose, 5);
    let rotation = |mistake: &str| after(mistake).images[image].pose.rotation;
    assert!(rotation("inverse-rotation").angle_to(&before.rotation.inverse()) < 1e-9);
    let last = rotation("quaternion-order");
    let own = before.rotation.coords;
    assert!(near(last.w, own.x) && near(last.i, own.y) && near(last.j, own.z) && near(last.k, own.w));
    // A point in front of the camera is behind one whose z axis points backwards.
    let point = before.centre + before.rotation.inverse() * Vector3::new(1.0, 2.0, 3.0);
    let seen = rotation("camera-axes") * (point - before.centre);
    assert!((seen - Vector3::new(1.0, -2.0, -3.0)).norm() < 1e-9, "{seen}");
    let centre = |mistake: &str| after(mistake).images[image].pose.centre;
    assert!((before.rotation * before.centre + centre("position-frame")).norm() < 1e-9);
    assert_eq!(centre("position-axes"), Vector3::new(before.centre.y, before.centre.x, before.centre.z));
    assert_eq!(centre("position-axes:change=z-reversed").z, -before.centre.z);
}

#[test]
fn cameras_in_other_units() {
    let interior = |mistake: &str| after(mistake).cameras[0].interior;
    let own = block().cameras[0].interior;
    assert!(near(interior("focal-unit")[0], own[0] * 0.0064));
    assert!(near(interior("focal-unit:unit=35mm")[0], own[0] * 36.0 / 5120.0));
    assert!(near(interior("principal-point-unit:unit=px-centred")[2], own[2] - 1920.0));
    assert!(near(interior("distortion-unit")[5], own[5] * own[0] * own[0]));
    assert!(near(interior("distortion-unit:unit=mm")[8], own[8] / 0.0064));
    let reversed = interior("distortion-sign");
    assert!((5..=9).all(|k| reversed[k] == -own[k]) && reversed[10] == own[10]);
    let sides = after("sensor-size:factor=2").cameras[0].clone();
    assert_eq!((sides.width_px, sides.height_px), (10240, 7680));
    let two = after("several-cameras:factor=1.01");
    let moved: Vec<usize> =
        two.ties.iter().zip(&block().ties).filter(|(a, b)| a != b).map(|(a, _)| a.image.index()).collect();
    assert!(!moved.is_empty() && moved.iter().all(|image| *image >= block().images.len() / 2));
}

#[test]
fn two_cameras_get_one_name_and_no_other_lens() {
    let mut two = block().clone();
    two.cameras.push(Camera { id: "second".into(), ..two.cameras[0].clone() });
    let half = two.images.len() / 2;
    two.images.iter_mut().skip(half).for_each(|image| image.camera = CameraId(1));
    let folder = tempfile::tempdir().expect("a folder");
    write_block(&two, folder.path()).expect("a block");
    let make_it = |mistake: &str| make(folder.path(), &[parse(mistake).expect(mistake)]);
    for given in ["several-cameras:factor=1.02", "several-cameras:from=any"] {
        let refused = format!("{:#}", make_it(given).expect_err(given));
        assert!(refused.contains("leave them out"), "{refused}");
    }
    make_it("several-cameras").expect("one name");
    let made = read_block(folder.path()).expect("a block").block;
    assert!(made.images.iter().all(|image| image.camera == CameraId(0)));
    assert_eq!(made.ties, two.ties);
}

#[test]
fn records_in_other_units() {
    let image = 7;
    let own = &block().images[image];
    let changed = |mistake: &str| after(mistake).images[image].clone();
    let velocity = |mistake: &str| changed(mistake).velocity.expect("a velocity");
    assert!((velocity("velocity-unit") - 3.6 * own.velocity.expect("a velocity")).norm() < 1e-9);
    assert!((velocity("velocity-unit:unit=reversed") + own.velocity.expect("a velocity")).norm() < 1e-9);
    let temperature = own.temperature_c.expect("a temperature");
    let in_unit = |mistake: &str| changed(mistake).temperature_c.expect("a temperature");
    assert!(near(in_unit("temperature-unit"), temperature + 273.15));
    assert!(near(in_unit("temperature-unit:unit=fahrenheit"), 1.8 * temperature + 32.0));
    assert_eq!(changed("time").time_s, block().images[0].time_s);
    assert!(near(changed("time:change=milliseconds").time_s.expect("a time"), 1000.0 * own.time_s.expect("a time")));
    let stated = after("precision:of=gnss,factor=0.1").sigma;
    assert!(near(stated.gnss_xy_m, 0.003) && near(stated.gnss_z_m, 0.005) && stated.tie_px == block().sigma.tie_px);
}
