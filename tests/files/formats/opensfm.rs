use super::small::opensfm::{RECONSTRUCTION, ROWS};
use super::{format, has, import, reprojection_errors, rms, sample, seen, try_import, write};
use misclosure::block::Role;
use misclosure::io::foreign::{ImportOptions, Kind};
use std::path::Path;

/// The files have no figure of their own; these are what their coordinates give by the documented formula. They were
/// computed once more in another program to the digits shown; a shift of half a pixel, or p1 for p2, changes the third
/// digit.
#[test]
fn berlin_in_two_versions() {
    for (name, points, ties, rms_px) in
        [("opensfm-berlin-v1", 1702, 3771, 1.92313), ("opensfm-berlin-v2", 1430, 3082, 1.74285)]
    {
        let Some(folder) = sample(name) else { return };
        assert!(format("opensfm").recognises(&folder));
        let (block, notes) = import("opensfm", &[folder]);
        // Ground control point 1 was seen but not surveyed: a tie point of two images.
        assert_eq!((block.images.len(), block.tie_points.len(), block.ties.len()), (3, points + 1, ties + 2), "{name}");
        let found = rms(&reprojection_errors(&block));
        assert!((found - rms_px).abs() < 1e-5, "{name}: {found} px");
        assert_eq!(block.surveyed.iter().map(|point| point.name.as_str()).collect::<Vec<_>>(), ["0", "3"]);
        assert!(has(&notes, Kind::Loss, "OpenSfM set them aside"), "{notes:?}");
        // One of the two had no times and one height for all.
        let has_times = block.images.iter().all(|image| image.time_s.is_some());
        let has_gnss = block.images.iter().all(|image| image.gnss.is_some());
        let is_second = name.ends_with("v2");
        assert_eq!((has_times, has_gnss), (is_second, is_second), "{name}");
    }
}

/// In the first version the reconstruction was adjusted to the ground control: its pixels are met.
#[test]
fn ground_control_is_where_it_was_seen() {
    let Some(folder) = sample("opensfm-berlin-v1") else { return };
    let (block, _) = import("opensfm", &[folder]);
    for mark in &block.marks {
        let [x, y] = seen(&block, mark.image.index(), &block.surveyed[mark.point.index()].position);
        let miss = (x - mark.x).hypot(y - mark.y);
        // 2.2, 0.5 and 0.2 px; a height that stands on something else, or degrees that are swapped, would miss
        // by hundreds.
        assert!(miss < 2.5, "{miss} px");
    }
}

fn small(folder: &Path, tracks: &str) {
    write(folder, "reconstruction.json", RECONSTRUCTION);
    write(folder, "tracks.csv", tracks);
}

#[test]
fn normalised_coordinates_begin_in_the_middle_of_the_image() {
    for rows in ROWS {
        let folder = tempfile::tempdir().unwrap();
        small(folder.path(), rows);
        let (block, _) = import("opensfm", &[folder.path().to_owned()]);
        let places: Vec<[f64; 2]> = block.ties.iter().map(|tie| [tie.x, tie.y]).collect();
        assert_eq!(places, [[2000.0, 1500.0], [3000.0, 1000.0]]);
        let f = 3000.0f64;
        // OpenSfM's p1 is our p2.
        let [k1, k2, p1, p2] = [-0.1 / f.powi(2), 0.05 / f.powi(4), -0.002 / f, 0.001 / f];
        let expected = [f, 2040.0, 1420.0, 2040.0, 1420.0, k1, k2, 0.0, p1, p2, 0.0, 0.0];
        for (found, expected) in block.cameras[0].interior.iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} {expected}");
        }
        assert_eq!(block.flights, ["a", "b"]);
        // -R't with a quarter turn from x to y.
        let centre = block.images[1].pose.centre;
        assert!((centre - nalgebra::Vector3::new(-2.0, 1.0, -3.0)).norm() < 1e-12, "{centre}");
        let [gnss, lone] = [0, 1].map(|k| block.images[k].gnss.unwrap());
        assert_eq!((gnss.sigma_xy, gnss.sigma_z, lone.sigma_xy), (Some(2.0), Some(2.0), None));
    }
}

