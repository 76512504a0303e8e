//! Too little memory: the program's own message and code 1, and the older run as it was.

use super::place::{Place, is_whole};

#[test]
fn too_little_memory_has_a_message_of_ours() {
    let place = Place::new();
    let (mut done, mut refused) = (0, 0);
    for megabytes in [80, 110, 140, 170, 200, 300, 600] {
        for command in ["adjust block -o run", "improve block -o run", "check block"] {
            let ended = place.run_under(&format!("ulimit -v {};", megabytes * 1024), command.split(' '));
            match ended.code {
                Some(0) => done += 1,
                // Too little for the system to load the program at all.
                Some(127) if ended.errors.contains("error while loading shared libraries") => {}
                Some(1) => {
                    refused += 1;
                    assert!(ended.errors.contains("error: "), "{megabytes} MB, {command}: {ended:?}");
                    assert!(!ended.errors.contains("internal error"), "{megabytes} MB, {command}: {ended:?}");
                }
                _ => panic!("{megabytes} MB, {command}: {ended:?}"),
            }
            is_whole(&place.at("run")).unwrap();
        }
    }
    assert!(done > 0 && refused > 0, "{done} done, {refused} refused");
}
