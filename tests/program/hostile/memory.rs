//! Too little memory: the program's own message and code 1, or success; the older run as it was.

use super::place::{Ended, Place, is_whole};

/// Address space that a command is given, MB. What a limit meets differs: the loader at 60, Rust's allocator, threads
/// and their stacks, CHOLMOD, Ceres above.
const LIMITS: [u32; 8] = [60, 80, 95, 105, 115, 140, 250, 800];
/// At every limit.
const OFTEN: [&str; 4] = ["adjust block -o run", "adjust block -o run --threads 16", "check block", "validate pair"];
/// At some limits, in turn.
const IN_TURN: [&str; 8] = [
    "improve block -o run",
    "simulate closerange --set points=50 -o out",
    "improve block -o run --threads 8",
    "import colmap colmap -o out",
    "diagnose block -o run",
    "inject truth --error noise:px=0.3 -o out",
    "export colmap block --approximate -o out",
    "report run",
];

/// Of processor seconds too: a program that waits for memory for ever would.
fn run(place: &Place, megabytes: u32, command: &str) -> Ended {
    let ended = place.run_under(&format!("ulimit -v {} -t 60;", megabytes * 1024), command.split(' '));
    let _ = std::fs::remove_dir_all(place.at("out"));
    ended
}

#[test]
fn too_little_memory_has_a_message_of_ours() {
    let place = Place::new();
    let (mut done, mut refused) = (0, 0);
    for (k, megabytes) in LIMITS.into_iter().enumerate() {
        let in_turn = (0..2).map(|j| IN_TURN[(2 * k + j) % IN_TURN.len()]);
        for command in OFTEN.into_iter().chain(in_turn) {
            let ended = run(&place, megabytes, command);
            let text = &ended.errors;
            match ended.code {
                Some(0) => done += 1,
                // Too little for the system to load the program at all.
                Some(127) if text.contains("error while loading shared libraries") => {}
                Some(1) => {
                    refused += 1;
                    assert!(text.contains("memory"), "{megabytes} MB, {command}: {ended:?}");
                }
                _ => panic!("{megabytes} MB, {command}: {ended:?}"),
            }
            for of_another in ["libgomp", "terminate called", "panicked", "internal error"] {
                assert!(!text.contains(of_another), "{megabytes} MB, {command}: {ended:?}");
            }
            is_whole(&place.at("run")).unwrap();
        }
    }
    assert!(done > 0 && refused > 0, "{done} done, {refused} refused");
}
