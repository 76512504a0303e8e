//! What a block could not have shown: the size of each effect that it would have found with a power of 80 %, and what
//! an effect of that size, undetected, does to the points.

use super::headline::{in_words, named, short_mm, short_size};
use super::html::Page;
use super::numbers::{fixed, or_dash};
use super::tables::Table;
use crate::diagnose::verdict::{CandidateEntry, DetectableEntry, Diagnosis};

/// Effects of the sentence; the table has all.
const NAMED: usize = 3;

/// Effects that were tested and not found, with what this block would have shown of them; the worst for the points
/// first.
fn hidden(diagnosis: &Diagnosis) -> Vec<(&CandidateEntry, &DetectableEntry)> {
    let is_found = |id: &str| diagnosis.found.iter().any(|found| found.effect == id);
    let tested = diagnosis.candidates.iter().filter(|c| c.tested && c.kind == "physical" && !is_found(&c.effect));
    let mut hidden: Vec<_> = tested.filter_map(|c| Some((c, c.detectable.as_ref()?))).collect();
    let change = |of: &DetectableEntry| of.check_change_m.unwrap_or(0.0);
    hidden.sort_by(|(_, a), (_, b)| change(b).total_cmp(&change(a)));
    hidden
}

fn untested(diagnosis: &Diagnosis) -> Vec<String> {
    diagnosis.candidates.iter().filter(|c| !c.tested).map(|c| in_words(&c.effect)).collect()
}

/// In a sentence; `None` where nothing is known.
pub(super) fn sentence(diagnosis: &Diagnosis, scaled: bool) -> Option<String> {
    let one = |(c, d): &(&CandidateEntry, &DetectableEntry)| {
        let moves = d
            .check_change_m
            .filter(|_| scaled)
            .map_or(String::new(), |m| format!(", which moves points by {} mm", short_mm(m)));
        format!("{} of {}{moves}", in_words(&c.effect), short_size(d.size, &d.unit))
    };
    let all = hidden(diagnosis);
    let shown: Vec<String> = all.iter().take(NAMED).map(one).collect();
    let mut sentences = Vec::new();
    if !shown.is_empty() {
        sentences
            .push(format!("Smaller effects than these can hide (found with 80 % probability): {}.", shown.join("; ")));
    }
    let untested = untested(diagnosis);
    if !untested.is_empty() {
        sentences.push(format!("Not testable in this block: {}.", untested.join(", ")));
    }
    (!sentences.is_empty()).then(|| sentences.join(" "))
}

/// The section with all of them.
pub(super) fn section(page: &mut Page, diagnosis: &Diagnosis, scaled: bool) {
    let all = hidden(diagnosis);
    if all.is_empty() {
        return;
    }
    page.section("What this block could not have shown");
    page.paragraph(
        "The smallest size of each effect that this block shows with a probability of 80 %, at the base model. An \
         effect below that size may be there, and the last column says what it would do to the check points (3D RMS).",
    );
    for (candidate, of) in all.iter().filter(|(_, of)| of.factor_of_sample > 1.0) {
        page.paragraph(&format!(
            "The values of {} are tested in a sample of the images. In all images, a standard deviation {} times \
             smaller would show.",
            named(&candidate.effect),
            fixed(of.factor_of_sample, 2)
        ));
    }
    let mut table = Table::new("").text("effect", "").number("size found with 80 %", "");
    if scaled {
        table = table.number("moves points by", "mm");
    }
    for (candidate, of) in all {
        let row = [named(&candidate.effect), short_size(of.size, &of.unit)];
        let change = scaled.then(|| or_dash(of.check_change_m, short_mm));
        table.row(row.into_iter().chain(change));
    }
    page.table(&table);
}
