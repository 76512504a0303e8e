//! Faults of `images.csv`.

use crate::malformed_blocks::Case;
use crate::malformed_blocks::block::IMAGES;

pub const CASES: &[Case] = &[
    ("empty images.csv", |b| b.set("images.csv", ""), "images.csv:1: column image is missing; the file is empty"),
    (
        "no image",
        |b| b.set("images.csv", IMAGES.lines().next().unwrap()),
        "images.csv: there is no image; the table has a header and no row",
    ),
    (
        "column missing",
        |b| b.replace("images.csv", "qw", "q0"),
        "images.csv:1: column qw is missing; the header has \"image\", \"camera\", \"flight\", \"time_s\", \"x\", \
         \"y\", \"z\", \"q0\", \"qx\", \"qy\", \"qz\", \"gnss_x\", \"gnss_y\", \"gnss_z\", \"gnss_sigma_xy\", \"vx\", \"vy\", \"vz\", \"exposure_s\", \"focus_m\", \"remark\"",
    ),
    ("column twice", |b| b.replace("images.csv", "remark", "x"), "images.csv:1: column \"x\" stands twice; keep one"),
    (
        "unknown column twice",
        |b| b.replace("images.csv", "time_s", "remark"),
        "images.csv:1: column \"remark\" stands twice; keep one",
    ),
    (
        "column name not UTF-8",
        |b| b.spoil("images.csv", "mage"),
        "images.csv:1: column name \"i\u{fffd}age\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "cell too few",
        |b| b.replace("images.csv", "80,first", "80"),
        "images.csv:2: number of cells 20, expected 21 as in the header",
    ),
    (
        "cell too many",
        |b| b.replace("images.csv", "80,first", "80,fir,st"),
        "images.csv:2: number of cells 22, expected 21 as in the header",
    ),
    (
        "image twice",
        |b| b.replace("images.csv", "i2,", "i0,"),
        "images.csv:4: column image: image \"i0\" stands twice, first in line 2",
    ),
    (
        "image without name",
        |b| b.replace("images.csv", "i1,cam", ",cam"),
        "images.csv:3: column image: expected a name, found an empty cell",
    ),
    (
        "image not UTF-8",
        |b| b.spoil("images.csv", "i1"),
        "images.csv:3: column image: \"\u{fffd}1\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "remark not UTF-8",
        |b| b.spoil("images.csv", "first"),
        "images.csv:2: column remark: \"\u{fffd}irst\" is not UTF-8; save the file as UTF-8",
    ),
    (
        "unknown camera",
        |b| b.replace("images.csv", "i1,cam", "i1,can"),
        "images.csv:3: column camera: \"can\" is not a camera of block.toml; did you mean \"cam\"?",
    ),
    (
        "no flight",
        |b| b.replace("images.csv", "i1,cam,f1", "i1,cam,"),
        "images.csv:3: column flight: expected a name, found an empty cell",
    ),
    (
        "coordinate empty",
        |b| b.replace("images.csv", "10,0,50", "10,,50"),
        "images.csv:3: column y: expected a finite number, found an empty cell",
    ),
    (
        "coordinate NaN",
        |b| b.replace("images.csv", "10,0,50", "10,NaN,50"),
        "images.csv:3: column y: expected a finite number, found \"NaN\"",
    ),
    (
        "coordinate infinite",
        |b| b.replace("images.csv", "10,0,50", "-inf,0,50"),
        "images.csv:3: column x: expected a finite number, found \"-inf\"",
    ),
    (
        "coordinate overflows",
        |b| b.replace("images.csv", "10,0,50", "1e999,0,50"),
        "images.csv:3: column x: expected a finite number, found \"1e999\"",
    ),
    (
        "coordinate with comma",
        |b| b.replace("images.csv", "10,0,50", "\"10,5\",0,50"),
        "images.csv:3: column x: expected a finite number, found \"10,5\"",
    ),
    (
        "coordinate with blank",
        |b| b.replace("images.csv", "10,0,50", " 10,0,50"),
        "images.csv:3: column x: expected a finite number, found \" 10\"",
    ),
    (
        "time is text",
        |b| b.replace("images.csv", "f1,2,", "f1,12:30:01,"),
        "images.csv:3: column time_s: expected a finite number, found \"12:30:01\"",
    ),
    (
        "quaternion of length 0.9",
        |b| b.replace("images.csv", "2,10,0,50,0,1,0,0", "2,10,0,50,0,0.9,0,0"),
        "images.csv:3: column qw: the quaternion has length 0.9, expected 1 within 1e-6",
    ),
    (
        "zero quaternion",
        |b| b.replace("images.csv", "2,10,0,50,0,1,0,0", "2,10,0,50,0,0,0,0"),
        "images.csv:3: column qw: the quaternion has length 0, expected 1 within 1e-6",
    ),
    (
        "gnss column missing",
        |b| b.replace("images.csv", "gnss_y", "gnss_north"),
        "images.csv:1: column gnss_y is missing; gnss_x, gnss_y, gnss_z come together or not at all",
    ),
    (
        "velocity column missing",
        |b| b.replace("images.csv", "vx", "speed"),
        "images.csv:1: column vx is missing; vx, vy, vz come together or not at all",
    ),
    (
        "gnss cell missing",
        |b| b.replace("images.csv", "10,0,50.2", "10,,50.2"),
        "images.csv:3: column gnss_y: the cell is empty; gnss_x, gnss_y, gnss_z are given together or not at all",
    ),
    (
        "velocity cell missing",
        |b| b.replace("images.csv", "0.02,5,0,0", "0.02,5,0,"),
        "images.csv:2: column vz: the cell is empty; vx, vy, vz are given together or not at all",
    ),
    (
        "gnss sigma zero",
        |b| b.replace("images.csv", "0.02", "0"),
        "images.csv:2: column gnss_sigma_xy: expected a number above zero, found \"0\"",
    ),
    (
        "gnss without precision",
        |b| b.replace("block.toml", "gnss_z_m = 0.05\n", ""),
        "images.csv:2: a GNSS position without standard deviation; give gnss_sigma_z here or gnss_z_m in block.toml, \
         [sigma]",
    ),
    (
        "exposure negative",
        |b| b.replace("images.csv", "0.001", "-0.001"),
        "images.csv:2: column exposure_s: expected a number above zero, found \"-0.001\"",
    ),
    (
        "focus zero",
        |b| b.replace("images.csv", ",80,first", ",0,first"),
        "images.csv:2: column focus_m: expected a number above zero, found \"0\"",
    ),
];
