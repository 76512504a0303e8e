//! The verdict as a sentence, and the tables of a diagnosis, alike in the terminal and on its page.

use super::numbers::{fixed, mm, or_dash, significant, unit_of};
use super::tables::Table;
use crate::diagnose::verdict::{CandidateEntry, Diagnosis, Verdict};
use crate::math::probability::p_value;
use crate::mistakes::Mistake;

/// The verdict as a sentence.
pub fn verdict_sentence(diagnosis: &Diagnosis) -> String {
    let names = |ids: &[String]| ids.iter().map(|id| with_partners(diagnosis, id)).collect::<Vec<_>>().join("; and ");
    match diagnosis.verdict {
        Verdict::Adequate => "adequate: no significant misfit remains.".into(),
        Verdict::Missing => format!("missing: {}.", names(&diagnosis.recommended)),
        Verdict::Mistake => mistake_sentence(diagnosis, &names(&diagnosis.recommended)),
        Verdict::Unexplained if diagnosis.check_points_alone_contradict() => match diagnosis.recommended.is_empty() {
            true => "unexplained: the check points contradict the block, and its images do not show why.".into(),
            false => {
                let included = names(&diagnosis.recommended);
                format!("unexplained: {included} is included, but the check points contradict the block.")
            }
        },
        Verdict::Unexplained if diagnosis.recommended.is_empty() => {
            "unexplained: residual patterns remain that no effect of the catalogue explains.".into()
        }
        Verdict::Unexplained => {
            format!("unexplained: {} is included, but residual patterns remain.", names(&diagnosis.recommended))
        }
    }
}

/// Mistakes stand below the sentence, each in one of its own.
fn mistake_sentence(diagnosis: &Diagnosis, beside: &str) -> String {
    let what = match diagnosis.mistakes.as_slice() {
        [one] => format!("{} ({})", one.kind, one.subject),
        many => many.iter().map(|m| format!("{} ({})", m.kind, m.subject)).collect::<Vec<_>>().join(", "),
    };
    match (diagnosis.recommended.is_empty(), diagnosis.left.is_empty()) {
        (true, true) => format!("mistake: {what}."),
        (false, true) => format!("mistake: {what}. Also missing: {beside}."),
        (_, false) => {
            format!("mistake: {what}. Residual patterns remain, too, that no effect of the catalogue explains.")
        }
    }
}

/// A mistake as lines for a person: what it is, what to do.
pub fn mistake_lines(mistake: &Mistake) -> [String; 2] {
    [mistake.sentence.clone(), format!("What to do: {}", mistake.remedy)]
}

fn with_partners(diagnosis: &Diagnosis, id: &str) -> String {
    let entry = diagnosis.candidates.iter().find(|c| c.effect == id);
    match entry.map(|c| c.inseparable_from.as_slice()) {
        Some(partners) if !partners.is_empty() => {
            format!("{id} (or {}; this block cannot tell)", partners.join(", "))
        }
        _ => id.to_string(),
    }
}

/// Candidates by rank; without lengths on the ground where the block has no scale.
pub fn candidates_table(candidates: &[CandidateEntry], shown: usize, scaled: bool) -> Table {
    let mut table = Table::new("What may be missing, at the base model")
        .text("effect", "")
        .number("statistic", "")
        .number("dof", "")
        .number("p", "")
        .number("p, Sidak", "")
        .text("significant", "")
        .number("predicted drop", "");
    if scaled {
        table = table.number("check points change", "mm");
    }
    table = table.text("estimate", "").text("cannot be told from", "");
    for candidate in candidates.iter().filter(|candidate| candidate.tested).take(shown) {
        let estimate = match candidate.estimate.len() {
            0..4 => candidate
                .estimate
                .iter()
                .map(|(name, e)| {
                    format!("{name} = {} ± {} {}", significant(e.value, 3), significant(e.sigma, 2), unit_of(&e.unit))
                        .trim_end()
                        .into()
                })
                .collect::<Vec<String>>()
                .join(", "),
            many => format!("{many} parameters"),
        };
        let statistic = fixed(candidate.statistic, 2);
        let test = [
            candidate.effect.clone(),
            match candidate.test.as_str() {
                "" => statistic,
                name => format!("{name} = {statistic}"),
            },
            fixed(candidate.dof, 0),
            p_value(candidate.p_value),
            or_dash(candidate.family_p_value, p_value),
            if candidate.significant { "yes" } else { "no" }.into(),
            fixed(candidate.predicted_drop, 1),
        ];
        let change = scaled.then(|| or_dash(candidate.predicted_check_change_m, mm));
        table.row(test.into_iter().chain(change).chain([estimate, candidate.inseparable_from.join(", ")]));
    }
    table.note(
        "F: of the parameters; z: of the summed squares of a random effect's scores, standardised. p: of this test \
         alone; p, Sidak, and significant: among all candidates together. predicted drop: of the weighted sum of \
         squares",
    );
    table
}

