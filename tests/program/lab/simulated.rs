//! A simulated block: measured anew under errors that one chooses, beside its truth.

use super::program::{Lab, command};
use serde_json::json;

#[test]
fn a_block_is_measured_anew_and_the_truth_stands_beside() {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = folder.path().join("lab");
    let arguments = ["--simulate", "closerange", "-o", steps.to_str().expect("UTF-8"), "--error", "noise:px=0.2"];
    let lab = Lab::start(&arguments);
    lab.done(1);
    let causes = lab.get("causes").json();
    assert_eq!(causes["preset"], "closerange");
    let cause = |id: &str| causes["causes"].as_array().expect("causes").iter().find(|c| c["id"] == id).cloned();
    assert!(cause("radial-high").is_some_and(|cause| !cause["parameters"].as_array().expect("parameters").is_empty()));

    let errors = json!({ "errors": ["noise:px=0.2", "unflatness"], "seed": 3 });
    let id = lab.post("simulate", &errors).json()["id"].as_u64().expect("a number");
    let node = lab.done(id);
    assert!(node["parent"].is_null(), "{node}");
    let truth = lab.get(&format!("truth/{id}")).json();
    assert_eq!(truth["errors"], json!(["noise:px=0.2", "unflatness"]));
    let focal = truth["rows"]
        .as_array()
        .expect("rows")
        .iter()
        .find(|row| row["what"].as_str().is_some_and(|w| w.starts_with("f (")));
    let focal = focal.expect("a focal length");
    let (known, found) = (focal["truth"].as_f64().expect("a number"), focal["estimate"].as_f64().expect("a number"));
    assert!((known - found).abs() < 0.01 * known, "{focal}");
    assert_eq!(lab.post("simulate", &json!({ "errors": ["nothing"] })).status, 400);
    // What does not go together is refused before anything is measured.
    let refused = lab.post("simulate", &json!({ "errors": ["homothety:centre=xy"] }));
    assert_eq!((refused.status, refused.text().contains("needs `cx` and `cy`")), (400, true), "{}", refused.text());
    let kinds = cause("outliers").expect("outliers")["parameters"].as_array().expect("parameters").clone();
    let kind = |name: &str| kinds.iter().find(|own| own["name"] == name).cloned().expect("a parameter");
    assert_eq!(kind("spread")["choices"], json!(["block", "image"]));
    assert_eq!((&kind("image")["kind"], &kind("image")["without"]), (&json!("name"), &json!("drawn at random")));
    assert!(kind("image")["choices"].as_array().is_some_and(|names| names.len() > 5));
    // Beside an effect stands what its cause has, or why nothing does.
    let added = lab.done(lab.step(id, json!({ "kind": "add", "effect": "unflatness" })));
    let rows = lab.get(&format!("truth/{}", added["id"])).json()["rows"].as_array().expect("rows").clone();
    let row = |name: &str| rows.iter().find(|row| row["what"] == name).cloned().expect("a row");
    assert_eq!(row("unflatness c_11")["truth"], 3.0);
    assert_eq!(row("unflatness c_20")["truth"], 2.0);
    assert!(rows.iter().all(|row| row["truth"].is_f64() != row["reason"].is_string()), "{rows:?}");

    // A step on it goes on from the block that was measured, also after a restart.
    drop(lab);
    let lab = Lab::start(&arguments);
    let child = lab.done(lab.step(id, json!({ "kind": "tie_centre", "tied": true })));
    assert_eq!(child["parent"], id);
}

#[test]
fn mistakes_are_in_every_measurement() {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = folder.path().join("lab");
    let path = steps.to_str().expect("UTF-8");
    let arguments = ["--simulate", "closerange", "-o", path, "--mistake", "scale:of=check,unit=mm"];
    let lab = Lab::start(&arguments);
    lab.done(1);
    assert_eq!(lab.get("causes").json()["mistakes"], json!(["scale:of=check,unit=mm"]));
    let control = std::fs::read_to_string(steps.join("measured-0001/control.csv")).expect("surveyed points");
    let check = control.lines().find(|line| line.ends_with(",check")).expect("a check point");
    let x: f64 = check.split(',').nth(1).expect("x").parse().expect("a number");
    assert!(x.abs() > 10.0, "{check}");
    drop(lab);
    // Another mistake is another laboratory.
    for (mistake, message) in [("scale:of=check,unit=cm", "has changed since"), ("scale:foot=1", "no parameter `foot`")]
    {
        let arguments = ["--simulate", "closerange", "-o", path, "--mistake", mistake, "--no-open"];
        let output = command(&arguments).output().expect("the program");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && errors.contains(message), "{errors}");
    }
}
