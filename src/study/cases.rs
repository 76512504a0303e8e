//! Which cases the study has.

use super::case::{Case, Term};
use crate::model::TieWeights;

/// Flights of the block, in the order in which they are flown.
pub const FLIGHTS: [&str; 4] = ["oblique50", "nadir50", "nadir30", "nadir70"];
/// The flights without the oblique one.
pub const NADIR_FLIGHTS: [&str; 3] = ["nadir50", "nadir30", "nadir70"];
/// S1: errors of the focal length, px.
pub const FOCAL_ERRORS_PX: [i32; 11] = [-50, -40, -30, -20, -10, 0, 10, 20, 30, 40, 50];
/// S3: growth of the focal length per image, and the rise of temperature that it stands for in the publication, K.
pub const GROWTH: (f64, f64) = (1e-5, 80.0);
/// Rises of temperature that are realistic according to the publication, K.
pub const REALISTIC_K: [f64; 3] = [20.0, 30.0, 40.0];
/// Lengths of the corridor, m.
pub const LENGTHS_M: [f64; 5] = [200.0, 500.0, 1000.0, 2000.0, 5000.0];
/// Tie points per square metre of the corridors: a third of the dike's, so that 5 km can be adjusted on a small
/// machine. An error-free block bends by its error and its geometry, not by the number of its points.
const CORRIDOR_POINTS_PER_M2: f64 = 0.2;
/// S1 within the comparison of flights, px: its effect is linear in the error.
pub const FLIGHTS_FOCAL_ERROR_PX: i32 = 50;
/// S4: the flaw.
pub const FLAW: &str = "local-flaw:centre_x=1000,centre_y=1000,lambda=10,sigma=200";
/// Centres of the homothety of S2.
pub const CENTRES: [&str; 2] = ["pp", "dc"];

/// Error of S3 with this growth per image.
pub fn growth(b: f64) -> String {
    format!("focal-growth:b={b:e}")
}

fn homothety(centre: &str) -> String {
    format!("homothety:lambda=0.005,centre={centre}")
}

/// Key of a case of S1.
pub fn s1_key(group: &str, error_px: i32) -> String {
    format!("s1-{group}{error_px:+}")
}

/// Key of a case of the comparison of flights.
pub fn flights_key(experiment: &str, flights: &[&str]) -> String {
    format!("flights-{experiment}-{}", flights.join("-"))
}

/// Every choice of flights, the single ones first.
pub fn flight_choices() -> Vec<Vec<&'static str>> {
    let choice =
        |bits: usize| (0..FLIGHTS.len()).filter(|k| bits >> k & 1 == 1).map(|k| FLIGHTS[k]).collect::<Vec<_>>();
    let mut choices: Vec<_> = (1..1 << FLIGHTS.len()).map(choice).collect();
    choices.sort_by_key(Vec::len);
    choices
}

fn s1(key: String, error_px: i32) -> Case {
    Case::dike(key).error(format!("calibration:f={error_px:+}")).fix("f")
}

/// S0 to S4 as published.
pub fn published() -> Vec<Case> {
    let mut cases = vec![Case::dike("s0")];
    for error in FOCAL_ERRORS_PX {
        cases.push(s1(s1_key("all", error), error));
        cases.push(s1(s1_key("nadir", error), error).flights(&NADIR_FLIGHTS));
    }
    cases.extend(CENTRES.map(|centre| Case::dike(format!("s2-{centre}")).error(homothety(centre)).pictures()));
    for (key, error) in [("s3", growth(GROWTH.0)), ("s4", FLAW.into())] {
        cases.push(Case::dike(key).error(error.clone()).pictures());
        for (name, weights) in [("multi", TieWeights::Multi), ("pairs", TieWeights::Pairs)] {
            cases.push(Case::dike(format!("{key}-{name}")).error(error.clone()).weights(weights));
        }
    }
    cases
}

/// What the publication left open.
pub fn answers() -> Vec<Case> {
    let mut cases = lengths();
    cases.extend(repairs());
    cases.extend(realistic());
    cases.extend(flight_patterns());
    cases
}

/// Key of a corridor.
pub fn length_key(length_m: f64) -> String {
    format!("length-{length_m}")
}

/// Height of the bowl against the length of the corridor; the longest first, since it takes longest.
fn lengths() -> Vec<Case> {
    let case = |length: &f64| {
        let case = Case { preset: "corridor".into(), ..Case::dike(length_key(*length)) };
        case.setting("length_m", *length).setting("points_per_m2", CORRIDOR_POINTS_PER_M2).error(growth(GROWTH.0))
    };
    LENGTHS_M.iter().rev().map(case).collect()
}