#[test]
fn gcp_list_pixels_count_from_the_centre_of_the_first() {
    let folder = tempfile::tempdir().unwrap();
    small(folder.path(), ROWS[0]);
    let list = "\u{feff}WGS84\t\n# a comment\n2.0 48.0 100 2039.5 1419.5 a/1.jpg\n2.0 48.0 100 10 20 b/1.jpg\n\
                2.001 48.0 90 1 2 a/1.jpg CHK-9\n2.002 48.0 NaN 1 2 a/1.jpg far\n2.0 48.0 100 1 1 c/1.jpg\n";
    write(folder.path(), "gcp_list.txt", list);
    let (block, notes) = import("opensfm", &[folder.path().to_owned()]);
    let marks: Vec<[f64; 2]> = block.marks.iter().map(|mark| [mark.x, mark.y]).collect();
    assert_eq!(marks, [[2040.0, 1420.0], [10.5, 20.5], [1.5, 2.5]]);
    let points: Vec<(&str, Role)> = block.surveyed.iter().map(|point| (point.name.as_str(), point.role)).collect();
    assert_eq!(points, [("gcp 1", Role::Control), ("CHK-9", Role::Check)]);
    assert!(block.surveyed[0].position.norm() < 1e-6);
    assert!(has(&notes, Kind::Guess, "half a pixel is added"));
    assert!(has(&notes, Kind::Loss, "1 marks of") && has(&notes, Kind::Loss, "without a known height"), "{notes:?}");
}

#[test]
fn bad_files_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let message = || {
        let error = try_import("opensfm", &[folder.path().to_owned()], &ImportOptions::default()).unwrap_err();
        error.to_string().replace(&format!("{}/", folder.path().display()), "")
    };
    write(folder.path(), "reconstruction.json", RECONSTRUCTION);
    assert_eq!(message(), "tracks.csv: the file is missing; it has the image coordinates of the tie points");
    for (tracks, expected) in [
        ("OPENSFM_TRACKS_VERSION_v3\n", "tracks.csv:1: expected version v0, v1 or v2 of the tracks"),
        ("a\t1\t1\n", "tracks.csv:1: expected 8 cells separated by tabs, found 3"),
        ("a\t1\t1\tx\t0\t0\t0\t0\n", "tracks.csv:1: x: expected a finite number, found \"x\""),
    ] {
        write(folder.path(), "tracks.csv", tracks);
        assert_eq!(message(), expected);
    }
    write(folder.path(), "tracks.csv", ROWS[0]);
    write(folder.path(), "gcp_list.txt", "EPSG:4326\n2 48 100 1 1 a/1.jpg p\n2 48 100 1 1 a/1.jpg p\n");
    assert_eq!(message(), "gcp_list.txt:3: point \"p\" is measured twice in image \"a/1.jpg\"");
    write(folder.path(), "gcp_list.txt", "EPSG:4326\n2 48 100 1 1 a/1.jpg p\n2 49 100 1 1 b/1.jpg p\n");
    assert_eq!(message(), "gcp_list.txt:3: point \"p\" has other coordinates than in line 2");
    write(folder.path(), "gcp_list.txt", "UTM\n");
    assert!(message().starts_with("gcp_list.txt:1: expected WGS84, WGS84 UTM 32N"), "{}", message());
    write(folder.path(), "reconstruction.json", RECONSTRUCTION.replace("brown", "fisheye"));
    assert!(message().starts_with("reconstruction.json: camera \"cam\": projection_type \"fisheye\""), "{}", message());
    write(folder.path(), "reconstruction.json", "[{\"cameras\": 1}]");
    assert!(message().starts_with("reconstruction.json:1:14: "), "{}", message());
}
