//! Kills at any moment: the output is the older run or the newer one, complete, and the same command works again.

use super::place::{Ended, Place, is_whole};
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Kills of each command here.
const KILLS: u32 = 18;

fn start(place: &Place, words: &[&str]) -> Child {
    place.command(words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program runs")
}

/// Kills the command at moments spread over its duration.
fn kill_spread(place: &Place, words: &[&str], signal: &str, after: impl Fn()) {
    let began = Instant::now();
    assert!(start(place, words).wait().expect("its end").success(), "{words:?}");
    let whole = began.elapsed();
    after();
    for k in 0..KILLS {
        let mut child = start(place, words);
        // A third of the kills strikes in the last tenth, when the results replace the output.
        let part = match k % 3 {
            0 => 0.9 + 0.15 * f64::from(k) / f64::from(KILLS),
            _ => f64::from(k) / f64::from(KILLS),
        };
        std::thread::sleep(Duration::from_secs_f64(part * whole.as_secs_f64()));
        // Fails where the command has ended before.
        let _ = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
        child.wait().expect("its end");
        after();
    }
}

#[test]
fn a_kill_while_an_older_run_is_replaced_leaves_one_of_the_two() {
    let place = Place::new();
    fs::write(place.at("run/notes.txt"), "my own").unwrap();
    for signal in ["-KILL", "-INT"] {
        kill_spread(&place, &["adjust", "block", "-o", "run", "--solver", "native"], signal, || {
            is_whole(&place.at("run")).unwrap();
            assert_eq!(fs::read_to_string(place.at("run/notes.txt")).unwrap(), "my own");
            // Whoever presses Ctrl-C finds the folder as it was.
            if signal == "-INT" {
                nothing_is_left(&place);
            }
        });
        place.run(["adjust", "block", "-o", "run"]).expect(0, "");
        nothing_is_left(&place);
    }
}

/// No temporary folder is there.
fn nothing_is_left(place: &Place) {
    let left: Vec<String> = place.names("").into_iter().filter(|name| name.starts_with('.')).collect();
    assert!(left.is_empty(), "{left:?}");
}

/// Results of a run that are the same whenever it is repeated.
const TABLES: [&str; 5] = ["images.csv", "points.csv", "residuals.csv", "checks.csv", "model.toml"];

fn tables(run: &Path) -> Vec<Vec<u8>> {
    TABLES.iter().map(|name| fs::read(run.join(name)).expect("a table")).collect()
}

/// Waits until results are being written, as far as the figures, the last ones but the report.
fn until_figures_are_written(place: &Place, child: &mut Child, earlier: &[String]) {
    let is_written = |name: &String| {
        name.starts_with(".misclosure-") && !earlier.contains(name) && place.at(name).join("figures").exists()
    };
    while child.try_wait().expect("its state").is_none() && !place.names("").iter().any(is_written) {
        std::thread::sleep(Duration::from_micros(200));
    }
}

#[test]
fn a_kill_never_mixes_two_runs() {
    // `scripts/kills.sh` does the same a thousand times.
    let place = Place::new();
    for (block, seed) in [("a", "1"), ("b", "2")] {
        place.run(["simulate", "closerange", "-o", &format!("{block}-truth"), "--set", "points=20"]).expect(0, "");
        let truth = format!("{block}-truth");
        place.run(["inject", &truth, "-o", block, "--error", "noise:px=0.3", "--seed", seed]).expect(0, "");
    }
    let improve = |block, run| ["improve", block, "-o", run, "--solver", "native", "--threads", "1"];
    let began = Instant::now();
    place.run(improve("a", "of-a")).expect(0, "");
    let whole = began.elapsed().as_secs_f64();
    place.run(improve("b", "of-b")).expect(0, "");
    place.run(improve("a", "out")).expect(0, "");
    let known = [tables(&place.at("of-a")), tables(&place.at("of-b"))];
    let which = || {
        is_whole(&place.at("out")).unwrap();
        assert_eq!(place.names("out"), place.names("of-a"));
        let found = tables(&place.at("out"));
        known.iter().position(|run| *run == found).expect("one of the two runs")
    };
    let kills = 30;
    for k in 0..kills {
        let (earlier, next) = (place.names(""), ["b", "a"][which()]);
        let mut child = start(&place, &improve(next, "out"));
        let part = f64::from(k) / f64::from(kills);
        if k % 3 == 0 {
            std::thread::sleep(Duration::from_secs_f64(part * whole));
        } else {
            until_figures_are_written(&place, &mut child, &earlier);
            // A few hundredths of a second until the older run is removed.
            std::thread::sleep(Duration::from_secs_f64(0.04 * part));
        }
        let _ = child.kill();
        child.wait().expect("its end");
        which();
    }
    // What the last kill left does not disturb the next run, which removes it.
    place.run(improve("a", "out")).expect(0, "");
    assert_eq!(which(), 0);
    assert!(!place.names("").iter().any(|name| name.starts_with('.')), "{:?}", place.names(""));
}

#[test]
fn a_command_that_was_interrupted_works_again() {
    let place = Place::new();
    for command in [
        "simulate closerange -o out --set points=150",
        "inject truth -o out --error noise:px=0.3",
        "import colmap colmap -o out",
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        kill_spread(&place, &words, "-INT", || {
            // Whole, or not there.
            if place.at("out").exists() {
                assert!(place.at("out/block.toml").exists(), "{command}");
                fs::remove_dir_all(place.at("out")).unwrap();
            }
        });
        place.run(&words).expect(0, "");
        assert!(!place.names("").iter().any(|name| name.starts_with('.')), "{:?}", place.names(""));
        fs::remove_dir_all(place.at("out")).unwrap();
    }
}

#[test]
fn leftovers_of_an_older_program_in_an_output_are_ignored() {
    let place = Place::new();
    fs::create_dir_all(place.at("out/.misclosure-AbCdEf")).unwrap();
    fs::write(place.at("out/.misclosure-AbCdEf/ties.csv"), "half").unwrap();
    place.run(["inject", "truth", "-o", "out", "--error", "noise:px=0.3"]).expect(0, "");
    assert!(!place.names("out").iter().any(|name| name.starts_with('.')), "{:?}", place.names("out"));
    place.run(["check", "out"]).expect(0, "");
}

#[test]
fn a_pipe_that_closes_changes_nothing() {
    let place = Place::new();
    for command in
        ["adjust block -o run", "adjust block -o run --json", "check block", "effects", "effects --json", "report run"]
    {
        let words: Vec<&str> = command.split(' ').collect();
        for closed in [">&-", "2>&-", "| true"] {
            let line = format!("\"$0\" \"$@\" {closed}; exit ${{PIPESTATUS[0]}}");
            let mut shell = std::process::Command::new("bash");
            shell.args(["-c", &line, env!("CARGO_BIN_EXE_misclosure")]).args(&words).current_dir(place.path());
            let ended: Ended = shell.output().expect("a shell").into();
            assert!(matches!(ended.code, Some(0 | 1)), "{command} {closed}: {ended:?}");
            assert!(!ended.errors.contains("panicked"), "{command} {closed}: {ended:?}");
        }
    }
    is_whole(&place.at("run")).unwrap();
}
