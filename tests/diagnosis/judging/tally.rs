//! Many blocks: a line for each, and the score.

use super::program::Found;
use super::rule::{Judgement, Truth, judge};
use std::collections::BTreeSet;

/// What came of one block.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Of the block.
    pub name: String,
    /// Nothing was put in.
    pub clean: bool,
    /// What is wrong.
    pub judgement: Judgement,
}

impl Judged {
    /// Nothing is wrong.
    pub fn right(&self) -> bool {
        self.judgement.faults.is_empty()
    }
}

/// Judges what was found in a block, or that nothing was, and prints a line.
pub fn judged(name: &str, truth: &Truth, found: Result<Found, String>) -> Judged {
    let (judgement, text) = match &found {
        Ok(found) => (judge(truth, found), describe(truth, found)),
        Err(text) => {
            let faults = vec![format!("the program failed: {text}")];
            (Judgement { faults, ..Judgement::default() }, hidden_in(truth))
        }
    };
    let faults = judgement.faults.iter().map(|fault| format!(" | {fault}")).collect::<String>();
    let right = if judgement.faults.is_empty() { "right" } else { "WRONG" };
    println!("{name:16} {right}  {text}{faults}");
    Judged { name: name.into(), clean: truth.hidden.is_empty(), judgement }
}

fn describe(truth: &Truth, found: &Found) -> String {
    let named = if found.recommended.is_empty() { "nothing".into() } else { found.recommended.join(" + ") };
    format!(
        "{:11} found {named} | {} | check points {:.4} mm (true model {:.4}) | {:.1} s",
        found.verdict,
        hidden_in(truth),
        found.check_mm(),
        truth.check_mm,
        found.seconds
    )
}

fn hidden_in(truth: &Truth) -> String {
    let one = |hidden: &super::rule::Hidden| {
        let outsider = if hidden.outsider { " (in no catalogue)" } else { "" };
        format!("{}{outsider} {:.0}", hidden.name, hidden.noncentrality)
    };
    let all: Vec<String> = truth.hidden.iter().map(one).collect();
    let noise = if truth.correlated_noise { ", correlated noise" } else { "" };
    format!("hidden {}{noise}", if all.is_empty() { "nothing".into() } else { all.join(" + ") })
}

/// Classes of noncentrality: below the first nothing can be seen, above the last everything should be.
const CLASSES: [f64; 4] = [10.0, 30.0, 60.0, 200.0];

/// Prints how often an effect was named, by kind of block (last word of its name) and by noncentrality, and how often
/// nothing was invented.
pub fn print_hit_rates(all: &[Judged]) {
    let kind = |judged: &Judged| judged.name.rsplit(' ').next().unwrap_or("").to_string();
    let kinds: BTreeSet<String> = all.iter().map(kind).collect();
    let bounds = |k: usize| (CLASSES[k], CLASSES.get(k + 1).copied().unwrap_or(f64::INFINITY));
    let heads: Vec<String> =
        (0..CLASSES.len()).map(|k| format!("{:>12}", format!("{} and more", CLASSES[k]))).collect();
    println!("named of put in, by noncentrality\n{:12} {}  nothing invented  all right", "block", heads.join(" "));
    for name in kinds.iter().map(Some).chain([None]) {
        let own = || all.iter().filter(|judged| name.is_none_or(|name| kind(judged) == *name));
        let class = |k: usize| {
            let (low, high) = bounds(k);
            let of = || own().flat_map(|judged| &judged.judgement.named).filter(|(size, _)| (low..high).contains(size));
            format!("{:>12}", format!("{} of {}", of().filter(|(_, named)| *named).count(), of().count()))
        };
        let classes: Vec<String> = (0..CLASSES.len()).map(class).collect();
        let count = own().count();
        let clean = own().filter(|judged| judged.judgement.not_there.is_empty()).count();
        let right = own().filter(|judged| judged.right()).count();
        let name = name.map_or("all", String::as_str);
        println!("{name:12} {}  {clean:8} of {count:4}  {right} of {count}", classes.join(" "));
    }
}

/// Prints the score and gives it as one sentence, with the blocks that are wrong.
pub fn score(all: &[Judged]) -> String {
    let names = |chosen: &dyn Fn(&Judged) -> bool| {
        let names: Vec<&str> = all.iter().filter(|judged| chosen(judged)).map(|judged| judged.name.as_str()).collect();
        if names.is_empty() { "none".into() } else { names.join(", ") }
    };
    let text = format!(
        "{} of {} right; wrong: {}; with an effect that is not there: {}",
        all.iter().filter(|judged| judged.right()).count(),
        all.len(),
        names(&|judged| !judged.right()),
        names(&|judged| !judged.judgement.not_there.is_empty())
    );
    println!("{text}");
    text
}
