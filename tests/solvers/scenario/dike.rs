//! The dike: the published counts, and what a block of a real matcher looks like.

use crate::scenario::simulation;
use misclosure::block::{Block, Role};
use misclosure::scenario::Simulation;
use nalgebra::Vector3;

fn flight_counts(block: &Block) -> Vec<(&str, usize)> {
    let count = |index: usize| block.images.iter().filter(|image| image.flight.index() == index).count();
    block.flights.iter().enumerate().map(|(index, name)| (name.as_str(), count(index))).collect()
}

#[test]
fn dike_has_the_published_counts() {
    let simulation = simulation("dike", 1);
    println!("{}", simulation.report);
    let Simulation { block, report, .. } = &simulation;
    assert_eq!(flight_counts(block), [("oblique50", 44), ("nadir50", 42), ("nadir30", 12), ("nadir70", 15)]);
    assert_eq!(block.images.len(), 113);
    assert_eq!(report.flights.iter().map(|flight| flight.strips).collect::<Vec<_>>(), [3, 3, 1, 1]);
    assert_eq!((block.count(Role::Control), block.count(Role::Check)), (10, 5000));
    assert!((13_720..=14_280).contains(&block.tie_points.len()));
    assert_eq!(block.cameras[0].interior[..5], [5510.09, 2539.75, 1945.80, 2537.97, 1955.92]);
    assert_eq!((block.cameras[0].width_px, block.cameras[0].height_px), (5120, 3840));
    for image in &block.images {
        assert!(image.time_s.is_some() && image.temperature_c.is_some() && image.velocity.is_some());
        assert!(image.exposure_s.is_some() && image.gnss.is_some_and(|gnss| gnss.position == image.pose.centre));
    }
    assert!(block.images.windows(2).all(|pair| pair[0].time_s < pair[1].time_s), "one after the other");
    assert!(block.images.windows(2).all(|pair| pair[0].temperature_c < pair[1].temperature_c), "it warms up");
}

#[test]
fn dike_looks_like_a_block_of_a_real_matcher() {
    let simulation = simulation("dike", 1);
    let report = &simulation.report;
    // The study's block has about 78 000 measurements of 14 000 points.
    assert!((5.0..6.2).contains(&report.mean_multiplicity()), "{}", report.mean_multiplicity());
    assert_eq!(report.multiplicity[..2], [0, 0]);
    // Two is the most frequent, the tail falls and is long.
    let tail = &report.multiplicity[2..12];
    assert!(tail.windows(2).all(|pair| pair[1] as f64 <= 1.1 * pair[0] as f64), "{tail:?}");
    assert!(report.multiplicity.len() > 15);
    assert!(report.least_ties_per_image >= 100, "{}", report.least_ties_per_image);
    // The points fill the sensor: all four corners are measured.
    let near = |value: f64, size: f64, far: bool| if far { value > 0.9 * size } else { value < 0.1 * size };
    for (right, bottom) in [(false, false), (false, true), (true, false), (true, true)] {
        let corner = simulation.block.ties.iter().filter(|t| near(t.x, 5120.0, right) && near(t.y, 3840.0, bottom));
        assert!(corner.count() > 200);
    }
}

#[test]
fn dike_flies_as_described() {
    let block = simulation("dike", 1).truth;
    for image in &block.images {
        let flight = &block.flights[image.flight.index()];
        let to_world = image.pose.rotation.inverse();
        let (right, forward) = (to_world * Vector3::x(), to_world * Vector3::z());
        let heading = image.velocity.expect("given").normalize();
        let expected = if flight == "oblique50" { 30.0_f64.to_radians().sin() } else { 0.0 };
        // Attitude scatters by 1 degree.
        assert!((forward.dot(&heading) - expected).abs() < 0.08, "{}", image.name);
        assert!(forward.z < -0.8);
        // Long side along track: x in the heading, tilted with the camera.
        assert!((right.dot(&heading) - (1.0 - expected * expected).sqrt()).abs() < 0.08, "{}", image.name);
        assert!(right.dot(&heading.cross(&Vector3::z())).abs() < 0.2, "{}", image.name);
        let height: f64 = flight[flight.len() - 2..].parse().expect("the name ends with the height");
        assert!((image.pose.centre.z - height).abs() < 2.5);
    }
    let heading = |name: &str| {
        let image = block.images.iter().find(|image| image.name == name).expect("exists");
        image.velocity.expect("given").y.signum()
    };
    assert_eq!([heading("nadir50_0001"), heading("nadir50_0015"), heading("nadir50_0029")], [1.0, -1.0, 1.0]);
}

#[test]
fn control_points_are_well_distributed() {
    let block = simulation("dike", 1).block;
    let control: Vec<_> = block.surveyed.iter().filter(|p| p.role == Role::Control).map(|p| p.position).collect();
    for y in [-75.0, -25.0, 25.0, 75.0] {
        assert!(control.iter().any(|p| (p.y - y).abs() <= 25.0), "{y}: {control:?}");
    }
    assert!(control.iter().any(|p| p.x < -10.0) && control.iter().any(|p| p.x > 10.0));
    for (i, a) in control.iter().enumerate() {
        assert!(control[i + 1..].iter().all(|b| (a - b).norm() > 15.0));
    }
    let mut marks = vec![0; block.surveyed.len()];
    block.marks.iter().for_each(|mark| marks[mark.point.index()] += 1);
    assert!(marks.iter().all(|count| *count >= 3));
}
