//! `misclosure validate` as scripts see it.

use misclosure::block::Block;
use misclosure::io::block::{read_block, write_block};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Runs the program and gives exit code, standard output as JSON, and standard error.
fn misclosure(arguments: &[&str]) -> (i32, Value, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_misclosure"))
        .args(arguments)
        .arg("--json")
        .output()
        .expect("the program runs");
    let code = output.status.code().expect("not killed");
    let json = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (code, json, String::from_utf8(output.stderr).expect("UTF-8"))
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn digits(json: &Value, problem: &str) -> f64 {
    let results = json["results"].as_array().expect("results");
    let found = results.iter().find(|result| result["problem"] == problem);
    found.and_then(|result| result["score"]["digits"].as_f64()).unwrap_or_else(|| panic!("{problem}: {json}"))
}

/// Writes the block of a problem with its solution as `misclosure adjust` finds it.
fn solved(suite: &Path, results: &Path, problem: &str) -> Block {
    let (own, run) = (suite.join(problem), results.join(format!("run-{problem}")));
    let (block, model) = (own.join("block"), own.join("model.toml"));
    let (code, _, error) =
        misclosure(&["adjust", text(&block), "-o", text(&run), "--model", text(&model), "--outliers", "none"]);
    assert_eq!(code, 0, "{error}");
    let measured = read_block(&block).expect("a block").block;
    misclosure::run::folder::Adjusted::read(measured, &run).expect("a run").block
}

#[test]
fn results_are_judged_and_a_damaged_one_is_caught() {
    let folder = tempfile::tempdir().expect("a folder");
    let (suite, results) = (folder.path().join("suite"), folder.path().join("results"));
    let (code, list, error) =
        misclosure(&["validate", "--suite", text(&suite), "radial-f-k1-k2", "crowd", "area-control"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(list["problems"].as_array().map(Vec::len), Some(3));
    for (problem, expected) in
        [("radial-f-k1-k2", ["colmap"].as_slice()), ("crowd", &["colmap", "bal"]), ("area-control", &[])]
    {
        for format in ["colmap", "bal"] {
            assert_eq!(suite.join(problem).join(format).is_dir(), expected.contains(&format), "{problem} as {format}");
        }
    }
    std::fs::create_dir(&results).expect("a folder");
    let whole: Vec<(&str, Block)> =
        ["radial-f-k1-k2", "area-control"].map(|name| (name, solved(&suite, &results, name))).into();
    let judged = |name: &str, change: &dyn Fn(&mut Block)| {
        let at = results.join(name);
        let mut block = whole.iter().find(|(other, _)| *other == name).expect("solved").1.clone();
        change(&mut block);
        let _ = std::fs::remove_dir_all(&at);
        write_block(&block, &at).expect("written");
        misclosure(&["validate", "--judge", text(&results), name])
    };
    for (name, _) in &whole {
        // The tolerance of a usual adjustment leaves fewer digits than a validated one.
        let (code, json, error) = judged(name, &|_| {});
        assert!(digits(&json, name) > 3.0, "{json}");
        assert_eq!(code == 0, json["passed"] == true, "{error}");
        // A point, a pose and a focal length, each by some hundredths of its sigma; nothing is too small to be seen.
        let damages: [&dyn Fn(&mut Block); 3] = [
            &|block| block.tie_points[41].position.as_mut().expect("adjusted").z += 1e-3,
            &|block| block.images[3].pose.centre.x += 1e-3,
            &|block| block.cameras[0].interior[0] += 0.1,
        ];
        for damage in damages {
            let (code, json, error) = judged(name, damage);
            assert_eq!(code, 4, "{error}");
            assert!(digits(&json, name) < 1.0, "{json}");
            assert!(error.contains(name), "{error}");
        }
    }
    // The similarity of a free datum is taken out, that of an observed one is an error of the result.
    for (name, _) in &whole {
        let (_, json, _) = judged(name, &|block| {
            block.tie_points.iter_mut().for_each(|point| point.position = point.position.map(|at| at * 1.5));
            block.images.iter_mut().for_each(|image| image.pose.centre *= 1.5);
        });
        assert_eq!(digits(&json, name) > 3.0, *name == "radial-f-k1-k2", "{json}");
    }
}

#[test]
fn a_run_folder_is_judged_with_its_standard_deviations() {
    let folder = tempfile::tempdir().expect("a folder");
    let (suite, results) = (folder.path().join("suite"), folder.path().join("results"));
    let (code, _, error) = misclosure(&["validate", "--suite", text(&suite), "focal-time"]);
    assert_eq!(code, 0, "{error}");
    let (own, run) = (suite.join("focal-time"), results.join("focal-time"));
    std::fs::create_dir(&results).expect("a folder");
    let (block, model) = (own.join("block"), own.join("model.toml"));
    let (code, _, error) =
        misclosure(&["adjust", text(&block), "-o", text(&run), "--model", text(&model), "--outliers", "none"]);
    assert_eq!(code, 0, "{error}");
    let judged = || misclosure(&["validate", "--judge", text(&results), "focal-time", "--digits", "3"]);
    let sigma = |json: &Value| json["results"][0]["score"]["sigma"].as_f64().expect("standard deviations");
    let (code, json, error) = judged();
    assert_eq!(code, 0, "{error}");
    assert!(sigma(&json) < 1e-3, "{json}");
    // One standard deviation of an effect's parameter too small by a tenth.
    let path = run.join("summary.json");
    let mut summary: Value = serde_json::from_slice(&std::fs::read(&path).expect("a summary")).expect("JSON");
    let parameters = summary["effects"]["focal-time"].as_object_mut().expect("parameters");
    let parameter = parameters.values_mut().next().expect("a parameter");
    parameter["sigma"] = (0.9 * parameter["sigma"].as_f64().expect("a sigma")).into();
    std::fs::write(&path, summary.to_string()).expect("written");
    let (code, json, _) = judged();
    assert_eq!(code, 4, "{json}");
    assert!((sigma(&json) - 0.1).abs() < 1e-3, "{json}");
}

#[test]
fn what_is_not_there_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let empty = text(folder.path());
    for (arguments, expected) in [
        (vec!["validate", "no-such-problem"], "no problem `no-such-problem`"),
        (vec!["validate", "--judge", empty], "no results"),
        (vec!["validate", "--judge", empty, "pair"], "no result of `pair`"),
        (vec!["validate", "--judge", "no/such/folder"], "no such folder"),
        (vec!["validate", "--nist", empty], "Misra1a.dat"),
        (vec!["validate", "--digits", "17", "pair"], "expected 0 to 16"),
    ] {
        let (code, json, error) = misclosure(&arguments);
        assert_eq!((code, json), (2, Value::Null), "{arguments:?}: {error}");
        assert!(error.contains(expected), "{arguments:?}: {error}");
    }
}

#[test]
fn our_solvers_are_scored_and_a_null_space_is_named() {
    let (code, json, error) = misclosure(&["validate", "pair", "no-distortion"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!((&json["passed"], json["results"].as_array().map(Vec::len)), (&Value::Bool(true), Some(4)));
    assert!(digits(&json, "pair") >= 6.0);
    assert_eq!(json["results"][2]["null_dimension"], 2);
    // More digits than doubles can have is more than there is.
    let (code, ..) = misclosure(&["validate", "pair", "--digits", "16"]);
    assert_eq!(code, 4);
}
