//! A plan on sliders: what can be turned, what follows, and what is refused.

use super::program::{Lab, command};
use serde_json::{Value, json};
use std::process::Command;

fn planned(lab: &Lab, turned: &Value) -> Value {
    let answer = lab.post("plan", turned);
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.json()
}

fn sizes(plan: &Value) -> Vec<(String, f64)> {
    let effects = plan["effects"].as_array().expect("effects");
    let of = |own: &Value| {
        let sizes = own["sizes"].as_array().expect("sizes").clone();
        let name = own["effect"].as_str().expect("a name").to_owned();
        sizes.into_iter().map(move |size| (format!("{name} {}", size["parameter"]), size["size"].as_f64().unwrap()))
    };
    let mut all: Vec<(String, f64)> = effects.iter().flat_map(of).collect();
    all.sort_by(|a, b| a.0.cmp(&b.0));
    all
}

#[test]
fn what_is_turned_is_planned_as_the_command_says() {
    let lab = Lab::start(&["--plan", "dike", "--datum", "control"]);
    let dials = lab.get("dials").json();
    assert_eq!([&dials["scenario"], &dials["datum"]], ["dike", "control"]);
    let names = dials["dials"].as_array().expect("dials").iter().map(|own| own["name"].as_str().expect("a name"));
    assert!(
        ["height_m", "forward_overlap", "tilt_deg", "control", "gnss_z_m"]
            .iter()
            .all(|own| { names.clone().any(|name| name == *own) })
    );
    let values = json!({ "tilt_deg": 15, "height_m": 45, "points": 2000, "check": 50 });
    let whole = planned(&lab, &json!({ "values": values, "datum": "all" }));
    assert!(whole["draft"].is_null() && whole["ellipses"].as_str().is_some_and(|svg| svg.starts_with("<svg")));
    assert_eq!(whole["plan"]["tie_points"], 2000);
    let command = whole["command"].as_str().expect("a command");
    let words: Vec<&str> = command.split(' ').collect();
    assert_eq!((words[0], words.iter().filter(|word| **word == "--set").count()), ("misclosure", 4));
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure")).args(&words[1..]).arg("--json").output();
    let output = output.expect("the program");
    let in_shell: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(sizes(&whole["plan"]), sizes(&in_shell), "{command}");
    // A request without a datum takes that of the command line.
    let control = planned(&lab, &json!({ "values": values }));
    assert!(control["command"].as_str().is_some_and(|text| text.ends_with("--datum control")));
    assert_ne!(sizes(&whole["plan"]), sizes(&control["plan"]));
}

/// How far a draft may be from the whole: the sizes in the mean, and the promise, which a hundred check points know to
/// some per cent.
const DRAFT: [f64; 2] = [1.1, 1.06];

#[test]
fn a_draft_says_nearly_the_same() {
    let lab = Lab::start(&["--plan", "mapping"]);
    let [draft, whole] = [true, false].map(|draft| planned(&lab, &json!({ "draft": draft })));
    assert_eq!((&draft["draft"], &draft["tie_points"]), (&json!(1000), &json!(12_000)));
    assert!(draft["ellipses"].is_null());
    let [quick, exact] = [&draft, &whole].map(|own| sizes(&own["plan"]));
    let names = |own: &[(String, f64)]| own.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&quick), names(&exact));
    let squares: f64 = quick.iter().zip(&exact).map(|(a, b)| (a.1 / b.1).ln().powi(2)).sum();
    let mean = (squares / quick.len() as f64).sqrt().exp();
    let check = |own: &Value| own["plan"]["precision"]["check"]["height_m"]["rms"].as_f64().expect("a number");
    let promise = check(&draft) / check(&whole);
    assert!(mean < DRAFT[0] && promise < DRAFT[1] && promise > 1.0 / DRAFT[1], "{mean}, {promise}");
}

#[test]
fn what_cannot_be_flown_is_refused_with_its_reason() {
    let lab = Lab::start(&["--plan", "mapping"]);
    for (turned, said) in [
        (json!({ "values": { "height_m": 1e6 } }), "mapping: height_m = 1000000: expected 20 to 500"),
        (json!({ "values": { "flaps": 1 } }), "mapping has no parameter \"flaps\""),
        (json!({ "values": { "cross_strips": 1.5 } }), "expected a whole number"),
        (json!({ "values": {}, "speed": 3 }), "unknown field `speed`"),
        (json!({ "datum": "gps" }), "unknown variant `gps`"),
    ] {
        let answer = lab.post("plan", &turned);
        assert!(answer.status == 400 && answer.text().replace('\\', "").contains(said), "{said}: {}", answer.text());
    }
    // A block that falls into parts has no plan, and says why.
    let apart =
        json!({ "height_m": 20, "forward_overlap": 0.2, "side_overlap": 0.1, "points": 100, "cross_strips": 0 });
    let answer = lab.post("plan", &json!({ "values": apart }));
    assert!(answer.status == 400 && answer.text().contains("no common tie points"), "{}", answer.text());
    assert_eq!([lab.get("tree").status, lab.get("plan").status], [404, 405], "it is no laboratory of a block");
    let page = lab.raw("GET /", &[("Host", &lab.host())], "").text();
    assert!(page.contains("plan.js") && !page.contains("main.js"), "{page}");
}

#[test]
fn options_that_a_plan_cannot_honour_are_refused() {
    for (arguments, said) in [
        (&["--plan", "dike", "--add", "rolling-shutter"][..], "--free, --tie and --datum alone"),
        (&["--plan", "dike", "-o", "folder"], "cannot be used with"),
        (&["--plan", "dike", "--simulate", "dike"], "cannot be used with"),
        (&["block", "--plan", "dike"], "cannot be used with"),
        (&["--plan", "no-such"], "neither a preset"),
        (&["--plan", "dike", "--error", "noise:px=1"], "cannot be used with"),
    ] {
        let output = command(arguments).arg("--no-open").output().expect("the program");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && text.contains(said), "{arguments:?}: {text}");
    }
}
