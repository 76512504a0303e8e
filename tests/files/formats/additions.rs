//! What is added to a block: only where it has nothing, and nothing more the second time.

use super::small::additions::MRK;
use super::small::{additions as small, opensfm};
use super::write;
use misclosure::block::{Block, Role};
use misclosure::geodesy::survey::SurveySystem;
use misclosure::io::foreign::{ImportOptions, Note, additions};
use nalgebra::Vector3;
use std::path::{Path, PathBuf};

/// Two images of 5120 x 3840 px, whose names and coordinate system are given, without anything that is optional.
pub fn block(names: [&str; 2], crs: &str) -> Block {
    let folder = tempfile::tempdir().unwrap();
    let [reconstruction, tracks] = [opensfm::RECONSTRUCTION, opensfm::ROWS[2]];
    write(folder.path(), "reconstruction.json", reconstruction.replace("4000", "5120").replace("3000", "3840"));
    write(folder.path(), "tracks.csv", tracks);
    let (mut block, _) = super::import("opensfm", &[folder.path().to_owned()]);
    block.flights = vec!["flight".into()];
    for (image, name) in block.images.iter_mut().zip(names) {
        (image.name, image.flight, image.time_s, image.gnss) = (name.into(), 0.into(), None, None);
    }
    block.crs = crs.into();
    block
}

pub fn try_add(name: &str, block: &mut Block, paths: &[PathBuf]) -> Result<Vec<Note>, String> {
    let addition = additions().iter().find(|addition| addition.name() == name).unwrap();
    addition.add(block, paths, &ImportOptions::default()).map_err(|error| error.to_string())
}

/// Adds, and adds the same once more: nothing changes and nothing is said to stay.
fn add(name: &str, block: &mut Block, paths: &[PathBuf]) -> Vec<Note> {
    let notes = try_add(name, block, paths).unwrap_or_else(|error| panic!("{error}"));
    let mut again = block.clone();
    let second = try_add(name, &mut again, paths).unwrap_or_else(|error| panic!("{error}"));
    assert!(again == *block, "the second time changes something");
    assert!(!second.iter().any(|note| note.text.contains("which stay")), "{second:?}");
    notes
}

pub const LOCAL: &str = "local east, north, up at latitude 48, longitude 2, height 0 m (WGS84)";

#[test]
fn mrk_gives_times_positions_and_lever_arms() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "100_0001_Timestamp.MRK", MRK);
    let mut block = block(["100_0001_0001.JPG", "100_0001_0002.JPG"], LOCAL);
    let notes = add("mrk", &mut block, std::slice::from_ref(&path));
    let [a, b] = [&block.images[0], &block.images[1]];
    assert_eq!(a.time_s, Some(2300.0 * 604_800.0 + 302_400.5));
    assert!((b.time_s.unwrap() - a.time_s.unwrap() - 2.557).abs() < 1e-6);
    let gnss = a.gnss.unwrap();
    // 0.001 degrees of a meridian at 48 degrees are 111.2 m; the height is that of the sensor, as it stands.
    assert!((gnss.position - Vector3::new(0.0, 111.2, 100.25)).norm() < 0.05, "{}", gnss.position);
    assert!((gnss.sigma_xy.unwrap() - 0.00025f64.sqrt()).abs() < 1e-12 && gnss.sigma_z == Some(0.03));
    let column = |name: &str| block.extra_image_columns.iter().find(|(other, _)| other == name).unwrap().1.clone();
    assert_eq!(
        (column("lever_n_m"), column("lever_u_m")),
        (vec!["0.012".to_string(); 2], vec!["-0.15".to_string(); 2])
    );
    assert_eq!(column("gnss_quality"), ["50", "16"]);
    assert!(notes.iter().any(|note| note.text.starts_with("1 exposures are no images")), "{notes:?}");
    assert!(notes.iter().any(|note| note.text.starts_with("1 exposures have no fixed solution")), "{notes:?}");

    // Times of another origin stay, and so does a position.
    let (mut other, position) = (block.clone(), Vector3::new(1.0, 2.0, 3.0));
    other.images[0].time_s = Some(7.0);
    other.images[0].gnss.as_mut().unwrap().position = position;
    let notes = try_add("mrk", &mut other, std::slice::from_ref(&path)).unwrap();
    assert_eq!((other.images[0].time_s, other.images[0].gnss.unwrap().position), (Some(7.0), position));
    assert_eq!(notes.iter().filter(|note| note.text.contains("which stay")).count(), 2, "{notes:?}");

    let bad = write(folder.path(), "bad.MRK", MRK.replace("100.25,Ellh", "high,Ellh"));
    let message = try_add("mrk", &mut block, &[bad]).unwrap_err();
    assert!(message.ends_with("bad.MRK:1: Ellh: expected a number, found \"high\""), "{message}");
}

