//! Many blocks: a line for each, and the score.

use super::program::Found;
use super::rule::{Judgement, Truth, judge};

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
