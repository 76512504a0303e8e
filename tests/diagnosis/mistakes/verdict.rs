//! What a diagnosis makes of a mistake.

use super::made::{block, gnss, points, settings};
use misclosure::block::Role;
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::verdict::{Diagnosis, Verdict};
use misclosure::mistakes::Mistake;
use misclosure::model::{Datum, Model};
use misclosure::screening;
use nalgebra::Vector3;

fn diagnosis(block: &misclosure::block::Block) -> Diagnosis {
    diagnose(block, &Model { datum: Datum::All, ..Model::default() }, &settings()).expect("a diagnosis").diagnosis
}

#[test]
fn a_mistake_is_the_verdict_and_is_left_out() {
    let mut feet = block("mapping", 3);
    points(&mut feet, Role::Control, |p| p / 0.3048);
    let found = diagnosis(&feet);
    assert_eq!(found.verdict, Verdict::Mistake);
    assert!(found.recommended.is_empty(), "no cause in place of the mistake: {:?}", found.recommended);
    let text = serde_json::to_value(&found).expect("JSON");
    assert_eq!(text["verdict"], "mistake");
    assert_eq!(text["mistakes"][0]["kind"], "scale");
    let again: Diagnosis = serde_json::from_value(text).expect("a diagnosis");
    assert_eq!(again.mistakes.len(), found.mistakes.len());
}

#[test]
fn control_goes_before_gnss_where_it_fixes_the_block() {
    let sound = block("mapping", 3);
    let offset = [Mistake::new("height-offset", "control", String::new(), String::new())];
    let model = Model { datum: Datum::Control, ..Model::default() };
    let left = |control: usize| {
        let mut block = sound.clone();
        let points = block.surveyed.iter_mut().filter(|point| point.role == Role::Control);
        points.skip(control).for_each(|point| point.role = Role::Check);
        let (block, model) = screening::without(&block, &model, &offset).expect("something is left out");
        (block.count(Role::Control), block.images.iter().any(|image| image.gnss.is_some()), model.datum)
    };
    assert_eq!(left(3), (3, false, Datum::Control));
    assert_eq!(left(2), (0, true, Datum::Gnss));
}

#[test]
fn without_a_mistake_the_list_is_empty() {
    let found = diagnosis(&block("mapping", 3));
    assert_eq!((found.verdict, found.mistakes.len()), (Verdict::Adequate, 0), "{:?}", found.mistakes);
}

#[test]
fn a_control_point_that_was_set_aside_is_named() {
    // Too little to stand out beside the bending of a free network, and far too much for the survey.
    let mut wrong = block("mapping", 4);
    wrong.surveyed[2].position.z += 0.12;
    let found = diagnosis(&wrong);
    let lost = found.mistakes.iter().any(|m| m.names.contains(&wrong.surveyed[2].name));
    assert!(lost || found.imprecise.iter().any(|i| format!("{i:?}").contains("ontrol")), "{:?}", found.mistakes);
    assert_eq!(found.verdict == Verdict::Mistake, lost);
}

/// What is stated of tie points stands to what is stated of marks as nobody measured it: that is no cause.
#[test]
fn tie_points_that_are_better_than_stated_have_no_cause() {
    let mut block = block("mapping", 3);
    block.sigma.tie_px *= 5.0;
    let found = diagnosis(&block);
    assert_eq!((found.verdict, &found.recommended[..]), (Verdict::Adequate, &[][..]), "{:?}", found.mistakes);
    let mark = found.sigma_factors.mark;
    assert!((mark / 5.0).ln().abs() < 0.3, "marks are as stated, five times the tie points: {mark}");
}

/// A base station with wrong coordinates: control contradicts GNSS, and is right.
#[test]
fn control_is_not_accused_of_what_a_shift_of_gnss_does() {
    let mut shifted = block("mapping", 3);
    gnss(&mut shifted, |_, p| p + Vector3::new(3.0, -2.0, 0.0));
    let found = diagnosis(&shifted);
    assert_eq!(found.recommended, ["gnss-shift"]);
    assert_eq!((found.mistakes.len(), found.outliers), (0, 0), "{:?}", found.mistakes);
}

/// Less than a bent network does to single positions, and far too much for the survey: no effect takes its place.
#[test]
fn a_small_tilt_of_the_positions_is_no_shift() {
    for preset in ["dike", "mapping"] {
        let mut tilted = block(preset, 3);
        let positions: Vec<_> = tilted.images.iter().filter_map(|image| image.gnss).map(|own| own.position).collect();
        let middle = positions.iter().sum::<Vector3<f64>>() / positions.len() as f64;
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 0.3f64.to_radians());
        gnss(&mut tilted, |_, p| middle + turn * (p - middle));
        let found = diagnosis(&tilted);
        let kinds: Vec<&str> = found.mistakes.iter().map(|own| own.kind.as_str()).collect();
        assert_eq!((kinds, found.recommended.len()), (vec!["tilt"], 0), "{preset}: {:?}", found.recommended);
        let angle = found.mistakes[0].value.expect("an angle");
        assert!((angle - 0.3).abs() < 0.03, "{preset}: {angle} degrees");
    }
}

/// The images of a tilted list of check points fit as well as ever: only the check points contradict the block.
#[test]
fn a_block_that_its_check_points_contradict_is_not_adequate() {
    let turned = |preset: &str, role: Role, degrees: f64| {
        let mut tilted = block(preset, 3);
        let middle = tilted.surveyed.iter().map(|p| p.position).sum::<Vector3<f64>>() / tilted.surveyed.len() as f64;
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), degrees.to_radians());
        points(&mut tilted, role, |p| middle + turn * (p - middle));
        diagnosis(&tilted)
    };
    // Of control, the tilt is known before, and is said once.
    let tilts = [("mapping", Role::Check, 0.25), ("closerange", Role::Check, 0.5), ("dike", Role::Control, 0.5)];
    for (preset, role, degrees) in tilts {
        let found = turned(preset, role, degrees);
        let kinds: Vec<&str> = found.mistakes.iter().map(|own| own.kind.as_str()).collect();
        assert_eq!((kinds, found.recommended.len()), (vec!["tilt"], 0), "{preset}: {:?}", found.left);
        let angle = found.mistakes[0].value.expect("an angle");
        assert!((angle - degrees).abs() < 0.1 * degrees, "{preset}: {angle} degrees");
    }
    // Heights that bend are no mistake that anybody knows.
    let mut bent = block("mapping", 3);
    points(&mut bent, Role::Check, |p| p + Vector3::z() * (2e-5 * (p - Vector3::zeros()).xy().norm_squared()));
    let found = diagnosis(&bent);
    assert_eq!((found.verdict, &found.recommended[..]), (Verdict::Unexplained, &[][..]), "{:?}", found.mistakes);
    assert!(found.left[0].contains("dome"), "{:?}", found.left);
}
