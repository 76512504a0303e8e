//! `adjust` as scripts see it: the run folder, its keys, its exit codes.

mod compared;
mod handed_on;
mod hard;
mod national;

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Number of check points: enough for statistics, few enough to be quick.
const CHECKS: &str = "check=200";
/// Number of tie points, likewise.
const TIES: &str = "points=2000";

struct Scene {
    folder: tempfile::TempDir,
}

impl Scene {
    /// A small `dike` with noise.
    fn new() -> Self {
        let scene = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        let block = scene.path("block");
        let (code, stderr) =
            scene.run(&["simulate", "dike", "-o", &block, "--noise-px", "0.3", "--set", CHECKS, "--set", TIES]);
        assert_eq!(code, 0, "{stderr}");
        scene
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().expect("UTF-8").to_string()
    }

    /// Exit code and standard error.
    fn run(&self, arguments: &[&str]) -> (i32, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
            .arg("--quiet")
            .args(arguments)
            .output()
            .expect("the program runs");
        (output.status.code().expect("not killed"), String::from_utf8(output.stderr).expect("UTF-8"))
    }

    /// Adjusts the block into the folder `name`.
    fn adjust(&self, name: &str, options: &[&str]) -> PathBuf {
        let (code, stderr) = self.run(&[&["adjust", &self.path("block"), "-o", &self.path(name)], options].concat());
        assert_eq!((code, stderr.as_str()), (0, ""));
        self.folder.path().join(name)
    }
}

fn summary(run: &Path) -> Value {
    let text = fs::read_to_string(run.join("summary.json")).expect("a summary");
    serde_json::from_str(&text).expect("JSON")
}

/// `summary.json` without what differs from run to run: times, and the last digits of what Ceres says of itself, whose
/// threads add up in no fixed order. Every result is the native solver's.
fn reproducible(run: &Path) -> Value {
    let mut summary = summary(run);
    let take =
        |value: &mut Value, key: &str| drop(value.as_object_mut().expect("an object").remove(key).expect("the key"));
    take(&mut summary["solvers"]["native"], "seconds");
    take(&mut summary["solvers"], "ceres");
    take(&mut summary, "agreement");
    summary
}

/// Header and rows of a table.
fn table(run: &Path, name: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(run.join(name)).expect("a table");
    let header = reader.headers().expect("a header").iter().map(String::from).collect();
    let rows = reader.records().map(|row| row.expect("a row").iter().map(String::from).collect()).collect();
    (header, rows)
}

#[test]
fn a_run_folder_has_what_scripts_read() {
    let scene = Scene::new();
    let run = scene.adjust("run", &[]);
    let found = summary(&run);
    let keys: Vec<&String> = found.as_object().expect("an object").keys().collect();
    assert_eq!(
        keys,
        [
            "format",
            "block",
            "observations",
            "unknowns",
            "datum_defect",
            "redundancy",
            "sigma0",
            "tie_rms_px",
            "solvers",
            "solvers_built",
            "agreement",
            "cameras",
            "effects",
            "similarity",
            "control",
            "check",
            "mistakes",
            "rows"
        ]
    );
    let (residual_header, residuals) = table(&run, "residuals.csv");
    assert_eq!(residual_header, ["image", "point", "kind", "x", "y", "rx", "ry", "sigma"]);
    let ties: Vec<_> = residuals.iter().filter(|row| row[2] == "tie").collect();
    assert_eq!(found["observations"], 2 * ties.len());
    // Two thousand points with three coordinates, 113 poses, twelve camera parameters.
    assert_eq!(found["unknowns"], 3 * 2000 + 6 * 113 + 12);
    assert_eq!(found["datum_defect"], 7);
    let redundancy = found["redundancy"].as_f64().expect("a number");
    assert_eq!(redundancy, (2 * ties.len()) as f64 - (3 * 2000 + 6 * 113 + 12) as f64 + 7.0);

    // Both figures follow from the table of residuals.
    let number = |row: &[String], k: usize| row[k].parse::<f64>().expect("a number");
    let sum: f64 = ties.iter().map(|row| number(row, 5).powi(2) + number(row, 6).powi(2)).sum();
    let rms = (sum / (2.0 * ties.len() as f64)).sqrt();
    let sigma0 = (sum / 0.3f64.powi(2) / redundancy).sqrt();
    assert!((found["tie_rms_px"].as_f64().expect("a number") / rms - 1.0).abs() < 1e-12);
    assert!((found["sigma0"].as_f64().expect("a number") / sigma0 - 1.0).abs() < 1e-9);

    let (check_header, checks) = table(&run, "checks.csv");
    assert_eq!(check_header[..5], ["point", "role", "dx", "dy", "dz"]);
    let of_check: Vec<_> = checks.iter().filter(|row| row[1] == "check").collect();
    assert_eq!(found["check"]["n"], of_check.len());
    let sum: f64 = of_check.iter().map(|row| (2..5).map(|k| number(row, k).powi(2)).sum::<f64>()).sum();
    let rms = (sum / of_check.len() as f64).sqrt();
    assert!((found["check"]["rms_m"]["xyz"].as_f64().expect("a number") / rms - 1.0).abs() < 1e-12);

    let (image_header, images) = table(&run, "images.csv");
    assert_eq!(images.len(), 113);
    for column in ["x", "qw", "sigma_w1", "sigma_cx", "sigma_cy", "sigma_cz"] {
        assert!(image_header.iter().any(|name| name == column), "{column}");
    }
    let (_, points) = table(&run, "points.csv");
    assert_eq!(points.len(), 2000);
    assert!(points.iter().all(|row| (4..7).all(|k| number(row, k) > 0.0)));
}

