//! The finding in two sentences: which effect, how large, what it did to the points, and what the model with it gains.

use super::numbers::{significant, unit_of};
use super::pictures::RunFolder;
use crate::diagnose::moved::{Kind, Moved};
use crate::diagnose::verdict::{Diagnosis, FoundEntry, Verdict};
use crate::run::summary::Summary;

/// Effects that the first screen names; the sections below have all.
pub(super) const NAMED: usize = 3;

/// The headline of a run.
pub(super) fn headline(run: &RunFolder) -> String {
    let Some(diagnosis) = &run.diagnosis else { return of_adjustment(&run.summary) };
    let mut sentences = Vec::new();
    if diagnosis.verdict == Verdict::Mistake {
        sentences.extend(diagnosis.mistakes.first().map(|mistake| mistake.sentence.clone()));
    }
    if diagnosis.found.is_empty() {
        if diagnosis.verdict == Verdict::Adequate {
            sentences.push("This block shows no missing effect.".into());
        }
        let checked = checked(&run.summary);
        sentences.extend(match diagnosis.verdict {
            // What the diagnosis left out, undid or kept differs from mistake to mistake: the sections say it of each.
            Verdict::Mistake => checked.map(|sentence| format!("In this run, {}", lowered(&sentence))),
            _ => checked,
        });
    } else {
        let check = run.summary.check.as_ref().map(|check| check.n);
        sentences.extend(of_effects(diagnosis, run.summary.has_scale(), check));
    }
    // The verdict above says already that something is left; a block without surveyed points has nothing else.
    if sentences.is_empty() {
        sentences.push("No effect was added.".into());
    }
    sentences.join(" ")
}

/// What the effects of the model did to the points, and what the model with them gains; `None` where it has none.
/// `scaled`: the block has a scale; `check`: its number of check points.
pub fn of_effects(diagnosis: &Diagnosis, scaled: bool, check: Option<usize>) -> Option<String> {
    let effects: Vec<&FoundEntry> = diagnosis.found.iter().collect();
    if effects.is_empty() {
        return None;
    }
    let lengths = diagnosis.has_lengths(scaled);
    let measured = diagnosis.moved.as_ref().filter(|_| lengths);
    let mut sentences = vec![format!("{}.", moved(&effects, measured))];
    sentences.extend(gained(diagnosis, check.filter(|_| lengths)));
    Some(sentences.join(" "))
}

fn of_adjustment(summary: &Summary) -> String {
    let sentences = summary.mistakes.first().map(|mistake| mistake.sentence.clone()).into_iter();
    let fit = summary
        .tie_rms_px
        .map(|rms| format!("Image residuals are {} px (tie points, RMS per coordinate).", significant(rms, 2)));
    let sentences: Vec<String> = sentences.chain(checked(summary)).chain(fit).collect();
    sentences.join(" ")
}

/// Check points as they are, where nothing was added; control points where there are no others.
fn checked(summary: &Summary) -> Option<String> {
    let (name, s) = match (&summary.check, &summary.control) {
        (Some(check), _) => ("Check points", check),
        (None, Some(control)) => ("Control points", control),
        (None, None) => return None,
    };
    Some(format!("{name} differ from the survey by {} mm ({}).", short_mm(s.rms_m.xyz), counted(s.n)))
}

fn counted(n: usize) -> String {
    format!("{n} {}, 3D RMS", if n == 1 { "point" } else { "points" })
}

/// Effects by their size in the images.
pub(super) fn largest_first<'a>(effects: &[&'a FoundEntry]) -> Vec<&'a FoundEntry> {
    let mut order = effects.to_vec();
    order.sort_by(|a, b| b.size_px.total_cmp(&a.size_px));
    order
}

/// What the effects did together, the largest first: `measured` between the adjustments without them and with them.
/// Without it, how much of each the images show.
fn moved(effects: &[&FoundEntry], measured: Option<&Moved>) -> String {
    let order = largest_first(effects);
    let named = |found: &FoundEntry| {
        let size = size(found).map_or(String::new(), |size| format!(" ({size})"));
        in_words(&found.effect) + &size
    };
    let several = order.len() > 1;
    let Some(measured) = measured else {
        let in_images = |found: &&FoundEntry| format!("{}: {} px", named(found), significant(found.size_px, 2));
        let names: Vec<String> = order.iter().take(NAMED).map(in_images).collect();
        let all = capitalised(&enumerated(names, order.len()));
        return format!("{all} in the images (RMS, after the part that camera and poses absorb)");
    };
    let names = order.iter().take(NAMED).map(|found| named(found)).collect();
    let together = if several { " together" } else { "" };
    format!(
        "{}{together} moved your points by {} mm ({}, 3D RMS)",
        capitalised(&enumerated(names, order.len())),
        short_mm(measured.rms_m),
        points(measured)
    )
}

