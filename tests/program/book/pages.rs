//! The pages.

use std::fs;
use std::path::{Path, PathBuf};

/// Pages outside of the book.
const BESIDE: [&str; 5] = ["README.md", "CONTRIBUTING.md", "CONVENTIONS.md", "SECURITY.md", "data/hidden/README.md"];

/// The source tree.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every page, by its path from the root, with its text.
pub fn pages() -> Vec<(PathBuf, String)> {
    let mut paths: Vec<PathBuf> = BESIDE.map(PathBuf::from).into();
    paths.extend(book());
    let read = |path: PathBuf| {
        let text = fs::read_to_string(root().join(&path)).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// Pages of the book, by their paths from the root.
pub fn book() -> Vec<PathBuf> {
    let (mut folders, mut found) = (vec![PathBuf::from("docs")], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root().join(&folder)).expect("a folder").flatten() {
            let path = folder.join(entry.file_name());
            match entry.path() {
                inner if inner.is_dir() => folders.push(path),
                inner if inner.extension().is_some_and(|extension| extension == "md") => found.push(path),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

/// Prose of a page and its code: lines outside of fences and between them.
pub fn prose_and_code(text: &str) -> (String, String) {
    let (mut parts, mut inside) = ((String::new(), String::new()), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
            continue;
        }
        let part = if inside { &mut parts.1 } else { &mut parts.0 };
        *part += line;
        part.push('\n');
    }
    parts
}

/// Code spans of prose: what stands between two backticks of a paragraph.
pub fn spans(prose: &str) -> Vec<&str> {
    prose.split("\n\n").flat_map(|paragraph| paragraph.split('`').skip(1).step_by(2)).collect()
}

#[test]
fn prose_code_and_spans_are_told_apart() {
    let (prose, code) = prose_and_code("See `a/b` and `c\nd`.\n```text\n`x`\n```\nend\n");
    assert_eq!((prose.as_str(), code.as_str()), ("See `a/b` and `c\nd`.\nend\n", "`x`\n"));
    assert_eq!(spans(&prose), ["a/b", "c\nd"]);
}