#[test]
fn the_model_of_a_run_repeats_it() {
    let scene = Scene::new();
    let first =
        scene.adjust("first", &["--tie", "dc=pp", "--fix", "affinity,k3", "--add", "focal-time:a=1", "--datum", "all"]);
    let model = first.join("model.toml");
    let second = scene.adjust("second", &["--model", model.to_str().expect("UTF-8"), "--threads", "1"]);
    assert_eq!(reproducible(&first), reproducible(&second));
    for file in ["model.toml", "images.csv", "points.csv", "residuals.csv", "checks.csv"] {
        assert!(fs::read(first.join(file)).expect(file) == fs::read(second.join(file)).expect(file), "{file} differs");
    }
    let found = summary(&first);
    assert_eq!(found["agreement"]["agree"], true);
    assert_eq!(found["datum_defect"], 0);
    assert_eq!(found["effects"]["focal-time"]["a"]["unit"], "px");
    let camera = &found["cameras"]["cam"];
    assert_eq!((&camera["dcx"]["value"], &camera["dcx"]["sigma"]), (&camera["ppx"]["value"], &camera["ppx"]["sigma"]));
    assert_eq!((&camera["b1"]["free"], &camera["b1"]["sigma"]), (&false.into(), &0.0.into()));
    assert_eq!((&camera["f"]["free"], &camera["dcx"]["free"]), (&true.into(), &false.into()));
}

#[test]
fn failures_have_their_codes() {
    let scene = Scene::new();
    let block = scene.path("block");
    let run = scene.path("run");
    for (options, code, message) in [
        (&["--add", "nonsense"][..], 2, "unknown effect `nonsense`"),
        (&["--free", "f,q"], 2, "--free q: no such parameter"),
        (&["--model", "none.toml"], 2, "none.toml"),
        (&["--datum", "nowhere"], 2, "invalid value 'nowhere'"),
        // Without distortion its centre has no effect: b1, b2, k and p are held at zero below.
        (&["--fix", "radial,decentring,affinity", "--model", &scene.path("flat.toml")], 3, "dcx"),
    ] {
        fs::write(
            scene.path("flat.toml"),
            "format = 1\n[camera.cam]\nk1 = 0.0\nk2 = 0.0\nk3 = 0.0\np1 = 0.0\np2 = 0.0\nb1 = 0.0\nb2 = 0.0\n",
        )
        .expect("written");
        let (found, stderr) = scene.run(&[&["adjust", &block, "-o", &run], options].concat());
        assert_eq!(found, code, "{options:?}: {stderr}");
        assert!(stderr.contains(message), "{options:?}: {stderr}");
        assert!(!Path::new(&run).exists(), "{options:?} left something behind");
    }
}

