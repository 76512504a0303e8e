//! The same block in national coordinates, with times since 1970, blunders and names in another alphabet: the same
//! verdict.

use super::{Scene, table};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Rewrites the cells of a table: `cell(row, column, text)`, rows counted from 0.
fn rewrite(file: &Path, cell: &dyn Fn(usize, &str, &str) -> String) {
    let mut rows = csv::Reader::from_path(file).expect("a table");
    let names = rows.headers().expect("names").clone();
    let mut moved = csv::Writer::from_path(file.with_extension("moved")).expect("a table");
    moved.write_record(&names).expect("names");
    for (number, row) in rows.records().enumerate() {
        let row = row.expect("a row");
        moved.write_record(names.iter().zip(&row).map(|(name, text)| cell(number, name, text))).expect("a row");
    }
    drop(moved);
    fs::rename(file.with_extension("moved"), file).expect("a table");
}

/// What national coordinates and times since 1970 add to the columns of a block.
const NATIONAL: [(&str, f64); 7] =
    [("x", 5e5), ("y", 5e6), ("z", 100.0), ("gnss_x", 5e5), ("gnss_y", 5e6), ("gnss_z", 100.0), ("time_s", 1.7e9)];

/// `data/hidden/received-1`, and a copy of it in national coordinates with times since 1970.
fn received_and_national(scene: &Scene) -> (PathBuf, PathBuf) {
    let received = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/hidden/received-1");
    let national = scene.folder.path().join("national");
    fs::create_dir(&national).expect("a folder");
    for entry in fs::read_dir(&received).expect("a block") {
        let path = entry.expect("an entry").path();
        if path.is_file() {
            fs::copy(&path, national.join(path.file_name().expect("a name"))).expect("a copy");
        }
    }
    for table in ["images.csv", "points.csv", "control.csv"].map(|table| national.join(table)) {
        if table.exists() {
            rewrite(&table, &|_, name, text| match NATIONAL.iter().find(|(column, _)| *column == name) {
                Some((_, by)) if !text.is_empty() => format!("{:?}", text.parse::<f64>().expect("a number") + by),
                _ => text.to_string(),
            });
        }
    }
    (received, national)
}

