//! Mistakes of people: named at the root, undone in a step, and undone again after the program was ended.

use super::program::{Lab, block};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// m.
const FOOT: f64 = 0.3048;

/// A copy of a block with the numbers of some columns of a table rewritten.
fn rewritten(to: &Path, file: &str, columns: &[&str], rewrite: impl Fn(usize, f64) -> f64) -> PathBuf {
    let copy = to.join("block");
    fs::create_dir(&copy).expect("a folder");
    for entry in fs::read_dir(block("received-1")).expect("a block").flatten().filter(|entry| entry.path().is_file()) {
        fs::copy(entry.path(), copy.join(entry.file_name())).expect("a file");
    }
    let text = fs::read_to_string(copy.join(file)).expect("a table");
    let header: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
    let wanted: Vec<usize> =
        columns.iter().map(|name| header.iter().position(|own| own == name).expect("a column")).collect();
    let line = |line: &str| {
        let mut cells: Vec<String> = line.split(',').map(String::from).collect();
        for (k, column) in wanted.iter().enumerate() {
            // What is not known stays so.
            if let Ok(number) = cells[*column].parse::<f64>() {
                cells[*column] = format!("{:.9}", rewrite(k, number));
            }
        }
        cells.join(",")
    };
    let lines: Vec<String> =
        text.lines().enumerate().map(|(k, own)| if k == 0 { own.into() } else { line(own) }).collect();
    fs::write(copy.join(file), lines.join("\n") + "\n").expect("a table");
    copy
}

fn check_mm(node: &Value) -> f64 {
    1e3 * node["figures"]["check_rms_m"].as_f64().expect("check points")
}

/// Kind and subject of what is recorded wrongly in the block of a node.
fn named(lab: &Lab, id: u64) -> Vec<(String, String)> {
    let answer = lab.get(&format!("nodes/{id}/candidates")).json();
    let text = |mistake: &Value, key: &str| mistake[key].as_str().expect("text").to_owned();
    let list = answer["mistakes"].as_array().expect("a list").clone();
    list.iter().map(|own| (text(own, "kind"), text(own, "subject"))).collect()
}

#[test]
fn control_in_feet_is_named_mended_and_mended_after_a_restart() {
    let folder = tempfile::tempdir().expect("a folder");
    let feet = rewritten(folder.path(), "control.csv", &["x", "y", "z"], |_, metres| metres / FOOT);
    let before = fs::read(feet.join("control.csv")).expect("a table");
    let steps = folder.path().join("lab");
    let lab = Lab::open(&feet, &steps);
    let root = lab.done(1);
    assert_eq!(root["verdict"], "mistake", "{root}");
    assert!(root["mistake"].as_str().is_some_and(|text| text.contains("feet")), "{root}");
    assert!(check_mm(&root) > 10_000.0, "{root}");
    assert!(named(&lab, 1).contains(&("scale".into(), "control".into())), "{:?}", named(&lab, 1));
    let answer = lab.get("nodes/1/candidates").json();
    let mistake = answer["mistakes"].as_array().and_then(|all| all.iter().find(|own| own["subject"] == "control"));
    let mistake = mistake.expect("a mistake of control");
    for key in ["kind", "subject", "names", "value", "sigma", "unit", "drop", "ln_p", "sentence", "remedy", "mend"] {
        assert!(mistake.get(key).is_some(), "{key}: {mistake}");
    }
    let sentence = answer["sentence"].as_str().expect("a sentence");
    assert!(sentence.contains("recorded wrongly") && sentence.contains("feet"), "{sentence}");
    // The same list as in the folder of the run.
    let kept: Value =
        serde_json::from_slice(&fs::read(steps.join("step-0001/diagnosis.json")).expect("a diagnosis")).expect("JSON");
    assert_eq!(kept["mistakes"], answer["mistakes"]);

    let mend = lab.step(1, json!({ "kind": "mend", "only": ["scale"] }));
    let mended = lab.done(mend);
    assert_eq!((mended["words"].as_str(), mended["parent"].as_u64()), (Some("mended: scale"), Some(1)));
    assert_ne!(mended["verdict"], "mistake", "{mended}");
    assert_eq!(mended["mistake"], Value::Null, "{mended}");
    assert!(named(&lab, mend).is_empty(), "{:?}", named(&lab, mend));
    // As the block without the mistake: 17.5 mm.
    assert!((check_mm(&mended) - 17.5).abs() < 0.5, "{mended}");
    assert!(mended["delta_words"].as_str().expect("words").contains("→ 17"), "{mended}");
    assert_eq!(fs::read(feet.join("control.csv")).expect("a table"), before, "no file is changed");

    // A step beneath goes on with the mended block; one beside it does not.
    let added = lab.done(lab.step(mend, json!({ "kind": "add", "effect": "rolling-shutter" })));
    assert!((check_mm(&added) - 4.4).abs() < 0.2, "{added}");
    let beside = lab.done(lab.step(1, json!({ "kind": "tie_centre", "tied": true })));
    assert_eq!(beside["verdict"], "mistake", "{beside}");
    assert!(check_mm(&beside) > 10_000.0, "{beside}");
    // Mended beneath an effect, the effect stays in the model.
    let effect = lab.step(1, json!({ "kind": "add", "effect": "rolling-shutter" }));
    lab.done(effect);
    let late = lab.done(lab.step(effect, json!({ "kind": "mend" })));
    assert!((check_mm(&late) - 4.4).abs() < 0.5, "{late}");
    let model = lab.get(&format!("nodes/{}/model", late["id"])).json();
    assert_eq!(model["effects"][0]["id"], "rolling-shutter", "{model}");

    let tree = lab.get("tree").json()["nodes"].clone();
    let measurements = |lab: &Lab| lab.get(&format!("nodes/{mend}/measurements?limit=0")).json();
    let all = measurements(&lab);
    lab.kill();
    let lab = Lab::open(&feet, &steps);
    assert_eq!(lab.get("tree").json()["nodes"], tree);
    assert_eq!(measurements(&lab), all);
    assert!(named(&lab, 1).contains(&("scale".into(), "control".into())));
    let again = lab.done(lab.step(mend, json!({ "kind": "add", "effect": "rolling-shutter" })));
    assert!((check_mm(&again) - check_mm(&added)).abs() < 0.05, "{again}");
    for view in ["sensor", "plan", "height", "gnss", "checks", "ledger"] {
        assert_eq!(lab.get(&format!("nodes/{mend}/figures/{view}.svg")).status, 200, "{view}");
    }
}