#[test]
fn geo_txt_in_a_projected_block() {
    let folder = tempfile::tempdir().unwrap();
    let text = "EPSG:4326\na.jpg 2.0 48.0 120 0 0 0 0.5 1.5\nb.jpg 2.001 48.0 121\nc.jpg 2 48 1\n";
    let path = write(folder.path(), "geo.txt", text);
    let mut block = block(["a.jpg", "b.jpg"], "EPSG:32631");
    add("geo", &mut block, &[path]);
    let [a, b] = [0, 1].map(|k| block.images[k].gnss.unwrap());
    // 48 N 2 E in zone 31, by the series of Krueger.
    assert!((a.position - Vector3::new(425_404.888, 5_316_784.009, 120.0)).norm() < 0.001, "{}", a.position);
    assert!((b.position.x - a.position.x - 74.6).abs() < 0.2, "{}", b.position);
    assert_eq!((a.sigma_xy, a.sigma_z, b.sigma_xy), (Some(0.5), Some(1.5), None));
}

#[test]
fn a_block_without_a_place_gets_one_and_one_with_other_positions_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "geo.txt", "EPSG:4326\na.jpg 2.0 48.0 120\nb.jpg 2.001 48.0 121\n");
    let mut block = block(["a.jpg", "b.jpg"], "local");
    add("geo", &mut block, std::slice::from_ref(&path));
    assert_eq!(block.crs, "local east, north, up at latitude 48, longitude 2.0005, height 0 m (WGS84)");
    block.crs = "local".into();
    let message = try_add("geo", &mut block, &[path]).unwrap_err();
    assert!(message.contains("says nothing of latitude and longitude"), "{message}");
}

fn image(folder: &Path, name: &str, time: &str, sub_second: &str, below: bool, xmp: &str) -> PathBuf {
    write(folder, name, small::image(time, sub_second, below, xmp))
}

#[test]
fn exif_of_two_flights() {
    let folder = tempfile::tempdir().unwrap();
    // Two hours east of Greenwich, 1 000 000 000 s after 1970; ten minutes later.
    image(folder.path(), "a.jpg", "2001:09:09 03:46:40", "057", true, "");
    image(folder.path(), "b.jpg", "2001:09:09 03:56:40", "5", false, "");
    image(folder.path(), "elsewhere.jpg", "2001:09:09 03:56:40", "5", false, "");
    let mut block = block(["b.jpg", "a.jpg"], LOCAL);
    let notes = add("exif", &mut block, &[folder.path().to_owned()]);
    let [b, a] = [&block.images[0], &block.images[1]];
    assert_eq!((a.time_s, b.time_s), (Some(1e9 + 0.057), Some(1e9 + 600.5)));
    assert_eq!((a.exposure_s, a.velocity), (Some(0.00125), None));
    // 0.001 degrees north, below zero by its reference.
    assert!((a.gnss.unwrap().position - Vector3::new(0.0, 111.2, -12.5)).norm() < 0.05);
    assert!(b.gnss.unwrap().position.z > 12.0);
    assert_eq!(block.flights, ["flight-1", "flight-2"]);
    assert_eq!((a.flight.0, b.flight.0), (0, 1));
    assert!(notes.iter().any(|note| note.text.starts_with("1 files are no images of the block")), "{notes:?}");
}

#[test]
fn dji_xmp_goes_before_exif() {
    let folder = tempfile::tempdir().unwrap();
    let a = image(folder.path(), "a.jpg", "2001:09:09 03:46:40", "0", false, small::XMP);
    let mut block = block(["a.jpg", "b.jpg"], LOCAL);
    add("exif", &mut block, std::slice::from_ref(&a));
    let image = &block.images[0];
    let gnss = image.gnss.unwrap();
    assert!((gnss.position - Vector3::new(74.6, 0.0, 99.5)).norm() < 0.1, "{}", gnss.position);
    assert!((gnss.sigma_xy.unwrap() - 0.0005f64.sqrt()).abs() < 1e-12 && gnss.sigma_z == Some(0.05));
    assert_eq!(image.velocity, Some(Vector3::new(2.0, 1.0, 0.5)));
    assert_eq!(image.temperature_c, Some(31.5));
    assert_eq!(block.extra_image_columns, [("altitude_type".to_string(), vec!["RtkAlt".to_string(), String::new()])]);
    let bad = self::image(folder.path(), "b.jpg", "soon", "0", false, "");
    let message = try_add("exif", &mut block, &[bad]).unwrap_err();
    assert!(message.ends_with("b.jpg: DateTimeOriginal: expected YYYY:MM:DD HH:MM:SS, found \"soon\""), "{message}");
}

