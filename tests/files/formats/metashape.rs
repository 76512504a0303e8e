use super::small::metashape::{MARKERS, POINTER, Project, RELATIVE, document, project, rig, whole};
use super::{format, has, import, reprojection_errors, rms, sample, try_import, write};
use misclosure::block::Role;
use misclosure::io::block::read_block;
use misclosure::io::foreign::{ExportOptions, ImportOptions, Kind};
use nalgebra::Vector3;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Marks and control are those of the block that was converted by other means; the tie points are not: another matching
/// made them.
#[test]
fn the_real_project_is_the_block_that_others_made_of_it() {
    let Some(project) = sample("metashape-sxb/sxb.psz") else { return };
    let (block, notes) = import("metashape", &[project]);
    assert_eq!((block.images.len(), block.surveyed.len(), block.tie_points.len()), (5, 16, 1166));
    assert!(block.surveyed.iter().all(|point| point.role == Role::Control));
    assert_eq!((block.sigma.tie_px, block.sigma.mark_px), (1.0, 0.1));
    assert!(!has(&notes, Kind::Loss, "left out"), "{notes:?}");
    // What the coordinates in the file give; the file has no figure of its own.
    let error = rms(&reprojection_errors(&block));
    assert!((error - 0.31168).abs() < 1e-5, "{error} px");

    let reference = read_block(&super::beside::shared("data/dbat-sxb").expect("beside the sample")).unwrap().block;
    for mark in &block.marks {
        let [name, image] = [&block.surveyed[mark.point.index()].name, &block.images[mark.image.index()].name];
        let position = block.surveyed[mark.point.index()].position - Vector3::new(1e6, 112_000.0, 0.0);
        let near = |other: &misclosure::block::SurveyedPoint| (other.position - position).norm() < 1e-6;
        let own = reference.surveyed.iter().position(near).unwrap_or_else(|| panic!("no point {name}"));
        let same = reference
            .marks
            .iter()
            .find(|other| other.point.index() == own && reference.images[other.image.index()].name == **image);
        let same = same.unwrap_or_else(|| panic!("no mark of {name} in {image}"));
        // Metashape writes eight digits.
        assert!((same.x - mark.x).abs() < 1e-3 && (same.y - mark.y).abs() < 1e-3, "{name} in {image}");
    }
    assert_eq!(block.marks.len(), reference.marks.len());
}

fn of_text(text: &str) -> Result<(misclosure::block::Block, Vec<misclosure::io::foreign::Note>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "cameras.xml", text);
    assert!(format("metashape").recognises(&path));
    let imported = try_import("metashape", &[path], &ImportOptions::default());
    let inside = format!("{}/", folder.path().display());
    imported.map(|imported| (imported.block, imported.notes)).map_err(|error| error.to_string().replace(&inside, ""))
}

#[test]
fn principal_points_are_relative_or_absolute_by_version() {
    let (relative, _) = of_text(&document(RELATIVE, MARKERS)).unwrap();
    let absolute =
        RELATIVE.replace("<f>2500</f><cx>3</cx><cy>-4</cy>", "<fx>2500</fx><fy>2500</fy><cx>2003</cx><cy>1496</cy>");
    let (absolute, _) = of_text(&document(&absolute, MARKERS)).unwrap();
    let f = 2500.0f64;
    // p1 and p2 keep their places, unlike those of OpenCV.
    let [k1, k2, p1, p2] = [-0.1 / f.powi(2), 0.05 / f.powi(4), 0.001 / f, -0.002 / f];
    let expected = [f, 2003.0, 1496.0, 2003.0, 1496.0, k1, k2, 0.0, p1, p2, 0.0, 0.0];
    for block in [relative, absolute] {
        for (found, expected) in block.cameras[0].interior.iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} {expected}");
        }
    }
}

#[test]
fn poses_markers_and_roles() {
    let (block, notes) = of_text(&document(RELATIVE, MARKERS)).unwrap();
    assert_eq!(block.flights, ["morning", "flight"]);
    assert!(has(&notes, Kind::Loss, "1 images are not aligned") && has(&notes, Kind::Loss, "1 marks that Metashape"));
    // The chunk's z is the world's y here: x_world = t + 2 R x.
    assert_eq!(block.images[1].pose.centre, Vector3::new(14.0, 20.0, 30.0));
    let control = &block.surveyed[0];
    assert_eq!((control.name.as_str(), control.role, control.sigma_z), ("G1", Role::Control, Some(0.1)));
    assert!((control.sigma_xy.unwrap() - 0.125f64.sqrt()).abs() < 1e-12);
    let [x, y] = super::seen(&block, 0, &control.position);
    assert!((x - 2003.0).abs() < 1e-9 && (y - 1496.0).abs() < 1e-9, "five metres ahead: {x} {y}");
    assert_eq!(block.surveyed[1].role, Role::Check);
    assert_eq!((block.marks.len(), block.marks[0].x, block.marks[1].x), (2, 2000.5, 5.0));
    assert_eq!((block.tie_points[0].name.as_str(), block.ties.len()), ("marker T1", 2));
}

