//! BlocksExchange XML.

use super::fixture::{ROUNDING_M, apart, block, camera, export, import, measurements};
use misclosure::io::foreign::{ImportOptions, Kind};
use std::fs;

const FILE: &str = "blocks.xml";
/// Half a pixel is taken off and put on again: two roundings of a number of some thousands.
const ROUNDING_PX: f64 = 2e-12;

#[test]
fn a_block_comes_back_with_its_survey() {
    let mut before = block(camera([1.5e-9, -4.5e-17, 1.4e-24, 3e-7, -2e-7, 0.0, 0.0]));
    before.tie_points.iter_mut().enumerate().for_each(|(k, point)| point.name = (k + 1).to_string());
    before.crs = "EPSG:2154 <a & b>".into();
    assert!(!before.surveyed.is_empty() && !before.marks.is_empty());
    let folder = tempfile::tempdir().expect("a folder");
    export("blocks-exchange", &before, folder.path(), false).expect("it can be written");
    let imported =
        import("blocks-exchange", &folder.path().join(FILE), &ImportOptions::default()).expect("it can be read");
    let after = imported.block;
    assert_eq!(after.crs, before.crs);
    for (found, written) in measurements(&after).iter().zip(measurements(&before)) {
        assert_eq!((&found.0, &found.1), (&written.0, &written.1));
        assert!((found.2[0] - written.2[0]).hypot(found.2[1] - written.2[1]) < ROUNDING_PX, "{found:?} {written:?}");
    }
    assert_eq!(after.ties.len(), before.ties.len());
    assert_eq!((after.surveyed.len(), after.marks.len()), (before.surveyed.len(), before.marks.len()));
    for (found, written) in after.surveyed.iter().zip(&before.surveyed) {
        assert_eq!((&found.name, found.position, found.role), (&written.name, written.position, written.role));
        assert_eq!(found.sigma_xy, Some(written.sigma_xy.unwrap_or(before.sigma.control_xy_m)));
    }
    let [metres, radians] = apart(&before, &after);
    assert!(metres < ROUNDING_M && radians < 1e-14, "{metres} m, {radians} rad");
    for (found, written) in after.cameras[0].interior.iter().zip(before.cameras[0].interior) {
        assert!((found - written).abs() <= 1e-12 * written.abs(), "{found} {written}");
    }
    let told = imported.notes.iter().find(|note| note.text.contains("distortion from object to image, P1 along x"));
    assert!(told.is_some_and(|note| note.kind == Kind::Guess), "{:?}", imported.notes);
}

/// A file in which the coefficients mean the other direction, and P1 goes along y: only its measurements say so.
#[test]
fn the_meaning_of_the_distortion_is_read_off_the_residuals() {
    let [k1, k2, p1, p2] = [-0.02, 0.005, 6e-4, -3e-4];
    // Image points whose rays are the same: found by iteration from the ideal ones.
    let mut exact = block(camera([0.0; 7]));
    let [f, ppx, ppy, ..] = exact.cameras[0].interior;
    let distorted = |ideal: [f64; 2]| {
        let goal = [(ideal[0] - ppx) / f, (ideal[1] - ppy) / f];
        let [mut x, mut y] = goal;
        for _ in 0..100 {
            let r2 = x * x + y * y;
            let radial = r2 * (k1 + r2 * k2);
            let add = [
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y),
            ];
            [x, y] = [goal[0] - add[0], goal[1] - add[1]];
        }
        [ppx + f * x, ppy + f * y]
    };
    for tie in &mut exact.ties {
        let point = exact.tie_points[tie.point.index()].position.expect("coordinates");
        let seen = exact.images[tie.image.index()].pose.cam_from_world(&point);
        let [x, y] = distorted([ppx + f * seen.x / seen.z, ppy + f * seen.y / seen.z]);
        (tie.x, tie.y) = (x, y);
    }
    exact.marks.clear();
    exact.surveyed.clear();
    let other = tempfile::tempdir().expect("a folder");
    export("blocks-exchange", &exact, other.path(), false).expect("it can be written");
    fs::remove_file(other.path().join("verification.csv")).expect("the points of another camera");
    let path = other.path().join(FILE);
    let text = fs::read_to_string(&path).expect("a file");
    let coefficients = format!("<K1>{k1}</K1><K2>{k2}</K2><K3>0</K3><P1>{p1}</P1><P2>{p2}</P2>");
    let zero = "<K1>0.0</K1><K2>0.0</K2><K3>0.0</K3><P1>0.0</P1><P2>0.0</P2>";
    assert!(text.contains(zero), "{text}");
    fs::write(&path, text.replace(zero, &coefficients)).expect("a file");
    let options = ImportOptions { approximate: true, ..ImportOptions::default() };
    let notes = import("blocks-exchange", &path, &options).expect("it can be read").notes;
    let told = "distortion from image to object, P1 along y, as in OpenCV";
    assert!(notes.iter().any(|note| note.text.contains(told)), "{notes:?}");
}

#[test]
fn what_cannot_be_meant_is_refused_by_its_place() {
    let before = block(camera([0.0; 7]));
    let folder = tempfile::tempdir().expect("a folder");
    export("blocks-exchange", &before, folder.path(), false).expect("it can be written");
    let path = folder.path().join(FILE);
    let text = fs::read_to_string(&path).expect("a file");
    for (from, to, expected) in [
        ("<M_00>", "<M_00>7</M_00><M_00>", "M_00 to M_22 are no rotation"),
        ("XRightYDown", "XRightYUp", "only XRightYDown can be read"),
        (
            "<Id>0</Id><Name>local</Name><Definition>local",
            "<Id>0</Id><Name>a</Name><Definition>EPSG:4326",
            "is geographic",
        ),
        ("<FocalLengthPixels>", "<FocalLengthPixels>x", "expected a finite number"),
        ("</TiePoints>", "", "not XML"),
    ] {
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replacen(from, to, 1)).expect("a file");
        let error = import("blocks-exchange", &path, &ImportOptions::default()).expect_err(expected).to_string();
        assert!(error.contains(expected) && error.contains(": byte "), "{error}");
    }
}
