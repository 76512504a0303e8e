//! The program is killed at any moment: the older run or the newer one is there, and the same command works again.

use super::place::{Ended, Place, is_whole};
use std::fs;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Kills of each command here.
const KILLS: u32 = 18;

fn start(place: &Place, words: &[&str]) -> Child {
    place.command(words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program runs")
}

/// Kills the command at moments spread over the time that it takes; gives how often it had ended before.
fn kill_spread(place: &Place, words: &[&str], signal: &str, mut after: impl FnMut(u32)) -> u32 {
    let began = Instant::now();
    assert!(start(place, words).wait().expect("its end").success(), "{words:?}");
    let whole = began.elapsed();
    after(0);
    let mut ended = 0;
    for k in 0..KILLS {
        let mut child = start(place, words);
        // The moments at the end, when results take their place, are those that matter: a third lies in the last tenth.
        let part = match k % 3 {
            0 => 0.9 + 0.15 * f64::from(k) / f64::from(KILLS),
            _ => f64::from(k) / f64::from(KILLS),
        };
        std::thread::sleep(Duration::from_secs_f64(part * whole.as_secs_f64()));
        let kill = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
        ended += u32::from(!kill.is_ok_and(|status| status.success()));
        child.wait().expect("its end");
        after(k);
    }
    ended
}

#[test]
fn a_kill_while_an_older_run_is_replaced_leaves_one_of_the_two() {
    let place = Place::new();
    fs::write(place.at("run/notes.txt"), "my own").unwrap();
    for signal in ["-KILL", "-INT"] {
        kill_spread(&place, &["adjust", "block", "-o", "run", "--solver", "native"], signal, |_| {
            is_whole(&place.at("run")).unwrap();
            assert_eq!(fs::read_to_string(place.at("run/notes.txt")).unwrap(), "my own");
        });
    }
    place.run(["adjust", "block", "-o", "run"]).expect(0, "");
    let left: Vec<String> = place.names("").into_iter().filter(|name| name.starts_with('.')).collect();
    assert!(left.is_empty(), "{left:?}");
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
        kill_spread(&place, &words, "-INT", |_| {
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
