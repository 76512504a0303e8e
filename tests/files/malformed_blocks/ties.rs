//! Faults of `ties.csv` and `points.csv`.

use crate::malformed_blocks::Case;

pub const CASES: &[Case] = &[
    (
        "points without z",
        |b| b.replace("points.csv", "x,y,z", "x,y,h"),
        "points.csv:1: column z is missing; the header has \"point\", \"x\", \"y\", \"h\"",
    ),
    (
        "point twice",
        |b| b.append("points.csv", "p0,1,2,3\n"),
        "points.csv:4: column point: point \"p0\" stands twice, first in line 2",
    ),
    (
        "point without name",
        |b| b.append("points.csv", ",1,2,3\n"),
        "points.csv:4: column point: expected a name, found an empty cell",
    ),
    (
        "point with empty coordinate",
        |b| b.append("points.csv", "p7,1,,3\n"),
        "points.csv:4: column y: expected a finite number, found an empty cell",
    ),
    ("empty ties.csv", |b| b.set("ties.csv", ""), "ties.csv:1: column image is missing; the file is empty"),
    (
        "ties without x",
        |b| b.replace("ties.csv", "x,y", "u,v"),
        "ties.csv:1: column x is missing; the header has \"image\", \"point\", \"u\", \"v\", \"sigma\"",
    ),
    (
        "unknown image",
        |b| b.replace("ties.csv", "i2,p0", "i3,p0"),
        "ties.csv:4: column image: \"i3\" is not an image of images.csv",
    ),
    (
        "tie without point",
        |b| b.replace("ties.csv", "i2,p0", "i2,"),
        "ties.csv:4: column point: expected a name, found an empty cell",
    ),
    (
        "tie point not UTF-8",
        |b| b.spoil("ties.csv", "p1"),
        "ties.csv:5: column point: \"\u{fffd}1\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "measurement is text",
        |b| b.replace("ties.csv", "800.5", "8OO.5"),
        "ties.csv:3: column x: expected a finite number, found \"8OO.5\"",
    ),
    (
        "measurement left of the sensor",
        |b| b.replace("ties.csv", "800.5", "-400.5"),
        "ties.csv:3: column x: -400.5 is outside the sensor, 0 to 4000 px, by more than 400 px",
    ),
    (
        "measurement below the sensor",
        |b| b.replace("ties.csv", "i0,p1,2000,2900", "i0,p1,2000,3401"),
        "ties.csv:5: column y: 3401 is outside the sensor, 0 to 3000 px, by more than 400 px",
    ),
    (
        "tie sigma zero",
        |b| b.replace("ties.csv", "0.4", "0"),
        "ties.csv:3: column sigma: expected a number above zero, found \"0\"",
    ),
    (
        "tie without precision",
        |b| b.replace("block.toml", "tie_px = 0.5\n", ""),
        "ties.csv:2: no standard deviation; give sigma here or tie_px in block.toml, [sigma]",
    ),
    (
        "measured twice",
        |b| b.append("ties.csv", "i1,p1,1801,2900,\n"),
        "ties.csv:7: point \"p1\" is measured twice in image \"i1\", first in line 6; keep one",
    ),
    (
        "nothing measured twice",
        |b| {
            b.remove("control.csv");
            b.remove("marks.csv");
            b.set("ties.csv", "image,point,x,y\ni0,p0,1,1\ni1,p1,1,1\n");
        },
        "ties.csv: no tie point is measured in two images, and there are no marks; nothing can be adjusted",
    ),
    (
        "unclosed quote",
        |b| b.replace("ties.csv", "i1,p0,800.5", "\"i1,p0,800.5"),
        "ties.csv:3: number of cells 1, expected 5 as in the header; is a quote not closed?",
    ),
];
