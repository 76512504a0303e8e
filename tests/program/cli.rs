//! The program as scripts see it: exit codes, what goes to which stream, keys.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program and gives exit code, standard output and standard error.
fn misclosure(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure")).args(arguments).output().expect("the program runs");
    let Output { status, stdout, stderr } = output;
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (status.code().expect("not killed"), text(stdout), text(stderr))
}

fn json(arguments: &[&str]) -> serde_json::Value {
    let (code, stdout, stderr) = misclosure(arguments);
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&stdout).expect("JSON and nothing else on standard output")
}

/// Bytes of every file below a folder, by relative path.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            found.extend(contents(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            found.insert(name, fs::read(&path).expect("a readable file"));
        }
    }
    found
}

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().expect("UTF-8").to_string()
}

#[test]
fn bad_usage_ends_with_2_and_help_with_0() {
    for arguments in [
        &[][..],
        &["bogus"],
        &["effects", "--bogus"],
        &["check"],
        &["effects", "nonsense"],
        &["--threads", "0", "effects"],
    ] {
        let (code, stdout, stderr) = misclosure(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(!stderr.is_empty(), "{arguments:?}");
    }
    let (code, stdout, _) = misclosure(&["--help"]);
    assert_eq!(code, 0);
    assert!(stdout.contains("Exit codes:\n  0  done\n"), "{stdout}");
}

#[test]
fn the_version_names_the_solvers_of_the_build() {
    let names: Vec<&str> = misclosure::adjust::BUILT.iter().map(|solver| solver.name()).collect();
    let alone = if names.len() == 1 { " (this build has no Ceres)" } else { "" };
    let expected = format!("misclosure {}\nsolvers: {}{alone}\n", env!("CARGO_PKG_VERSION"), names.join(", "));
    assert_eq!(misclosure(&["--version"]), (0, expected, String::new()));
}

/// What the list offers, the build reads; a build that lacks it says so.
#[test]
fn the_list_of_formats_is_that_of_the_build() {
    let (code, list, _) = misclosure(&["import", "--list"]);
    assert_eq!(code, 0);
    let lacks = "not in this build";
    assert_eq!(list.contains(lacks), !cfg!(feature = "database"), "{list}");
    let manifest = include_str!("../../Cargo.toml");
    let default = manifest.lines().find(|line| line.starts_with("default = ")).expect("default features");
    assert!(default.contains("\"database\""), "{default}");
}

/// A script that asks for two solvers must not get the result of one.
#[cfg(not(feature = "ceres"))]
#[test]
fn a_solver_that_the_build_lacks_is_refused() {
    for solver in ["both", "ceres"] {
        let (code, stdout, stderr) = misclosure(&["adjust", "block", "-o", "run", "--solver", solver]);
        assert_eq!((code, stdout.as_str()), (2, ""));
        let why = "this build has the native solver alone; build it with Cargo's feature ceres";
        assert!(stderr.contains(why), "{stderr}");
    }
}

#[test]
fn completions_are_scripts_that_name_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let (code, script, stderr) = misclosure(&["completions", shell]);
        assert_eq!((code, stderr.as_str()), (0, ""), "{shell}");
        assert!(script.contains("improve") && script.contains("tolerance-mm"), "{shell}");
    }
    assert_eq!(json(&["--json", "completions", "bash"])["script"], misclosure(&["completions", "bash"]).1);
}

