//! Surveyed groups whose stated precision the residuals contradict, where nothing else explains it.

use super::super::imprecise::Imprecise;
use super::super::verdict::{Diagnosis, Verdict};
use crate::mistakes::{Mistake, Subject};

/// Groups of an adequate block that are much less precise than stated. Beside a cause, a pattern or another mistake
/// nobody knows whether the precision is at fault.
pub fn of_weights(diagnosis: &Diagnosis) -> Vec<Mistake> {
    if diagnosis.verdict != Verdict::Adequate {
        return Vec::new();
    }
    diagnosis.imprecise.iter().filter_map(|group| Some(said(group, subject_of(group)?))).collect()
}

/// Image measurements have no stated precision that anybody measured.
fn subject_of(group: &Imprecise) -> Option<Subject> {
    match group.group.split(' ').next() {
        Some("control") => Some(Subject::Control),
        Some("GNSS") => Some(Subject::Gnss),
        _ => None,
    }
}

fn said(group: &Imprecise, subject: Subject) -> Mistake {
    let Imprecise { group, factor, worst } = group;
    // The factor stands at the end of its range: a bound, and no value.
    let sentence = format!(
        "The residuals of {group} are at least {factor:.1} times as large as the stated standard deviations allow; \
         the largest: {}.",
        worst.join(", ")
    );
    let remedy = "Look for wrong coordinates first; else state the precision that they have (sigma columns, or \
                  [sigma] of block.toml).";
    Mistake::new("precision", subject.key(), sentence, remedy.into())
        .of(worst.clone())
        .tested(f64::NAN, f64::NEG_INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_of_the_survey_is_named_and_images_are_not() {
        let group = |group: &str| Imprecise { group: group.into(), factor: 3.0, worst: vec!["gcp1".into()] };
        assert_eq!(subject_of(&group("image measurements of flight a")), None);
        assert_eq!(subject_of(&group("GNSS in height of flight a")), Some(Subject::Gnss));
        let control = group("control in height");
        assert_eq!(subject_of(&control), Some(Subject::Control));
        let mistake = said(&control, Subject::Control);
        assert_eq!((mistake.kind.as_str(), mistake.value, mistake.unit), ("precision", None, None), "a bound alone");
        assert!(mistake.sentence.contains("control in height are at least 3.0 times"), "{}", mistake.sentence);
    }
}