/// The same image with a next directory behind that of the exposure, where the standard has none and some writers leave
/// one.
fn with_a_next_directory(mut jpeg: Vec<u8>) -> Vec<u8> {
    const TIFF: usize = 12;
    let pointer = jpeg.windows(4).position(|four| four == [0x69, 0x87, 4, 0]).expect("a pointer to Exif") + 8;
    let number = |at: usize, jpeg: &[u8]| u16::from_le_bytes([jpeg[at], jpeg[at + 1]]) as usize;
    let directory = TIFF + number(pointer, &jpeg);
    let next = directory + 2 + 12 * number(directory, &jpeg);
    jpeg[next] = 8;
    jpeg
}

#[test]
fn exif_goes_on_after_damaged_and_unreadable_images() {
    let folder = tempfile::tempdir().unwrap();
    let whole = small::image("2001:09:09 03:46:40", "0", false, "");
    write(folder.path(), "a.jpg", with_a_next_directory(whole));
    image(folder.path(), "b.jpg", "soon", "0", false, "");
    let mut block = block(["a.jpg", "b.jpg"], LOCAL);
    let notes = add("exif", &mut block, &[folder.path().to_owned()]);
    let [a, b] = [&block.images[0], &block.images[1]];
    assert_eq!((a.time_s, b.time_s), (Some(1e9), None));
    let has = |parts: [&str; 3]| notes.iter().any(|note| parts.iter().all(|part| note.text.contains(part)));
    assert!(has(["1 images have damaged EXIF", "a.jpg", "Unexpected next IFD"]), "{notes:?}");
    assert!(has(["1 images cannot be read", "b.jpg: DateTimeOriginal", "found \"soon\""]), "{notes:?}");
}

#[test]
fn ground_control_from_four_kinds_of_files() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let list = write(
        dir,
        "gcp_list.txt",
        "EPSG:4326\n2.001 48.0 5 99.5 199.5 a.jpg G1\n2.001 48.0 5 9.5 19.5 b.jpg G1\n2.0 48.0 6 1 2 a.jpg CHK-1\n",
    );
    let json = r#"{"points":[{"id":"G1","position":{"latitude":48.0,"longitude":2.001,"altitude":5},
        "observations":[{"shot_id":"a.jpg","projection":[0.0,0.0]}]}]}"#;
    let json = write(dir, "ground_control_points.json", json);
    let points = write(
        dir,
        "points.csv",
        "#CoordinateSystem: GEOGCS[\"WGS \
         84\",AUTHORITY[\"EPSG\",\"4326\"]]\n#Label,X,Y,Z\nG1,2.001,48.0,5,0.01,0.02\nfar,2,48,1\n",
    );
    let marks = write(dir, "marks.csv", "a.jpg,G1,100,200\nb.jpg,G1,10,20\n");
    let mut of_list = block(["a.jpg", "b.jpg"], LOCAL);
    add("gcp", &mut of_list, std::slice::from_ref(&list));
    let mut of_tables = block(["a.jpg", "b.jpg"], LOCAL);
    let notes = add("gcp", &mut of_tables, &[points.clone(), marks]);
    assert!(notes.iter().any(|note| note.text.starts_with("1 points are marked in no image")), "{notes:?}");
    let mut of_json = block(["a.jpg", "b.jpg"], LOCAL);
    add("gcp", &mut of_json, &[json]);
    for block in [&of_list, &of_tables, &of_json] {
        let point = &block.surveyed[0];
        assert_eq!((point.name.as_str(), point.role), ("G1", Role::Control));
        assert!((point.position - of_list.surveyed[0].position).norm() < 1e-6);
    }
    assert_eq!(of_list.surveyed[1].role, Role::Check);
    assert_eq!((of_tables.surveyed[0].sigma_xy, of_tables.surveyed[0].sigma_z), (Some(0.01), Some(0.02)));
    let places = |block: &Block| -> Vec<[f64; 2]> {
        block.marks.iter().filter(|mark| mark.point.0 == 0).map(|mark| [mark.x, mark.y]).collect()
    };
    // The list counts from the centre of the first pixel, the table from its corner.
    assert_eq!(places(&of_list), [[100.0, 200.0], [10.0, 20.0]]);
    assert_eq!(places(&of_tables), places(&of_list));
    assert_eq!(places(&of_json), [[2560.0, 1920.0]]);

    let moved = write(dir, "moved.csv", "G1,1,2,3\n");
    let message = try_add("gcp", &mut of_list, &[moved]).unwrap_err();
    assert!(message.contains("point \"G1\" is in control.csv with other coordinates"), "{message}");
    let other = write(dir, "other.csv", "a.jpg,G1,100,201\n");
    let message = try_add("gcp", &mut of_list, &[other]).unwrap_err();
    assert!(message.contains("point \"G1\" is marked elsewhere in image \"a.jpg\""), "{message}");
    let bad = write(dir, "bad.csv", "G1,1,x,3\n");
    assert!(try_add("gcp", &mut of_list, &[bad]).unwrap_err().ends_with("bad.csv:1: expected a number, found \"x\""));
}