/// The erroneous blocks with something in the model that may repair them.
fn repairs() -> Vec<Case> {
    let s3 = |key: &str, term: Term| Case::dike(key).error(growth(GROWTH.0)).effect(term).pictures();
    let s4 = |key: &str, term: Term| Case::dike(key).error(FLAW).effect(term).pictures();
    vec![
        s3("s3-order", Term::new("focal-time").value("against", 1.0)),
        s3("s3-time", Term::new("focal-time")),
        s3("s3-spline", Term::new("focal-spline").prior(SPLINE_PRIOR)),
        s4("s4-flaw", known_flaw()),
        s4("s4-grid", local_grid()),
        s4("s4-grid-sensor", Term::new("image-grid").prior(GRID_PRIOR)),
    ]
}

/// Prior of each spline coefficient of the focal length, times its typical 3 px: several times the drift that is to be
/// found. It fixes the sum of all coefficients, which the focal length itself contains.
const SPLINE_PRIOR: f64 = 10.0;
/// Prior of each node of the displacement grid, times its typical 0.2 px: the size of the flaw. It fixes what the
/// camera and the images' rotations contain already.
const GRID_PRIOR: f64 = 50.0;

/// A flaw of unknown size at about the known place.
fn known_flaw() -> Term {
    let start = [("lambda", 1.0), ("centre_x", 1000.0), ("centre_y", 1000.0), ("sigma", 200.0)];
    start.into_iter().fold(Term::new("local-flaw"), |term, (name, value)| term.value(name, value))
}

/// A displacement grid around the known place. Cells of half the flaw's sigma: larger ones cannot follow it.
fn local_grid() -> Term {
    let place = [("centre_x", 1000.0), ("centre_y", 1000.0), ("cell", 100.0)];
    place.into_iter().fold(Term::new("image-grid").prior(GRID_PRIOR), |term, (name, value)| term.value(name, value))
}

/// Key of S3 with a smaller rise of temperature.
pub fn realistic_key(rise_k: f64) -> String {
    format!("s3-{rise_k}K")
}

/// S3 with realistic rises: the growth in proportion, and a lens that warms up in time, without and with the
/// temperature in the model.
fn realistic() -> Vec<Case> {
    let scaled = |rise: &f64| {
        let b = GROWTH.0 * rise / GROWTH.1;
        Case::dike(realistic_key(*rise)).error(growth(b))
    };
    let mut cases: Vec<Case> = REALISTIC_K.iter().map(scaled).collect();
    for rise in REALISTIC_K {
        let warm = |key: String| Case::dike(key).error(warming(rise));
        cases.push(warm(warming_key(rise, false)));
        cases.push(warm(warming_key(rise, true)).effect(Term::new("focal-temperature")));
    }
    cases
}

/// Growth of the focal length with temperature in the publication: 6.17 px for 80 K, in parts per million of the focal
/// length.
const PPM_PER_K: f64 = 6.17 / 5510.26 / 80.0 * 1e6;

fn warming(rise_k: f64) -> String {
    format!("temperature-focal:expansion={PPM_PER_K},from=20,to={}", 20.0 + rise_k)
}

/// Key of a block whose lens warms up in time; with the temperature in the model or not.
pub fn warming_key(rise_k: f64, modelled: bool) -> String {
    format!("warming-{rise_k}K{}", if modelled { "-modelled" } else { "" })
}

/// S1 to S4 for every choice of flights.
fn flight_patterns() -> Vec<Case> {
    let mut cases = Vec::new();
    for flights in flight_choices() {
        let key = |experiment: &str| flights_key(experiment, &flights);
        let case = |experiment: &str, error: String| Case::dike(key(experiment)).error(error).flights(&flights);
        cases.push(s1(key("s1"), FLIGHTS_FOCAL_ERROR_PX).flights(&flights));
        cases.push(case("s2", homothety("pp")));
        cases.push(case("s3", growth(GROWTH.0)));
        cases.push(case("s4", FLAW.into()));
    }
    cases
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn keys_are_file_names_and_stand_once() {
        let cases: Vec<Case> = [published(), answers()].concat();
        let keys: BTreeSet<&str> = cases.iter().map(|case| case.key.as_str()).collect();
        assert_eq!(keys.len(), cases.len());
        let plain = |c: char| c.is_ascii_alphanumeric() || "+-".contains(c);
        assert!(keys.iter().all(|key| key.chars().all(plain)), "{keys:?}");
    }

    #[test]
    fn every_case_can_be_set_up() {
        for case in [published(), answers()].concat() {
            case.model().unwrap();
            case.errors.iter().for_each(|error| drop(crate::inject::parse(error).unwrap()));
        }
        assert_eq!(flight_choices().len(), 15);
    }
}
