//! COLMAP models.

use super::beside;
use super::fixture::{ROUNDING_M, apart, block, camera, export, import, measurements};
use misclosure::block::Block;
use misclosure::camera::fraser::project;
use misclosure::io::foreign::{ImportOptions, Kind};
use std::fs;
use std::process::Command;

/// Numbers of k1, k2, k3, p1, p2, b1, b2 that COLMAP has a model for, and the model.
const EXACT: [(&str, [f64; 7]); 6] = [
    ("SIMPLE_PINHOLE", [0.0; 7]),
    ("PINHOLE", [0.0, 0.0, 0.0, 0.0, 0.0, 2e-4, 0.0]),
    ("SIMPLE_RADIAL", [1.5e-9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ("RADIAL", [1.5e-9, -4.5e-17, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ("OPENCV", [1.5e-9, -4.5e-17, 0.0, 3e-7, -2e-7, 0.0, 0.0]),
    ("FULL_OPENCV", [1.5e-9, -4.5e-17, 1.4e-24, 3e-7, -2e-7, 0.0, 0.0]),
];

fn there_and_back(form: &str, before: &Block) -> (Block, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    export(form, before, folder.path(), false).expect("it can be written");
    // Either name reads either form.
    let imported = import("colmap", folder.path(), &ImportOptions::default()).expect("it can be read");
    let met = imported
        .notes
        .iter()
        .any(|note| note.kind == Kind::Detail && note.text.starts_with("10 points of verification.csv"));
    assert!(met, "{:?}", imported.notes);
    (imported.block, folder)
}

#[test]
fn a_block_comes_back_from_either_form() {
    for (form, (model, coefficients)) in
        ["colmap", "colmap-text"].iter().flat_map(|form| EXACT.map(|exact| (form, exact)))
    {
        let before = block(camera(coefficients));
        let (after, folder) = there_and_back(form, &before);
        if *form == "colmap-text" {
            let cameras = fs::read_to_string(folder.path().join("cameras.txt")).expect("cameras");
            assert!(cameras.contains(&format!("1 {model} ")), "{cameras}");
        }
        for (found, written) in after.cameras[0].interior.iter().zip(before.cameras[0].interior) {
            // b1 is the difference of two focal lengths: of 2e-4 a rounding of 1 is a part in 1e12.
            assert!((found - written).abs() <= 1e-11 * written.abs(), "{form} {model}: {found} {written}");
        }
        // Points are numbered in the order of the block.
        let mut numbered = before.clone();
        numbered.tie_points.iter_mut().enumerate().for_each(|(k, point)| point.name = (k + 1).to_string());
        assert_eq!(measurements(&after), measurements(&numbered), "{form}");
        let positions = |block: &Block| block.tie_points.iter().map(|point| point.position).collect::<Vec<_>>();
        assert_eq!(positions(&after), positions(&before), "{form}");
        let [metres, radians] = apart(&before, &after);
        assert!(metres < ROUNDING_M * 100.0 && radians < 1e-15 * 10.0, "{form}: {metres} m, {radians} rad");
    }
}

#[test]
fn ids_of_points_stay() {
    let mut before = block(camera([0.0; 7]));
    before.tie_points.iter_mut().enumerate().for_each(|(k, point)| point.name = (7 * k + 3).to_string());
    assert_eq!(measurements(&there_and_back("colmap", &before).0), measurements(&before));
}

/// What a mistake would be is larger than what the verification points let through.
#[test]
fn half_a_pixel_and_exchanged_decentring_are_noticed() {
    let before = block(camera(EXACT[4].1));
    let folder = tempfile::tempdir().expect("a folder");
    export("colmap-text", &before, folder.path(), false).expect("it can be written");
    let path = folder.path().join("cameras.txt");
    let cameras = fs::read_to_string(&path).expect("cameras");
    let words: Vec<&str> = cameras.lines().last().expect("a camera").split(' ').collect();
    let altered = |edit: &dyn Fn(&mut Vec<String>)| {
        let mut words: Vec<String> = words.iter().map(|word| word.to_string()).collect();
        edit(&mut words);
        fs::write(&path, words.join(" ")).expect("cameras");
        import("colmap", folder.path(), &ImportOptions::default()).map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(altered(&|_| {}), Ok(()));
    for edit in [
        &(|words: &mut Vec<String>| words[6] = format!("{}", words[6].parse::<f64>().expect("cx") + 0.5))
            as &dyn Fn(&mut Vec<String>),
        &|words| words.swap(10, 11),
    ] {
        let error = altered(edit).expect_err("it is noticed");
        assert!(error.contains("px from where it was written"), "{error}");
    }
}

#[test]
fn a_camera_that_colmap_has_not_is_refused_with_the_difference() {
    let before = block(camera([1.5e-9, 0.0, 0.0, 0.0, 0.0, 1e-4, 1e-4]));
    let folder = tempfile::tempdir().expect("a folder");
    let error = export("colmap", &before, folder.path(), false).expect_err("b2").to_string();
    assert!(error.contains("b1, b2") && error.contains("px at most") && error.contains("--approximate"), "{error}");
    let notes = export("colmap", &before, folder.path(), true).expect("asked for");
    assert!(notes.iter().any(|note| note.text.contains("px at most")), "{notes:?}");
    import("colmap", folder.path(), &ImportOptions::default()).expect("the files are true to themselves");
}

/// Published counts of the sample, and COLMAP's own error of each point.
#[test]
fn maupertuis_is_what_colmap_says() {
    let Some(folder) = beside::shared("data/interop/colmap-maupertuis") else { return };
    let imported = import("colmap", &folder, &ImportOptions::default()).expect("a model");
    let block = imported.block;
    // The tracks have 3355 elements; some have two features of one image, at one place or at two.
    assert_eq!((block.images.len(), block.tie_points.len(), block.ties.len()), (4, 1039, 3345));
    assert!(
        imported.notes.iter().any(|note| note.text.starts_with("10 measurements are left out")),
        "{:?}",
        imported.notes
    );
    assert_eq!(block.cameras[0].interior, [1847.53, 959.5, 539.5, 959.5, 539.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let names: Vec<&str> = block.images.iter().map(|image| image.name.as_str()).collect();
    assert_eq!(names, ["00.jpg", "01.jpg", "02.jpg", "03.jpg"]);
    let mut sums = vec![(0.0, 0); block.tie_points.len()];
    for tie in &block.ties {
        let point = block.tie_points[tie.point.index()].position.expect("coordinates");
        let seen = block.images[tie.image.index()].pose.cam_from_world(&point);
        let [x, y] = project(&block.cameras[0].interior, seen.into()).expect("in front");
        let sum = &mut sums[tie.point.index()];
        *sum = (sum.0 + (tie.x - x).hypot(tie.y - y), sum.1 + 1);
    }
    let text = fs::read_to_string(folder.join("points3D.txt")).expect("points");
    let mut compared = 0;
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split(' ').collect();
        let elements = words[8..].len() / 2;
        let point = block.tie_points.iter().position(|point| point.name == words[0]).expect("every point");
        if sums[point].1 as usize != elements {
            continue;
        }
        let (error, stated) = (sums[point].0 / f64::from(sums[point].1), words[7].parse::<f64>().expect("an error"));
        // Poses and coordinates in the file have six digits: 1e-6 of 20 m at 1800 px / 10 m, times a few numbers.
        assert!((error - stated).abs() < 0.02, "point {}: {error} px, {stated} px in the file", words[0]);
        compared += 1;
    }
    assert!(compared > 1000, "{compared}");
}

/// The client itself opens what is written, finds our reprojection errors in it, and what it writes then is read as the
/// same.
#[test]
fn pycolmap_reads_and_writes_the_same() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/check_colmap.py");
    let python = |arguments: &[&str]| Command::new("python3").args(arguments).output();
    if !python(&["-c", "import pycolmap"]).is_ok_and(|output| output.status.success()) {
        use std::io::Write;
        writeln!(std::io::stderr(), "skipped: no pycolmap").expect("standard error");
        return;
    }
    for (model, coefficients) in EXACT {
        let mut before = block(camera(coefficients));
        // Errors to compare: without noise they are the difference of the camera from that which took the images.
        before.cameras[0].interior[1] += 0.25;
        before.cameras[0].interior[3] += 0.25;
        for form in ["colmap", "colmap-text"] {
            let (after, folder) = there_and_back(form, &before);
            let again = tempfile::tempdir().expect("a folder");
            let [from, to] = [folder.path(), again.path()].map(|path| path.to_str().expect("UTF-8"));
            let output = python(&[script, from, to]).expect("python3");
            let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{form} {model}: {text}");
            let written = import("colmap", again.path(), &ImportOptions::default()).expect("what pycolmap wrote").block;
            assert_eq!(measurements(&written), measurements(&after), "{form} {model}");
            assert_eq!(written.cameras[0].interior, after.cameras[0].interior, "{form} {model}");
            let [metres, radians] = apart(&written, &after);
            assert!(metres < ROUNDING_M * 100.0 && radians < 1e-14, "{form} {model}: {metres} m, {radians} rad");
        }
    }
}
