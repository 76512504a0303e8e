//! The findings as an expert would write them: what each effect is, how large, what it did to the points, how sure that
//! is, what else it could be, what to do, and the pictures that show it: residuals before and after, and its own size.

use super::figures::{Arrow, Axis, LineChart, LineStyle, Panel, Series, VectorField, line_chart, vector_field};
use super::headline::in_words;
use super::html::Page;
use super::numbers::{fixed, mm, significant, unit_of, with_sigma};
use super::pictures::RunFolder;
use super::words;
use crate::diagnose::impact::Impact;
use crate::diagnose::imprecise::Imprecise;
use crate::diagnose::verdict::{Diagnosis, EstimateEntry, FoundEntry};
use crate::math::probability::p_is;
use crate::model::{FlightFactors, SigmaFactors};
use crate::run::folder::{BASE, FoundRow, WITH, WITHOUT};
use std::collections::{BTreeMap, BTreeSet};

/// Parameters of an effect that are named one by one; of more, their number and their sizes in px and mm say it better.
const NAMED_PARAMETERS: usize = 4;
/// More marks than this per component are no curve.
const MARKS_JOINED: usize = 60;

/// One section per effect that was found.
pub(super) fn letter(page: &mut Page, run: &RunFolder, diagnosis: &Diagnosis) {
    for found in &diagnosis.found {
        page.section(&format!("Found: {}", in_words(&found.effect)));
        for sentence in sentences(found, diagnosis.has_lengths(run.summary.has_scale())) {
            page.paragraph(&sentence);
        }
        if !found.plausible {
            page.warning(
                "The estimate is beyond what physics allows of this effect. Take it as a similar shape, and look for \
                 the cause among the effects that look like it.",
            );
        }
        picture(page, run, found);
    }
}

/// The findings on one effect, a sentence or two each; without lengths on the ground where the block has no scale.
pub fn sentences(found: &FoundEntry, scaled: bool) -> Vec<String> {
    let mut sentences = Vec::new();
    let words = words::of_found(found);
    sentences.extend(words.map(|words| words.what.to_string()));
    let mut size = format!("Size: {}.", sizes(&found.estimate));
    for (option, value) in &found.options {
        size.push_str(&format!(" Option: {option}={value}."));
    }
    if let Some(inputs) = &found.inputs {
        size.push_str(&format!(" With {inputs}."));
    }
    if let Some(impact) = found.impact.as_ref().filter(|_| scaled) {
        size += &format!(" {}.", moved(impact));
    }
    size += &format!(
        " In the images it is {} px (RMS over all image coordinates, after the part that camera and poses absorb).",
        significant(found.size_px, 2)
    );
    sentences.push(size);
    sentences.push(format!("Significance, conditional on the rest of the model: {}.", p_is(found.p_value)));
    let tell = words.map_or(String::new(), |words| format!(" To tell: {}.", words.tell));
    sentences.push(match found.inseparable_from.as_slice() {
        [] => format!("No other effect of the catalogue looks like it in this block.{tell}"),
        others => format!("This block cannot tell it from {}.{tell}", others.join(", ")),
    });
    sentences.extend(words.map(|words| format!("What to do: {}", words.remedy)));
    sentences
}

fn sizes(estimate: &BTreeMap<String, EstimateEntry>) -> String {
    if estimate.len() > NAMED_PARAMETERS {
        return format!("{} coefficients, in summary.json", estimate.len());
    }
    let size = |(name, e): (&String, &EstimateEntry)| {
        format!("{name} = {} {}", with_sigma(e.value, e.sigma), unit_of(&e.unit)).trim_end().to_string()
    };
    estimate.iter().map(size).collect::<Vec<_>>().join(", ")
}

/// Of one effect alone; how far all of them together moved the points is measured, and the headline has it.
fn moved(Impact { rms_m, height_m, surveyed }: &Impact) -> String {
    let points = if *surveyed { "the surveyed points" } else { "the points (a sample, after a similarity)" };
    format!(
        "Left out of the final model, at unchanged weights, it moves {points} by {} mm (3D RMS, to first order; {} \
         mm in height)",
        mm(*rms_m),
        mm(*height_m)
    )
}

fn id(found: &FoundEntry) -> String {
    format!("found-{}", found.effect.replace(|c: char| !c.is_ascii_alphanumeric(), "-"))
}

