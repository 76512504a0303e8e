//! Against measurements that another program made under one effect each, and against the study's figures.

use crate::inject::fixture::distance;
use misclosure::block::Block;
use misclosure::inject::{apply, parse};
use misclosure::io::block::read_block;
use misclosure::scenario::{Scenario, simulate};
use std::collections::BTreeMap;
use std::path::Path;

/// The vectors were computed and written in double precision by another program, px.
const SAME_FORMULA_PX: f64 = 1e-8;
/// Metres of some hundred in double precision.
const SAME_FORMULA_M: f64 = 1e-10;

/// Reads the vectors of an effect, its poses and points being the true ones.
fn vectors(id: &str) -> Option<Block> {
    let dir = crate::beside::shared("vectors")?.join(id);
    Some(read_block(&dir).expect(id).block)
}

/// Largest difference to the vectors: image points px, antennas m, surveyed coordinates m; and the largest image
/// change.
fn differences(id: &str, truth: &Block, error: &str) -> [f64; 4] {
    let measured = vectors(id).unwrap();
    let injected = apply(&measured, truth, &[parse(error).unwrap()], 0).unwrap();
    assert_eq!(injected.report.dropped.total(), 0, "{id}");
    let block = injected.block;
    let pixels = (block.ties.iter().chain(&block.marks)).zip(measured.ties.iter().chain(&measured.marks));
    let pixels = pixels.map(|(a, b)| distance([a.x, a.y], [b.x, b.y])).fold(0.0, f64::max);
    let antennas = block.images.iter().zip(&measured.images);
    let antennas = antennas.map(|(a, b)| (a.gnss.unwrap().position - b.gnss.unwrap().position).norm());
    let surveyed = block.surveyed.iter().zip(&measured.surveyed).map(|(a, b)| (a.position - b.position).norm());
    [pixels, antennas.fold(0.0, f64::max), surveyed.fold(0.0, f64::max), injected.report.change_max_px]
}

#[test]
fn causes_give_what_another_program_computed() {
    let Some(none) = vectors("none") else { return };
    // Farthest corner of the vectors' camera from its centre of distortion.
    let corner = (5120.0_f64 - 2537.97).hypot(1955.92);
    let q = 3e-15_f64.hypot(-2e-15);
    // Definitions, and causes that are linear: the same to rounding. The others: the catalogue's formula is the first
    // order of the cause; the part of the change that may be left is stated.
    let exact = [
        ("none", "calibration".to_owned()),
        ("focal-flight", "focal-steps:steps=0/5/-5/4".into()),
        ("focal-temperature", "temperature-focal:alpha=0.5".into()),
        ("local-flaw", "local-flaw:lambda=2,centre_x=1000,centre_y=1400,sigma=350".into()),
        ("radial-high", format!("radial-high:corner={}", 1e-31 * corner.powi(9))),
        (
            "decentring-high",
            format!(
                "decentring-high:corner={},direction_deg={}",
                3.0 * q * corner.powi(4),
                (-2e-15_f64).atan2(3e-15).to_degrees()
            ),
        ),
        ("gnss-lever-arm", "gnss-lever-arm:x=0.05,y=-0.03,z=0.1".into()),
        ("gnss-shift", "gnss-shift:x=0.04,y=-0.02,z=0.06".into()),
        ("map-scale", "map-scale:m=0.0004,in=control".into()),
    ];
    for (id, error) in exact {
        let [px, antenna, surveyed, change] = differences(id, &none, &error);
        println!("{id}: differs by {px:.1e} px of {change:.2}, {antenna:.1e} m, {surveyed:.1e} m");
        assert!(px < SAME_FORMULA_PX && antenna < SAME_FORMULA_M && surveyed < SAME_FORMULA_M, "{id}");
        assert_eq!(change > 0.5, expected_change_px(id) > 0.5, "{id}");
    }
    // Velocities of the vectors do not quite agree with the way between their positions, so the trajectory accelerates.
    let [px, _, _, change] = differences("rolling-shutter", &none, "rolling-shutter:readout=0.02");
    assert!(change > 9.0 && px < 2e-3 * change, "rolling-shutter: {px} of {change}");
    let [px, _, _, change] = differences("forward-motion", &none, "forward-motion:exposure=0.004");
    assert!(change > 2.0 && px < 1e-3 * change, "forward-motion: {px} of {change}");
    let [px, antenna, ..] = differences("gnss-delay", &none, "gnss-delay:dt=0.02");
    assert!(px < SAME_FORMULA_PX && antenna < 0.01 * 0.1, "gnss-delay: {antenna} of 0.1 m");
    // kappa = -n' / 2 to first order in n - 1, which is 0.08 here: the air is 300 times as strong as ours.
    let strength = 4e-6 / (0.5 * 2.77e-4 / 10_400.0);
    let [px, _, _, change] = differences("refraction", &none, &format!("refraction:strength={strength}"));
    assert!(change > 1.9 && px < 0.1 * change, "refraction: {px} of {change}");
}

/// Largest change of an image point that the vectors state.
fn expected_change_px(id: &str) -> f64 {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/vectors").join(id).join("case.json");
    let case: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    case["largest_change_px"].as_f64().unwrap()
}

#[test]
fn blocks_of_scenarios_are_measured_again_to_the_last_bit() {
    for preset in ["dike", "closerange"] {
        let simulation = simulate(&Scenario::preset(preset, &BTreeMap::new()).unwrap(), 3).unwrap();
        let again = apply(&simulation.block, &simulation.truth, &[], 0).unwrap();
        assert_eq!(again.block, simulation.block, "{preset}");
        assert_eq!(again.report.replaced_rms_px, 0.0);
    }
}

#[test]
fn homothety_of_the_study() {
    let simulation = simulate(&Scenario::preset("dike", &BTreeMap::new()).unwrap(), 3).unwrap();
    let homothety = [parse("homothety:lambda=0.005,centre=pp").unwrap()];
    let report = apply(&simulation.block, &simulation.truth, &homothety, 0).unwrap().report;
    // 16.15 px at the corners of the sensor; among thousands of points some come near.
    assert!((15.0..16.16).contains(&report.change_max_px), "{}", report.change_max_px);
    let growth = [parse("focal-growth:b=1e-5").unwrap()];
    let report = apply(&simulation.block, &simulation.truth, &growth, 0).unwrap().report;
    let ratio: f64 = report.applied[0].notes[0].1.parse().unwrap();
    // 113 images: 6.17 px from the first to the last.
    assert!(((ratio - 1.0) * 5510.09 - 6.17).abs() < 0.01, "{ratio}");
}