/// The ledger; drops are those of the weighted sum of squares. Its steps are numbered by their place. Without check
/// points where lengths on the ground mean nothing.
pub fn ledger_table(diagnosis: &Diagnosis, lengths: bool) -> Table {
    let mut table = Table::new("Ledger")
        .number("step", "")
        .text("added", "")
        .number("sigma0", "")
        .number("tie RMS", "px")
        .number("held-out RMS", "px");
    if lengths {
        table = table.number("check points RMS", "mm");
    }
    table = table.number("drop", "").number("objective", "").number("p", "");
    for (step, row) in diagnosis.ledger.iter().enumerate() {
        let misfit = [
            step.to_string(),
            row.added.clone().unwrap_or_else(|| "(base)".into()),
            fixed(row.sigma0, 5),
            fixed(row.tie_rms_px, 5),
            or_dash(row.heldout_rms_px, |rms| fixed(rms, 5)),
        ];
        let check = lengths.then(|| or_dash(row.check_rms_m, mm));
        let gain = [fixed(row.statistic, 1), fixed(row.objective, 1), p_value(row.p_value)];
        table.row(misfit.into_iter().chain(check).chain(gain));
    }
    table.note("drop: of the weighted sum of squares");
    table
}

/// Tests of residual structure, at the final model.
pub fn structure_table(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::new("Structure in the residuals of the final model")
        .text("against", "")
        .number("statistic", "")
        .number("p", "")
        .number("p among all", "")
        .text("in words", "");
    for test in &diagnosis.structure {
        let watching = if test.decides { "" } else { " (decides nothing)" };
        table.row([
            test.against.clone() + watching,
            fixed(test.statistic, 2),
            p_value(test.p_value),
            p_value(test.family_p_value),
            test.description.clone(),
        ]);
    }
    table
}

/// Candidates that this block cannot test, and what it lacks.
pub fn untested_table(candidates: &[CandidateEntry]) -> Table {
    let mut table = Table::new("Not tested: what the block lacks").text("effect", "").text("needs", "");
    for candidate in candidates.iter().filter(|candidate| !candidate.tested) {
        table.row([candidate.effect.clone(), candidate.needs.join(", ")]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_lengths_the_ledger_has_no_millimetres() {
        let text = r#"{"format": 1, "verdict": "mistake", "significance": 0.001, "candidates": [], "recommended": [],
            "structure": [], "left": [], "outliers": 0,
            "ledger": [{"step": 0, "added": null, "sigma0": 1.0, "tie_rms_px": 0.3, "heldout_rms_px": 0.4,
                "check_rms_m": 21.312, "statistic": 0.0, "p_value": 1.0}],
            "sigma_factors": {"image": 1.0, "control": 1.0, "control_z": 1.0, "gnss": 1.0, "gnss_z": 1.0}}"#;
        let diagnosis: Diagnosis = serde_json::from_str(text).expect("a diagnosis");
        let with = ledger_table(&diagnosis, true).to_text();
        assert!(with.contains("check points RMS") && with.contains("21312"), "{with}");
        let without = ledger_table(&diagnosis, false).to_text();
        assert!(!without.contains("mm") && !without.contains("21312") && without.contains("0.40000"), "{without}");
    }
}
