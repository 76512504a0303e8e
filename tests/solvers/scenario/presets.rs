//! The other presets, and a scenario of one's own.

use crate::common::preset;
use crate::scenario::exact::assert_exact;
use crate::scenario::simulation;
use misclosure::block::Image;
use misclosure::scenario::{Scenario, add_noise, simulate};
use nalgebra::Vector3;

#[test]
fn presets_have_their_shape() {
    assert_eq!(simulation("mapping", 1).block.images.len(), 90);
    let closerange = simulation("closerange", 1);
    let images = &closerange.block.images;
    assert!((20..=40).contains(&images.len()));
    // Coded targets are found in most images.
    let multiplicity = closerange.report.mean_multiplicity();
    assert!(multiplicity > 0.6 * images.len() as f64, "{multiplicity}");
    // In an image rolled by 90 degrees the vertical runs along x.
    let vertical = |image: &Image| image.pose.rotation * Vector3::z();
    let rolled = images.iter().filter(|image| vertical(image).x.abs() > vertical(image).y.abs()).count();
    assert!(rolled >= 8, "{rolled}");
}

#[test]
fn corridor_of_the_dikes_length_is_the_dike_and_grows_with_it() {
    let images = |length: f64| {
        preset("corridor", &[("length_m", length), ("points", 500.0), ("check", 0.0)], 1).block.images.len()
    };
    // The dike has 113: its oblique strips of 15, 14 and 15 images are all of 14 here.
    assert_eq!(images(200.0), 111);
    let (short, long) = (images(1000.0), images(4000.0));
    assert!((3.9..4.1).contains(&(long as f64 / short as f64)), "{short} {long}");
}

#[test]
fn same_seed_same_block_whatever_the_threads() {
    let simulated = |seed: u64| preset("corridor", &[("points", 3000.0), ("check", 50.0)], seed);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = simulated(11);
            add_noise(&mut simulation.block, 0.3, 5).unwrap();
            simulation
        })
    };
    let one = with(1);
    assert_eq!(one, with(5));
    assert_ne!(one.block.ties, simulated(12).block.ties);
}

#[test]
fn a_scenario_of_ones_own_needs_little() {
    let text = r#"
name = "small"
sigma = { tie_px = 0.5, mark_px = 0.5, control_xy_m = 0.01, control_z_m = 0.01, gnss_xy_m = 0.03, gnss_z_m = 0.05 }
ties = { per_m2 = 0.02, detection = { best = 1.0, decay = 1.0 } }

[[camera]]
id = "a"
width_px = 4000
height_px = 3000
f = 3000.0
ppx = 2000.0
ppy = 1500.0
dcx = 2000.0
dcy = 1500.0

[terrain.plain]
length_m = 100.0
width_m = 100.0
margin_m = 0.0
relief_m = 1.0
wavelength_m = 50.0
roughness_m = 0.0

[[flight]]
name = "one"
height_m = 60.0
speed_mps = 5.0
strips = 3
side_overlap = 0.6
forward_overlap = 0.8
long_side = "along"
"#;
    let simulation = simulate(&Scenario::from_toml(text, "small.toml").unwrap(), 1).unwrap();
    assert_eq!(simulation.block.tie_points.len(), 200);
    assert_exact(&simulation, 1.0);
    let flight = &simulation.report.flights[0];
    // Footprint 80 m along, 60 m across; 100 m at a base of at most 16 m are 8 images.
    assert_eq!((flight.images, flight.footprint_m), (24, [60.0, 80.0]));
    assert!((flight.forward_overlap.unwrap() - (1.0 - 100.0 / 7.0 / 80.0)).abs() < 0.05, "{flight:?}");
    assert!((flight.side_overlap.unwrap() - 0.6).abs() < 0.05, "{flight:?}");
    assert!(simulation.block.images.iter().all(|image| image.gnss.is_none() && image.temperature_c.is_none()));
}
