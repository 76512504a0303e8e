//! Campaigns: every case once, whatever happens to the workers.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Tables of a gathered campaign.
const TABLES: [&str; 3] = ["results.csv", "candidates.csv", "estimates.csv"];

const GRID: &str = r#"
about = "twelve small blocks"
[case]
seed = "{seed}"
causes = ["rolling-shutter:readout={readout}"]
expected = ["rolling-shutter"]
scenario = { preset = "closerange", set = { points = 40 } }
noise = { px = 0.1, stated_px = 0.1 }
[factors]
seed = "1..6"
readout = [0.01, 0.02]
"#;

fn command(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_misclosure"));
    command.arg("--quiet").args(words);
    command
}

fn misclosure(words: &[&str]) -> (i32, String, String) {
    let output = command(words).output().expect("the program runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code().expect("not killed"), text(output.stdout), text(output.stderr))
}

fn done(words: &[&str]) -> String {
    let (code, stdout, stderr) = misclosure(words);
    assert_eq!(code, 0, "{words:?}: {stderr}");
    stdout
}

fn planned(folder: &Path, name: &str, grid: &str) -> String {
    let grid_file = folder.join(format!("{name}.toml"));
    fs::write(&grid_file, grid).expect("a file");
    let campaign = folder.join(name).to_str().expect("UTF-8").to_owned();
    done(&["campaign", "plan", grid_file.to_str().expect("UTF-8"), "-o", &campaign]);
    campaign
}

fn gathered(campaign: &str) -> Vec<Vec<u8>> {
    done(&["campaign", "gather", campaign]);
    TABLES.iter().map(|name| fs::read(Path::new(campaign).join(name)).expect("a table")).collect()
}

fn worker(campaign: &str) -> Child {
    let mut command = command(&["campaign", "run", campaign, "--jobs", "1", "--lease", "3"]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program runs")
}

#[test]
fn a_campaign_is_planned_worked_gathered_and_analysed() {
    let folder = tempfile::tempdir().expect("a folder");
    let campaign = planned(folder.path(), "c", GRID);
    let status: serde_json::Value =
        serde_json::from_str(&done(&["campaign", "status", &campaign, "--json"])).expect("JSON");
    assert_eq!((&status["cases"], &status["open"]), (&12.into(), &12.into()));
    // Two parts are the whole.
    done(&["campaign", "run", &campaign, "--shard", "1/2"]);
    let (_, text, _) = misclosure(&["campaign", "status", &campaign]);
    assert_eq!(text, "12 cases: 6 done, 0 given up, 0 taken, 6 open\n");
    done(&["campaign", "run", &campaign, "--shard", "2/2"]);
    let results = String::from_utf8(gathered(&campaign).swap_remove(0)).expect("UTF-8");
    let mut lines = results.lines();
    let header = lines.next().expect("a header");
    assert!(header.starts_with("id,readout,seed,state,reason,expected,verdict,named,mistakes,right,"), "{header}");
    let readouts: BTreeMap<&str, usize> = lines.fold(BTreeMap::new(), |mut counts, line| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells[3..6], ["done", "", "rolling-shutter"], "{line}");
        *counts.entry(cells[1]).or_default() += 1;
        counts
    });
    assert_eq!(readouts, [("0.01", 6), ("0.02", 6)].into());
    let text = done(&["campaign", "analyse", &campaign]);
    for caption in ["Cases\n", "Power: ", "Confusion\n", "Analysis of variance of check_rms_m_final over 12 cases\n"] {
        assert!(text.contains(caption), "{caption}: {text}");
    }
    let page = fs::read_to_string(Path::new(&campaign).join("analysis/report.html")).expect("a page");
    assert!(page.contains("twelve small blocks") && page.contains("<svg"));
    // Everything is done: nothing is worked again.
    assert_eq!(done(&["campaign", "run", &campaign]), "12 cases: 0 worked here, 0 given up\n");
}

