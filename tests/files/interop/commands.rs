//! `misclosure import` and `export` as scripts see them.

use super::beside;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the program and gives exit code, standard output and standard error.
fn misclosure(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure")).args(arguments).output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("not killed"), text(output.stdout), text(output.stderr))
}

fn json(arguments: &[&str]) -> Value {
    let (code, stdout, stderr) = misclosure(&[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{arguments:?}: {stderr}");
    serde_json::from_str(&stdout).expect("JSON and nothing else on standard output")
}

fn refused(arguments: &[&str], what: &str) {
    let (code, stdout, stderr) = misclosure(arguments);
    assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
    assert!(stderr.contains(what), "{arguments:?}: {stderr}");
}

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().expect("UTF-8").to_string()
}

/// A close-range block with noise, and start values without the affinity that other programs have not.
fn simulated(folder: &tempfile::TempDir) -> String {
    let block = path(folder, "block");
    json(&["simulate", "closerange", "-o", &block, "--set", "points=150", "--noise-px", "0.2"]);
    without_affinity(&block);
    block
}

fn without_affinity(block: &str) {
    let path = Path::new(block).join("block.toml");
    let text = fs::read_to_string(&path).expect("block.toml");
    let affinity = |line: &str| line.starts_with("b1 = ") || line.starts_with("b2 = ");
    let lines =
        text.lines().map(|line| if affinity(line) { format!("{} = 0.0\n", &line[..2]) } else { format!("{line}\n") });
    fs::write(&path, lines.collect::<String>()).expect("block.toml");
}

#[test]
fn the_list_says_what_there_is() {
    let list = json(&["import", "--list"]);
    let formats = list["formats"].as_array().expect("a list");
    for name in ["colmap", "colmap-text", "bundler", "bal", "blocks-exchange"] {
        assert!(formats.iter().any(|format| format["name"] == name && format["export"] == true), "{name}: {list}");
    }
    let (_, text, _) = misclosure(&["import", "--list"]);
    assert!(formats.iter().all(|format| text.contains(format["about"].as_str().expect("words"))), "{text}");
}

#[test]
fn a_model_is_guessed_and_every_note_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let block = simulated(&folder);
    let (model, again) = (path(&folder, "model"), path(&folder, "again"));
    let written = json(&["export", "colmap", &block, "-o", &model, "--approximate"]);
    assert!(written["files"].as_array().expect("files").contains(&Value::from("verification.csv")), "{written}");
    let made = json(&["import", &model, "-o", &again]);
    assert_eq!(made["from"], "colmap");
    let checked = json(&["check", &again]);
    assert_eq!(made["tie_measurements"], checked["ties"]["measurements"]);
    let comments = fs::read_to_string(Path::new(&again).join("block.toml")).expect("block.toml");
    for note in made["notes"].as_array().expect("notes") {
        let line = format!("# {}: {}", note["kind"].as_str().expect("a kind"), note["text"].as_str().expect("words"));
        assert!(comments.lines().any(|comment| comment == line), "{line}\n{comments}");
    }
    refused(&["import", &model, "-o", &again], "is a block");
    refused(&["export", "colmap", &block, "-o", &path(&folder, "block/model")], "lies in the block");
}

#[test]
fn bad_usage_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = path(&folder, "out");
    let nothing = path(&folder, "nothing");
    fs::create_dir(&nothing).expect("a folder");
    refused(&["import", &nothing, "-o", &out], "the format cannot be told");
    refused(&["import", "colmap", &nothing, "-o", &out], "this is no COLMAP model");
    refused(&["import", "nonsense", "-o", &out], "there is no such file, folder or format");
    refused(&["import", "colmap", "-o", &out], "name its files");
    refused(&["import", "bal", &nothing, "-o", &out, "--size", "10"], "WIDTHxHEIGHT");
    refused(&["import", "bal", &nothing, "-o", &out, "--tie-px", "0"], "--tie-px");
    refused(&["export", "nonsense", &nothing, "-o", &out], "no format is called `nonsense`");
    assert!(!Path::new(&out).exists());
}

