//! Positions and standard deviations that are none: left out and counted, or refused with their place. Tables of
//! control as people write them.

use super::additions::{LOCAL, block, try_add};
use super::small::additions::{MRK, XMP, image};
use super::write;

#[test]
fn a_position_that_is_none_is_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = ["48.001,Lat\t2.0,Lon", "0.0,Lat\t0.0,Lon"];
    let mrk = |name: &str, [from, to]: [&str; 2]| write(folder.path(), name, MRK.replacen(from, to, 1));
    let geo = "EPSG:4326\na.jpg 0 0 0 0 0 0 0.5 1.5\nb.jpg 2.001 48.0 121\n";
    let zero = XMP.replace("+48.0", "0").replace("+2.001", "0");
    let no_solution = format!("{XMP} drone-dji:RtkFlag=\"0\"");
    let lost = folder.path().join("lost");
    std::fs::create_dir(&lost).unwrap();
    let cases = [
        ("mrk", mrk("a.MRK", nowhere)),
        ("mrk", mrk("b.MRK", ["50,Q", "0,Q"])),
        ("geo", write(folder.path(), "geo.txt", geo)),
        ("exif", write(folder.path(), "a.jpg", image("2001:09:09 03:46:40", "0", false, &zero))),
        ("exif", write(&lost, "a.jpg", image("2001:09:09 03:46:40", "0", false, &no_solution))),
    ];
    for (name, path) in cases {
        let mut block =
            block(if name == "mrk" { ["100_0001_0001.JPG", "100_0001_0002.JPG"] } else { ["a.jpg", "b.jpg"] }, LOCAL);
        let notes = try_add(name, &mut block, std::slice::from_ref(&path)).unwrap_or_else(|error| panic!("{error}"));
        assert!(block.images[0].gnss.is_none(), "{}", path.display());
        let counted = notes.iter().any(|note| note.text.starts_with("1 positions are none (0, 0 or no solution"));
        assert!(counted, "{}: {notes:?}", path.display());
        // What else the file says is kept.
        assert!(name == "geo" || block.images[0].time_s.is_some(), "{}", path.display());
        assert!(name == "exif" || block.images[1].gnss.is_some(), "{}", path.display());
    }
}

#[test]
fn a_place_or_a_standard_deviation_that_there_is_not_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut block = block(["a.jpg", "100_0001_0001.JPG"], LOCAL);
    for (from, to, what) in [
        ("48.001,Lat", "95.0,Lat", ":1: expected a latitude within ±90"),
        ("48.001,Lat", "200.0,Lat", ":1: expected a latitude within ±90"),
        ("100.25,Ellh", "1e300,Ellh", ":1: expected a latitude within ±90"),
        ("0.01, 0.02, 0.03", "-1, 0.02, 0.03", ":1: expected a standard deviation of 0 to 10000 m, found -1.0"),
        ("0.01, 0.02, 0.03", "0.01, 0.02, 1e300", ":1: expected a standard deviation of 0 to 10000 m, found 1e300"),
    ] {
        let path = write(folder.path(), "a.MRK", MRK.replacen(from, to, 1));
        let message = try_add("mrk", &mut block, &[path]).unwrap_err();
        assert!(message.contains(&format!("a.MRK{what}")), "{message}");
    }
    for (row, what) in [
        ("2 95 120", "no place 2, 95"),
        ("2 200 120", "no place 2, 200"),
        ("2 48 1e300", "expected a latitude"),
        ("2 48 120 0 0 0 -1 1", "found -1.0"),
        ("2 48 120 0 0 0 1 1e300", "found 1e300"),
    ] {
        let path = write(folder.path(), "geo.txt", format!("EPSG:4326\na.jpg {row}\n"));
        let message = try_add("geo", &mut block, &[path]).unwrap_err();
        assert!(message.contains("geo.txt:2: ") && message.contains(what), "{row}: {message}");
    }
    for (name, value) in [("GpsLatitude", "95"), ("GpsLatitude", "200"), ("RtkStdLon", "-1"), ("RtkStdHgt", "1e300")] {
        let start = XMP.find(&format!("{name}=\"")).unwrap_or_else(|| panic!("{name} in {XMP}")) + name.len() + 2;
        let end = start + XMP[start..].find('"').unwrap();
        let xmp = format!("{}{value}{}", &XMP[..start], &XMP[end..]);
        let path = write(folder.path(), "a.jpg", image("2001:09:09 03:46:40", "0", false, &xmp));
        let message = try_add("exif", &mut block, &[path]).unwrap_err();
        assert!(message.contains("a.jpg: XMP") && message.contains("expected a "), "{name}: {message}");
    }
    let path = write(folder.path(), "points.csv", "G1,1,2,3,-1\n");
    let message = try_add("gcp", &mut block, &[path]).unwrap_err();
    assert!(message.contains("points.csv:1: expected a standard deviation"), "{message}");
}

#[test]
fn tables_of_control_have_headers_and_decimal_commas() {
    let folder = tempfile::tempdir().unwrap();
    let plain = ["G1,100.5,200.25,3,0.01,0.02\n", "a.jpg,G1,100.5,200\nb.jpg,G1,10,20\n"];
    let headed = [
        "name,x,y,z,horizontal,vertical\nG1,100.5,200.25,3,0.01,0.02\n",
        "image,name,column,row\na.jpg,G1,100.5,200\nb.jpg,G1,10,20\n",
    ];
    let german = [
        "Name;Easting [m];Northing [m];Height [m];sxy;sz\nG1;100,5;200,25;3;0,01;0,02\n",
        "image;name;column;row\na.jpg;G1;100,5;200\nb.jpg;G1;10;20\n",
    ];
    let blocks = [plain, headed, german].map(|[points, marks]| {
        let mut block = block(["a.jpg", "b.jpg"], "local");
        let paths = [write(folder.path(), "points.csv", points), write(folder.path(), "marks.csv", marks)];
        try_add("gcp", &mut block, &paths).unwrap_or_else(|error| panic!("{error}"));
        block
    });
    let point = &blocks[0].surveyed[0];
    assert_eq!(
        (point.position.x, point.position.y, point.sigma_xy, point.sigma_z),
        (100.5, 200.25, Some(0.01), Some(0.02))
    );
    for other in &blocks[1..] {
        assert_eq!((&other.surveyed, &other.marks), (&blocks[0].surveyed, &blocks[0].marks));
    }
    let mut block = block(["a.jpg", "b.jpg"], "local");
    for (text, what) in [
        ("name,y,x,z\nG1,1,2,3\n", "in this order"),
        ("G1,1,2,3\nname,x,y,z\n", "expected a number, found \"x\""),
        ("G1;1.234,5;2;3\n", "expected a number, found \"1.234,5\""),
    ] {
        let path = write(folder.path(), "points.csv", text);
        let message = try_add("gcp", &mut block, &[path]).unwrap_err();
        assert!(message.contains("points.csv:") && message.contains(what), "{message}");
    }
}
