//! Groups of measurements whose stated precision the residuals contradict, where nothing else explains it.

use super::imprecise::Imprecise;
use super::verdict::{Diagnosis, Verdict};
use crate::mistakes::Mistake;

/// Groups of an adequate block that are much less precise than stated. Beside a cause, a pattern or another mistake
/// nobody knows whether the precision is at fault.
pub fn of_weights(diagnosis: &Diagnosis) -> Vec<Mistake> {
    if diagnosis.verdict != Verdict::Adequate {
        return Vec::new();
    }
    diagnosis.imprecise.iter().filter_map(|group| Some(said(group, subject_of(group)?))).collect()
}

fn subject_of(group: &Imprecise) -> Option<&'static str> {
    match group.group.split(' ').next() {
        Some("control") => Some("control"),
        Some("GNSS") => Some("gnss"),
        Some("image") => Some("ties"),
        Some("marks") => Some("marks"),
        _ => None,
    }
}

fn said(imprecise: &Imprecise, subject: &str) -> Mistake {
    let Imprecise { group, factor, worst } = imprecise;
    let (at_least, worst_ones) = (if imprecise.is_bound() { "at least " } else { "" }, worst.join(", "));
    let sentence = format!(
        "The residuals of {group} are {at_least}{factor:.1} times as large as the stated standard deviations allow; \
         the largest: {worst_ones}."
    );
    let remedy = "Look for wrong measurements first; else state the precision that they have (sigma columns, or \
                  [sigma] of block.toml).";
    let mistake = Mistake::new("precision", subject, sentence, remedy.into())
        .of(worst.clone())
        .tested(f64::NAN, f64::NEG_INFINITY);
    if imprecise.is_bound() { mistake } else { mistake.sized(*factor, None, "times") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_named_with_its_factor_or_its_bound() {
        let with = |group: &str, factor| Imprecise { group: group.into(), factor, worst: vec!["gcp1".into()] };
        let group = |group: &str| with(group, 30.0);
        assert_eq!(subject_of(&group("image measurements of flight a")), Some("ties"));
        assert_eq!(subject_of(&group("marks of control points")), Some("marks"));
        assert_eq!(subject_of(&group("GNSS in height of flight a")), Some("gnss"));
        let control = group("control in height");
        assert_eq!(subject_of(&control), Some("control"));
        let mistake = said(&control, "control");
        assert_eq!((mistake.kind.as_str(), mistake.value, mistake.unit), ("precision", None, None), "a bound alone");
        assert!(mistake.sentence.contains("control in height are at least 30.0 times"), "{}", mistake.sentence);
        let mistake = said(&with("GNSS in plan", 9.8), "gnss");
        assert_eq!((mistake.value, mistake.sigma, mistake.unit.as_deref()), (Some(9.8), None, Some("times")));
        assert!(mistake.sentence.contains("GNSS in plan are 9.8 times"), "{}", mistake.sentence);
    }
}