fn points(moved: &Moved) -> String {
    let kind = match moved.of {
        Kind::Check => "check",
        Kind::Control => "control",
        Kind::Tie => "tie",
    };
    format!("{} {kind} {}", moved.points, if moved.points == 1 { "point" } else { "points" })
}

/// `a`, `a and b`, `a, b and c`; of more than are named, how many more there are.
fn enumerated(mut names: Vec<String>, total: usize) -> String {
    if total > names.len() {
        let more = total - names.len();
        names.push(format!("{more} more {}", if more == 1 { "effect" } else { "effects" }));
    }
    let last = names.pop().unwrap_or_default();
    match names.is_empty() {
        true => last,
        false => format!("{} and {last}", names.join(", ")),
    }
}

/// An error before and after, as the last step of the ledger has it: of the check points, else of predicted image
/// measurements.
fn gained(diagnosis: &Diagnosis, check: Option<usize>) -> Option<String> {
    let without = diagnosis.moved.as_ref().map_or(0, |moved| moved.step);
    let (first, last) = (diagnosis.ledger.get(without)?, diagnosis.ledger.last()?);
    let what = match diagnosis.found.len() {
        1 => "it",
        2 => "both",
        _ => "them",
    };
    let goes = |from: f64, to: f64| if to <= from { "falls" } else { "rises" };
    if let (Some(from), Some(to), Some(n)) = (first.check_rms_m, last.check_rms_m, check) {
        let [before, after] = [short_mm(from), short_mm(to)];
        let goes = goes(from, to);
        return Some(format!(
            "With {what} in the model the check-point error {goes} from {before} to {after} mm ({}).",
            counted(n)
        ));
    }
    let (from, to) = (first.heldout_rms_px?, last.heldout_rms_px?);
    Some(format!(
        "With {what} in the model the error of predicted image measurements {} from {} to {} px (left out of the fit, \
         RMS).",
        goes(from, to),
        significant(from, 3),
        significant(to, 3)
    ))
}

/// The size of an effect of one parameter, in a unit without many zeros.
fn size(found: &FoundEntry) -> Option<String> {
    let mut parameters = found.estimate.values();
    let one = parameters.next().filter(|_| found.estimate.len() == 1)?;
    // Nobody knows a coefficient of a polynomial by its size.
    if one.unit.contains('^') {
        return None;
    }
    Some(short_size(one.value, &one.unit))
}

/// A size in a unit without many zeros.
pub(super) fn short_size(value: f64, unit: &str) -> String {
    let small = value.abs() < 0.1;
    match unit {
        "s" if small => format!("{} ms", significant(1e3 * value, 3)),
        "m" if small => format!("{} mm", significant(1e3 * value, 3)),
        unit => format!("{} {}", significant(value, 3), unit_of(unit)).trim_end().into(),
    }
}

/// Millimetres, one decimal from 1 to 100.
pub(super) fn short_mm(metres: f64) -> String {
    let mm = 1e3 * metres;
    match mm.abs() {
        1.0..100.0 => format!("{mm:.1}"),
        100.0.. => format!("{mm:.0}"),
        _ => significant(mm, 2),
    }
}

/// An effect's id as words.
pub(super) fn in_words(id: &str) -> String {
    let id = id.strip_prefix("free:").map_or_else(|| id.to_string(), |group| format!("held value of {group}"));
    let word = |word: &str| match word {
        "gnss" => "GNSS".to_string(),
        "pp" => "principal point".to_string(),
        other => other.to_string(),
    };
    id.split(['-', ' ']).map(word).collect::<Vec<_>>().join(" ")
}

/// The same at the beginning of a sentence.
pub(super) fn named(id: &str) -> String {
    capitalised(&in_words(id))
}

