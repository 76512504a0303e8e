//! Simulated blocks, judged from outside: counts, exactness against a projection of the test's own, determinism,
//! messages.

use crate::common;
mod dike;
mod errors;
mod exact;
mod presets;
mod refused;
mod twins;

use misclosure::scenario::Simulation;

fn simulation(name: &str, seed: u64) -> Simulation {
    common::preset(name, &[], seed)
}
