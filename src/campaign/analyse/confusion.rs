//! Confusion: what is named in the place of what is there.

use super::super::gather::Row;
use super::finished;
use std::collections::BTreeMap;

/// In the place of a name where there is nothing.
const NOTHING: &str = "nothing";

/// How often something is called something.
#[derive(Debug, Clone, PartialEq)]
pub struct Confusion {
    /// What is there.
    pub expected: String,
    /// What was named.
    pub said: String,
    /// Number of cases.
    pub count: usize,
}

/// By what is there, the most frequent answer first.
pub fn confusion(rows: &[Row]) -> Vec<Confusion> {
    let mut counts: BTreeMap<(String, String), usize> = BTreeMap::new();
    let joined = |names: Vec<&str>| if names.is_empty() { NOTHING.to_owned() } else { names.join(" + ") };
    for (row, outcome) in finished(rows) {
        let mut expected: Vec<&str> = row.expected.iter().map(String::as_str).collect();
        expected.sort_unstable();
        let mut said = joined(outcome.said());
        if outcome.verdict == "unexplained" {
            said += " (unexplained)";
        }
        *counts.entry((joined(expected), said)).or_default() += 1;
    }
    let cell = |((expected, said), count)| Confusion { expected, said, count };
    let mut all: Vec<Confusion> = counts.into_iter().map(cell).collect();
    all.sort_by(|a, b| a.expected.cmp(&b.expected).then(b.count.cmp(&a.count)));
    all
}