fn lowered(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(effect: &str, value: f64, unit: &str, size_px: f64) -> FoundEntry {
        let text = format!(
            r#"{{"effect": "{effect}", "estimate": {{"t": {{"value": {value}, "sigma": 0.001, "unit": "{unit}"}}}},
                "drop": 1, "p_value": 0, "ln_p_value": -900, "size_px": {size_px}, "inseparable_from": [],
                "impact": {{"rms_m": 0.0248, "height_m": 0.005, "surveyed": true}}, "plausible": true}}"#
        );
        serde_json::from_str(&text).expect("a finding")
    }

    #[test]
    fn what_moved_the_points_is_measured_and_the_largest_effect_stands_first() {
        let small = found("focal-time", 5.98, "px", 0.11);
        let large = found("rolling-shutter", 0.0199, "s", 0.228);
        let measured = Moved { rms_m: 0.0457, height_m: 0.01, points: 50, of: Kind::Check, step: 0 };
        assert_eq!(
            moved(&[&large], Some(&measured)),
            "Rolling shutter (19.9 ms) moved your points by 45.7 mm (50 check points, 3D RMS)"
        );
        let sentence = moved(&[&small, &large], Some(&measured));
        assert!(
            sentence.starts_with("Rolling shutter (19.9 ms) and focal time (5.98 px) together moved"),
            "{sentence}"
        );
        let many = [&small, &large, &small, &small, &small];
        let sentence = moved(&many, Some(&measured));
        assert!(sentence.contains("focal time (5.98 px) and 2 more effects together moved"), "{sentence}");
        let radial = found("radial-high", -1.8e-29, "px^-8", 0.3);
        assert!(moved(&[&radial], Some(&measured)).starts_with("Radial high moved your points"));
        let sentence =
            "Rolling shutter (19.9 ms): 0.23 px in the images (RMS, after the part that camera and poses absorb)";
        assert_eq!(moved(&[&large], None), sentence);
    }

    fn diagnosis() -> Diagnosis {
        let row = |check: f64, heldout: f64| {
            format!(
                r#"{{"step": 0, "added": null, "sigma0": 1.0, "tie_rms_px": 0.3, "heldout_rms_px": {heldout},
                    "check_rms_m": {check}, "statistic": 0.0, "p_value": 1.0}}"#
            )
        };
        let text = format!(
            r#"{{"format": 1, "verdict": "adequate", "significance": 0.001, "candidates": [], "recommended": [],
                "structure": [], "left": [], "outliers": 0, "ledger": [{}, {}, {}],
                "sigma_factors": {{"image": 1.0, "control": 1.0, "control_z": 1.0, "gnss": 1.0, "gnss_z": 1.0}}}}"#,
            row(0.05, 0.5),
            row(0.0292, 0.4),
            row(0.0034, 0.3)
        );
        serde_json::from_str(&text).expect("a diagnosis")
    }

    #[test]
    fn what_is_gained_begins_with_the_step_that_the_points_moved_from() {
        let moved = Moved { rms_m: 0.028, height_m: 0.01, points: 50, of: Kind::Check, step: 1 };
        let found = vec![found("rolling-shutter", 0.0199, "s", 0.228)];
        assert_eq!(of_effects(&diagnosis(), true, Some(50)), None);
        let of = |verdict: Verdict, scaled: bool| {
            let (found, moved) = (found.clone(), Some(moved.clone()));
            of_effects(&Diagnosis { verdict, found, moved, ..diagnosis() }, scaled, Some(50)).expect("sentences")
        };
        assert_eq!(
            of(Verdict::Adequate, true),
            "Rolling shutter (19.9 ms) moved your points by 28.0 mm (50 check points, 3D RMS). With it in the model \
             the check-point error falls from 29.2 to 3.4 mm (50 points, 3D RMS)."
        );
        for sentence in [of(Verdict::Mistake, true), of(Verdict::Adequate, false)] {
            assert!(sentence.ends_with("falls from 0.400 to 0.300 px (left out of the fit, RMS)."), "{sentence}");
            assert!(!sentence.contains(" mm"), "{sentence}");
        }
    }

    #[test]
    fn names_and_sizes_are_words() {
        assert_eq!(named("gnss-lever-arm"), "GNSS lever arm");
        assert_eq!([named("pp-time"), in_words("gnss-shift")], ["Principal point time", "GNSS shift"]);
        assert_eq!(short_size(2.8e-4, "1"), "2.80e-4");
        assert_eq!([0.2, 0.0019709, 4e-5].map(short_mm), ["200", "2.0", "0.040"]);
    }
}
