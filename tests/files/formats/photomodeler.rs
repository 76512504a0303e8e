use super::small::photomodeler::{HEAD, LISTS, PHOTOS};
use super::{beside, has, sample, try_import, write};
use misclosure::io::block::read_block;
use misclosure::io::foreign::{ImportOptions, Kind};

/// The block that others converted from this file: the same measurements and poses, and the four control points that
/// were tie points.
#[test]
fn the_real_export_is_the_block_that_others_made_of_it() {
    let Some(folder) = sample("photomodeler") else { return };
    let path = folder.join("camcal-pmexport.txt");
    assert!(super::format("photomodeler").recognises(&path));
    // Its lens takes measured points to ideal ones by up to 50 px: the nearest camera of the other direction is 0.375
    // px off at a corner.
    let refused = try_import("photomodeler", std::slice::from_ref(&path), &ImportOptions::default()).unwrap_err();
    assert!(refused.to_string().contains("3.75e-1 px at most"), "{refused}");
    let options = ImportOptions { approximate: true, ..ImportOptions::default() };
    let block = try_import("photomodeler", &[path], &options).unwrap().block;
    let other = read_block(&beside::shared("data/dbat-camcal").expect("beside the sample")).unwrap().block;
    assert_eq!(block.tie_points.len(), other.tie_points.len() + other.surveyed.len());
    assert_eq!(block.ties.len(), other.ties.len() + other.marks.len());
    for (a, b) in block.images.iter().zip(&other.images) {
        assert_eq!((&a.name, a.pose.centre), (&b.name, b.pose.centre));
        assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-7, "{}", a.name);
    }
    let mut ours: Vec<(u32, &str, [f64; 2])> =
        block.ties.iter().map(|t| (t.image.0, block.tie_points[t.point.index()].name.as_str(), [t.x, t.y])).collect();
    let ties = other.ties.iter().map(|t| (t.image.0, other.tie_points[t.point.index()].name.as_str(), [t.x, t.y]));
    let marks = other.marks.iter().map(|t| (t.image.0, other.surveyed[t.point.index()].name.as_str(), [t.x, t.y]));
    let mut theirs: Vec<_> = ties.chain(marks).collect();
    ours.sort_by(|a, b| a.partial_cmp(b).unwrap());
    theirs.sort_by(|a, b| a.partial_cmp(b).unwrap());
    assert_eq!(ours, theirs);
    // They took the first order of the inverse as a start; ours is the camera of the file.
    let [a, b] = [&block.cameras[0], &other.cameras[0]];
    assert_eq!((a.width_px, a.height_px, a.pixel_um), (b.width_px, b.height_px, b.pixel_um));
    assert!((a.interior[0] / b.interior[0] - 1.0).abs() < 1e-3, "{:?} {:?}", a.interior, b.interior);
    let errors = super::rms(&super::reprojection_errors(&block));
    println!("photomodeler {errors} px {:?}", a.interior);
}

#[test]
fn bad_lines_are_refused_with_their_place() {
    let folder = tempfile::tempdir().unwrap();
    let (head, photo, lists) = (HEAD, PHOTOS, LISTS);
    let of = |text: String| {
        let path = write(folder.path(), "x.txt", text);
        try_import("photomodeler", &[path], &ImportOptions::default())
            .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
    };
    let imported = of(format!("{head}{photo}{lists}")).unwrap();
    let block = imported.block;
    assert_eq!((block.ties.len(), block.marks.len(), block.surveyed[0].sigma_z), (2, 1, Some(0.2)));
    assert!(has(&imported.notes, Kind::Detail, "differs by"), "{:?}", imported.notes);
    // Two cameras 5 m above, x to the right and y down: the world's y is up.
    let down = block.images[0].pose.rotation.inverse() * nalgebra::Vector3::z();
    assert!((down + nalgebra::Vector3::z()).norm() < 1e-12);
    // f = 10 mm on 2 mm and 200 px.
    assert!(
        (block.cameras[0].interior[0] - 1000.0).abs() < 1e-6 && (block.cameras[0].interior[1] - 100.0).abs() < 1e-6
    );
    let strange = of(format!("{head}{photo}{}", lists.replace("0 7 50", "5 7 50"))).unwrap_err();
    assert_eq!(strange, "x.txt:23: there is no photo 5");
    let word = of(format!("{head}{photo}{}", lists.replace("7 0 0 0", "7 0 x 0"))).unwrap_err();
    assert_eq!(word, "x.txt:21: its coordinates: expected a finite number, found \"x\"");
    let ends = of(head.replace("10 1 0.5 2 1 0 0 0 0 0", "10 1")).unwrap_err();
    assert!(ends.starts_with("x.txt:4: the line ends where f, x0"), "{ends}");
}
