//! Where nobody made a mistake none is named, whatever physics does to the block.

use super::common;
use super::made::{BLOCKS, block, few_checks, named};
use misclosure::inject;

/// Errors at other than their own sizes, beside each cause at its own.
const LARGER: [&str; 4] = [
    "gnss-lever-arm:x=0.3,y=0.2,z=-0.4",
    "gnss-shift:x=0.2,y=-0.2,z=0.5",
    "rolling-shutter:readout=0.04",
    "map-scale:m=-0.001",
];

/// Not causes: what is no physics, and the noise that every block here has.
const OTHERS: [&str; 3] = ["control-blunder", "exact-marks", "noise"];

#[test]
fn noise_alone() {
    for (preset, seed) in BLOCKS {
        let found = named(&block(preset, seed));
        assert!(found.is_empty(), "{preset} {seed}: {found:?}");
    }
}

#[test]
fn physical_causes() {
    for (preset, seed) in [("dike", 5), ("mapping", 6)] {
        let mut truth = common::preset(preset, &[("points", 1500.0)], seed).block;
        few_checks(&mut truth);
        let causes = inject::registry().iter().map(|cause| cause.id()).filter(|id| !OTHERS.contains(id));
        for error in causes.chain(LARGER) {
            let errors = [error, "noise:px=0.3,gnss=1,control=1"].map(|error| inject::parse(error).expect("an error"));
            let block = inject::apply(&truth, &truth, &errors, seed).expect("injected").block;
            let found = named(&block);
            assert!(found.is_empty(), "{preset} {seed} with {error}: {found:?}");
        }
    }
}
