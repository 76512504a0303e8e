//! What is recorded wrongly in the block of a node, and what may be missing beside it, strongest impact first, in
//! figures and in words.

use super::screened::in_words;
use super::state::Lab;
use crate::diagnose::verdict::{CandidateEntry, Diagnosis, FoundEntry, Verdict};
use crate::report::letter;
use crate::report::numbers::{mm, significant};
use crate::report::words;
use anyhow::Result;
use serde_json::{Value, json};

/// The candidates of a node.
///
/// # Errors
/// A node that is not done.
pub fn candidates(lab: &Lab, id: u32) -> Result<Value> {
    let view = lab.view(id)?;
    let Some(diagnosis) = &view.run.diagnosis else { anyhow::bail!("step {id} was not diagnosed") };
    let mut all: Vec<&CandidateEntry> = diagnosis.candidates.iter().collect();
    let impact = |one: &CandidateEntry| one.impact.as_ref().map_or(0.0, |impact| impact.rms_m);
    // Significant ones by what they do to the points, those that name a possible cause first; others by rank, which
    // puts the untested last.
    all.sort_by(|a, b| {
        let cause = |one: &CandidateEntry| one.kind == "physical" && one.plausible;
        let group = |one: &CandidateEntry| (!one.significant, one.significant && !cause(one));
        group(a).cmp(&group(b)).then_with(|| match a.significant {
            true => impact(b).total_cmp(&impact(a)),
            false => a.rank.cmp(&b.rank),
        })
    });
    let structure = diagnosis.structure.iter().map(|test| {
        json!({
            "against": test.against, "p_value": test.p_value, "family_p_value": test.family_p_value,
            "description": test.description,
            "decides": test.decides,
        })
    });
    Ok(json!({
        "verdict": diagnosis.verdict, "sentence": sentence(diagnosis), "left": diagnosis.left,
        "recommended": diagnosis.recommended, "next": next(diagnosis), "mistakes": diagnosis.mistakes,
        "candidates": all.into_iter().map(|one| candidate(lab, one)).collect::<Vec<_>>(),
        "found": diagnosis.found.iter().map(found).collect::<Vec<_>>(),
        "structure": structure.collect::<Vec<_>>(),
        "weight": diagnosis.weight.as_ref().map(|weight| weight.sentence.clone()),
    }))
}

/// The effect that the objective adds next. A diagnosis to which nothing is missing recommends what its model has
/// already.
fn next(diagnosis: &Diagnosis) -> Option<&str> {
    let is_in = |id: &String| diagnosis.found.iter().any(|found| found.effect == *id);
    diagnosis.recommended.iter().find(|id| !is_in(id)).map(String::as_str)
}

/// The verdict on the model as it stands.
fn sentence(diagnosis: &Diagnosis) -> String {
    match diagnosis.verdict {
        Verdict::Missing => format!("Something is missing; what shows most is {}.", diagnosis.recommended.join(", ")),
        Verdict::Unexplained => "Something is left that no effect of the catalogue explains.".into(),
        Verdict::Adequate => "Nothing significant is left.".into(),
        Verdict::Mistake => mistaken(diagnosis),
    }
}

/// The verdict where something is recorded wrongly: the mistake, and what shows beside it.
fn mistaken(diagnosis: &Diagnosis) -> String {
    let mistake = in_words(&diagnosis.mistakes).unwrap_or_default();
    let beside = match next(diagnosis) {
        None if diagnosis.left.is_empty() => String::new(),
        None => " Beside it something is left that no effect of the catalogue explains.".into(),
        Some(effect) => format!(" Beside it something is missing; what shows most is {effect}."),
    };
    format!("Something is recorded wrongly. {mistake}{beside}")
}

fn candidate(lab: &Lab, one: &CandidateEntry) -> Value {
    json!({
        "effect": one.effect, "rank": one.rank, "kind": one.kind, "tested": one.tested, "significant": one.significant,
        "plausible": one.plausible, "p_value": one.p_value, "ln_p_value": one.ln_p_value, "statistic": one.statistic,
        "dof": one.dof, "predicted_drop": one.predicted_drop, "size_px": one.size_px, "estimate": one.estimate,
        "impact_mm": one.impact.as_ref().map(|impact| 1e3 * impact.rms_m),
        "impact_height_mm": one.impact.as_ref().map(|impact| 1e3 * impact.height_m),
        "impact_surveyed": one.impact.as_ref().map(|impact| impact.surveyed),
        "inseparable_from": one.inseparable_from, "needs": one.needs, "detectable": one.detectable,
        "sentences": candidate_sentences(lab, one),
    })
}

/// What it is, and what it would do or what is lacking to say so.
fn candidate_sentences(lab: &Lab, one: &CandidateEntry) -> Vec<String> {
    // Of the catalogue or a plug-in; a camera group that is set free is neither.
    let effect = lab.effect(&one.effect);
    let descriptor = effect.as_ref().map(|effect| effect.descriptor());
    let about = descriptor.map_or_else(|| words::of(&one.effect), |descriptor| descriptor.words.as_ref());
    let mut sentences: Vec<String> = about.map(|words| words.what.to_string()).into_iter().collect();
    if sentences.is_empty() {
        sentences.extend(descriptor.map(|descriptor| descriptor.summary.to_string()));
    }
    if !one.tested {
        sentences.push(format!("It cannot be tested here: it needs {}.", one.needs.join(", ")));
        return sentences;
    }
    let mut size =
        format!("In the images it would take {} px away (RMS over all coordinates)", significant(one.size_px, 2));
    if let Some(impact) = &one.impact {
        let points = if impact.surveyed { "the surveyed points" } else { "the points" };
        size +=
            &format!(", and move {points} by {} mm, of which {} mm in height", mm(impact.rms_m), mm(impact.height_m));
    }
    sentences.push(size + ".");
    let tell = about.map_or(String::new(), |words| format!(" To tell: {}.", words.tell));
    match one.inseparable_from.as_slice() {
        [] if one.significant => sentences.push(format!("Nothing else looks like it in this block.{tell}")),
        [] => {}
        others => sentences.push(format!("It cannot be told from {} in this block.{tell}", others.join(", "))),
    }
    if one.significant {
        sentences.extend(about.map(|words| format!("What to do: {}", words.remedy)));
    }
    if !one.plausible {
        sentences.push("Its size is beyond what physics allows: it only looks like this cause.".into());
    }
    sentences
}

fn found(one: &FoundEntry) -> Value {
    json!({
        "effect": one.effect, "estimate": one.estimate, "drop": one.drop, "p_value": one.p_value,
        "ln_p_value": one.ln_p_value,
        "size_px": one.size_px, "impact_mm": one.impact.as_ref().map(|impact| 1e3 * impact.rms_m),
        "impact_height_mm": one.impact.as_ref().map(|impact| 1e3 * impact.height_m),
        "inseparable_from": one.inseparable_from, "plausible": one.plausible, "sentences": letter::sentences(one, true),
    })
}