#[test]
fn the_page_has_its_sections_and_is_the_same_from_the_folder() {
    let scene = Scene::new();
    let run = scene.adjust("run", &[]);
    let page = || fs::read_to_string(run.join("report.html")).expect("a page");
    let first = page();
    let sections = [
        "Adjustment",
        "Camera and effects",
        "Residuals over the sensor",
        "Residuals of images",
        "Flights and points",
        "Coverage and precision",
    ];
    for section in sections.into_iter().chain(["Control and check points", "What agreement cannot prove"]) {
        assert!(first.contains(section), "{section}");
    }
    let pictures = fs::read_dir(run.join("figures")).expect("pictures").count();
    assert_eq!(
        pictures, 18,
        "sensor, images, histogram, flights, three of check points, two of control points, which are few, four of \
         GNSS, three of coverage and precision, uncertainty and correlations of the camera"
    );
    assert_eq!((first.matches("<svg").count(), first.matches("</svg>").count()), (pictures, pictures));
    assert!(!first.contains("no data"));
    fs::remove_file(run.join("report.html")).expect("removed");
    assert_eq!(scene.run(&["report", run.to_str().expect("UTF-8")]).0, 0);
    assert!(page() == first, "the page differs when it is made again from the folder");
    fs::remove_file(run.join("residuals.csv")).expect("removed");
    let (code, stderr) = scene.run(&["report", run.to_str().expect("UTF-8")]);
    assert!(code != 0 && stderr.contains("residuals.csv"), "{stderr}");
}

#[test]
fn a_folder_of_another_version_or_without_its_rows_has_no_report() {
    let scene = Scene::new();
    let run = scene.adjust("run", &["--solver", "native"]);
    let refused = |file: &str, content: &str, expected: &str| {
        let path = run.join(file);
        let before = fs::read_to_string(&path).expect("a file of the run");
        fs::write(&path, content).expect("written");
        let (code, stderr) = scene.run(&["report", run.to_str().expect("UTF-8")]);
        assert_eq!(code, 2, "{file}: {stderr}");
        assert!(stderr.contains(&format!("{file}{expected}")), "{file}: {stderr}");
        fs::write(&path, before).expect("written");
    };
    let read = |file: &str| fs::read_to_string(run.join(file)).expect("a file of the run");
    let summary = read("summary.json");
    let newer = summary.replacen("\"format\": 1", "\"format\": 2", 1);
    assert_ne!(newer, summary);
    refused("summary.json", &newer, ": \"format\": 2, expected \"format\": 1");
    refused("summary.json", "{}", ": no \"format\", expected \"format\": 1");
    for file in ["images.csv", "residuals.csv", "checks.csv", "sensor.csv"] {
        let table = read(file);
        let header = table.lines().next().expect("a header");
        refused(file, "", ":1: the file is empty, expected a header with the columns ");
        refused(
            file,
            &format!("{header}\n"),
            ": the table has no rows, expected some, as summary.json has results of them",
        );
        let (_, rest) = header.split_once(',').expect("columns");
        refused(file, &format!("else,{rest}\n"), ":1: column ");
    }
    fs::write(run.join("diagnosis.json"), "{\"format\": 2}").expect("written");
    refused("diagnosis.json", "{\"format\": 2}", ": \"format\": 2, expected \"format\": 1");
    fs::remove_file(run.join("diagnosis.json")).expect("removed");
    assert_eq!(scene.run(&["report", run.to_str().expect("UTF-8")]).0, 0, "the run as it was");
}

#[test]
fn an_effect_with_one_derivation_is_named_wherever_the_solvers_agree() {
    let scene = Scene::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let header = fs::read_to_string(root.join("cpp/effects/focal-time.h")).expect("a header");
    fs::write(scene.path("my-drift.h"), header.replace("\"focal-time\"", "\"my-drift\"")).expect("written");
    let library = scene.path("my-drift.so");
    let compiled = Command::new("c++")
        .args(["-std=c++17", "-O1", "-fPIC", "-shared", "-fvisibility=hidden", "-DMISCLOSURE_PLUGIN", "-I"])
        .arg(root.join("cpp"))
        .args(["-I", "/usr/include/eigen3", "-x", "c++", &scene.path("my-drift.h"), "-o", &library])
        .status()
        .expect("a C++ compiler, which the build needs too");
    assert!(compiled.success());
    let options = ["--plugin", &library, "--add", "my-drift", "--datum", "all"];
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args([&["--quiet", "adjust", &scene.path("block"), "-o", &scene.path("run")], &options[..]].concat())
        .output()
        .expect("the program runs");
    let text = String::from_utf8(output.stdout).expect("UTF-8").replace('\n', " ");
    let run = scene.folder.path().join("run");
    let found = &summary(&run)["agreement"];
    assert_eq!((&found["agree"], &found["polished"]), (&true.into(), &false.into()), "{found}");
    assert_eq!(found["one_derivation"], serde_json::json!(["my-drift"]));
    let sentence = "one derivation: solvers not independent here (my-drift)";
    assert!(text.contains(sentence), "{text}");
    assert!(fs::read_to_string(run.join("report.html")).expect("a page").contains(sentence));
}