/// Three workers, killed at random moments for some seconds, and two that end the rest.
#[test]
fn kills_lose_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let grid = GRID.replace("1..6", "1..10");
    let (whole, killed) = (planned(folder.path(), "whole", &grid), planned(folder.path(), "killed", &grid));
    done(&["campaign", "run", &whole]);
    let mut workers: Vec<Child> = (0..3).map(|_| worker(&killed)).collect();
    let begun = Instant::now();
    let mut kills = 0;
    while begun.elapsed() < Duration::from_secs(3) {
        // Moments that repeat: the ninth part of a second that grows.
        std::thread::sleep(Duration::from_millis(110 + 37 * (kills % 7)));
        let one = (kills % 3) as usize;
        let _ = workers[one].kill();
        workers[one].wait().expect("its end");
        workers[one] = worker(&killed);
        kills += 1;
    }
    for mut one in workers {
        assert!(one.wait().expect("its end").success());
    }
    assert!(kills >= 4, "{kills} kills");
    assert!(gathered(&killed) == gathered(&whole), "tables differ");
}

#[test]
fn a_case_that_fails_is_tried_three_times_and_says_why() {
    let folder = tempfile::tempdir().expect("a folder");
    // A size that the scenario refuses, in half of the cases.
    let grid = GRID.replace("points = 40", "points = \"{points}\"") + "points = [40, -1]\n";
    let campaign = planned(folder.path(), "c", &grid.replace("1..6", "1..1"));
    let (code, _, stderr) = misclosure(&["campaign", "run", &campaign]);
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("2 cases were given up"), "{stderr}");
    let text = done(&["campaign", "status", &campaign]);
    assert!(text.starts_with("4 cases: 2 done, 2 given up, 0 taken, 0 open\n  2 times: "), "{text}");
    let attempts = |of: &str| {
        let folders = fs::read_dir(Path::new(&campaign).join(of)).expect("a folder");
        folders.map(|one| fs::read_dir(one.expect("an entry").path()).expect("a folder").count()).sum::<usize>()
    };
    assert_eq!(attempts("failures"), 6);
    let results = String::from_utf8(gathered(&campaign).swap_remove(0)).expect("UTF-8");
    assert_eq!(results.lines().filter(|line| line.contains(",failed,")).count(), 2);
    let (code, ..) = misclosure(&["campaign", "run", &campaign, "--again"]);
    assert_eq!((code, attempts("failures")), (1, 6), "tried again");
}

#[test]
fn a_folder_that_takes_no_results_loses_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let campaign = planned(folder.path(), "c", &GRID.replace("1..6", "1..1"));
    let results = Path::new(&campaign).join("results");
    fs::write(&results, "in the way").expect("a file");
    let (code, _, stderr) = misclosure(&["campaign", "run", &campaign]);
    assert_eq!(code, 1);
    assert!(stderr.contains("cannot write"), "{stderr}");
    fs::remove_file(&results).expect("a file");
    assert_eq!(done(&["campaign", "run", &campaign]), "2 cases: 2 worked here, 0 given up\n");
}

#[test]
fn what_is_no_campaign_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path().to_str().expect("UTF-8");
    let refused = |words: &[&str], said: &str| {
        let (code, _, stderr) = misclosure(words);
        assert_eq!(code, 2, "{words:?}: {stderr}");
        assert!(stderr.contains(said), "{words:?}: {stderr}");
    };
    refused(&["campaign", "run", place], "this is no campaign");
    refused(&["campaign", "run", place, "--shard", "3/2"], "expected I/N with I from 1 to N");
    refused(&["campaign", "run", place, "--lease", "1"], "expected more than 2 s");
    let grid = folder.path().join("grid.toml");
    fs::write(&grid, GRID.replace("rolling-shutter:readout", "roling-shutter:readout")).expect("a file");
    let (grid, to) = (grid.to_str().expect("UTF-8"), folder.path().join("c"));
    refused(&["campaign", "plan", grid, "-o", to.to_str().expect("UTF-8")], "roling-shutter");
    assert!(!to.exists(), "nothing is written of what cannot be planned");
    refused(&["campaign", "plan", grid, "-o", place], "roling-shutter");
}

/// Each grid of the repository can be planned.
#[test]
fn the_grids_of_the_project_are_grids() {
    let folder = tempfile::tempdir().expect("a folder");
    let grids = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns");
    let mut count = 0;
    for entry in fs::read_dir(grids).expect("a folder") {
        let grid = entry.expect("an entry").path();
        let to = folder.path().join(grid.file_stem().expect("a name"));
        done(&["campaign", "plan", grid.to_str().expect("UTF-8"), "-o", to.to_str().expect("UTF-8")]);
        count += 1;
    }
    assert!(count >= 6, "{count} grids");
}
