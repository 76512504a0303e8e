//! The first screen: what was wrong, what it cost, what to do; what remains, and what this block could not have shown.

use super::diagnosis_tables::mistake_lines;
use super::figures::{VectorField, map_width, residuals_plan_arrows, residuals_plan_signed, vector_field};
use super::headline::{NAMED, headline, in_words, largest_first, short_mm};
use super::html::{Page, class};
use super::pictures::{self, RunFolder};
use super::run_tables::solvers_verdict;
use super::{detectable, letter, points, provenance, words};
use crate::diagnose::verdict::{Diagnosis, FoundEntry, Verdict};
use crate::run::folder::{BASE, CheckRow, FINAL};

/// Width of the small pictures, px.
const SMALL: f64 = 360.0;
/// Points of the summary.
const WORST: usize = 3;

/// The first screen of a run's page.
pub(super) fn finding(page: &mut Page, run: &RunFolder) {
    let verdict = run.diagnosis.as_ref().map(|diagnosis| diagnosis.verdict);
    let verdict = verdict.or((!run.summary.mistakes.is_empty()).then_some(Verdict::Mistake));
    page.part(&format!("finding {}", verdict.map_or("adjusted", class)), |page| {
        match verdict {
            Some(verdict) => page.verdict(verdict, &headline(run)),
            None => page.line("headline", &headline(run)),
        };
        for sentence in to_do(run) {
            page.line("todo", &sentence);
        }
    });
    unsound(page, run);
    mistakes(page, run);
    if let Some(diagnosis) = &run.diagnosis {
        before_and_after(page, run);
        page.part("facts", |page| {
            page.terms(facts(run, diagnosis));
        });
        if let Some(sentence) = letter::weights_sentence(diagnosis) {
            page.warning(&sentence);
        }
        if let Some(sentence) = letter::looser_sentence(diagnosis) {
            page.note(&sentence);
        }
    }
    worst(page, run);
    page.line("provenance", &provenance::line(run));
}

/// What to do, in a sentence per effect.
fn to_do(run: &RunFolder) -> Vec<String> {
    let Some(diagnosis) = &run.diagnosis else {
        let next = "What to do: an adjustment alone does not say what is missing; misclosure improve looks for it.";
        let mistake = run.summary.mistakes.first().map(|mistake| mistake_lines(mistake)[1].clone());
        return vec![mistake.unwrap_or_else(|| next.into())];
    };
    let mut sentences = Vec::new();
    if let Some(mistake) = diagnosis.mistakes.first() {
        sentences.push(mistake_lines(mistake)[1].clone());
    }
    let found: Vec<&FoundEntry> = diagnosis.found.iter().collect();
    for one in largest_first(&found).into_iter().take(NAMED) {
        let whose = if found.len() > 1 { format!(" about {}", in_words(&one.effect)) } else { String::new() };
        sentences.extend(words::of_found(one).map(|words| format!("What to do{whose}: {}", words.remedy)));
    }
    if found.len() > NAMED {
        sentences.push("What to do about the others stands in the section of each.".into());
    }
    if sentences.is_empty() {
        sentences.push(match diagnosis.verdict {
            Verdict::Unexplained => {
                "What to do: see which pattern is left, below; it may be an effect of your own.".into()
            }
            _ => "What to do: nothing; the result stands as precise as stated.".into(),
        });
    }
    sentences
}

/// Solvers that do not agree: then nothing else matters.
fn unsound(page: &mut Page, run: &RunFolder) {
    if let Some(conclusion) = solvers_verdict(&run.summary).filter(|conclusion| !conclusion.sound) {
        page.warning(&format!("{}. No figure of this page can be relied on.", conclusion.text));
    }
}

/// Every mistake but the first, which is the headline.
fn mistakes(page: &mut Page, run: &RunFolder) {
    let of_diagnosis = run.diagnosis.as_ref().map(|diagnosis| &diagnosis.mistakes);
    for mistake in of_diagnosis.unwrap_or(&run.summary.mistakes).iter().skip(1) {
        page.warning(&mistake_lines(mistake).join(" "));
    }
}

