//! The commands that a step gives make it again in a shell, in whatever folder.

use super::program::{Lab, block};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The first iteration of another start: what a fit leaves open, a small part of the last digit that is shown.
const RELATIVE: f64 = 1e-6;

fn summary(run: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(run.join("summary.json")).expect("a summary")).expect("JSON")
}

/// The program, and what else a shell finds.
fn path() -> std::ffi::OsString {
    let program = Path::new(env!("CARGO_BIN_EXE_misclosure")).parent().expect("a folder").to_path_buf();
    let others = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(program).chain(std::env::split_paths(&others))).expect("a path")
}

/// Runs the commands of a step in `folder`; the run that they make.
fn again(lab: &Lab, id: u64, folder: &Path) -> PathBuf {
    let commands = lab.get(&format!("nodes/{id}/commands")).json();
    for command in commands["commands"].as_array().expect("commands") {
        let command = command.as_str().expect("a command");
        let made = Command::new("sh").args(["-c", command]).current_dir(folder).env("PATH", path()).output();
        let made = made.expect("a shell");
        assert!(made.status.success(), "{command}: {}", String::from_utf8_lossy(&made.stderr));
    }
    folder.join(format!("step-{id:04}-again"))
}

fn close(what: &str, found: &Value, wanted: &Value) {
    let (found, wanted) = (found.as_f64().expect(what), wanted.as_f64().expect(what));
    assert!((found - wanted).abs() <= RELATIVE * wanted.abs(), "{what}: {found} and {wanted}");
}

#[test]
fn the_commands_of_a_step_make_it_again() {
    let folder = tempfile::tempdir().expect("a folder");
    // A quote and a space in the name have to come through the shell.
    let steps = folder.path().join("it's a lab");
    let lab = Lab::open(&block("received-1"), &steps);
    lab.done(1);
    let added = lab.step(1, json!({ "kind": "add", "effect": "rolling-shutter" }));
    lab.done(added);
    let held = lab.step(added, json!({ "kind": "free", "parameters": ["f", "pp", "dc", "radial"] }));
    lab.done(held);
    let brush = json!({ "view": "images", "ids": [3] });
    let aside = lab.step(held, json!({ "kind": "set_aside_brush", "brush": brush }));
    lab.done(aside);
    for id in [1, added, held, aside] {
        let elsewhere = tempfile::tempdir().expect("a folder");
        let run = again(&lab, id, elsewhere.path());
        let (found, wanted) = (summary(&run), summary(&steps.join(format!("step-{id:04}"))));
        assert_eq!(found["observations"], wanted["observations"], "step {id}");
        assert_eq!(found["unknowns"], wanted["unknowns"], "step {id}");
        assert_eq!(found["agreement"]["agree"], true, "step {id}");
        close("sigma0", &found["sigma0"], &wanted["sigma0"]);
        close("tie RMS", &found["tie_rms_px"], &wanted["tie_rms_px"]);
        close("check RMS", &found["check"]["rms_m"]["xyz"], &wanted["check"]["rms_m"]["xyz"]);
        let node = lab.node(id);
        close("check RMS of the tree", &found["check"]["rms_m"]["xyz"], &node["figures"]["check_rms_m"]);
        if id >= added {
            let t = |summary: &Value| summary["effects"]["rolling-shutter"]["t"]["value"].clone();
            close("t of the rolling shutter", &t(&found), &t(&wanted));
        }
        assert!(run.join("report.html").exists());
    }
}