#[test]
fn an_error_is_one_line_per_cause_on_standard_error() {
    let (code, stdout, stderr) = misclosure(&["check", "no/such/folder"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    assert!(stderr.starts_with("error: no/such/folder: this is not a folder"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
}

#[test]
fn every_effect_has_a_page() {
    let catalogue = json(&["effects", "--json"]);
    let effects = catalogue["effects"].as_array().expect("a list");
    assert!(!effects.is_empty());
    for effect in effects {
        let id = effect["id"].as_str().expect("an id");
        let (code, page, _) = misclosure(&["effects", id]);
        assert_eq!(code, 0);
        for parameter in effect["parameters"].as_array().expect("a list") {
            let name = parameter["name"].as_str().expect("a name");
            assert!(page.lines().any(|line| line.split_whitespace().next() == Some(name)), "{id}: {name}\n{page}");
        }
        for heading in ["What happens", "Formula", "Needs", "Confused with", "Source"] {
            assert!(page.lines().any(|line| line.starts_with(heading)), "{id}: {heading}");
        }
    }
}

#[test]
fn whoever_stops_reading_causes_no_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .arg("effects")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
}

#[test]
fn simulate_gives_the_same_bytes_whatever_the_number_of_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let simulate = |name: &str, more: &[&str]| {
        let output = path(&folder, name);
        let (code, _, stderr) = misclosure(&[&["simulate", "dike", "-o", &output, "--noise-px", "0.3"], more].concat());
        assert_eq!(code, 0, "{stderr}");
        contents(Path::new(&output))
    };
    let one = simulate("one", &["--threads", "1"]);
    assert!(one.contains_key("truth/images.csv"));
    assert!(one == simulate("two", &["--threads", "2"]), "threads change the block");
    assert!(one != simulate("three", &["--seed", "2"]), "the seed changes nothing");
}

#[test]
fn check_counts_what_simulate_made() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = path(&folder, "dike");
    let made = json(&["simulate", "dike", "-o", &output, "--json", "--quiet"]);
    let found = json(&["check", &output, "--json"]);
    assert_eq!(found["images"], 113);
    assert_eq!(found["images"], made["images"]);
    assert_eq!(found["ties"]["points"], made["tie_points"]);
    assert_eq!(found["ties"]["measurements"], made["tie_measurements"]);
    assert_eq!(found["multiplicity"], made["multiplicity"]);
    let flights: Vec<u64> =
        found["flights"].as_array().expect("a list").iter().filter_map(|f| f["images"].as_u64()).collect();
    assert_eq!(flights, [44, 42, 12, 15]);
    assert_eq!((&found["control"]["points"], &found["check"]["points"]), (&10.into(), &5000.into()));
    // The truth is a block as well.
    assert_eq!(json(&["check", &format!("{output}/truth"), "--json"])["images"], 113);
}

#[test]
fn simulate_names_what_is_wrong() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = path(&folder, "x");
    for (arguments, message) in [
        (
            &["dyke"][..],
            "error: `dyke` is neither a preset (dike, corridor, mapping, closerange) nor a scenario's file",
        ),
        (&["none.toml"], "error: cannot read the scenario none.toml"),
        (&["dike", "--set", "length"], "error: --set length: expected KEY=NUMBER"),
        (&["dike", "--set", "width_of_sea=1"], "error: dike has no parameter \"width_of_sea\": expected one of"),
        (&["dike", "--noise-px", "-1"], "error: noise_px = -1: expected at least 0"),
        (&["--from", "nowhere"], "error: nowhere: this is not a folder"),
    ] {
        let (code, _, stderr) = misclosure(&[&["simulate", "--quiet", "-o", &output], arguments].concat());
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.starts_with(message), "{stderr}");
        assert!(!Path::new(&output).exists(), "{arguments:?} left something behind");
    }
}

#[test]
fn goals_and_additions_that_are_none_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let extra = path(&folder, "extra.toml");
    let plan = |more: &[&str]| {
        let dike = ["plan", "--quiet", "dike", "--set", "points=400", "--set", "check=10"];
        let (code, _, stderr) = misclosure(&[&dike, more].concat());
        assert_eq!(code, 2, "{more:?}: {stderr}");
        stderr
    };
    assert!(plan(&["--goal", "height"]).starts_with("error: --goal `height` is no goal."));
    assert!(plan(&["--goal", "sagging 1 px"]).contains("there is no effect `sagging`"));
    assert!(plan(&["--mistake", "height"]).contains("no such mistake"));
    assert!(plan(&["--goal", "notice exchanged 3 m"]).contains("it has no size"));
    assert!(plan(&["--extra", &extra]).contains("--goal"));
    let with = ["--goal", "height 1 mm", "--extra", &extra];
    assert!(plan(&with).contains("cannot read the additions"));
    fs::write(&extra, "[[extra]]\nname = \"odd\"\ncost = 1\nsurveyed.control.count = -3\n").expect("written");
    assert!(plan(&with).contains("with odd: "));
    fs::write(&extra, "[[extra]]\nname = \"odd\"\n").expect("written");
    assert!(plan(&with).contains("extra `odd`: expected cost = a number above 0"));
}