#[test]
fn the_system_of_a_list_is_kept_and_its_coordinates_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let [easting, northing, height] = [425_404.888, 5_316_784.009, 12.5];
    let text = format!(
        "EPSG:32631\n{easting} {northing} {height} 9.5 19.5 a.jpg G1\n{easting} {northing} {height} 1 2 b.jpg G1\n"
    );
    let list = write(folder.path(), "gcp_list.txt", text);
    let mut block = block(["a.jpg", "b.jpg"], LOCAL);
    add("gcp", &mut block, &[list]);
    assert_eq!((block.crs.as_str(), block.survey_crs.as_str()), (LOCAL, "EPSG:32631"));
    let system = SurveySystem::of(&block.crs, &block.survey_crs).expect("two systems");
    let back = system.coordinates(&block.surveyed[0].position).expect("coordinates");
    let off = Vector3::from(back) - Vector3::new(easting, northing, height);
    assert!(off.norm() < 1e-4, "{back:?}");
}

#[test]
fn what_exif_and_xmp_contradict_each_other_in_is_said() {
    let folder = tempfile::tempdir().unwrap();
    // The clock is two hours ahead of UTC; the receiver counts GPS time.
    for (name, clock, seconds) in [("a.jpg", "2023:11:15 00:13:20", 38), ("b.jpg", "2023:11:15 00:13:25", 43)] {
        let stamp = Some(("2023:11:14", [22, 13, seconds]));
        let xmp = small::XMP.replace("+99.5", "+12.50");
        write(folder.path(), name, small::with_stamp(clock, "0", true, &xmp, stamp));
    }
    let paths = [folder.path().join("a.jpg"), folder.path().join("b.jpg")];
    let mut block = block(["a.jpg", "b.jpg"], LOCAL);
    let notes = add("exif", &mut block, &paths);
    let has = |words: &str| notes.iter().any(|note| note.text.contains(words));
    assert!(has("2 images have a height in EXIF"), "{notes:?}");
    assert!(has("2 images: GPSTimeStamp and the time of exposure in UTC are 18 s apart"), "{notes:?}");
}

#[test]
fn exif_and_xmp_that_agree_are_not_mentioned() {
    let folder = tempfile::tempdir().unwrap();
    for (name, clock, seconds) in [("a.jpg", "2023:11:15 00:13:20", 20), ("b.jpg", "2023:11:15 00:13:25", 24)] {
        let stamp = Some(("2023:11:14", [22, 13, seconds]));
        write(folder.path(), name, small::with_stamp(clock, "3", false, &small::XMP.replace("+99.5", "+58.2"), stamp));
    }
    let paths = [folder.path().join("a.jpg"), folder.path().join("b.jpg")];
    let notes = add("exif", &mut block(["a.jpg", "b.jpg"], LOCAL), &paths);
    assert!(
        !notes.iter().any(|note| note.text.contains("GPSTimeStamp") || note.text.contains("AltitudeRef")),
        "{notes:?}"
    );
}

#[test]
fn control_points_that_one_image_each_sees_are_said() {
    let folder = tempfile::tempdir().unwrap();
    let lists = [
        ("G1\n2.0 48.001 6 1 2 b.jpg G2", "all 2 control points have marks in one image only"),
        ("G1\n2.0 48.001 6 1 2 b.jpg G2\n2.001 48.0 5 9 9 b.jpg G1", ""),
    ];
    for (k, (rest, said)) in lists.into_iter().enumerate() {
        let text = format!("EPSG:4326\n2.001 48.0 5 99.5 199.5 a.jpg {rest}\n");
        let list = write(folder.path(), &format!("list{k}.txt"), text);
        let notes = add("gcp", &mut block(["a.jpg", "b.jpg"], LOCAL), &[list]);
        let has = notes.iter().any(|note| note.text.contains("in one image only"));
        assert_eq!(has, !said.is_empty(), "{notes:?}");
        assert!(said.is_empty() || notes.iter().any(|note| note.text.starts_with(said)), "{notes:?}");
    }
}
