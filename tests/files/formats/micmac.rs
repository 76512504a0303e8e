use super::small::micmac::{CALIBRATION, PAIRS, PAIRS_BACK, PMUL, binary_pairs, binary_pmul, orientation};
use super::{format, has, import, sample, try_import, write};
use misclosure::block::{Block, Role};
use misclosure::camera::fraser::project;
use misclosure::io::block::{read_block, write_block};
use misclosure::io::foreign::{ExportOptions, ImportOptions, Kind, Note};
use std::path::{Path, PathBuf};

fn approximately(path: &Path) -> (Block, Vec<Note>) {
    let options = ImportOptions { approximate: true, ..ImportOptions::default() };
    let imported = try_import("micmac", &[path.to_owned()], &options).unwrap_or_else(|error| panic!("{error}"));
    (imported.block, imported.notes)
}

/// The calibration of the first version has a term in r^9, which no Fraser camera has: it is fitted, and MMVII fitted
/// it too.
#[test]
fn the_same_project_in_both_versions() {
    let Some(folder) = sample("micmac-saisies") else { return };
    let refused = try_import("micmac", std::slice::from_ref(&folder), &ImportOptions::default()).unwrap_err();
    assert!(refused.to_string().contains("no exact counterpart"), "{refused}");
    let (first, notes) = approximately(&folder);
    assert!(has(&notes, Kind::Detail, "40 verification points of the orientations are met to"), "{notes:?}");
    let (second, _) = import("micmac", &[folder.join("mmvii")]);
    assert_eq!((first.images.len(), second.images.len()), (4, 4));
    for (a, b) in first.images.iter().zip(&second.images) {
        assert_eq!(a.name, b.name);
        // MMVII writes fifteen digits.
        assert!((a.pose.centre - b.pose.centre).norm() < 1e-14 * 10.0, "{}", a.name);
        assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-7, "{}", a.name);
    }
    let marks = |block: &Block| {
        let mark = |mark: &misclosure::block::Measurement| {
            let [image, point] =
                [&block.images[mark.image.index()].name, &block.surveyed[mark.point.index()].name].map(String::clone);
            (image, point, [mark.x, mark.y].map(|value| (value * 1e9).round()))
        };
        let mut marks: Vec<_> = block.marks.iter().map(mark).collect();
        marks.sort_by(|a, b| (&a.0, &a.1).cmp(&(&b.0, &b.1)));
        marks
    };
    assert!(!first.marks.is_empty());
    assert_eq!(marks(&first), marks(&second));
    for (a, b) in first.surveyed.iter().zip(&second.surveyed) {
        assert_eq!((&a.name, a.role, a.sigma_xy, a.sigma_z), (&b.name, Role::Control, b.sigma_xy, b.sigma_z));
        assert!((a.position - b.position).norm() < 1e-13);
    }
    // Two fits of one camera: each is off by less than a tenth of a pixel where points are (ours by 0.082 px at the
    // corner).
    let [a, b] = [&first.cameras[0].interior, &second.cameras[0].interior];
    for [x, y] in [[0.0, 0.0], [0.2, 0.1], [-0.3, 0.2], [-0.15, -0.2]] {
        let [[ax, ay], [bx, by]] = [project(a, [x, y, 1.0]).unwrap(), project(b, [x, y, 1.0]).unwrap()];
        assert!((ax - bx).hypot(ay - by) < 0.1, "{x} {y}: {} {}", ax - bx, ay - by);
    }
}

