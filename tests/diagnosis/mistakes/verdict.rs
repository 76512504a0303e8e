//! What a diagnosis makes of a mistake.

use super::made::{block, points};
use misclosure::adjust::Options;
use misclosure::block::Role;
use misclosure::diagnose::run::diagnose;
use misclosure::diagnose::screening;
use misclosure::diagnose::settings::Settings;
use misclosure::diagnose::verdict::{Diagnosis, Verdict};
use misclosure::mistakes::Mistake;
use misclosure::model::{Datum, Model};

fn diagnosis(block: &misclosure::block::Block) -> Diagnosis {
    let options = Options::default();
    let settings = Settings { plugins: &[], options, significance: 1e-3, snoop: true, tell: &|_| {} };
    diagnose(block, &Model { datum: Datum::All, ..Model::default() }, &settings).expect("a diagnosis").diagnosis
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
