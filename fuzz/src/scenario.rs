//! The reader of scenarios, and the simulation of those that are small.

use super::folder::said;
use misclosure::scenario::{Scenario, simulate};

/// Scenarios with more are read, not simulated: an input should take a moment.
const MOST_TIES: usize = 50;
/// See [`MOST_TIES`].
const MOST_IMAGES: usize = 50;
/// See [`MOST_TIES`].
const MOST_SURVEYED: usize = 20;

/// One input.
pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Scenario::from_toml(text, "scenario.toml") {
        Ok(scenario) if is_small(&scenario) => {
            if let Err(error) = simulate(&scenario, 1) {
                said(error);
            }
        }
        Ok(_) => {}
        Err(error) => said(error),
    }
}

fn is_small(scenario: &Scenario) -> bool {
    // Without a list an overlap says how many images there are.
    let of_flights =
        scenario.flights.iter().map(|flight| flight.images.as_ref().map(|images| images.iter().sum::<usize>()));
    let images = of_flights.chain(scenario.rings.iter().map(|ring| Some(ring.images))).sum::<Option<usize>>();
    scenario.tie_count() <= MOST_TIES
        && images.is_some_and(|images| images <= MOST_IMAGES)
        && scenario.surveyed.control.count + scenario.surveyed.check.count <= MOST_SURVEYED
}