#[test]
fn a_planned_mission_takes_the_place_of_the_flights() {
    let mission = concat!(env!("CARGO_MANIFEST_DIR"), "/data/missions/dike.plan");
    let dike = ["plan", "dike", "--set", "points=400", "--set", "check=10", "--mission", mission];
    // Two strips of 300 m with an image every 15 m.
    let plan = json(&[&dike[..], &["--json"]].concat());
    assert_eq!(plan["images"], 2 * (300 / 15 + 1));
    assert_eq!(plan["mission"]["images"], plan["images"]);
    let (code, _, stderr) = misclosure(&dike);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("dike.plan: The mission says no heading of 42 of 42 images: that of the path."),
        "{stderr}"
    );
    let extra = concat!(env!("CARGO_MANIFEST_DIR"), "/data/extras/dike.toml");
    let goal = json(&[&dike[..], &["--json", "--goal", "height 1 mm", "--extra", extra]].concat());
    assert!(goal["goals"]["steps"].as_array().is_some_and(|steps| steps.len() > 1), "{}", goal["goals"]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let block = path(&folder, "block");
    let simulated = json(&["simulate", "dike", "--set", "points=400", "--mission", mission, "-o", &block, "--json"]);
    assert_eq!(simulated["images"], 42);
    assert_eq!(simulated["flights"][0]["strips"], 2);
    let none = path(&folder, "none.plan");
    fs::write(&none, "{\"fileType\": \"Plan\",\n \"mission\": }").expect("written");
    for (arguments, expected) in [
        (["plan", &block, "--mission", mission], "is a block; a mission takes the place of a scenario's flights"),
        (["plan", "dike", "--mission", &none], "none.plan:2:13: not JSON"),
        (["plan", "dike", "--mission", "no.plan"], "cannot read the mission no.plan"),
        (["plan", "closerange", "--mission", mission], "expected a scenario whose terrain is a plain or a dike"),
    ] {
        let (code, stdout, stderr) = misclosure(&arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert!(stderr.contains(expected), "{stderr}");
    }
}

#[test]
fn inject_changes_the_measurements_and_keeps_the_truth() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (clean, bad) = (path(&folder, "clean"), path(&folder, "bad"));
    json(&["simulate", "dike", "-o", &clean, "--json"]);
    let report = json(&["inject", &clean, "-o", &bad, "--error", "noise:px=0.5", "--json"]);
    let rms = report["change_rms_px"].as_f64().expect("a number");
    // 165 000 measurements of 0.5 px: their RMS is known to 0.2 %.
    assert!((rms - 0.5).abs() < 0.005, "{rms}");
    let (clean, bad) = (contents(Path::new(&clean)), contents(Path::new(&bad)));
    assert!(clean["ties.csv"] != bad["ties.csv"]);
    assert!(clean["truth/ties.csv"] == bad["truth/ties.csv"]);
    assert!(bad.contains_key("truth/errors.json"));
    for (arguments, message) in [
        (&["--error", "nose"][..], "error: no error is called `nose`; nearest: noise"),
        (&["--error", "noise:x=1"], "error: error `noise`: no parameter `x`"),
        (&[][..], "error: the following required arguments were not provided"),
    ] {
        let here = path(&folder, "clean");
        let (code, _, stderr) = misclosure(&[&["inject", &here, "-o", &path(&folder, "x")], arguments].concat());
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.starts_with(message), "{stderr}");
    }
    let (code, _, stderr) = misclosure(&["inject", &path(&folder, "bad/truth"), "-o", "x", "--error", "noise"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("has no truth/"), "{stderr}");
}

#[test]
fn inject_follows_a_recipe() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let recipe = concat!(env!("CARGO_MANIFEST_DIR"), "/data/hidden/received-2.toml");
    let received = concat!(env!("CARGO_MANIFEST_DIR"), "/data/hidden/received-2");
    let report = json(&["inject", recipe, "-o", &path(&folder, "block"), "--json"]);
    let errors = report["errors"].as_array().expect("a list");
    assert!(errors.iter().any(|error| error["error"] == "unflatness"), "{report}");
    let (made, received) = (contents(&folder.path().join("block")), contents(Path::new(received)));
    assert!(made["ties.csv"] == received["ties.csv"]);
    assert!(made.contains_key("truth/errors.json"));
    let (code, _, stderr) = misclosure(&["inject", recipe, "-o", &path(&folder, "x"), "--seed", "7"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("a recipe has its own seed, errors and mistakes"), "{stderr}");
}

