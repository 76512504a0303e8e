//! Faults of `control.csv` and `marks.csv`.

use crate::malformed_blocks::Case;

pub const CASES: &[Case] = &[
    (
        "control without role",
        |b| b.replace("control.csv", "role", "rule"),
        "control.csv:1: column role is missing; the header has \"point\", \"x\", \"y\", \"z\", \"rule\", \"sigma_xy\", \
         \"sigma_z\"",
    ),
    (
        "unknown role",
        |b| b.replace("control.csv", "check", "chek"),
        "control.csv:3: column role: expected control or check, found \"chek\"; did you mean \"check\"?",
    ),
    (
        "surveyed twice",
        |b| b.append("control.csv", "c0,1,2,3,check,,\n"),
        "control.csv:4: column point: point \"c0\" stands twice, first in line 2",
    ),
    (
        "control sigma negative",
        |b| b.replace("control.csv", "0.01", "-0.01"),
        "control.csv:2: column sigma_xy: expected a number above zero, found \"-0.01\"",
    ),
    (
        "control without precision",
        |b| b.replace("block.toml", "control_z_m = 0.005\n", ""),
        "control.csv:2: control without standard deviation; give sigma_z here or control_z_m in block.toml, [sigma]",
    ),
    (
        "control point without mark",
        |b| b.append("control.csv", "c2,1,2,3,control,,\n"),
        "control.csv:4: control point \"c2\" has no mark; measure it in marks.csv or take its row out",
    ),
    (
        "marks empty",
        |b| b.set("marks.csv", "image,point,x,y\n"),
        "control.csv:2: control point \"c0\" has no mark; measure it in marks.csv or take its row out",
    ),
    (
        "mark of an unknown point",
        |b| b.replace("marks.csv", "i1,c0", "i1,p0"),
        "marks.csv:3: column point: unknown point \"p0\"; marks measure the points of control.csv",
    ),
    (
        "mark in an unknown image",
        |b| b.replace("marks.csv", "i1,c0", "j1,c0"),
        "marks.csv:3: column image: \"j1\" is not an image of images.csv",
    ),
    (
        "mark outside the sensor",
        |b| b.replace("marks.csv", "1400,1400", "4400.5,1400"),
        "marks.csv:3: column x: 4400.5 is outside the sensor, 0 to 4000 px, by more than 400 px",
    ),
    (
        "marked twice",
        |b| b.append("marks.csv", "i0,c1,2300,1101\n"),
        "marks.csv:5: point \"c1\" is measured twice in image \"i0\", first in line 4; keep one",
    ),
    (
        "mark without precision",
        |b| b.replace("block.toml", "mark_px = 0.5\n", ""),
        "marks.csv:2: no standard deviation; give sigma here or mark_px in block.toml, [sigma]",
    ),
];
