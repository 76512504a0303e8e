//! `compare` as scripts see it: two adjustments of one block, in JSON, as text and as a page.

use super::{Scene, summary};
use serde_json::Value;
use std::fs;
use std::process::Command;

#[test]
fn two_runs_are_compared_in_cameras_poses_and_points() {
    let scene = Scene::new();
    let whole = scene.adjust("whole", &[]);
    // Without the radial terms the camera is another one, and the points lie elsewhere.
    let bare = scene.adjust("bare", &["--fix", "radial"]);
    let page = scene.path("compared.html");
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args(["--json", "compare"])
        .args([&whole, &bare])
        .args(["-o", &page])
        .output()
        .expect("the program runs");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let compared: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let runs = compared["runs"].as_array().expect("runs");
    for (run, folder) in runs.iter().zip([&whole, &bare]) {
        let of = summary(folder);
        assert_eq!((&run["tie_rms_px"], &run["check_rms_m"]), (&of["tie_rms_px"], &of["check"]["rms_m"]["xyz"]));
    }
    let [difference] = compared["differences"].as_array().expect("differences").as_slice() else {
        panic!("{compared}");
    };
    let rms = |key: &str| difference["cameras"][0][key]["rms_px"].as_f64().expect("a number");
    let [whole_px, turned, last] = ["whole", "after_rotation", "after_rotation_and_f"].map(rms);
    assert!(whole_px >= turned && turned >= last && last > 0.0, "{whole_px} {turned} {last}");
    let n = |of: &str| difference[of]["n"].as_u64().expect("a count");
    let rows = &summary(&whole)["rows"];
    assert_eq!((n("images"), n("points")), (rows["images"].as_u64().unwrap(), rows["points"].as_u64().unwrap()));
    assert_eq!(n("check_points"), summary(&whole)["check"]["n"].as_u64().unwrap());
    assert!(difference["check_points"]["rms_m"].as_f64().expect("a length") > 0.0);

    let html = fs::read_to_string(&page).expect("a page");
    assert!(html.contains("<svg") && html.contains("after a rotation") && html.contains("least squares"));

    // A run against itself differs by nothing.
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args(["--json", "compare"])
        .args([&whole, &whole])
        .output()
        .expect("the program runs");
    let same: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let same = &same["differences"][0];
    assert_eq!((&same["points"]["max_m"], &same["check_points"]["max_m"]), (&0.0.into(), &0.0.into()));
    assert!(same["cameras"][0]["whole"]["max_px"].as_f64().expect("a number") < 1e-6, "{same}");
}

#[test]
fn what_is_no_run_is_refused() {
    let scene = Scene::new();
    let (block, nothing) = (scene.path("block"), scene.path("nothing"));
    let (code, stderr) = scene.run(&["compare", &block, &nothing]);
    assert!(code == 2 && stderr.contains("no such folder"), "{code} {stderr}");
    let (code, stderr) = scene.run(&["compare", &block, &block]);
    assert!(code == 2 && stderr.contains("is this the folder of a run?"), "{code} {stderr}");
    let (code, _) = scene.run(&["compare", &block]);
    assert_eq!(code, 2, "one run is compared with nothing");
}
