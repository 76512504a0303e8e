//! Lines of source have at most 120 columns. Tables, drawings and formulas at the head of a file, and data in raw
//! texts, are as wide as they must be.

use crate::imports::source::{files, root};
use std::fs;

/// Columns of a line, at most (rustfmt.toml).
const MOST: usize = 120;

/// Folders with the extension of their sources.
const FOLDERS: [(&str, &str); 5] = [("src", "rs"), ("examples", "rs"), ("benches", "rs"), ("cpp", "h"), ("cpp", "cc")];

#[test]
fn no_line_is_too_wide() {
    let (mut read, mut found) = (0, Vec::new());
    for (folder, extension) in FOLDERS {
        for path in files(&root().join(folder), extension) {
            let source = fs::read_to_string(&path).expect("readable source");
            read += source.lines().count();
            let wide = source.lines().enumerate().filter(|(_, line)| {
                let set_as_it_must = line.starts_with("//!") || line.starts_with("//   ") || line.contains("r#\"");
                line.chars().count() > MOST && !set_as_it_must
            });
            let file = path.strip_prefix(root()).expect("below the root").display();
            found.extend(wide.map(|(k, line)| format!("{file}:{}: {} columns", k + 1, line.chars().count())));
        }
    }
    assert!(read > 50_000, "{read} lines: most were not seen");
    assert!(found.is_empty(), "lines of more than {MOST} columns:\n{}", found.join("\n"));
}
