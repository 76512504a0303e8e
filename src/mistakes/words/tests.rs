//! All sentences on the survey, one beside the other: a changed word shows in the snapshot.

use super::super::clock::Clock;
use super::super::relation::{Difference, Relation};
use super::super::shape::{Change, FOOT};
use super::super::survey::{Count, Subject};
use super::super::{Mistake, words};
use nalgebra::Vector3;
use std::fmt::Write;

fn as_text(mistakes: &[Mistake]) -> String {
    let mut text = String::new();
    for Mistake { kind, subject, sentence, remedy, .. } in mistakes {
        writeln!(text, "{kind} of {subject}\n  {sentence}\n  {remedy}").expect("a string takes all");
    }
    text
}

#[test]
fn of_a_group() {
    let (control, gnss) = (Subject::Control, Subject::Gnss);
    let clock = |seconds: f64| Change::Clock(Clock { seconds, sigma: 0.02, tried: 1 });
    let changes = [
        (control, Change::HeightUnit(FOOT)),
        (control, Change::HeightUnit(1e-3)),
        (control, Change::Exchanged(0, 1)),
        (gnss, Change::Reversed(2)),
        (gnss, Change::Degrees(true)),
        (control, Change::Degrees(false)),
        (control, Change::Shifted(-1)),
        (gnss, Change::Shifted(2)),
        (gnss, clock(-18.02)),
        (gnss, clock(3.5)),
    ];
    let mut found: Vec<Mistake> =
        changes.into_iter().map(|(subject, change)| words::changed(subject, change, 5e3, -900.0)).collect();
    let place = Vector3::new(500.0, 200.0, 80.0);
    found.push(words::collapsed(gnss, vec!["a".into()], &Vector3::zeros(), 1));
    found.push(words::collapsed(gnss, vec!["a".into(), "b".into()], &Vector3::zeros(), 2));
    found.push(words::collapsed(control, Vec::new(), &place, 12));
    insta::assert_snapshot!(as_text(&found));
}

#[test]
fn of_members() {
    let (control, shift) = (Subject::Control, Vector3::new(0.1, -0.2, 15.0));
    let names = |count: usize| (1..=count).map(|k| format!("p{k}")).collect::<Vec<String>>();
    let count = |aside: usize| Count { name: "p7".into(), aside, all: 20 };
    let found = [
        words::wrong_positions(names(1), 9.0, 5e3, -900.0),
        words::wrong_positions(names(8), 9.0, 5e3, -900.0),
        words::flight_offset("nadir", names(3), &shift, 0.05, 5e3, -900.0),
        words::wrong_coordinate(control, "p4", 2, 1.002, 0.004, 5e3, -900.0),
        words::wrong_position(Subject::Check, "p4", &shift, 5e3, -900.0),
        words::exchanged(control, [&"p1".into(), &"p6".into()], 5e3, -900.0),
        words::exchanged_images(["a", "b"], 5e3, -900.0),
        words::points_set_aside(&[count(18)], 12),
        words::images_set_aside(&[count(18), count(15)]),
        words::share_set_aside(&count(8)),
    ];
    insta::assert_snapshot!(as_text(&found));
}

#[test]
fn of_two_groups() {
    let difference = |relation: Relation, shift: [f64; 3]| Difference {
        relation,
        shift: shift.into(),
        sigma: Vector3::repeat(0.01),
        tilt: 0.002,
        drop: 5e3,
        ln_p: -900.0,
    };
    let offset = |z: f64| difference(Relation::Height, [0.0, 0.0, z]);
    let apart = difference(Relation::Plan, [3.0, -4.0, 0.02]);
    let (gnss, control, check) = (Subject::Gnss, Subject::Control, Subject::Check);
    let mut found = vec![
        words::height_offset(gnss, control, &offset(49.349), None),
        words::height_offset(control, check, &offset(-1.5), None),
        words::height_offset(gnss, control, &offset(1.5), Some(0.012)),
        words::of_one_point(words::height_offset(gnss, control, &offset(1.5), None)),
        words::plan_offset(gnss, control, &apart),
        words::other_frame(gnss, control, 3.9e6, &apart),
        words::other_frame(control, check, 52.0, &apart),
        words::scale(gnss, control, 1.004, &apart),
        words::rotation(gnss, control, 2.0, &apart),
        words::tilt(gnss, control, &apart),
    ];
    let relations = [
        Relation::Unit(FOOT),
        Relation::Unit(1e-3),
        Relation::HeightUnit(FOOT),
        Relation::Exchanged(0, 1),
        Relation::Reversed(2),
    ];
    for relation in relations {
        found.push(words::recorded_otherwise(gnss, control, &difference(relation, [0.0; 3])));
    }
    insta::assert_snapshot!(as_text(&found));
}