/// What `improve` writes as `diagnosis.json`.
fn improved(scene: &Scene, block: &Path, name: &str) -> Value {
    let (code, stderr) = scene.run(&["improve", block.to_str().expect("UTF-8"), "-o", &scene.path(name)]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let text = fs::read_to_string(scene.folder.path().join(name).join("diagnosis.json")).expect("a diagnosis");
    serde_json::from_str(&text).expect("JSON")
}

/// A figure of the last row of the ledger.
fn last(diagnosis: &Value, key: &str) -> f64 {
    diagnosis["ledger"].as_array().expect("rows").last().expect("a row")[key].as_f64().expect("a number")
}

#[test]
fn national_coordinates_and_times_since_1970_change_nothing() {
    let scene = Scene { folder: tempfile::tempdir().expect("a temporary folder") };
    let (received, national) = received_and_national(&scene);
    let (here, there) = (improved(&scene, &received, "here"), improved(&scene, &national, "there"));
    assert_eq!((&here["verdict"], &here["recommended"]), (&there["verdict"], &there["recommended"]));
    for key in ["sigma0", "tie_rms_px", "check_rms_m"] {
        let (a, b) = (last(&here, key), last(&there, key));
        assert!((a / b - 1.0).abs() < 1e-4, "{key}: {a} and {b}");
    }
    let row = |name: &str| {
        let text = fs::read_to_string(scene.folder.path().join(name).join("points.csv")).expect("points");
        let cells: Vec<String> = text.lines().nth(1).expect("a point").split(',').map(str::to_string).collect();
        [1, 2, 3].map(|k| cells[k].parse::<f64>().expect("a coordinate"))
    };
    let moved = std::array::from_fn::<f64, 3, _>(|k| row("there")[k] - row("here")[k] - NATIONAL[k].1);
    assert!(moved.iter().all(|by| by.abs() < 1e-5), "written in the survey's own coordinates: {moved:?}");
}

/// The small letters of a name in Cyrillic; their order stays.
fn in_cyrillic(name: &str) -> String {
    let letter = |c: char| match c {
        'a'..='z' => char::from_u32('а' as u32 + (c as u32 - 'a' as u32)).expect("a letter"),
        _ => c,
    };
    name.chars().map(letter).collect()
}

#[test]
fn blunders_in_national_coordinates_with_names_in_another_alphabet_change_no_verdict() {
    /// One measurement in as many is wrong, and by how much, px.
    const EVERY: usize = 100;
    const BLUNDER_PX: f64 = 500.0;
    /// A hundredth of the measurements is gone: less than the standard deviation of the figures themselves, which at
    /// the 60 check points is 5 %.
    const FIGURES: f64 = 0.02;
    /// Half of the sensor, px: towards its middle a blunder stays on it.
    const MIDDLE: [f64; 2] = [2560.0, 1920.0];
    let scene = Scene { folder: tempfile::tempdir().expect("a temporary folder") };
    let (received, national) = received_and_national(&scene);
    for table in ["images.csv", "control.csv", "marks.csv", "ties.csv"].map(|table| national.join(table)) {
        rewrite(&table, &|_, name, text| match name {
            "image" | "camera" | "flight" | "point" => in_cyrillic(text),
            _ => text.to_string(),
        });
    }
    let toml = fs::read_to_string(national.join("block.toml")).expect("a block");
    assert!(toml.contains("id = \"cam\""), "{toml}");
    let toml = toml.replace("id = \"cam\"", &format!("id = \"{}\"", in_cyrillic("cam")));
    fs::write(national.join("block.toml"), toml).expect("a block");
    rewrite(&national.join("ties.csv"), &|row, name, text| {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            _ => return text.to_string(),
        };
        if row % EVERY != 0 {
            return text.to_string();
        }
        let angle = (row / EVERY) as f64;
        let value: f64 = text.parse().expect("a coordinate");
        let by = BLUNDER_PX * [angle.cos(), angle.sin()][axis].abs();
        format!("{}", if value > MIDDLE[axis] { value - by } else { value + by })
    });
    let (here, there) = (improved(&scene, &received, "here"), improved(&scene, &national, "there"));
    assert_eq!((&here["verdict"], &here["recommended"]), (&there["verdict"], &there["recommended"]));
    for key in ["sigma0", "tie_rms_px", "check_rms_m"] {
        let (a, b) = (last(&here, key), last(&there, key));
        assert!((a / b - 1.0).abs() < FIGURES, "{key}: {a} and {b}");
    }
    let effects = |diagnosis: &Value| diagnosis["found"].as_array().expect("effects").clone();
    for (here, there) in effects(&here).iter().zip(&effects(&there)) {
        for (parameter, one) in here["estimate"].as_object().expect("parameters") {
            let other = &there["estimate"][parameter];
            let of = |estimate: &Value, key: &str| estimate[key].as_f64().expect("a number");
            let apart = (of(one, "value") - of(other, "value")).abs();
            assert!(apart < of(one, "sigma"), "{parameter}: {one} and {other}");
        }
    }
    let (_, measured) = table(&national, "ties.csv");
    let (_, outliers) = table(&scene.folder.path().join("there"), "outliers.csv");
    let rays = |point: &str| measured.iter().filter(|row| row[1] == point).count();
    for row in measured.iter().step_by(EVERY) {
        // Of two rays it cannot be told which one is wrong: the point is then out with either.
        let is_out = |out: &Vec<String>| out[1] == row[1] && (out[0] == row[0] || rays(&row[1]) == 2);
        assert!(outliers.iter().any(is_out), "{row:?}");
    }
}