#[test]
fn no_command_writes_over_measurements() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let block = path(&folder, "site/block");
    fs::create_dir(folder.path().join("site")).expect("a folder");
    json(&["simulate", "closerange", "-o", &block, "--set", "points=60", "--json"]);
    std::os::unix::fs::symlink(&block, folder.path().join("link")).expect("a link");
    let before = contents(folder.path());
    let commands: [&[&str]; 7] = [
        &["simulate", "closerange"],
        &["simulate", "--from", &block],
        &["inject", &block, "--error", "noise"],
        &["adjust", &block],
        &["diagnose", &block],
        &["improve", &block],
        &["reproduce", "calibration-error"],
    ];
    let aliases = ["site/block", "site/block/", "link", "site/../link", "new/../site/block", "link/truth", "link/run"];
    for command in commands {
        for alias in aliases {
            let (code, _, stderr) = misclosure(&[command, &["-o", &path(&folder, alias), "--quiet"]].concat());
            assert_eq!(code, 2, "{command:?} -o {alias}: {stderr}");
            assert!(stderr.contains("the block") || stderr.contains("a block"), "{command:?} -o {alias}: {stderr}");
        }
        assert!(before == contents(folder.path()), "{command:?} changed the block");
    }
    // What holds the block is no place either, for those that read it.
    for command in &commands[1..6] {
        let (code, _, stderr) = misclosure(&[command, &["-o", &path(&folder, "site"), "--quiet"][..]].concat());
        assert_eq!(code, 2, "{command:?}: {stderr}");
    }
    assert!(before == contents(folder.path()), "the block changed");
}

#[test]
fn what_no_block_has_is_refused_or_shown_as_text() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let block = path(&folder, "block");
    json(&["simulate", "closerange", "-o", &block, "--set", "points=60", "--json"]);
    let refused = |arguments: &[&str], what: &str| {
        let (code, stdout, stderr) = misclosure(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
        assert!(stderr.contains(what), "{arguments:?}: {stderr}");
    };
    refused(&["--threads", "10000", "check", &block], "--threads 10000: this machine has");

    let control = Path::new(&block).join("control.csv");
    let text = fs::read_to_string(&control).expect("surveyed points");
    let line = text.lines().nth(1).expect("a point");
    let cells: Vec<&str> = line.split(',').collect();
    let far = line.replacen(cells[1], "1e308", 1);
    fs::write(&control, text.replacen(line, &far, 1)).expect("surveyed points");
    refused(&["check", &block], "control.csv:2: column x: \"1e308\" is no coordinate; expected at most 1e12 m");
    fs::write(&control, &text).expect("surveyed points");

    // Names of any length, and one that would clear a terminal.
    let images = fs::read_to_string(Path::new(&block).join("images.csv")).expect("images");
    let long = "x".repeat(70_000);
    let renamed = |name: &str| {
        let flight = images.lines().nth(1).expect("an image").split(',').nth(2).expect("a flight");
        let rows: Vec<String> =
            images.lines().map(|row| row.replace(&format!(",{flight},"), &format!(",{name},"))).collect();
        fs::write(Path::new(&block).join("images.csv"), rows.join("\n") + "\n").expect("images");
    };
    for name in [long.as_str(), "a\u{1b}[2Jb"] {
        renamed(name);
        let (code, stdout, stderr) = misclosure(&["check", &block]);
        assert_eq!(code, 0, "{stderr}");
        assert!(stdout.lines().all(|line| line.len() < 1000) && !stdout.contains('\u{1b}'), "{stdout}");
    }
    fs::write(Path::new(&block).join("images.csv"), &images).expect("images");

    let ties = Path::new(&block).join("ties.csv");
    fs::remove_file(&ties).expect("measurements");
    assert!(Command::new("mkfifo").arg(&ties).status().expect("mkfifo").success());
    refused(&["check", &block], "this is no regular file");
}
