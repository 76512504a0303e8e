//! Blunders of every size at the worst places: no diagnosis takes them for a cause, and nothing fails of them.
//!
//! `make test-blunders` runs the whole campaign, `make test` a handful of it.
//!
//! `MISCLOSURE_BLUNDERS=mapping cargo test --release --test diagnosis blunders:: -- --nocapture` runs the cases whose
//! names have that part.

mod campaign;
mod place;

use campaign::{Case, Count, PRESETS, Size};
use place::Place;
use std::time::Instant;

/// `all` runs the whole campaign, anything else the cases whose names have that part.
const WHICH: &str = "MISCLOSURE_BLUNDERS";

const COUNTS: [Count; 4] = [Count::Of(1), Count::Of(2), Count::Of(10), Count::Share(0.01)];
const SIZES: [Size; 5] = [Size::Px(5.0), Size::Px(50.0), Size::Px(500.0), Size::Px(3000.0), Size::Sensor];
const PLACES: [Place; 3] = [Place::Random, Place::Corners, Place::FewRays];

/// What stands for the campaign in `make test`: the size that bends a block most, on the quickest block; one whose
/// least-squares adjustment fails of a single blunder; one in which least squares bends the camera until a blunder
/// fits; one in which a spot of the sensor fits a blunder in a point of two rays as well as it would a flaw; and one in
/// which all that an image has measured is in points with a blunder.
const HANDFUL: [Case; 6] = [
    Case { preset: 4, count: Count::Of(10), size: Size::Px(5.0), place: Place::FewRays },
    Case { preset: 2, count: Count::Share(0.01), size: Size::Sensor, place: Place::Corners },
    Case { preset: 1, count: Count::Of(1), size: Size::Px(3000.0), place: Place::FewRays },
    Case { preset: 3, count: Count::Of(1), size: Size::Sensor, place: Place::FewRays },
    Case { preset: 3, count: Count::Of(10), size: Size::Px(50.0), place: Place::Corners },
    Case { preset: 3, count: Count::Share(0.01), size: Size::Px(5.0), place: Place::Random },
];

#[test]
fn blunders_are_no_cause_and_fail_nothing() {
    let cases = selected();
    let mut failures = Vec::new();
    for case in &cases {
        let started = Instant::now();
        let found = case.failures();
        let outcome = if found.is_empty() { "as it should be".to_string() } else { found.join("; ") };
        println!("{case}: {outcome} ({:.1} s)", started.elapsed().as_secs_f64());
        failures.extend(found.into_iter().map(|text| format!("{case}: {text}")));
    }
    assert!(failures.is_empty(), "{} failures in {} cases:\n{}", failures.len(), cases.len(), failures.join("\n"));
}

fn selected() -> Vec<Case> {
    match std::env::var(WHICH).unwrap_or_default().as_str() {
        "" => HANDFUL.to_vec(),
        "all" => campaign(),
        part => {
            let cases: Vec<Case> = campaign().into_iter().filter(|case| case.to_string().contains(part)).collect();
            assert!(!cases.is_empty(), "{WHICH}={part}: no such case");
            cases
        }
    }
}

fn campaign() -> Vec<Case> {
    let mut cases = Vec::new();
    for preset in 0..PRESETS.len() {
        for count in COUNTS {
            for size in SIZES {
                cases.extend(PLACES.map(|place| Case { preset, count, size, place }));
            }
        }
    }
    cases
}