/// What the measurements leave before the effect was added and after, and the effect's own size.
fn picture(page: &mut Page, run: &RunFolder, found: &FoundEntry) {
    let rows: Vec<&FoundRow> = run.found.iter().filter(|row| row.effect == found.effect).collect();
    match rows.first() {
        None => {}
        Some(first) if first.y.is_some() => sensor_picture(page, run, found, &rows),
        Some(_) => {
            let caption = match rows.iter().any(|row| row.stage == BASE) {
                true => AS_FITTED.to_string() + " " + OWN_SIZE,
                false => OWN_SIZE.into(),
            };
            page.figure(&id(found), line_chart(&profiles(found, &rows)), &caption);
        }
    }
}

const AS_FITTED: &str = "What each adjustment leaves: in the base model cameras and poses absorb most of the effect.";
const OWN_SIZE: &str = "The effect's own size: the final model with the effect taken out and everything else held. No \
                        adjustment shows residuals like these.";

fn profiles(found: &FoundEntry, rows: &[&FoundRow]) -> LineChart {
    let mut components: Vec<&str> = Vec::new();
    for row in rows {
        if !components.contains(&row.component.as_str()) {
            components.push(&row.component);
        }
    }
    // A mark of one residual has no deviation: lines between such marks would show their scatter alone.
    let single = rows.iter().all(|row| row.sigma.is_none())
        || rows.iter().filter(|row| row.stage == WITH).count() > MARKS_JOINED * components.len();
    let series = |component: &str, stage: &str, label: &str| {
        let own = rows.iter().filter(|row| row.stage == stage && row.component == component);
        let mut own: Vec<&&FoundRow> = own.collect();
        // Images come in the order of the block, and the line goes along the axis.
        own.sort_by(|a, b| a.x.total_cmp(&b.x));
        let series = Series::new(label, own.iter().map(|row| [row.x, row.mean]).collect());
        match single {
            true => series.style(LineStyle::Markers),
            false => series.sigma(own.iter().map(|row| 2.0 * row.sigma.unwrap_or(f64::NAN)).collect()),
        }
    };
    let panel = |component: &str, title: &str, series: Vec<Series>| Panel {
        title: title.into(),
        x: Axis::new(rows[0].against.as_str(), ""),
        y: Axis::new(component, rows[0].unit.as_str()),
        series,
    };
    let mut panels = Vec::new();
    for component in components {
        if rows.iter().any(|row| row.stage == BASE) {
            let both = vec![series(component, BASE, "base model"), series(component, WITH, "final model")];
            panels.push(panel(component, "Residuals of the two adjustments", both));
        }
        panels.push(panel(component, "The effect's own size", vec![series(component, WITHOUT, "the effect alone")]));
    }
    LineChart {
        title: format!("What shows {}", in_words(&found.effect)),
        panels,
        columns: 1,
        note: if single { String::new() } else { "Bars: ± 2 sigma of the mean.".into() },
        width: None,
    }
}

fn sensor_picture(page: &mut Page, run: &RunFolder, found: &FoundEntry, rows: &[&FoundRow]) {
    let cameras: BTreeSet<&str> = rows.iter().map(|row| row.camera.as_str()).collect();
    for (number, camera) in cameras.into_iter().enumerate() {
        let size = run.sensor.iter().find(|row| row.camera == camera).map(|row| [row.width_px, row.height_px]);
        let Some(size) = size else { continue };
        let field = |stage: &str, title: &str| {
            let of = |component: &'static str| {
                rows.iter().filter(move |row| row.camera == camera && row.stage == stage && row.component == component)
            };
            let arrows: Vec<Arrow> =
                of("dx").zip(of("dy")).filter_map(|(dx, dy)| Some(([dx.x, dx.y?], [dx.mean, dy.mean]))).collect();
            VectorField::single(&format!("{title}, camera {camera}"), size, arrows, "px")
        };
        let name = |stage: &str| format!("{}-{stage}-{}", id(found), number + 1);
        let alone = field(WITHOUT, "The effect's own size");
        if rows.iter().any(|row| row.stage == BASE) {
            let (mut base, mut last) = (field(BASE, "Residuals of the base model"), field(WITH, "Of the final model"));
            base.scale = [base.natural_scale(), last.natural_scale()].into_iter().flatten().reduce(f64::min);
            last.scale = base.scale;
            page.pair(
                (&name(BASE), vector_field(&base), AS_FITTED),
                (&name(WITH), vector_field(&last), "At the same scale."),
            );
        }
        page.figure(&name(WITHOUT), vector_field(&alone), OWN_SIZE);
    }
}

/// Factor on a stated standard deviation from which it is said that residuals ask for it: one digit shows it.
const LOOSER: f64 = 1.05;

