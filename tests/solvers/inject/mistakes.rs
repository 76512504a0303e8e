//! Mistakes of people in the files of a block: what `inject` makes, `check` names.

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Points of the block: a command takes a fraction of a second.
const POINTS: &str = "points=300";

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_misclosure"));
    command.args(arguments).current_dir(folder).output().expect("the program runs")
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = run(folder, &[arguments, &["--json", "--quiet"]].concat());
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// A folder with `truth-block`, without errors, and `noisy`, the same with noise.
fn place() -> &'static TempDir {
    static PLACE: OnceLock<TempDir> = OnceLock::new();
    PLACE.get_or_init(|| {
        let place = tempfile::tempdir().expect("a folder");
        json(place.path(), &["simulate", "mapping", "-o", "truth-block", "--set", POINTS]);
        json(place.path(), &["inject", "truth-block", "-o", "noisy", "--error", "noise:px=0.3"]);
        place
    })
}

/// A new folder for a block, beside those of [`place`].
fn new() -> TempDir {
    tempfile::tempdir_in(place().path()).expect("a folder")
}

/// The noisy block with mistakes; what was done.
fn with(mistakes: &[&str], output: &Path) -> Value {
    let output = output.to_str().expect("UTF-8");
    let named: Vec<&str> = mistakes.iter().flat_map(|mistake| ["--mistake", *mistake]).collect();
    json(place().path(), &[&["inject", "noisy", "-o", output], named.as_slice()].concat())
}

fn text(block: &Path, file: &str) -> String {
    fs::read_to_string(block.join(file)).expect("a file")
}

#[test]
fn check_names_what_was_made() {
    for (mistake, kind, subject) in [
        ("scale:of=control,unit=feet", "scale", "control"),
        ("height-offset:of=gnss,by=47.3", "height-offset", "control"),
        ("exchanged:of=control,a=gcp0001,b=gcp0010", "exchanged", "control"),
        ("y-up:of=marks", "y-up", "marks"),
        ("y-up:of=both", "y-up", "ties"),
        ("geographic:of=gnss", "geographic", "gnss"),
    ] {
        let folder = new();
        let output = folder.path().join("block");
        with(&[mistake], &output);
        let checked = json(place().path(), &["check", output.to_str().expect("UTF-8")]);
        let found = checked["mistakes"].as_array().expect("a list");
        let is_it = |own: &&Value| own["kind"] == kind && own["subject"] == subject;
        let one = found.iter().find(is_it).unwrap_or_else(|| panic!("{mistake}: {found:?}"));
        if kind == "exchanged" {
            assert_eq!(one["names"], serde_json::json!(["gcp0001", "gcp0010"]));
        }
    }
    let checked = json(place().path(), &["check", "noisy"]);
    assert_eq!(checked["mistakes"], serde_json::json!([]));
}

#[test]
fn mistakes_alone_leave_all_else_as_it_is() {
    let folder = new();
    let output = folder.path().join("block");
    let made = with(&["scale:of=check,unit=mm", "wrong-position"], &output);
    let noisy = place().path().join("noisy");
    for file in ["ties.csv", "points.csv", "marks.csv", "block.toml", "truth/control.csv"] {
        assert_eq!(text(&noisy, file), text(&output, file), "{file}");
    }
    // The truth says what errors and what mistakes the block has.
    let stated: Value = serde_json::from_str(&text(&output, "truth/errors.json")).expect("JSON");
    assert_eq!(stated, made);
    assert_eq!(stated["errors"][0]["error"], "noise");
    let kinds: Vec<&Value> = stated["mistakes"].as_array().expect("a list").iter().map(|own| &own["mistake"]).collect();
    assert_eq!(kinds, ["scale", "wrong-position"]);
    assert_eq!(stated["mistakes"][0]["parameters"]["unit"], "mm");
    assert_eq!(stated["mistakes"][1]["notes"]["cells changed"], "2");
    assert!(stated["refused"].is_null());
    // More mistakes are added to the list.
    let twice = folder.path().join("twice");
    let output = output.to_str().expect("UTF-8");
    let arguments = ["inject", output, "-o", twice.to_str().expect("UTF-8"), "--mistake", "focal-wrong"];
    assert_eq!(json(place().path(), &arguments)["mistakes"].as_array().map(Vec::len), Some(3));
}

