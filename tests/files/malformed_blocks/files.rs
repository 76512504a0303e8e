//! Faults of whole files: missing ones, and the line that a fault is given whatever the line ends are.

use crate::malformed_blocks::Case;
use crate::malformed_blocks::block::TIES;

pub const CASES: &[Case] = &[
    (
        "no block.toml",
        |b| b.remove("block.toml"),
        "block.toml: the file is missing; every block has block.toml, images.csv and ties.csv",
    ),
    (
        "no images.csv",
        |b| b.remove("images.csv"),
        "images.csv: the file is missing; every block has block.toml, images.csv and ties.csv",
    ),
    (
        "no ties.csv",
        |b| b.remove("ties.csv"),
        "ties.csv: the file is missing; every block has block.toml, images.csv and ties.csv",
    ),
    (
        "control without marks.csv",
        |b| b.remove("marks.csv"),
        "marks.csv: the file is missing, but control.csv has points; they need image measurements",
    ),
    (
        "marks without control.csv",
        |b| b.remove("control.csv"),
        "control.csv: the file is missing, but marks.csv measures its points",
    ),
    // The line is that of an editor, whatever the line ends are.
    (
        "fault after blank lines",
        |b| b.replace("ties.csv", "i2,p0,600", "\n\ni2,p0,x"),
        "ties.csv:6: column x: expected a finite number, found \"x\"",
    ),
    (
        "fault after a quoted line end",
        |b| {
            b.replace("images.csv", "first", "\"fi\nrst\"");
            b.replace("images.csv", "i2,cam", "i2,c");
        },
        "images.csv:5: column camera: \"c\" is not a camera of block.toml; known: \"cam\"",
    ),
    (
        "fault with CRLF",
        |b| b.set("ties.csv", TIES.replace('\n', "\r\n").replace("600", "6oo")),
        "ties.csv:4: column x: expected a finite number, found \"6oo\"",
    ),
];