#[test]
fn slaves_of_a_rig_have_the_pose_of_their_master_and_the_offset_of_their_sensor() {
    let (block, notes) = of_text(&rig()).unwrap();
    let names: Vec<&str> = block.images.iter().map(|image| image.name.as_str()).collect();
    assert_eq!(names, ["a.jpg", "b.jpg", "c.jpg", "d.jpg"]);
    // In the chunk one unit to the right of a and of b, whose x axis is the chunk's y.
    assert!((block.images[2].pose.centre - Vector3::new(12.0, 20.0, 30.0)).norm() < 1e-12);
    assert!((block.images[3].pose.centre - Vector3::new(14.0, 20.0, 28.0)).norm() < 1e-12);
    // The slave's x axis is its master's y, which is downwards in the world for a.
    let right = |image: usize| block.images[image].pose.rotation.inverse() * Vector3::x();
    assert!((right(2) + Vector3::z()).norm() < 1e-12, "{}", right(2));
    let down_of_master = block.images[1].pose.rotation.inverse() * Vector3::y();
    assert!((right(3) - down_of_master).norm() < 1e-12, "{}", right(3));
    assert_eq!(block.cameras[block.images[2].camera.index()].id, "slave 8");
    assert!(has(&notes, Kind::Guess, "2 images of rigs have their pose from that of their master"), "{notes:?}");
    assert!(has(&notes, Kind::Loss, "1 images of rigs have no pose, their master image is not aligned"), "{notes:?}");
    assert!(has(&notes, Kind::Loss, "1 images of rigs have no pose, their sensor has no rotation"), "{notes:?}");
    assert!(has(&notes, Kind::Loss, "1 images are not aligned"), "{notes:?}");
    let bent = rig().replace("<rotation>0 -1 0 1 0 0 0 0 1", "<rotation>0 -1 0 1 0 0 0 0 2");
    assert!(of_text(&bent).unwrap_err().ends_with("<rotation> of the sensor is no rotation"));
}

#[test]
fn geographic_chunks_are_laid_into_a_local_system() {
    let wgs84 = "<reference>GEOGCS[\"WGS \
                 84\",DATUM[\"W\",AUTHORITY[\"EPSG\",\"6326\"]],AUTHORITY[\"EPSG\",\"4326\"]]</reference>";
    // On the equator at Greenwich the Earth-centred x is up, y east, z north.
    let text = document(RELATIVE, &format!("{MARKERS}{wgs84}"))
        .replace("10 20 30", "6378137 0 0")
        .replace("x=\"10\" y=\"30\" z=\"30\"", "x=\"0.0001\" y=\"0\" z=\"12\"")
        .replace("x=\"11\" y=\"31\" z=\"30\"", "x=\"0\" y=\"0.0001\" z=\"12\"");
    let (block, notes) = of_text(&text).unwrap();
    assert!(has(&notes, Kind::Fact, "latitude 0, longitude 0"), "{notes:?}");
    assert!((block.images[1].pose.centre - Vector3::new(0.0, 0.0, 4.0)).norm() < 1e-6);
    // The camera's x axis is the chunk's y in image b, the Earth's -z: south.
    let south = block.images[1].pose.rotation.inverse() * Vector3::x();
    assert!((south - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-9, "{south}");
    let east = block.surveyed[0].position;
    assert!((east - Vector3::new(11.1319, 0.0, 12.0)).norm() < 1e-3, "{east}");
    let refused = of_text(&text.replace("4326", "6326")).unwrap_err();
    assert!(refused.starts_with("cameras.xml: expected WGS84"), "{refused}");
}

#[test]
fn what_is_no_frame_camera_or_no_number_is_refused_with_its_place() {
    let fisheye = document(RELATIVE, "").replace("type=\"frame\" class", "type=\"fisheye\" class");
    let message = of_text(&fisheye).unwrap_err();
    assert_eq!(message, "cameras.xml:4:1: calibration of the type \"fisheye\"; only \"frame\" is a Fraser camera");
    let message = of_text(&document("<f>much</f>", "")).unwrap_err();
    assert!(message.contains("<f>: expected one finite number, found \"much\""), "{message}");
    let mirrored = document(RELATIVE, "").replace("<rotation>1 0 0 0 0 1 0 -1 0", "<rotation>1 0 0 0 0 1 0 1 0");
    assert_eq!(of_text(&mirrored).unwrap_err(), "cameras.xml: image \"a.jpg\": <transform> is no rotation");
}

#[test]
fn what_is_exported_is_read_again_and_verified() {
    let (mut block, _) = of_text(&document(RELATIVE, MARKERS)).unwrap();
    block.cameras[0].pixel_um = Some(3.5);
    let folder = tempfile::tempdir().unwrap();
    let exporter = format("metashape").exporter().unwrap();
    exporter.export(&block, folder.path(), &ExportOptions::default()).unwrap();
    let paths = [folder.path().join("cameras.xml")];
    let again = try_import("metashape", &paths, &ImportOptions::default()).unwrap();
    assert!(has(&again.notes, Kind::Detail, "10 points of verification.csv are met"), "{:?}", again.notes);
    assert_eq!(again.block.cameras, block.cameras);
    for (a, b) in again.block.images.iter().zip(&block.images) {
        assert!(a.name == b.name && (a.pose.centre - b.pose.centre).norm() < 1e-9);
        assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-12);
    }
}

