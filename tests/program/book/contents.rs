//! The book's list of contents.

use super::pages::{book, root};
use std::collections::BTreeSet;
use std::fs;

/// Pages that stand in another one.
const NO_CHAPTER: [&str; 1] = ["docs/SUMMARY.md"];

#[test]
fn every_page_is_a_chapter_once() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("the contents");
    let chapters: Vec<String> =
        summary.split("](").skip(1).filter_map(|rest| Some(format!("docs/{}", rest.split(')').next()?))).collect();
    let once: BTreeSet<&str> = chapters.iter().map(String::as_str).collect();
    assert_eq!(once.len(), chapters.len(), "a page stands twice in the contents");
    let pages: Vec<String> = book().iter().map(|path| path.to_str().expect("UTF-8").to_owned()).collect();
    let pages: BTreeSet<&str> = pages.iter().map(String::as_str).filter(|page| !NO_CHAPTER.contains(page)).collect();
    assert_eq!(once, pages);
}

/// A page that is included in another one must be there, and mdbook would only warn.
#[test]
fn what_a_page_includes_is_there() {
    for page in book() {
        let text = fs::read_to_string(root().join(&page)).expect("a page");
        for part in text.split("{{#include ").skip(1) {
            let name = part.split("}}").next().expect("its end");
            let file = root().join(&page).parent().expect("a folder").join(name);
            assert!(file.is_file(), "{}: {name}", page.display());
        }
    }
}

/// A README that takes longer than that to read is none.
#[test]
fn the_readme_is_short() {
    const MOST_LINES: usize = 150;
    let readme = fs::read_to_string(root().join("README.md")).expect("the README");
    let lines = readme.lines().count();
    assert!(lines <= MOST_LINES, "{lines} lines; what is longer is a page of the book");
}