#[test]
fn a_run_that_fails_leaves_the_older_one_as_it_was() {
    let scene = Scene::new();
    let run = scene.adjust("run", &["--solver", "native"]);
    let read = |name: &str| fs::read(run.join(name)).expect("a file of the run");
    // A folder in the place of one of its files goes with the older run: the new one takes the place of the whole.
    fs::remove_file(run.join("points.csv")).expect("a file of the run");
    fs::create_dir(run.join("points.csv")).expect("a folder in its place");
    scene.adjust("run", &["--solver", "native"]);
    assert!(run.join("points.csv").is_file() && run.join("summary.json").is_file());
    let before = ["summary.json", "residuals.csv", "report.html"].map(read);
    let (code, stderr) =
        scene.run(&["adjust", &scene.path("block"), "-o", &scene.path("run"), "--datum", "gnss", "--add", "nothing"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(before == ["summary.json", "residuals.csv", "report.html"].map(read), "the older run is as it was");
    assert!(
        fs::read_dir(&run)
            .expect("a folder")
            .all(|entry| { !entry.expect("an entry").file_name().to_string_lossy().starts_with('.') })
    );
}

#[test]
fn the_model_of_an_improvement_repeats_it_without_its_outliers() {
    let scene = Scene::new();
    let block = scene.path("block");
    let ties = Path::new(&block).join("ties.csv");
    let text = fs::read_to_string(&ties).expect("measurements");
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    // A hand that slipped: 60 px.
    let mut cells: Vec<String> = lines[100].split(',').map(str::to_string).collect();
    cells[2] = format!("{}", cells[2].parse::<f64>().expect("a coordinate") + 60.0);
    let slipped = format!("{},{},tie,", cells[0], cells[1]);
    lines[100] = cells.join(",");
    fs::write(&ties, lines.join("\n") + "\n").expect("measurements");

    let (code, stderr) = scene.run(&["improve", &block, "-o", &scene.path("improved")]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let improved = scene.folder.path().join("improved");
    let outliers = fs::read_to_string(improved.join("outliers.csv")).expect("outliers");
    assert!(outliers.starts_with("image,point,kind,reason\n"), "{outliers}");
    assert!(outliers.lines().any(|line| line.starts_with(&slipped)), "{slipped}: {outliers}");

    let model = improved.join("model.toml");
    let again = scene.adjust("again", &["--model", model.to_str().expect("UTF-8")]);
    // The improvement ended where its diagnosis did, the adjustment begins at the block's approximations: the same to
    // what a fit leaves open, a ten-thousandth of a standard deviation.
    let [one, other] = [&improved, &again].map(|run| summary(run));
    for key in ["observations", "unknowns", "redundancy", "datum", "effects"] {
        assert_eq!(one[key], other[key], "{key}");
    }
    let figure = |of: &Value, path: &str| of.pointer(path).and_then(Value::as_f64).expect("a number");
    for path in ["/sigma0", "/tie_rms_px", "/check/rms_m/xyz", "/control/rms_m/xyz"] {
        let [one, other] = [&one, &other].map(|of| figure(of, path));
        assert!((one - other).abs() < 1e-6 * one, "{path}: {one} {other}");
    }
    for (name, own) in one["cameras"]["cam"].as_object().expect("a camera") {
        let same = &other["cameras"]["cam"][name];
        let moved = (figure(own, "/value") - figure(same, "/value")).abs() / figure(own, "/sigma");
        assert!(moved < 1e-4, "{name}: {moved} sigma");
    }
    assert_eq!(outliers, fs::read_to_string(again.join("outliers.csv")).expect("outliers"));
}