/// A project of two images with ties in `ties`: path below the project, content.
fn project_with(ties: &[(&str, &[u8])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let orientations = folder.path().join("Ori-A");
    std::fs::create_dir(&orientations).unwrap();
    write(&orientations, "AutoCal.xml", CALIBRATION);
    write(&orientations, "Orientation-a.jpg.xml", orientation("1 2 3"));
    write(&orientations, "Orientation-b.jpg.xml", orientation("4 5 6"));
    write(&orientations, "Residus.xml", "<XmlSauvExportAperoGlob/>");
    for (name, content) in ties {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    folder
}

/// Four forms of the same tie points. They count from the centre of the first pixel, ours from its corner.
#[test]
fn ties_as_text_and_binary_multiple_and_in_pairs() {
    let (pmul, pairs) = (binary_pmul(), binary_pairs());
    for ties in [
        &[("Homol/PMul.txt", PMUL.as_bytes())][..],
        &[("Homol/PMul.dat", &pmul)],
        &[("Homol_Ratafia/Pastisa.jpg/b.jpg.dat", &pairs)],
        &[("Homol/Pastisa.jpg/b.jpg.txt", PAIRS.as_bytes()), ("Homol/Pastisb.jpg/a.jpg.txt", PAIRS_BACK.as_bytes())],
    ] {
        let folder = project_with(ties);
        assert!(format("micmac").recognises(folder.path()));
        let (block, notes) = import("micmac", &[folder.path().to_owned()]);
        let places = |point: usize| -> Vec<[f64; 2]> {
            block.ties.iter().filter(|tie| tie.point.index() == point).map(|tie| [tie.x, tie.y]).collect()
        };
        assert_eq!(block.tie_points.len(), 2, "{ties:?}");
        assert_eq!([places(0), places(1)], [[[10.5, 20.5], [31.0, 40.5]], [[11.5, 21.5], [31.5, 41.5]]]);
        assert!(has(&notes, Kind::Guess, "half a pixel is added"));
        let expected = [3000.0, 2000.0, 1500.0, 2010.0, 1490.0, -1e-8, 2e-16, 0.0, 1e-7, -2e-7, 1e-4, -3e-5];
        assert_eq!(block.cameras[0].interior, expected);
        assert_eq!(block.cameras[0].pixel_um, Some(4.0));
        // The matrix takes the camera to the world: its first column is the camera's x axis.
        let axis = block.images[0].pose.rotation.inverse() * nalgebra::Vector3::x();
        assert!((axis - nalgebra::Vector3::y()).norm() < 1e-12, "{axis}");
    }
}

#[test]
fn distortion_from_image_to_ideal_point_is_turned_round() {
    let folder = project_with(&[("Homol/PMul.txt", PMUL.as_bytes())]);
    // A lens of which three terms hold the inverse too.
    let calibration = CALIBRATION.replace("M2C", "C2M").replace("-1e-8", "-3e-9").replace("2e-16", "1e-17");
    let calibration = calibration.replace("1e-7", "1e-8").replace("-2e-7", "-1e-8").replace("1e-4", "1e-5");
    write(&folder.path().join("Ori-A"), "AutoCal.xml", calibration);
    let (block, _) = import("micmac", &[folder.path().to_owned()]);
    let [f, ppx, ppy, dcx, ..] = block.cameras[0].interior;
    // Of a measured point at (du, dv) = (1000, 500) from the centre of distortion, by the formula in the other
    // direction.
    let (du, dv) = (1000.0, 500.0);
    let r2 = du * du + dv * dv;
    let radial = -3e-9 * r2 + 1e-17 * r2 * r2;
    let u = 3010.0 + du * radial + 1e-8 * (r2 + 2.0 * du * du) - 2e-8 * du * dv + 1e-5 * du - 3e-5 * dv;
    let v = 1990.0 + dv * radial - 1e-8 * (r2 + 2.0 * dv * dv) + 2e-8 * du * dv;
    let ray = [(u - 2000.0) / 3000.0, (v - 1500.0) / 3000.0, 1.0];
    let [x, y] = project(&block.cameras[0].interior, ray).unwrap();
    assert!((x - 3010.0).hypot(y - 1990.0) < 0.05, "{x} {y}");
    assert!((f - 3000.0).abs() < 20.0 && (ppx - dcx).abs() > 1.0 && (ppy - 1500.0).abs() < 20.0, "{f} {ppx} {ppy}");
}

#[test]
fn what_is_not_understood_is_refused_with_its_place() {
    let message = |file: &str, content: &str| {
        let folder = project_with(&[("Homol/PMul.txt", PMUL.as_bytes())]);
        let path = folder.path().join(file);
        std::fs::write(&path, content).unwrap();
        let error = try_import("micmac", &[folder.path().to_owned()], &ImportOptions::default()).unwrap_err();
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    let calibration = |from: &str, to: &str| message("Ori-A/AutoCal.xml", &CALIBRATION.replace(from, to));
    let directionless = calibration("<KnownConv>eConvApero_DistM2C</KnownConv>", "");
    assert!(directionless.starts_with("Ori-A/AutoCal.xml:1:14: <KnownConv> is missing"), "{directionless}");
    let second = calibration("</CalibDistortion>", "</CalibDistortion><CalibDistortion/>");
    assert!(second.contains("a second <CalibDistortion>"), "{second}");
    let afocal = calibration("<F>", "<ParamAF>1</ParamAF><F>");
    assert!(afocal.contains("<ParamAF> is not understood"), "{afocal}");
    assert!(calibration("ModPhgrStd>", "ModEbner>").contains("<ModEbner> is no Fraser camera"));
    let film = orientation("1 2 3").replace("<V10>1 0", "<V10>1 0.1");
    assert!(message("Ori-A/Orientation-a.jpg.xml", &film).contains("expected the identity"));
    let mirrored = orientation("1 2 3").replace("<L3>0 0 1", "<L3>0 0 -1");
    assert!(message("Ori-A/Orientation-a.jpg.xml", &mirrored).contains("expected the matrix of a rotation"));
    let verified = orientation("1 2 3")
        .replace("</Externe>", "</Externe><Verif><Appuis><Im>1 1</Im><Ter>1 2 9</Ter></Appuis></Verif>");
    assert!(message("Ori-A/Orientation-a.jpg.xml", &verified).contains("misses its own verification point"));
    let short = message("Homol/PMul.txt", &PMUL.replace("7 8 1", "7"));
    assert_eq!(short, "Homol/PMul.txt:19: the file ends where a coordinate should stand");
    let nobody = message("Homol/PMul.txt", &PMUL.replace("1 2\n2 1", "1 2\n2 3"));
    assert_eq!(nobody, "Homol/PMul.txt:18: there is no image 3");
}

#[test]
fn what_is_exported_is_read_again() {
    let folder = project_with(&[("Homol/PMul.txt", PMUL.as_bytes())]);
    let (block, _) = import("micmac", &[folder.path().to_owned()]);
    let exported = tempfile::tempdir().unwrap();
    let exporter = format("micmac").exporter().unwrap();
    exporter.export(&block, exported.path(), &ExportOptions::default()).unwrap();
    let paths: [PathBuf; 1] = [exported.path().to_owned()];
    let (again, notes) = import("micmac", &paths);
    assert!(has(&notes, Kind::Detail, "10 points of verification.csv are met"), "{notes:?}");
    let bits = |block: &Block| -> Vec<[f64; 2]> { block.ties.iter().map(|tie| [tie.x, tie.y]).collect() };
    assert_eq!(bits(&again), bits(&block));
    assert_eq!(again.cameras[0].interior, block.cameras[0].interior);
    for (a, b) in again.images.iter().zip(&block.images) {
        assert_eq!((&a.name, a.pose.centre), (&b.name, b.pose.centre));
        assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-7);
    }
    let whole = tempfile::tempdir().unwrap();
    write_block(&again, whole.path()).unwrap();
    assert_eq!(read_block(whole.path()).unwrap().block.ties, again.ties);
}
