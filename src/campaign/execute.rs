//! Works a case: makes its block, diagnoses it, keeps what was said.

use super::{Candidate, Case, Estimate, Outcome};
use crate::adjust::Options;
use crate::diagnose::run::diagnose;
use crate::diagnose::settings::Settings;
use crate::diagnose::verdict::{Diagnosis, Verdict};
use anyhow::Result;
use std::collections::BTreeMap;
use std::path::Path;

/// Works a case on one thread; `folder`: of the campaign.
///
/// # Errors
/// A block that cannot be made, or cannot be adjusted.
pub fn execute(case: &Case, folder: &Path) -> Result<Outcome> {
    let block = case.block(folder)?;
    let model = case.model(&block)?;
    let options = Options { threads: 1, ..Options::default() };
    let settings = Settings { plugins: &[], options, significance: case.significance(), snoop: true, tell: &|_| {} };
    let diagnosed = diagnose(&block, &model, &settings)?;
    let counts = [
        ("images", block.images.len()),
        ("tie_points", block.tie_points.len()),
        ("measurements", block.ties.len() + block.marks.len()),
    ];
    Ok(outcome(&diagnosed.diagnosis, &counts, &case.expected))
}

fn outcome(diagnosis: &Diagnosis, counts: &[(&str, usize)], expected: &[String]) -> Outcome {
    let mut figures: BTreeMap<String, f64> =
        counts.iter().map(|(name, count)| ((*name).to_owned(), *count as f64)).collect();
    let rows = [("base", diagnosis.ledger.first()), ("final", diagnosis.ledger.last())];
    for (of, row) in rows.into_iter().filter_map(|(of, row)| Some((of, row?))) {
        let own = [
            ("sigma0", Some(row.sigma0)),
            ("tie_rms_px", Some(row.tie_rms_px)),
            ("heldout_rms_px", row.heldout_rms_px),
            ("check_rms_m", row.check_rms_m),
        ];
        // A table has numbers alone.
        let known = own.into_iter().filter_map(|(name, value)| Some((name, value.filter(|value| value.is_finite())?)));
        figures.extend(known.map(|(name, value)| (format!("{name}_{of}"), value)));
    }
    figures.insert("outliers".into(), diagnosis.outliers as f64);
    let verdict = match diagnosis.verdict {
        Verdict::Adequate => "adequate",
        Verdict::Missing => "missing",
        Verdict::Unexplained => "unexplained",
        Verdict::Mistake => "mistake",
    };
    let tested = diagnosis.candidates.iter().filter(|own| own.tested && own.p_value.is_finite());
    let sizes = diagnosis.found.iter().flat_map(|found| {
        let of_parameter = |(parameter, size): (&String, &crate::diagnose::verdict::EstimateEntry)| Estimate {
            effect: found.effect.clone(),
            parameter: parameter.clone(),
            value: size.value,
            sigma: size.sigma,
            unit: size.unit.clone(),
        };
        found.estimate.iter().map(of_parameter).collect::<Vec<_>>()
    });
    let mut outcome = Outcome {
        verdict: verdict.into(),
        named: diagnosis.recommended.clone(),
        mistakes: diagnosis.mistakes.iter().map(|own| format!("{} of {}", own.kind, own.subject)).collect(),
        right: false,
        figures,
        candidates: tested.map(|own| Candidate { effect: own.effect.clone(), p_value: own.p_value }).collect(),
        estimates: sizes.filter(|size| size.value.is_finite() && size.sigma.is_finite()).collect(),
    };
    let mut wanted: Vec<&str> = expected.iter().map(String::as_str).collect();
    wanted.sort_unstable();
    outcome.right = outcome.verdict != "unexplained" && outcome.said() == wanted;
    outcome
}
