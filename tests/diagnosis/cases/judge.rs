//! The judge: `improve` on every block, held against its truth.

use crate::beside;
use crate::cases::truth;
use crate::in_turn::in_turn;
use crate::judging::program::improve;
use crate::judging::tally::{Judged, judged, score};
use std::path::Path;

/// Cases judged by `make test`: quick ones of different kinds.
const SUBSET: [&str; 6] =
    ["case200_close", "case203_close", "case204_dike", "case227_close", "case229_mapping", "case236_close"];

/// Set to `all` (as `make test-cases` does) it asks for every case; else to a part of a case's name.
const WHICH: &str = "MISCLOSURE_CASES";

/// Part of all cases that must be right: 38 of 40.
const RIGHT: f64 = 0.95;

#[test]
fn improve_finds_what_the_cases_hide() {
    let Some(folder) = beside::shared("cases") else { return };
    let which = std::env::var(WHICH).unwrap_or_default();
    let mut names = names(&folder);
    names.retain(|name| match which.as_str() {
        "all" => true,
        "" => SUBSET.contains(&name.as_str()),
        part => name.contains(part),
    });
    assert!(!names.is_empty(), "{WHICH}={which}: no such case");
    let all = in_turn(&names, |name| {
        let truth = truth::read(&folder.join(format!("{name}.truth.json")));
        judged(name, &truth, improve(&folder.join(name)))
    });
    let score = score(&all);
    let right = all.iter().filter(|judged| judged.right()).count() as f64;
    let asked = if which == "all" { RIGHT } else { 1.0 };
    assert!(right >= asked * all.len() as f64, "{score}");
    let invented = |judged: &Judged| !judged.judgement.not_there.is_empty();
    assert!(!all.iter().any(invented), "{score}");
}

/// Every case's truth is understood, of those too that `make test` does not judge.
#[test]
fn truths_can_be_read() {
    let Some(folder) = beside::shared("cases") else { return };
    let names = names(&folder);
    assert!(SUBSET.iter().all(|chosen| names.iter().any(|name| name == chosen)));
    for name in names {
        let truth = truth::read(&folder.join(format!("{name}.truth.json")));
        assert!(truth.check_mm > 0.0, "{name}");
        assert!(truth.hidden.iter().all(|hidden| hidden.noncentrality > 0.0), "{name}");
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("readable").path());
    let name = |path: std::path::PathBuf| path.file_name()?.to_str()?.strip_suffix(".truth.json").map(String::from);
    let mut names: Vec<String> = entries.filter_map(name).collect();
    names.sort();
    names
}
