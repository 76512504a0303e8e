//! Outputs: unfit ones are refused before anything is computed, files of others are kept, a reader always finds a
//! complete run.

use super::place::{Place, is_whole};
use std::fs;
use std::os::fd::AsRawFd;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};

/// Commands that write a folder, with arguments that fit [`Place`].
pub const WRITERS: [&str; 10] = [
    "simulate closerange --set points=50",
    "inject truth --error noise:px=0.3",
    "inject recipe.toml",
    "adjust block",
    "diagnose block",
    "improve block",
    "import colmap colmap",
    "export colmap block --approximate",
    "validate pair --suite",
    "reproduce calibration-error --part published",
];

/// The words of a command with its output.
pub fn words<'a>(command: &'a str, output: &'a str) -> Vec<&'a str> {
    let mut words: Vec<&str> = command.split(' ').collect();
    if !command.ends_with("--suite") {
        words.push("-o");
    }
    words.push(output);
    words
}

pub fn with_recipe() -> Place {
    let place = Place::new();
    let recipe = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/hidden/closerange-none.toml");
    fs::copy(recipe, place.at("recipe.toml")).unwrap();
    place
}

#[test]
fn a_place_that_takes_no_file_is_found_before_anything_is_computed() {
    let place = with_recipe();
    fs::write(place.at("file"), "mine").unwrap();
    // Nobody, not even root, can make a folder in a file or in /proc.
    for output in ["file/out", "/proc/out"] {
        for command in WRITERS {
            let ended = place.run(words(command, output));
            ended.expect(if output == "file/out" && ended.code == Some(2) { 2 } else { 1 }, "cannot");
            assert!(!ended.errors.contains("iteration") && !ended.errors.contains("flying"), "{command}: {ended:?}");
        }
    }
    assert_eq!(fs::read_to_string(place.at("file")).unwrap(), "mine");
}

#[test]
fn a_disk_that_is_too_small_is_found_before_anything_is_computed() {
    let place = with_recipe();
    // A process that ignores SIGXFSZ gets an error in its place. The limit is below the size of the test file.
    for command in WRITERS {
        let ended = place.run_under("trap '' XFSZ; ulimit -f 16;", words(command, "out"));
        ended.expect(1, "cannot write");
        assert!(!ended.errors.contains("iteration") && !ended.errors.contains("flying"), "{command}: {ended:?}");
        assert!(!place.names("").iter().any(|name| name.starts_with(".misclosure")), "{command}");
        let _ = fs::remove_dir_all(place.at("out"));
    }
    // A file system of 1 MB, where this machine allows a mount.
    let small = "mkdir -p small && mount -t tmpfs -o size=1m none small";
    let mounts = |then: &str| {
        let mut command = Command::new("unshare");
        command.args(["-rm", "sh", "-c", &format!("{small} && {then}")]).current_dir(place.path());
        command.args(["sh", env!("CARGO_BIN_EXE_misclosure")]).output()
    };
    if !mounts("true").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: no file system can be mounted here (unshare -rm)");
        return;
    }
    for output in ["small/out", "small"] {
        let ended: super::place::Ended = mounts(&format!("\"$1\" adjust block -o {output}")).unwrap().into();
        ended.expect(1, "MB left, results may take");
        assert!(!ended.errors.contains("iteration"), "{ended:?}");
    }
}

#[test]
fn files_that_belong_to_no_run_are_not_written_over() {
    let place = Place::new();
    fs::create_dir(place.at("mine")).unwrap();
    for name in ["points.csv", "model.toml", "summary.json", "report.html", "residuals.csv"] {
        fs::write(place.at("mine").join(name), "my own").unwrap();
        place.run(["adjust", "block", "-o", "mine"]).expect(2, &format!("holds a {name} that is of no run"));
        assert_eq!(fs::read_to_string(place.at("mine").join(name)).unwrap(), "my own");
        fs::remove_file(place.at("mine").join(name)).unwrap();
    }
    fs::write(place.at("mine/notes.txt"), "my own").unwrap();
    for _ in 0..2 {
        place.run(["adjust", "block", "-o", "mine"]).expect(0, "");
        assert_eq!(fs::read_to_string(place.at("mine/notes.txt")).unwrap(), "my own");
        is_whole(&place.at("mine")).unwrap();
    }
}

/// Looks again and again while the run is replaced; gives the number of looks.
fn while_replaced(place: &Place, look: impl Fn() + Sync) -> usize {
    let ends = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let looks = scope.spawn(|| {
            let mut looks = 0;
            while !ends.load(Ordering::Relaxed) {
                look();
                looks += 1;
            }
            looks
        });
        for _ in 0..5 {
            place.run(["adjust", "block", "-o", "run", "--solver", "native"]).expect(0, "");
        }
        ends.store(true, Ordering::Relaxed);
        looks.join().expect("no look failed")
    })
}

#[test]
fn a_reader_finds_a_whole_run_at_the_path_at_every_moment() {
    let place = Place::new();
    // Files of two runs of one block may be read in one look: their rows agree.
    let looks = while_replaced(&place, || is_whole(&place.at("run")).unwrap());
    assert!(looks > 10, "{looks}");
}

#[test]
fn a_reader_that_holds_the_folder_sees_one_run_until_it_is_replaced() {
    let place = Place::new();
    let looks = while_replaced(&place, || {
        let folder = fs::File::open(place.at("run")).expect("a run");
        let handle = format!("/proc/self/fd/{}", folder.as_raw_fd());
        let found = is_whole(Path::new(&handle));
        // The program removes the older run after the exchange. A handle outlives that, and its link tells:
        // it ends with another name then, or with ` (deleted)`.
        let is_in_place = fs::read_link(&handle).expect("a link").ends_with("run");
        assert!(found.is_ok() || !is_in_place, "{found:?}");
    });
    assert!(looks > 10, "{looks}");
}

#[test]
fn a_run_in_the_working_directory_is_replaced_too() {
    let place = Place::new();
    let mut command = place.command(["adjust", "../block", "-o", "."]);
    let ended: super::place::Ended = command.current_dir(place.at("run")).output().unwrap().into();
    ended.expect(0, "");
    is_whole(&place.at("run")).unwrap();
    assert!(!place.names("run").iter().any(|name| name.starts_with(".misclosure")));
}

#[test]
fn a_table_of_a_run_that_was_cut_off_is_told() {
    let place = Place::new();
    place.run(["report", "run"]).expect(0, "");
    for table in ["residuals.csv", "images.csv", "checks.csv"] {
        let text = fs::read_to_string(place.at("run").join(table)).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        fs::write(place.at("run").join(table), lines[..lines.len() / 2].join("\n") + "\n").unwrap();
        let expected = format!("{table}: the table has {} rows, expected {}", lines.len() / 2 - 1, lines.len() - 1);
        place.run(["report", "run"]).expect(2, &expected);
        fs::write(place.at("run").join(table), text).unwrap();
    }
}
