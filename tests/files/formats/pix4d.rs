use super::small::pix4d::{BINGO, CAMERAS, EXTERNAL, TIES};
use super::{format, has, import, try_import, write};
use misclosure::io::foreign::{ImportOptions, Kind};
use nalgebra::Vector3;

fn folder(ties: &str, content: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "p_calibrated_camera_parameters.txt", CAMERAS);
    write(folder.path(), "p_calibrated_external_camera_parameters.txt", EXTERNAL);
    write(folder.path(), "p_offset.xyz", "1000 2000 0\n");
    write(folder.path(), ties, content);
    folder
}

#[test]
fn cameras_poses_and_ties() {
    let folder = folder("p_tp_pix4d.txt", TIES);
    assert!(format("pix4d").recognises(folder.path()));
    let (block, notes) = import("pix4d", &[folder.path().to_owned()]);
    let f = 2500.0f64;
    // t1 is our p2, t2 our p1.
    let [k1, k2, k3] = [-0.1 / f.powi(2), 0.05 / f.powi(4), 0.01 / f.powi(6)];
    let expected = [f, 2010.0, 1490.0, 2010.0, 1490.0, k1, k2, k3, -0.002 / f, 0.001 / f, 0.0, 0.0];
    for (found, expected) in block.cameras[0].interior.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} {expected}");
    }
    assert_eq!((block.cameras.len(), block.images[1].pose.centre), (1, Vector3::new(1011.0, 2002.0, 50.0)));
    let places: Vec<[f64; 2]> = block.ties.iter().map(|tie| [tie.x, tie.y]).collect();
    // No half pixel is added.
    assert_eq!(places, [[100.5, 200.25], [300.0, 400.0]]);
    assert!(has(&notes, Kind::Loss, "1 images have tie points but no pose"), "{notes:?}");
}

#[test]
fn bingo_coordinates_are_millimetres_from_the_middle_with_y_up() {
    let folder = folder("p_tp_bingo.txt", BINGO);
    let (block, notes) = import("pix4d", &[folder.path().to_owned()]);
    let places: Vec<[f64; 2]> = block.ties.iter().map(|tie| [tie.x, tie.y]).collect();
    assert_eq!(places, [[0.0, 0.0], [3000.0, 2250.0]]);
    assert!(has(&notes, Kind::Loss, "chosen by a grid"));
}

#[test]
fn bad_files_are_refused_with_their_place() {
    let message = |file: &str, content: &str| {
        let folder = folder("p_tp_pix4d.txt", TIES);
        write(folder.path(), file, content);
        let error = try_import("pix4d", &[folder.path().to_owned()], &ImportOptions::default()).unwrap_err();
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    let cameras = |from: &str, to: &str| message("p_calibrated_camera_parameters.txt", &CAMERAS.replacen(from, to, 1));
    assert!(cameras("0 -1 0", "0 1 0").ends_with(":14: the three rows before are no rotation"));
    assert!(cameras("2500 0 2010", "2500 3 2010").contains("expected K = [f 0 x; 0 f y; 0 0 1]"));
    let turned = message("p_calibrated_external_camera_parameters.txt", &EXTERNAL.replace("0 0 90", "0 0 0"));
    assert!(turned.ends_with(":3: image \"b.jpg\": the angles are 90.0 degrees from R of the other file"), "{turned}");
    let word = message("p_tp_pix4d.txt", "a\n7 1 y 1\n");
    assert!(
        word.ends_with("p_tp_pix4d.txt:2: the point's coordinates: expected a finite number, found \"y\""),
        "{word}"
    );
}
