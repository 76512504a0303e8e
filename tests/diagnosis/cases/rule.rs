//! The rule itself: what it lets pass and what it does not.

use crate::judging::program::{Candidate, Found, Row};
use crate::judging::rule::{Hidden, Judgement, Truth, judge};

fn hidden(name: &str, noncentrality: f64, stand_ins: &[&str]) -> Hidden {
    let stand_ins = stand_ins.iter().map(ToString::to_string).collect();
    Hidden { name: name.into(), outsider: false, noncentrality, stand_ins }
}

fn outsider(noncentrality: f64) -> Hidden {
    Hidden { outsider: true, ..hidden("seam", noncentrality, &[]) }
}

fn found(verdict: &str, recommended: &[&str], check_mm: f64) -> Found {
    let partners = vec!["gnss-delay".to_string()];
    Found {
        verdict: verdict.into(),
        recommended: recommended.iter().map(ToString::to_string).collect(),
        candidates: vec![Candidate { effect: "forward-motion".into(), inseparable_from: partners }],
        ledger: vec![Row { check_rms_m: Some(9.0) }, Row { check_rms_m: Some(1e-3 * check_mm) }],
        seconds: 0.0,
    }
}

/// The true model reaches 1 mm.
fn of(hidden: &[Hidden], found: &Found) -> Judgement {
    judge(&Truth { hidden: hidden.to_vec(), correlated_noise: false, check_mm: 1.0 }, found)
}

fn right(hidden: &[Hidden], found: &Found) -> bool {
    of(hidden, found).faults.is_empty()
}

#[test]
fn effects_are_asked_for_by_their_size() {
    let nothing = found("missing", &[], 1.0);
    assert!(!right(&[hidden("pp-time", 60.0, &[])], &nothing));
    assert!(right(&[hidden("pp-time", 59.0, &[])], &nothing));
    let it = found("missing", &["pp-time"], 1.0);
    assert!(right(&[hidden("pp-time", 60.0, &[])], &it) && right(&[hidden("pp-time", 10.0, &[])], &it));
    assert_eq!(of(&[hidden("pp-time", 9.0, &[])], &it).not_there, ["pp-time"]);
}

#[test]
fn others_may_stand_for_an_effect() {
    let time = found("missing", &["focal-time"], 1.0);
    assert!(right(&[hidden("focal-temperature", 100.0, &["focal-time"])], &time));
    assert_eq!(of(&[hidden("focal-temperature", 100.0, &[])], &time).faults.len(), 2, "missed, and another one named");
    // Declared by the diagnosis, in either direction.
    assert!(right(&[hidden("forward-motion", 100.0, &[])], &found("missing", &["gnss-delay"], 1.0)));
    assert!(right(&[hidden("gnss-delay", 100.0, &[])], &found("missing", &["forward-motion"], 1.0)));
    assert!(!right(&[hidden("gnss-delay", 100.0, &[])], &found("missing", &["gnss-shift"], 1.0)));
}

#[test]
fn outsiders_are_unexplained() {
    assert!(right(&[outsider(60.0)], &found("unexplained", &[], 7.0)), "nobody asks for its check points");
    assert!(!right(&[outsider(60.0)], &found("adequate", &[], 1.0)));
    assert!(right(&[outsider(59.0)], &found("adequate", &[], 1.0)));
    assert_eq!(of(&[outsider(60.0)], &found("unexplained", &["unflatness"], 1.0)).not_there, ["unflatness"]);
}

#[test]
fn nothing_is_adequate() {
    assert!(right(&[], &found("adequate", &[], 1.0)));
    let unexplained = found("unexplained", &[], 1.0);
    assert!(!right(&[], &unexplained));
    let correlated = Truth { hidden: vec![], correlated_noise: true, check_mm: 1.0 };
    assert!(judge(&correlated, &unexplained).faults.is_empty());
    assert!(!judge(&correlated, &found("missing", &["pp-time"], 1.0)).faults.is_empty());
}

#[test]
fn check_points_end_where_the_true_model_does() {
    assert!(right(&[], &found("adequate", &[], 1.09)));
    assert!(!right(&[], &found("adequate", &[], 1.11)) && !right(&[], &found("adequate", &[], f64::NAN)));
    assert!(right(&[hidden("map-scale", 100.0, &[])], &found("missing", &["map-scale"], 2.0)));
}