#[test]
fn the_commands_of_a_mended_step_begin_with_mend() {
    let folder = tempfile::tempdir().expect("a folder");
    let feet = rewritten(folder.path(), "control.csv", &["x", "y", "z"], |_, metres| metres / FOOT);
    let lab = Lab::open(&feet, &folder.path().join("lab"));
    lab.done(1);
    let mend = lab.step(1, json!({ "kind": "mend", "only": ["scale"] }));
    let mended = lab.done(mend);
    let commands = lab.get(&format!("nodes/{mend}/commands")).json();
    let commands: Vec<String> = serde_json::from_value(commands["commands"].clone()).expect("commands");
    assert!(commands[0].starts_with("misclosure mend ") && commands[0].ends_with(" --only 'scale'"), "{commands:?}");
    let elsewhere = tempfile::tempdir().expect("a folder");
    let program = Path::new(env!("CARGO_BIN_EXE_misclosure"));
    for command in &commands {
        let own = command.replacen("misclosure", &format!("'{}'", program.display()), 1);
        let made = Command::new("sh").args(["-c", &own]).current_dir(elsewhere.path()).output().expect("a shell");
        assert!(made.status.success(), "{command}: {}", String::from_utf8_lossy(&made.stderr));
    }
    let summary = elsewhere.path().join(format!("step-{mend:04}-again/summary.json"));
    let summary: Value = serde_json::from_slice(&fs::read(summary).expect("a summary")).expect("JSON");
    let found = 1e3 * summary["check"]["rms_m"]["xyz"].as_f64().expect("check points");
    assert!((found - check_mm(&mended)).abs() < 1e-3, "{found} and {}", check_mm(&mended));
    // Without the step the commands say what they cannot repeat.
    let root = lab.get("nodes/1/commands").json();
    assert!(
        root["commands"][0].as_str().is_some_and(|line| line.starts_with("# ") && line.contains("scale (control)"))
    );
}

#[test]
fn what_needs_a_person_is_named_and_not_mended() {
    let folder = tempfile::tempdir().expect("a folder");
    let degrees = |k: usize, metres: f64| match k {
        0 => 48.0 + metres / 111_195.0,
        _ => 11.0 + metres / 74_400.0,
    };
    let block = rewritten(folder.path(), "images.csv", &["gnss_x", "gnss_y"], degrees);
    let lab = Lab::open(&block, &folder.path().join("lab"));
    let root = lab.done(1);
    assert_eq!(root["verdict"], "mistake", "{root}");
    // The adjustment goes on with control.
    assert!(check_mm(&root) < 100.0, "{root}");
    assert_eq!(root["figures"]["gnss_rms_m"], Value::Null, "{root}");
    let answer = lab.get("nodes/1/candidates").json();
    let mistake = answer["mistakes"].as_array().and_then(|all| all.iter().find(|own| own["kind"] == "geographic"));
    let mistake = mistake.unwrap_or_else(|| panic!("no degrees: {answer}"));
    assert!(mistake.get("mend").is_none() && !mistake["remedy"].as_str().unwrap_or("").is_empty(), "{mistake}");
    for (change, said) in [
        (json!({ "kind": "mend", "only": ["geographic"] }), "can be undone here"),
        (json!({ "kind": "mend", "only": ["nothing"] }), "can be undone here"),
    ] {
        let node = lab.wait(lab.step(1, change), &["failed", "done"]);
        assert_eq!(node["state"], "failed", "{node}");
        assert!(node["error"].as_str().is_some_and(|error| error.contains(said)), "{node}");
    }
    let strange = json!({ "parent": 1, "change": { "kind": "mend", "edits": [] } });
    assert_eq!(lab.post("steps", &strange).status, 400);
}

#[test]
fn a_block_without_mistakes_has_an_empty_list() {
    let folder = tempfile::tempdir().expect("a folder");
    let lab = Lab::open(&block("received-1"), &folder.path().join("lab"));
    let root = lab.done(1);
    assert_eq!((&root["verdict"], &root["mistake"]), (&json!("missing"), &Value::Null));
    assert_eq!(lab.get("nodes/1/candidates").json()["mistakes"], json!([]));
    let node = lab.wait(lab.step(1, json!({ "kind": "mend" })), &["failed", "done"]);
    assert_eq!(node["state"], "failed", "{node}");
}
