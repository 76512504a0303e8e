//! A diagnosis in words and tables, for the terminal.

use crate::diagnose::verdict::Diagnosis;
use crate::mistakes::Mistake;
use crate::report::diagnosis_tables::{candidates_table, ledger_table, mistake_lines, verdict_sentence};
use crate::report::letter::{looser_sentence, sentences, weights_sentence};

/// Candidates that the terminal shows; the report and diagnosis.json have all.
const SHOWN: usize = 10;
/// Columns of a paragraph.
const WIDTH: usize = 100;

/// Mistakes, each with what to do; empty without any.
pub fn mistakes_text(mistakes: &[Mistake]) -> String {
    let mut text = String::new();
    for mistake in mistakes {
        let [sentence, remedy] = mistake_lines(mistake);
        for (text_of, first) in [(sentence, "  - "), (remedy, "    ")] {
            let options = textwrap::Options::new(WIDTH).initial_indent(first).subsequent_indent("    ");
            text += &format!("{}\n", textwrap::fill(&text_of, options));
        }
    }
    text
}

/// The whole text; without lengths on the ground where the block has no scale, or a mistake may have moved it.
pub fn text(diagnosis: &Diagnosis, scaled: bool) -> String {
    let scaled = diagnosis.has_lengths(scaled);
    let mut text = format!("{}\n", verdict_sentence(diagnosis));
    text += &mistakes_text(&diagnosis.mistakes);
    if let Some(weight) = &diagnosis.weight {
        text += &format!("{}\n", weight.sentence);
    }
    if let Some(sentence) = &diagnosis.check_points {
        text += &format!("{sentence}\n");
    }
    for sentence in weights_sentence(diagnosis).into_iter().chain(looser_sentence(diagnosis)) {
        text += &format!("{sentence}\n");
    }
    for found in &diagnosis.found {
        text += &format!("\n{}\n", found.effect);
        for sentence in sentences(found, scaled) {
            let options = textwrap::Options::new(WIDTH).initial_indent("  ").subsequent_indent("  ");
            text += &format!("{}\n", textwrap::fill(&sentence, options));
        }
    }
    if !diagnosis.left.is_empty() {
        let what =
            if diagnosis.check_points_alone_contradict() { "Unexplained" } else { "Unexplained residual patterns" };
        text += &format!("\n{what}:\n");
    }
    for sentence in &diagnosis.left {
        text += &format!("  - {sentence}\n");
    }
    if let Some(set_aside) = diagnosis.set_aside() {
        text += &format!("{set_aside}\n");
    }
    text + "\n"
        + &candidates_table(&diagnosis.candidates, SHOWN, scaled).to_text()
        + "\n"
        + &ledger_table(diagnosis, scaled).to_text()
}