/// What a run found goes back: a plain adjustment of the corrected measurements gives the run's own camera and
/// residuals.
#[test]
fn an_effect_is_taken_out_of_the_measurements_or_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let block = simulated(&folder);
    let (run, model, again, plain) =
        (path(&folder, "run"), path(&folder, "model"), path(&folder, "again"), path(&folder, "plain"));
    // A large effect, held: it acts whatever the block says.
    let bad = path(&folder, "bad");
    json(&["inject", &block, "-o", &bad, "--error", "radial-high", "--error", "noise:px=0.2"]);
    without_affinity(&bad);
    let camera = ["--tie", "dc=pp", "--fix", "affinity"];
    let adjusted = json(&[&["adjust", &bad, "-o", &run, "--add", "radial-high"], &camera[..]].concat());
    refused(&["export", "colmap", &run, "-o", &model], "--correct-measurements");
    assert!(!Path::new(&model).exists());
    let written = json(&["export", "colmap", &run, "-o", &model, "--correct-measurements"]);
    let notes = written["notes"].as_array().expect("notes");
    assert!(
        notes.iter().any(|note| note["text"].as_str().expect("words").contains("corrected for radial-high")),
        "{notes:?}"
    );
    json(&["import", &model, "-o", &again]);
    let repeated = json(&[&["adjust", &again, "-o", &plain], &camera[..]].concat());
    let number = |summary: &Value, way: &str| summary.pointer(way).and_then(Value::as_f64).expect("a number");
    let [before, after] = [&adjusted, &repeated].map(|summary| number(summary, "/tie_rms_px"));
    // Noise is of second order in what the effect changes of the derivatives: parts in ten thousand of it.
    assert!((before - after).abs() < 1e-3 * before, "{before} px, {after} px");
    let id = adjusted["cameras"].as_object().expect("cameras").keys().next().expect("a camera").clone();
    let [f, sigma] = ["value", "sigma"].map(|what| number(&adjusted, &format!("/cameras/{id}/f/{what}")));
    let found = number(&repeated, "/cameras/1/f/value");
    assert!((found - f).abs() < sigma, "{found} {f} +- {sigma}");
}

#[test]
fn a_run_without_effects_goes_back_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let block = simulated(&folder);
    let (run, model) = (path(&folder, "run"), path(&folder, "model"));
    let summary = json(&["adjust", &block, "-o", &run, "--tie", "dc=pp", "--fix", "affinity"]);
    let f =
        summary.pointer("/cameras").and_then(Value::as_object).and_then(|c| c.values().next()).expect("a camera")["f"]
            ["value"]
            .clone();
    // The run is found again from elsewhere, and the block by its note.
    let written = json(&["export", "colmap-text", &run, "-o", &model]);
    assert_eq!(
        written["notes"].as_array().map(|notes| notes.iter().filter(|note| note["kind"] == "fact").count()),
        Some(0),
        "{written}"
    );
    let cameras = fs::read_to_string(Path::new(&model).join("cameras.txt")).expect("cameras");
    let words: Vec<&str> = cameras.lines().last().expect("a camera").split(' ').collect();
    assert_eq!(words[4].parse::<f64>().ok(), f.as_f64());
    fs::rename(&block, path(&folder, "moved")).expect("moved");
    refused(&["export", "colmap", &run, "-o", &path(&folder, "b")], "--block names another place");
    json(&["export", "colmap", &run, "-o", &path(&folder, "c"), "--block", &path(&folder, "moved")]);
}

/// Reading sets check points without a mark aside: a table that is written anew would lose them.
#[test]
fn nothing_is_added_where_something_would_be_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    let block = simulated(&folder);
    let control = Path::new(&block).join("control.csv");
    let text = fs::read_to_string(&control).expect("control.csv");
    let cell = |name: &str| match name {
        "point" => "lonely",
        "role" => "check",
        "x" | "y" | "z" => "1",
        _ => "",
    };
    let row: Vec<&str> = text.lines().next().expect("a header").split(',').map(cell).collect();
    let with_one_more = format!("{text}{}\n", row.join(","));
    fs::write(&control, &with_one_more).expect("control.csv");
    let list = path(&folder, "gcp_list.txt");
    fs::write(&list, "+proj=utm +zone=32 +datum=WGS84\n500000 5000000 100 10 10 none.jpg g1\n").expect("a list");
    refused(&["import", "gcp", &list, "--into", &block], "1 check point without a mark");
    assert_eq!(fs::read_to_string(&control).expect("control.csv"), with_one_more);
}

