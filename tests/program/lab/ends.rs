//! Steps that come to nothing leave nothing behind, and what is read of all steps together.

use super::program::{Lab, block};
use serde_json::json;

#[test]
fn a_failed_step_is_dismissed_and_doing_all_with_nothing_to_do_is_no_step() {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = folder.path().join("lab");
    let lab = Lab::start(&["--simulate", "dike", "-o", steps.to_str().expect("UTF-8")]);
    lab.done(1);
    let candidates = lab.get("nodes/1/candidates").json();
    assert!(candidates["next"].is_null(), "{}", candidates["next"]);
    // The only step stays, and so does one that is done.
    assert_eq!(lab.post("steps/1/dismiss", &json!({})).status, 400);
    assert_eq!(lab.post("steps/9/dismiss", &json!({})).status, 404);
    let failed = lab.step(1, json!({ "kind": "remove", "effect": "refraction" }));
    assert_eq!(lab.wait(failed, &["failed", "done"])["state"], "failed");
    assert_eq!(lab.post(&format!("steps/{failed}/dismiss"), &json!({})).status, 200);
    assert!(lab.node(failed).is_null());

    let nothing = lab.step(1, json!({ "kind": "improve" }));
    let began = std::time::Instant::now();
    while !lab.node(nothing).is_null() {
        assert_ne!(lab.node(nothing)["state"], "failed");
        assert!(began.elapsed().as_secs() < 240, "{}", lab.node(nothing));
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
}

#[test]
fn the_longest_arrows_are_those_of_the_worst_step_and_points_say_where_they_were_marked() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    let base = lab.done(1);
    assert!(base["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0), "{base}");
    let before = lab.get("longest").json();
    assert_eq!(lab.get("nodes/1/candidates").json()["next"], "rolling-shutter");
    lab.done(lab.step(1, json!({ "kind": "add", "effect": "rolling-shutter" })));
    let both = lab.get("longest").json();
    // The base model is the worse one at the points.
    assert_eq!(both["plan"], before["plan"]);
    let scale = |id: u32, query: &str| {
        let drawing = lab.get(&format!("nodes/{id}/figures/plan.svg?{query}")).text();
        let (_, rest) = drawing.split_once("data-scale=\"").expect("a scale");
        rest.split('"').next().and_then(|text| text.parse::<f64>().ok()).expect("a number")
    };
    let longest = format!("longest={}", both["plan"]);
    assert!((scale(1, &longest) / scale(2, &longest) - 1.0).abs() < 1e-9);
    assert!(scale(2, "") > 1.5 * scale(2, &longest), "the smaller errors have a larger scale of their own");

    let points = lab.get("nodes/2/points").json();
    let points = points["points"].as_array().expect("points");
    let size = |k: usize| points[k]["size_mm"].as_f64().expect("a size");
    assert!(points.len() > 10 && size(0) >= size(1), "{}", points[0]);
    let marks: usize = points.iter().map(|point| point["marks"].as_array().map_or(0, Vec::len)).sum();
    assert_eq!(marks as u64, lab.get("block").json()["marks"].as_u64().expect("a number"));
    let known = points.iter().flat_map(|point| point["marks"].as_array().cloned().unwrap_or_default());
    assert!(known.filter(|mark| mark["rx"].is_f64()).count() > marks / 2);
}
