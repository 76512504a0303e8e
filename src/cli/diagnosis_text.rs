//! A diagnosis in words and tables, for the terminal.

use crate::diagnose::verdict::Diagnosis;
use crate::report::diagnosis_tables::{candidates_table, ledger_table, verdict_sentence};

/// Candidates that the terminal shows; the report and diagnosis.json have all.
const SHOWN: usize = 10;

/// The whole text.
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut text = format!("{}\n", verdict_sentence(diagnosis));
    for sentence in &diagnosis.left {
        text += &format!("  - {sentence}\n");
    }
    if diagnosis.outliers > 0 {
        text += &format!("{} measurements were set aside as outliers.\n", diagnosis.outliers);
    }
    text + "\n" + &candidates_table(&diagnosis.candidates, SHOWN).to_text() + "\n" + &ledger_table(diagnosis).to_text()
}
