//! The tree is a folder: it is there again after the program was ended, whenever that was, and of one block alone.

use super::program::{Lab, block, command};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn nodes(lab: &Lab) -> Value {
    lab.get("tree").json()["nodes"].clone()
}

#[test]
fn whoever_ends_the_program_finds_every_step_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = folder.path().join("lab");
    let lab = Lab::open(&block("received-1"), &steps);
    lab.done(1);
    let second = lab.step(1, json!({ "kind": "tie_centre", "tied": true }));
    lab.done(second);
    let before = nodes(&lab);

    // In the middle of a step.
    let third = lab.step(second, json!({ "kind": "add", "effect": "rolling-shutter" }));
    lab.wait(third, &["running"]);
    lab.kill();
    assert_eq!(names(&steps).iter().filter(|name| name.starts_with("step-")).count(), 2);

    let again = Lab::open(&block("received-1"), &steps);
    assert_eq!(nodes(&again), before);
    assert!(names(&steps).iter().all(|name| !name.starts_with(".step-")), "{:?}", names(&steps));
    assert_eq!(again.get("nodes/1/candidates").status, 200);
    let third = again.step(second, json!({ "kind": "add", "effect": "rolling-shutter" }));
    let third = again.done(third);
    assert!((1e3 * third["figures"]["check_rms_m"].as_f64().expect("a number") - 4.4).abs() < 0.2, "{third}");

    // A step is the folder of a run that other commands read.
    let step = steps.join("step-0003");
    for file in ["summary.json", "model.toml", "diagnosis.json", "residuals.csv", "report.html", "figures", "step.json"]
    {
        assert!(step.join(file).exists(), "{file}");
    }
    let report = std::process::Command::new(env!("CARGO_BIN_EXE_misclosure")).arg("report").arg(&step).output();
    assert!(report.expect("the program").status.success());
}

#[test]
fn the_folder_of_another_block_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = folder.path().join("lab");
    Lab::open(&block("received-1"), &steps).done(1);
    let path = |path: &Path| path.to_str().expect("UTF-8").to_string();
    let refused = |block: &Path, output: &Path| {
        let output = command(&[&path(block), "-o", &path(output), "--no-open"]).output().expect("the program");
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let error = refused(&block("received-2"), &steps);
    assert!(error.contains("is the laboratory of the block") && error.contains("received-1"), "{error}");
    let error = refused(&block("received-1"), &block("received-1").join("lab"));
    assert!(error.contains("lies in the block"), "{error}");
    fs::write(folder.path().join("notes.txt"), "mine").expect("a file");
    let error = refused(&block("received-1"), folder.path());
    assert!(error.contains("has other things in it"), "{error}");
}