/// A finding of its own: stated precisions that the residuals contradict.
pub fn weights_sentence(diagnosis: &Diagnosis) -> Option<String> {
    let group = |of: &Imprecise| {
        let worst = if of.worst.is_empty() { String::new() } else { format!(": worst {}", of.worst.join(", ")) };
        let at_least = if of.is_bound() { "at least " } else { "" };
        format!("{} ({at_least}{} times{worst})", of.group, fixed(of.factor, 1))
    };
    let groups: Vec<String> = diagnosis.imprecise.iter().map(group).collect();
    (!groups.is_empty()).then(|| {
        format!(
            "Much less precise than stated: {}. That is no question of precision any more: look for wrong coordinates, \
             a wrong frame or a missing effect there first.",
            groups.join("; ")
        )
    })
}

/// Stated precisions that the residuals reject, but not beyond what a precision may be: what was taken in their place.
pub fn looser_sentence(diagnosis: &Diagnosis) -> Option<String> {
    let SigmaFactors { image, mark, control, control_z, gnss, gnss_z } = diagnosis.sigma_factors;
    let marks = if mark > 1.0 { image * mark } else { 1.0 };
    let mut groups = vec![
        ("image measurements".to_string(), image),
        ("marks of control points".into(), marks),
        ("control in plan".into(), control),
        ("control in height".into(), control_z),
        ("GNSS in plan".into(), gnss),
        ("GNSS in height".into(), gnss_z),
    ];
    for (flight, FlightFactors { image, gnss, gnss_z }) in &diagnosis.flight_factors {
        for (name, factor) in [("image measurements", image), ("GNSS in plan", gnss), ("GNSS in height", gnss_z)] {
            groups.push((format!("{name} of flight {flight}"), *factor));
        }
    }
    let is_said = |name: &String| diagnosis.imprecise.iter().any(|of| of.group == *name);
    let looser = groups.into_iter().filter(|(name, factor)| *factor >= LOOSER && !is_said(name));
    let looser: Vec<String> = looser.map(|(name, factor)| format!("{name} ({} times)", fixed(factor, 1))).collect();
    (!looser.is_empty()).then(|| format!("Taken to be less precise than stated: {}.", looser.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(effect: &str) -> FoundEntry {
        let text = format!(
            r#"{{"effect": "{effect}", "estimate": {{}}, "drop": 1, "p_value": 0, "ln_p_value": -900, "size_px": 1,
                "inseparable_from": [], "impact": null, "plausible": true}}"#
        );
        serde_json::from_str(&text).expect("a finding")
    }

    #[test]
    fn what_is_taken_to_be_less_precise_is_said_once() {
        let text = r#"{"format": 1, "verdict": "adequate", "significance": 0.001, "candidates": [], "recommended": [],
            "structure": [], "left": [], "outliers": 0, "ledger": [],
            "sigma_factors":
                {"image": 0.6, "mark": 1.7, "control": 1.0, "control_z": 12.0, "gnss": 1.04, "gnss_z": 2.5},
            "imprecise": [{"group": "control in height", "factor": 12.0, "worst": ["gcp1"]}]}"#;
        let diagnosis: Diagnosis = serde_json::from_str(text).expect("a diagnosis");
        let expected = "Taken to be less precise than stated: GNSS in height (2.5 times).";
        assert_eq!(looser_sentence(&diagnosis).as_deref(), Some(expected), "marks are as precise as stated in all");
        let as_stated = Diagnosis { sigma_factors: SigmaFactors::default(), ..diagnosis };
        assert_eq!(looser_sentence(&as_stated), None);
    }

    /// Marks at 3, 1, 2, each of one residual or of several.
    fn row(k: usize, sigma: Option<f64>) -> FoundRow {
        FoundRow {
            effect: "earth-curvature".into(),
            stage: WITH.into(),
            against: "distance (m)".into(),
            component: "up".into(),
            unit: "m".into(),
            camera: String::new(),
            x: [3.0, 1.0, 2.0][k],
            y: None,
            n: 1,
            mean: k as f64,
            sigma,
        }
    }

    #[test]
    fn marks_of_one_residual_are_not_joined_and_lines_go_along_the_axis() {
        for (sigma, style) in [(None, LineStyle::Markers), (Some(0.1), LineStyle::LineAndMarkers)] {
            let rows: Vec<FoundRow> = (0..3).map(|k| FoundRow { stage: WITHOUT.into(), ..row(k, sigma) }).collect();
            let chart = profiles(&found("earth-curvature"), &rows.iter().collect::<Vec<_>>());
            let series = &chart.panels[0].series[0];
            assert_eq!(series.points, [[1.0, 1.0], [2.0, 2.0], [3.0, 0.0]]);
            assert_eq!((series.style, chart.note.is_empty()), (style, sigma.is_none()));
        }
    }
}