#[test]
fn mistakes_come_after_errors() {
    let folder = new();
    let [noisy, wrong] = ["noisy", "wrong"].map(|name| folder.path().join(name));
    let inject = |output: &PathBuf, more: &[&str]| {
        let output = output.to_str().expect("UTF-8");
        let arguments = ["inject", "truth-block", "-o", output, "--error", "noise:px=0.3", "--seed", "5"];
        json(place().path(), &[&arguments, more].concat())
    };
    assert_eq!(inject(&noisy, &[])["mistakes"], serde_json::json!([]));
    let made = inject(&wrong, &["--mistake", "offset:of=ties,x=1,y=0"]);
    assert_eq!((&made["errors"][0]["error"], &made["mistakes"][0]["mistake"]), (&"noise".into(), &"offset".into()));
    let first = |block: &Path| -> f64 {
        let ties = text(block, "ties.csv");
        ties.lines().nth(1).and_then(|line| line.split(',').nth(2)).expect("x").parse().expect("a number")
    };
    assert!((first(&wrong) - first(&noisy) - 1.0).abs() < 1e-9);
    assert_eq!(text(&noisy, "marks.csv"), text(&wrong, "marks.csv"));
}

#[test]
fn a_block_without_truth_and_one_that_is_refused() {
    let folder = new();
    let bare = folder.path().join("bare");
    fs::create_dir(&bare).expect("a folder");
    for file in ["block.toml", "images.csv", "ties.csv", "points.csv", "control.csv", "marks.csv"] {
        fs::copy(place().path().join("noisy").join(file), bare.join(file)).expect("a file");
    }
    let output = run(folder.path(), &["inject", "bare", "-o", "wrong", "--mistake", "centred", "--quiet"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("no command reads the block"), "{said}");
    assert!(said.contains("has no truth/") && !folder.path().join("wrong/truth").exists(), "{said}");
    assert_eq!(run(folder.path(), &["check", "wrong"]).status.code(), Some(2));
}

#[test]
fn what_there_is_not_is_refused() {
    for (mistake, message) in [
        ("feets", "error: no mistake is called `feets`; nearest:"),
        ("scale:of=ties", "error: mistake `scale`: parameter `of`: `ties` is none of"),
        ("scale:factor=1", "error: mistake `scale`: it changes nothing in this block"),
    ] {
        let arguments = ["inject", "noisy", "-o", "refused", "--quiet", "--mistake", mistake];
        let output = run(place().path(), &arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && errors.starts_with(message), "{errors}");
        assert!(!place().path().join("refused").exists(), "{mistake}");
    }
    let seeded = ["inject", "noisy", "-o", "refused", "--quiet", "--mistake", "scale", "--seed", "2"];
    let output = run(place().path(), &seeded);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && errors.starts_with("error: --seed: without --error"), "{errors}");
    let listed = json(place().path(), &["inject", "--list"]);
    let kinds = listed["mistakes"].as_array().expect("a list");
    let scale = kinds.iter().find(|kind| kind["mistake"] == "scale").expect("scale");
    assert_eq!(scale["parameters"][0]["name"], "of");
}

#[test]
fn a_recipe_has_mistakes() {
    let folder = new();
    let recipe = "about = 'feet'\nseed = 3\nmistakes = ['scale:unit=feet']\n[scenario]\npreset = 'mapping'\n\
                  set = { points = 150 }\n[noise]\npx = 0.3\nstated_px = 0.5\n[truth]\nverdict = 'mistake'\n\
                  noncentrality = 0.0\ncheck_mm = { base = 0.0, model = 0.0 }\n";
    fs::write(folder.path().join("feet.toml"), recipe).expect("a file");
    let made = json(folder.path(), &["inject", "feet.toml", "-o", "feet"]);
    assert_eq!(made["mistakes"][0]["mistake"], "scale");
    fs::write(folder.path().join("metres.toml"), recipe.replace("'scale:unit=feet'", "")).expect("a file");
    json(folder.path(), &["inject", "metres.toml", "-o", "metres"]);
    let [feet, metres] = ["feet", "metres"].map(|name| text(&folder.path().join(name), "control.csv"));
    let first = |table: &str| -> f64 {
        table.lines().nth(1).and_then(|line| line.split(',').nth(1)).expect("x").parse().expect("a number")
    };
    assert!((first(&feet) * 0.3048 - first(&metres)).abs() < 1e-9);
}
