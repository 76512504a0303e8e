//! Every command under every fault of its surroundings: it succeeds, or ends with a message and one of the program's
//! codes.

use super::outputs::{WRITERS, with_recipe, words};
use super::place::{Place, odd};
use std::ffi::OsString;

/// Commands that write no folder.
const READERS: [&str; 6] =
    ["check block", "report run", "effects", "effects rolling-shutter", "validate pair", "import --list"];
/// Faults of the surroundings: a name, and commands of a shell that run before the program.
const FAULTS: [(&str, &str); 4] = [
    ("little memory", "ulimit -v 150000;"),
    ("no room", "trap '' XFSZ; ulimit -f 16;"),
    ("few files", "ulimit -n 4;"),
    ("closed streams", "exec <&- >&- 2>&-;"),
];

fn all(place: &Place, output: &str) -> Vec<Vec<OsString>> {
    let mut all: Vec<Vec<OsString>> =
        READERS.iter().map(|line| line.split(' ').map(OsString::from).collect()).collect();
    // A study takes minutes, and consists of adjustments.
    for command in WRITERS.iter().filter(|command| !command.starts_with("reproduce")) {
        all.push(words(command, output).into_iter().map(OsString::from).collect());
    }
    assert!(place.path().exists());
    all
}

#[test]
fn every_command_under_every_fault_ends_with_a_code_of_its_own() {
    let place = with_recipe();
    for (fault, before) in FAULTS {
        for words in all(&place, "out") {
            let ended = place.run_under(before, &words);
            let loader = ended.code == Some(127) && ended.errors.contains("error while loading shared libraries");
            assert!(matches!(ended.code, Some(0..=4)) || loader, "{fault}: {words:?}: {ended:?}");
            assert!(!ended.errors.contains("panicked"), "{fault}: {words:?}: {ended:?}");
            eprintln!(
                "{fault}\t{}\t{:?}",
                words.iter().map(|w| w.to_string_lossy()).collect::<Vec<_>>().join(" "),
                ended.code
            );
            let _ = std::fs::remove_dir_all(place.at("out"));
        }
    }
    for mut words in all(&place, "out") {
        if words.last().is_some_and(|last| last == "out") {
            words.pop();
            words.push(odd());
            place.run(&words).expect(0, "");
            let _ = std::fs::remove_dir_all(place.at(odd()));
        }
    }
}
