//! No circle of imports: whoever reads a file can read what it rests on first.

use crate::imports::source::{files, imports, module_of, root};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// Files, by module, and the files that each imports. What a module imports from those that it is part of is no arrow:
/// they only hold it.
type Arrows = BTreeMap<Vec<String>, BTreeSet<Vec<String>>>;

fn arrows<'a>(sources: impl IntoIterator<Item = (Vec<String>, &'a str)>) -> Arrows {
    let sources: BTreeMap<Vec<String>, &str> = sources.into_iter().collect();
    let file_of =
        |path: &[String]| (1..=path.len()).rev().map(|n| path[..n].to_vec()).find(|p| sources.contains_key(p));
    let of = |module: &Vec<String>, source: &str| -> BTreeSet<Vec<String>> {
        let used = imports(source, module).into_iter().filter(|import| !import.in_test);
        used.filter_map(|import| file_of(&import.path)).filter(|file| !module.starts_with(file)).collect()
    };
    sources.iter().map(|(module, source)| (module.clone(), of(module, source))).collect()
}

/// Files that lie on a circle, or between two of them.
fn in_circles(mut arrows: Arrows) -> Vec<String> {
    loop {
        // What nothing rests on, and what rests on nothing that is left, is in no circle.
        let aims: BTreeSet<Vec<String>> = arrows.values().flatten().cloned().collect();
        let before = arrows.len();
        arrows.retain(|module, used| aims.contains(module) && !used.is_empty());
        let left: BTreeSet<Vec<String>> = arrows.keys().cloned().collect();
        arrows.values_mut().for_each(|used| used.retain(|module| left.contains(module)));
        if arrows.len() == before {
            return arrows.iter().map(|(module, used)| described(module, used)).collect();
        }
    }
}

fn described(module: &[String], used: &BTreeSet<Vec<String>>) -> String {
    let used: Vec<String> = used.iter().map(|module| module.join("::")).collect();
    format!("{} imports {}", module.join("::"), used.join(", "))
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let src = root().join("src");
    let read = |file: &std::path::PathBuf| {
        let module = module_of(file.strip_prefix(&src).expect("below src"));
        (module, fs::read_to_string(file).expect("readable source"))
    };
    let sources: Vec<(Vec<String>, String)> = files(&src, "rs").iter().map(read).collect();
    // The front page and the program name everything.
    let own = sources.iter().filter(|(module, _)| !module.is_empty());
    let found = in_circles(arrows(own.map(|(module, source)| (module.clone(), source.as_str()))));
    assert!(found.is_empty(), "circles of imports:\n{}", found.join("\n"));
}

/// Files of the laboratory's page that a file of it imports, also those that it only loads when they are needed.
fn imports_of_page(source: &str) -> BTreeSet<Vec<String>> {
    let named = source.split("\"./").skip(1).filter_map(|rest| rest.split_once(".js\""));
    named.map(|(name, _)| vec![name.to_owned()]).collect()
}

#[test]
fn no_files_of_the_page_import_each_other_in_a_circle() {
    let arrow = |file: &std::path::PathBuf| {
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        (vec![name], imports_of_page(&fs::read_to_string(file).expect("readable source")))
    };
    let page: Arrows = files(&root().join("web"), "js").iter().map(arrow).collect();
    assert!(page[&vec!["main".to_string()]].len() > 5, "the first file imports others");
    let found = in_circles(page);
    assert!(found.is_empty(), "circles of imports:\n{}", found.join("\n"));
}

#[test]
fn a_circle_is_seen() {
    let module = |path: &str| path.split("::").map(String::from).collect::<Vec<_>>();
    let files = |sources: &[(&str, &'static str)]| {
        in_circles(arrows(sources.iter().map(|(path, source)| (module(path), *source)).collect::<Vec<_>>()))
    };
    let circle =
        files(&[("a", "use crate::b::B;"), ("b", "use super::c;"), ("c", "use crate::a::A;"), ("d", "use crate::a;")]);
    assert_eq!(circle, ["a imports b", "b imports c", "c imports a"]);
    let none =
        [("a", "use crate::b::B;"), ("b", "#[cfg(test)] mod tests { use crate::a::A; }"), ("b::c", "use super::B;")];
    assert!(files(&none).is_empty());
    let page =
        imports_of_page("import { a } from \"./b.js\";\nimport {\n  c } from \"./d.js\";\nawait import(\"./e.js\");");
    assert_eq!(page, ["b", "d", "e"].map(|name| vec![name.to_owned()]).into());
}