/// Four control points at one place, which images see at different ones: the block is written, and the mistake is said.
#[test]
fn what_is_imported_is_examined_and_written_all_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    let block = simulated(&folder);
    let images = fs::read_to_string(Path::new(&block).join("images.csv")).expect("images.csv");
    let names: Vec<&str> = images.lines().skip(1).filter_map(|row| row.split(',').next()).collect();
    let (points, marks) = (path(&folder, "points.csv"), path(&folder, "marks.csv"));
    let places = [(100.3, 100.8), (700.1, 200.4), (400.7, 800.2), (900.6, 600.9)];
    let mut rows = [String::new(), String::new()];
    for (k, (x, y)) in places.into_iter().enumerate() {
        rows[0] += &format!("P{k},1,2,3\n");
        rows[1] += &format!("{},P{k},{x},{y}\n{},P{k},{},{y}\n", names[0], names[1], x + 30.25);
    }
    fs::write(&points, &rows[0]).expect("points");
    fs::write(&marks, &rows[1]).expect("marks");
    let arguments = ["import", "gcp", &points, &marks, "--into", &block];
    let made = json(&arguments);
    let mistakes = made["mistakes"].as_array().expect("a list");
    let collapsed = mistakes.iter().find(|own| own["kind"] == "collapsed" && own["subject"] == "control");
    assert!(collapsed.is_some(), "{mistakes:?}");
    let control = fs::read_to_string(Path::new(&block).join("control.csv")).expect("control.csv");
    assert!(control.contains("P3"), "{control}");
    // The same once more changes nothing, and says it again, for people.
    let (code, stdout, stderr) = misclosure(&arguments);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.starts_with("MISTAKES\n") && stdout.contains("misclosure mend"), "{stdout}");
    assert!(stderr.contains("MISTAKES in the block: ") && stderr.contains("collapsed of control"), "{stderr}");
    assert_eq!(made["mistakes"], json(&["check", &block])["mistakes"]);
}

/// Rotations the wrong way round in a model that says what its points are missed by.
#[test]
fn a_model_that_contradicts_itself_is_named() {
    let Some(sample) = beside::shared("data/interop/colmap-maupertuis") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let model = path(&folder, "model");
    fs::create_dir(&model).expect("a folder");
    for name in ["cameras.txt", "points3D.txt", "images.txt"] {
        fs::copy(sample.join(name), Path::new(&model).join(name)).expect("a copy");
    }
    let right = json(&["import", &model, "-o", &path(&folder, "right")]);
    assert_eq!(right["mistakes"], serde_json::json!([]), "{right}");
    let file = Path::new(&model).join("images.txt");
    let text = fs::read_to_string(&file).expect("images.txt");
    let (mut wrong, mut is_pose) = (String::new(), true);
    for line in text.lines() {
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let is_comment = line.starts_with('#');
        if is_pose && !is_comment {
            for word in &mut words[2..5] {
                *word = word.strip_prefix('-').map_or_else(|| format!("-{word}"), str::to_owned);
            }
        }
        is_pose = is_comment || !is_pose;
        wrong += &format!("{}\n", words.join(" "));
    }
    fs::write(&file, wrong).expect("images.txt");
    let made = json(&["import", &model, "-o", &path(&folder, "wrong")]);
    let mistakes = made["mistakes"].as_array().expect("a list");
    assert!(mistakes.iter().any(|own| own["kind"] == "inverse-rotation"), "{mistakes:?}");
}

/// Files of other programs of which nothing is wrong.
#[test]
fn right_samples_show_no_mistake() {
    let Some(samples) = beside::shared("data/interop") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let all: [(&str, &str, &[&str]); 8] = [
        ("colmap", "colmap-maupertuis", &[]),
        ("opensfm", "opensfm-berlin-v1", &[]),
        ("opensfm", "opensfm-berlin-v2", &[]),
        ("metashape", "metashape-sxb/sxb.psz", &[]),
        ("micmac", "micmac-saisies", &["--approximate"]),
        ("bundler", "bal-bundler/Balbianello.out", &[]),
        ("bal", "bal-bundler/dubrovnik-3-7-pre.txt", &[]),
        ("photomodeler", "photomodeler/camcal-pmexport.txt", &["--approximate"]),
    ];
    for (k, (format, name, options)) in all.into_iter().enumerate() {
        let (from, to) = (samples.join(name), path(&folder, &k.to_string()));
        let arguments = [&["import", format, from.to_str().expect("UTF-8"), "-o", &to], options].concat();
        let made = json(&arguments);
        assert_eq!(made["mistakes"], serde_json::json!([]), "{name}");
    }
}
