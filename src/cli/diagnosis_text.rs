//! A diagnosis in words and tables, for the terminal.

use crate::diagnose::run::Diagnosed;
use crate::diagnose::verdict::{CandidateEntry, Verdict};
use crate::report::numbers::{fixed, mm, or_dash, p_value, significant};
use crate::report::tables::Table;

/// Candidates that the terminal shows; the report and diagnosis.json have all.
const SHOWN: usize = 10;

/// The whole text.
pub fn text(diagnosed: &Diagnosed) -> String {
    let diagnosis = &diagnosed.diagnosis;
    let mut text = format!("{}\n", verdict_sentence(diagnosed));
    for sentence in &diagnosis.left {
        text += &format!("  - {sentence}\n");
    }
    if diagnosis.outliers > 0 {
        text += &format!("{} measurements were set aside as outliers.\n", diagnosis.outliers);
    }
    text + "\n" + &candidates_table(&diagnosis.candidates, SHOWN).to_text() + "\n" + &ledger_table(diagnosed).to_text()
}

/// The verdict as a sentence.
pub fn verdict_sentence(diagnosed: &Diagnosed) -> String {
    let diagnosis = &diagnosed.diagnosis;
    let names = |ids: &[String]| ids.iter().map(|id| with_partners(diagnosed, id)).collect::<Vec<_>>().join("; and ");
    match diagnosis.verdict {
        Verdict::Adequate => "adequate: nothing significant is left.".into(),
        Verdict::Missing => format!("missing: {}.", names(&diagnosis.recommended)),
        Verdict::Unexplained if diagnosis.recommended.is_empty() => {
            let significant: Vec<&CandidateEntry> =
                diagnosis.candidates.iter().filter(|c| c.significant && c.kind == "physical").collect();
            match significant.first() {
                Some(best) if diagnosed.improvement.confirmations.is_empty() => {
                    format!("missing, not yet added: {}; run improve.", with_partners(diagnosed, &best.effect))
                }
                _ => "unexplained: something significant is left that no effect of the catalogue explains.".into(),
            }
        }
        Verdict::Unexplained => {
            format!("unexplained: {} was added, but something significant is left.", names(&diagnosis.recommended))
        }
    }
}

fn with_partners(diagnosed: &Diagnosed, id: &str) -> String {
    let entry = diagnosed.diagnosis.candidates.iter().find(|c| c.effect == id);
    match entry.map(|c| c.inseparable_from.as_slice()) {
        Some(partners) if !partners.is_empty() => {
            format!("{id} (or {}; this block cannot tell)", partners.join(", "))
        }
        _ => id.to_string(),
    }
}

/// Candidates by rank.
pub fn candidates_table(candidates: &[CandidateEntry], shown: usize) -> Table {
    let mut table = Table::new("What may be missing, at the base model")
        .text("effect", "")
        .number("statistic", "")
        .number("dof", "")
        .number("p", "")
        .number("predicted drop of v'Pv", "")
        .number("check points change", "mm")
        .text("estimate", "")
        .text("cannot be told from", "");
    for candidate in candidates.iter().filter(|candidate| candidate.tested).take(shown) {
        let estimate = match candidate.estimate.len() {
            0..4 => candidate
                .estimate
                .iter()
                .map(|(name, e)| {
                    format!("{name} = {} ± {} {}", significant(e.value, 3), significant(e.sigma, 2), e.unit)
                })
                .collect::<Vec<_>>()
                .join(", "),
            many => format!("{many} parameters"),
        };
        table.row([
            candidate.effect.clone(),
            fixed(candidate.statistic, 2),
            fixed(candidate.dof, 0),
            p_value(candidate.p_value),
            fixed(candidate.predicted_drop, 1),
            or_dash(candidate.predicted_check_change_m, mm),
            estimate,
            candidate.inseparable_from.join(", "),
        ]);
    }
    table
}

/// The ledger.
pub fn ledger_table(diagnosed: &Diagnosed) -> Table {
    let mut table = Table::new("Ledger")
        .number("step", "")
        .text("added", "")
        .number("sigma0", "")
        .number("tie RMS", "px")
        .number("held-out RMS", "px")
        .number("check points RMS", "mm")
        .number("drop of v'Pv", "")
        .number("p", "");
    for row in &diagnosed.diagnosis.ledger {
        table.row([
            row.step.to_string(),
            row.added.clone().unwrap_or_else(|| "(base)".into()),
            fixed(row.sigma0, 5),
            fixed(row.tie_rms_px, 5),
            or_dash(row.heldout_rms_px, |rms| fixed(rms, 5)),
            or_dash(row.check_rms_m, mm),
            fixed(row.statistic, 1),
            p_value(row.p_value),
        ]);
    }
    table
}