/// Errors of the check points before and after, of the control points where there are no others; else the residuals
/// over the sensor of the first camera.
fn before_and_after(page: &mut Page, run: &RunFolder) {
    let stage = |role: &str, stage: &str| -> Vec<CheckRow> {
        let rows = run.checks_by_model.iter().filter(|row| row.role == role && row.stage == stage);
        rows.map(pictures::as_check).collect()
    };
    for (role, name) in [("check", "Check points"), ("control", "Control points")] {
        let [before, after] = [stage(role, BASE), stage(role, FINAL)];
        if !before.is_empty() && !after.is_empty() {
            page.part("before-after", |page| points_before_and_after(page, run, name, &before, &after));
            return;
        }
    }
    let Some(camera) = run.sensor.first().map(|row| row.camera.as_str()) else { return };
    let field = |stage: &str, title: &str| pictures::sensor(run, camera, stage, title);
    if let (Some(mut before), Some(mut after)) = (field(BASE, "Before"), field(FINAL, "After")) {
        for field in [&mut before, &mut after] {
            field.width = Some(SMALL);
            field.cells.clear();
        }
        before.scale = [&before, &after].into_iter().filter_map(VectorField::natural_scale).reduce(f64::min);
        after.scale = before.scale;
        page.part("before-after", |page| {
            page.pair(
                ("finding-before", vector_field(&before), "Mean image residuals over the sensor."),
                ("finding-after", vector_field(&after), "At the same scale."),
            );
        });
    }
}

/// In plan or in height, where the errors were larger.
fn points_before_and_after(page: &mut Page, run: &RunFolder, name: &str, before: &[CheckRow], after: &[CheckRow]) {
    let mean = |rows: &[CheckRow], of: fn(&CheckRow) -> f64| {
        (rows.iter().map(|row| of(row).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt()
    };
    let title = |when: &str, rows: &[CheckRow]| format!("{when}: {} mm", short_mm(mean(rows, points::length)));
    let titles = [title("Before", before), title("After", after)];
    let in_plan = mean(before, |row| row.dx.hypot(row.dy)) >= mean(before, |row| row.dz);
    let frame = pictures::frame(run);
    let width = map_width(before.iter().map(|row| [row.x, row.y]), SMALL);
    let [left, right] = if in_plan {
        let mut maps = [before, after].map(|rows| pictures::plan(name, frame, rows.iter()));
        let scale = maps.iter().filter_map(|map| map.natural_scale()).reduce(f64::min);
        maps.iter_mut().zip(titles).for_each(|(map, title)| {
            (map.title, map.scale, map.width) = (title, scale, Some(width));
        });
        maps.map(|map| residuals_plan_arrows(&map))
    } else {
        let mut maps = [before, after].map(|rows| pictures::heights(name, frame, rows.iter()));
        let scale = maps.iter().filter_map(|map| map.natural_scale()).reduce(f64::min);
        maps.iter_mut().zip(titles).for_each(|(map, title)| {
            (map.title, map.scale, map.width) = (title, scale, Some(width));
        });
        maps.map(|map| residuals_plan_signed(&map))
    };
    let component = if in_plan { "in plan" } else { "in height" };
    page.pair(
        ("finding-before", left, &format!("{name} against the survey ({component}; RMS of the title in 3D).")),
        ("finding-after", right, "With the effects in the model, at the same scale."),
    );
}

/// What remains, what it means for a point, what could hide.
fn facts(run: &RunFolder, diagnosis: &Diagnosis) -> Vec<(&'static str, String)> {
    let scaled = run.summary.has_scale();
    let mut facts = Vec::new();
    match &diagnosis.weight {
        Some(weight) if scaled => facts.push(("What remains", weight.sentence.clone())),
        Some(_) if diagnosis.left.is_empty() => facts.push(("What remains", "No significant misfit.".into())),
        Some(_) => facts.push(("What remains", diagnosis.left.join("; "))),
        None => {}
    }
    facts.extend(diagnosis.check_points.as_ref().map(|sentence| ("Check points", sentence.clone())));
    facts.extend(
        detectable::sentence(diagnosis, diagnosis.has_lengths(scaled)).map(|sentence| ("What could hide", sentence)),
    );
    facts
}

/// The three worst check points, of control where there are no others.
fn worst(page: &mut Page, run: &RunFolder) {
    let of = |role: &str| run.checks.iter().filter(|row| row.role == role).collect::<Vec<_>>();
    let (name, rows) = match of("check") {
        rows if !rows.is_empty() => ("check points", rows),
        _ => ("control points", of("control")),
    };
    let worst = points::worst_first(&rows);
    if !worst.is_empty() {
        let worst = &worst[..worst.len().min(WORST)];
        page.table(&points::table(&format!("The worst {name} (of {})", rows.len()), worst));
    }
}
