//! Paths of the source tree that pages name, and links from page to page.

use super::pages::{pages, prose_and_code, root, spans};
use std::fs;
use std::path::Path;

/// Folders at the root whose paths are held against the tree.
const FOLDERS: [&str; 12] =
    ["benches", "cmake", "cpp", "data", "docs", "examples", "fuzz", "rust", "scripts", "src", "tests", "web"];

/// Paths in a sample that a page takes from another project.
const ELSEWHERE: [(&str, &str); 1] = [("docs/your-odm-project.md", "data/berlin")];

/// Whether a path from the root is there; `*` in its last part is any text.
fn is_there(path: &str) -> bool {
    let whole = root().join(path);
    let (Some(folder), Some(name)) = (whole.parent(), whole.file_name().and_then(|name| name.to_str())) else {
        return whole.exists();
    };
    let Some((start, end)) = name.split_once('*') else { return whole.exists() };
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .any(|name| name.len() >= start.len() + end.len() && name.starts_with(start) && name.ends_with(end))
}

/// Targets of links, in the line or below the text.
fn links(prose: &str) -> Vec<&str> {
    let in_line = prose.split("](").skip(1).filter_map(|rest| rest.split([')', ' ', '\n']).next());
    let below = prose.lines().filter_map(|line| line.strip_prefix('[')?.split_once("]: ").map(|(_, target)| target));
    in_line.chain(below).collect()
}

#[test]
fn every_path_in_a_page_is_there() {
    let mut lost = Vec::new();
    for (page, text) in pages() {
        let (prose, _) = prose_and_code(&text);
        for word in spans(&prose).into_iter().flat_map(str::split_whitespace) {
            let word = word.trim_end_matches(['.', ',', ';', ':', ')']);
            let of_tree = word.split_once('/').is_some_and(|(folder, _)| FOLDERS.contains(&folder));
            let elsewhere = ELSEWHERE.iter().any(|own| Path::new(own.0) == page && own.1 == word);
            if of_tree && !elsewhere && !is_there(word) {
                lost.push(format!("{}: `{word}`", page.display()));
            }
        }
    }
    assert!(lost.is_empty(), "paths that lead nowhere:\n{}", lost.join("\n"));
}

#[test]
fn every_link_to_a_file_leads_to_one() {
    let mut lost = Vec::new();
    for (page, text) in pages() {
        let (prose, _) = prose_and_code(&text);
        let folder = root().join(page.parent().expect("a file"));
        for link in links(&prose) {
            let file = link.split('#').next().unwrap_or(link);
            if !file.is_empty() && !link.contains("://") && !folder.join(file).exists() {
                lost.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(lost.is_empty(), "links that lead nowhere:\n{}", lost.join("\n"));
}

#[test]
fn what_is_not_there_is_noticed() {
    assert!(is_there("src/lib.rs") && is_there("docs/*.md") && is_there("cpp/effects/"));
    assert!(!is_there("src/lib.r") && !is_there("docs/*.odt") && !is_there("src/nowhere/*.rs"));
    assert_eq!(links("a [b](c.md#d), ![e](f.svg)\n[g]: h.md\n"), ["c.md#d", "f.svg", "h.md"]);
}
