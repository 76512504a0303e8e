use super::small::aicon::{POINTS, POSES, files};
use super::{format, has, import, try_import, write};
use misclosure::block::Role;
use misclosure::io::foreign::{ImportOptions, Kind};
use nalgebra::Vector3;
use std::path::Path;

/// Writes the files, in one of which `from` is replaced.
fn folder(file: &str, from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files() {
        assert!(name != file || text.contains(from), "{from} is not in {name}");
        write(folder.path(), name, if name == file { text.replacen(from, to, 1) } else { text });
    }
    folder
}

#[test]
fn measurements_are_those_of_their_formula() {
    let folder = folder("", "", "");
    assert!(format("aicon").recognises(folder.path()));
    write(folder.path(), "p.scale", "0 \"bar\" 11 12 500.0 0.01 1\n");
    let (block, notes) = import("aicon", &[folder.path().to_owned()]);
    assert_eq!((block.images.len(), block.tie_points.len(), block.ties.len(), block.marks.len()), (3, 5, 14, 3));
    let mut largest: f64 = 0.0;
    let mut compared = 0;
    let marks = block.marks.iter().map(|mark| (mark, Some(block.surveyed[mark.point.index()].position)));
    let ties = block.ties.iter().map(|tie| (tie, block.tie_points[tie.point.index()].position));
    for (measured, position) in ties.chain(marks) {
        let Some(position) = position else { continue };
        let [x, y] = super::seen(&block, measured.image.index(), &position);
        largest = largest.max((x - measured.x).hypot(y - measured.y));
        compared += 1;
    }
    assert_eq!(compared, POSES.len() * POINTS.len());
    assert!(largest < 1e-9, "{largest} px");
    // 6 um on a side, and 0.0003 and 0.0004 mm.
    assert_eq!(block.cameras[0].pixel_um.map(|um| (um * 1e6).round()), Some(6e6));
    let sigma = block.ties[0].sigma.unwrap();
    assert!((sigma - 12.5e-8f64.sqrt() / 0.006).abs() < 1e-12, "{sigma}");
    let control = &block.surveyed[0];
    assert_eq!(
        (control.name.as_str(), control.role, control.position),
        ("B", Role::Control, Vector3::new(-0.15, -0.2, 0.06))
    );
    assert!((control.sigma_xy.unwrap() - 12.5f64.sqrt() * 1e-3).abs() < 1e-15 && control.sigma_z == Some(0.005));
    for words in ["1 images are left out", "1 points are left out", "3 measurements are left out", "scale bars"] {
        assert!(has(&notes, Kind::Loss, words), "{words}: {notes:?}");
    }
    assert!(has(&notes, Kind::Guess, "millimetres") && has(&notes, Kind::Guess, "not new"), "{notes:?}");
    assert!(has(&notes, Kind::Fact, "1 measured points have no coordinates"), "{notes:?}");
}

#[test]
fn bad_lines_are_refused_with_their_place() {
    let message = |file: &str, from: &str, to: &str| {
        let folder = folder(file, from, to);
        let error = try_import("aicon", &[folder.path().to_owned()], &ImportOptions::default()).unwrap_err();
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    let of = |file, from, to, expected: &str| {
        let found = message(file, from, to);
        assert!(found.starts_with(expected), "{found}");
    };
    of("p.ior", "36.0 24.0", "36.0 23.0", "p.ior:6: expected square pixels");
    of("p.ior", "-28.5", "28.5", "p.ior:6: camera \"1\": expected c below zero");
    of("p.ior", " 6e-6 -9e-6", " 6e-6", "p.ior:4: the line ends where B1 or B2 should stand");
    of("p.eor", "2 1 400", "1 1 400", "p.eor:2: image \"1\" stands twice");
    of("p.eor", "2 1 400", "2 3 400", "p.eor:2: there is no camera \"3\"");
    of("p.eor", "0 307 3", "1 307 3", "p.eor:1: order 1 of the angles");
    of("p.obc", "500", "x", "p.obc:2: its coordinates: expected a finite number, found \"x\"");
    of("p.obc", "12 ", "11 ", "p.obc:2: point \"11\" stands twice");
    of("p.phc", "1 11", "3 11", "p.phc:1: there is no image \"3\"");
    of("p.phc", "1 A", "1 B", "p.phc:5: point \"B\" is measured twice in the image");
}

#[test]
fn a_folder_without_one_of_the_files_is_refused() {
    let folder = folder("", "", "");
    std::fs::remove_file(folder.path().join("p.eor")).unwrap();
    assert!(!format("aicon").recognises(folder.path()));
    let refused =
        |path: &Path| try_import("aicon", &[path.to_owned()], &ImportOptions::default()).unwrap_err().to_string();
    assert!(refused(folder.path()).ends_with("has no file that ends with .eor"), "{}", refused(folder.path()));
}