#[test]
fn a_project_in_one_zip_file_and_in_several() {
    let folder = tempfile::tempdir().unwrap();
    let Project { project, chunk, frame, cloud, points, projections: [a, b] } = project();
    write(folder.path(), "p.psx", POINTER);
    let files = folder.path().join("p.files");
    std::fs::create_dir_all(files.join("0/0/point_cloud")).unwrap();
    zip(&files.join("project.zip"), &[("doc.xml", &project)]);
    zip(&files.join("0/chunk.zip"), &[("doc.xml", &chunk)]);
    zip(&files.join("0/0/frame.zip"), &[("doc.xml", &frame)]);
    let members: [(&str, &[u8]); 4] = [("doc.xml", &cloud), ("points0.ply", &points), ("p3.ply", &a), ("p4.ply", &b)];
    zip(&files.join("0/0/point_cloud/point_cloud.zip"), &members);
    zip(&folder.path().join("p.psz"), &[&[("doc.xml", whole().as_bytes())], &members[1..]].concat());
    for file in ["p.psx", "p.psz"] {
        let (block, notes) = import("metashape", &[folder.path().join(file)]);
        assert_eq!(block.tie_points[0].position, Some(Vector3::new(10.0, 30.0, 30.0)));
        assert_eq!(block.ties.iter().map(|tie| [tie.x, tie.y]).collect::<Vec<_>>(), [[100.0, 200.0], [300.0, 400.0]]);
        assert_eq!(block.marks.len(), 1);
        assert!(has(&notes, Kind::Loss, "1 tie points have no coordinates"), "{notes:?}");
    }
}

fn zip(path: &Path, members: &[(&str, &[u8])]) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in members {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

#[test]
fn files_that_do_not_belong_together_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let cameras = write(folder.path(), "cameras.xml", document(RELATIVE, ""));
    let elsewhere = "<document version=\"1.2.0\"><chunk><cameras><camera id=\"0\" \
                     label=\"z.jpg\"/></cameras><markers><marker id=\"0\" label=\"G\"/></markers>\
                     <frames><frame><markers><marker marker_id=\"0\"><location camera_id=\"0\" x=\"1\" \
                     y=\"1\"/></marker></markers></frame></frames></chunk></document>";
    let markers = write(folder.path(), "markers.xml", elsewhere);
    let message =
        |paths: &[PathBuf]| try_import("metashape", paths, &ImportOptions::default()).unwrap_err().to_string();
    assert!(
        message(&[cameras.clone(), markers.clone()])
            .ends_with("a marker was seen in image \"z.jpg\", which this file does not have")
    );
    assert!(message(&[markers]).contains("expected an export of cameras"));
    assert!(message(&[cameras.clone(), cameras]).contains("cameras stand in a file before"));
    let broken = write(folder.path(), "x.psz", b"PK\x03\x04 nothing");
    assert!(message(&[broken]).contains("x.psz: expected a zip file"));
}
