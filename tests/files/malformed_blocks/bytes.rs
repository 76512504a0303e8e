//! No file, whatever is in it, makes the reader panic.

use crate::malformed_blocks::block::Files;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the bytes are, reading ends with a block or a message.
    #[test]
    fn arbitrary_bytes_do_not_panic(file in 0..6usize, content in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut files = Files::valid();
        let name = *files.0.keys().nth(file).expect("six files");
        files.set(name, content);
        if let Err(message) = files.read() {
            prop_assert!(message.contains(".csv") || message.contains(".toml"), "{}", message);
        }
    }

    /// A valid file with a few bytes changed, taken out or put in: most faults of real files are near to valid ones.
    #[test]
    fn damaged_files_do_not_panic(
        file in 0..6usize,
        damages in prop::collection::vec((any::<prop::sample::Index>(), 0..3u8, prop::sample::select(b"\",\n\r=[]{}#.-e0917 \\\xff\x00naif".to_vec())), 1..6),
    ) {
        let mut files = Files::valid();
        let name = *files.0.keys().nth(file).expect("six files");
        let mut content = files.0[name].clone();
        for (at, kind, byte) in damages {
            let at = at.index(content.len());
            match kind {
                0 => content[at] = byte,
                1 => drop(content.remove(at)),
                _ => content.insert(at, byte),
            }
        }
        files.set(name, content);
        if let Err(message) = files.read() {
            prop_assert!(message.contains(".csv") || message.contains(".toml"), "{}", message);
        }
    }
}
