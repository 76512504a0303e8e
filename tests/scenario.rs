//! Simulated blocks, judged from outside: counts, exactness against a projection of the test's own, determinism, messages.

#[path = "common/beside.rs"]
mod beside;

use misclosure::block::{Block, Image, Measurement, Role};
use misclosure::io::block::{read_block, write_block};
use misclosure::scenario::{
    Perturbation, Scenario, Simulation, SurveyNoise, add_noise, add_survey_noise, preset_names, preset_text, simulate,
    twin_of,
};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Demanded agreement of the measurements with the exact projection.
const EXACT_PX: f64 = 1e-9;

fn preset(name: &str, overrides: &[(&str, f64)]) -> Scenario {
    let overrides: BTreeMap<String, f64> = overrides.iter().map(|(key, value)| (key.to_string(), *value)).collect();
    Scenario::preset(name, &overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn simulation(name: &str, seed: u64) -> Simulation {
    simulate(&preset(name, &[]), seed).unwrap_or_else(|error| panic!("{error}"))
}

/// Hamilton product.
fn times(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The camera formula of the block format, with the rotation as the sandwich q v q*; also Z.
fn project(interior: &[f64; 12], image: &Image, point: &Vector3<f64>) -> ([f64; 2], f64) {
    let q = image.pose.rotation;
    let q = [q.w, q.i, q.j, q.k];
    let d = point - image.pose.centre;
    let [_, x, y, z] = times(times(q, [0.0, d.x, d.y, d.z]), [q[0], -q[1], -q[2], -q[3]]);
    let [f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2] = *interior;
    let (u, v) = (ppx + f * x / z, ppy + f * y / z);
    let (du, dv) = (u - dcx, v - dcy);
    let r2 = du * du + dv * dv;
    let radial = k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
    let x = u + du * radial + p1 * (r2 + 2.0 * du * du) + 2.0 * p2 * du * dv + b1 * du + b2 * dv;
    let y = v + dv * radial + p2 * (r2 + 2.0 * dv * dv) + 2.0 * p1 * du * dv;
    ([x, y], z)
}

/// Every measurement equals the projection of the truth, in front, on the sensor by `margin`; every point is measured in
/// two images or more, once in each.
fn assert_exact(simulation: &Simulation, margin: f64) {
    let Simulation { block, truth, .. } = simulation;
    let positions: [Vec<Vector3<f64>>; 2] = [
        truth.tie_points.iter().map(|point| point.position.expect("the truth is complete")).collect(),
        truth.surveyed.iter().map(|point| point.position).collect(),
    ];
    for (table, positions) in [&block.ties, &block.marks].into_iter().zip(&positions) {
        let mut images_of = vec![Vec::new(); positions.len()];
        for &Measurement { image, point, x, y, .. } in table {
            let camera = truth.camera_of(image);
            let (exact, depth) = project(&camera.interior, &truth.images[image.index()], &positions[point.index()]);
            assert!(depth > 0.0);
            assert!((x - exact[0]).abs() < EXACT_PX && (y - exact[1]).abs() < EXACT_PX, "{x} {y} {exact:?}");
            assert!(x >= margin && x <= f64::from(camera.width_px) - margin);
            assert!(y >= margin && y <= f64::from(camera.height_px) - margin);
            images_of[point.index()].push(image);
        }
        for images in &mut images_of {
            images.sort();
            assert!(images.len() >= 2, "a point with {} rays", images.len());
            assert!(images.windows(2).all(|pair| pair[0] < pair[1]), "twice in one image");
        }
    }
    assert!(truth.ties.is_empty() && truth.marks.is_empty());
}

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

#[test]
fn every_preset_is_exact() {
    for name in preset_names() {
        let simulation = simulation(name, 7);
        println!("{name}\n{}", simulation.report);
        assert_exact(&simulation, 1.0);
        let Simulation { block, truth, .. } = &simulation;
        assert_eq!(
            (&block.cameras, &block.images, &block.tie_points),
            (&truth.cameras, &truth.images, &truth.tie_points)
        );
        assert_eq!(block.name, name);
        assert!(block.ties.len() > 1000);
    }
}

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
        let scenario = preset("corridor", &[("length_m", length), ("points", 500.0), ("check", 0.0)]);
        simulate(&scenario, 1).unwrap().block.images.len()
    };
    // The dike has 113: its oblique strips of 15, 14 and 15 images are all of 14 here.
    assert_eq!(images(200.0), 111);
    let (short, long) = (images(1000.0), images(4000.0));
    assert!((3.9..4.1).contains(&(long as f64 / short as f64)), "{short} {long}");
}

#[test]
fn same_seed_same_block_whatever_the_threads() {
    let scenario = preset("corridor", &[("points", 3000.0), ("check", 50.0)]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = simulate(&scenario, 11).unwrap();
            add_noise(&mut simulation.block, 0.3, 5).unwrap();
            simulation
        })
    };
    let one = with(1);
    assert_eq!(one, with(5));
    assert_ne!(one.block.ties, simulate(&scenario, 12).unwrap().block.ties);
}

#[test]
fn noise_has_its_size_and_is_stated() {
    let exact = simulation("dike", 1).block;
    let mut noisy = exact.clone();
    add_noise(&mut noisy, 0.3, 4).unwrap();
    assert_eq!((noisy.sigma.tie_px, noisy.sigma.mark_px), (0.3, 0.3));
    for (noisy, exact) in [(&noisy.ties, &exact.ties), (&noisy.marks, &exact.marks)] {
        let errors: Vec<f64> = noisy.iter().zip(exact).flat_map(|(a, b)| [a.x - b.x, a.y - b.y]).collect();
        let count = errors.len() as f64;
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
        // Five standard deviations of an estimated standard deviation and of a mean.
        assert!((rms - 0.3).abs() < 5.0 * 0.3 / (2.0 * count).sqrt(), "{rms}");
        assert!((errors.iter().sum::<f64>() / count).abs() < 5.0 * 0.3 / count.sqrt());
    }
    let mut again = exact.clone();
    add_noise(&mut again, 0.3, 4).unwrap();
    assert_eq!(again, noisy);
    let mut other = exact.clone();
    add_noise(&mut other, 0.3, 5).unwrap();
    assert_ne!(other, noisy);
    let mut untouched = exact.clone();
    add_noise(&mut untouched, 0.0, 4).unwrap();
    assert_eq!(untouched, exact);
    assert!(add_noise(&mut untouched, f64::NAN, 4).is_err() && add_noise(&mut untouched, -1.0, 4).is_err());
}

#[test]
fn survey_noise_is_switched_by_table() {
    let exact = simulation("dike", 1).block;
    let mut noisy = exact.clone();
    add_survey_noise(&mut noisy, SurveyNoise { gnss: true, control: true, check: false }, 4);
    let mut squares = [0.0; 2];
    for (a, b) in noisy.images.iter().zip(&exact.images) {
        let error = a.gnss.unwrap().position - b.gnss.unwrap().position;
        squares[0] += error.xy().norm_squared() / 2.0 / exact.images.len() as f64;
        squares[1] += error.z.powi(2) / exact.images.len() as f64;
        assert_eq!(a.pose, b.pose);
    }
    // 113 images: the standard deviations are known to 5 % and 7 %.
    assert!((squares[0].sqrt() / exact.sigma.gnss_xy_m - 1.0).abs() < 0.25, "{squares:?}");
    assert!((squares[1].sqrt() / exact.sigma.gnss_z_m - 1.0).abs() < 0.3, "{squares:?}");
    for (a, b) in noisy.surveyed.iter().zip(&exact.surveyed) {
        assert_eq!(a.position == b.position, a.role == Role::Check);
        assert!((a.position - b.position).norm() < 0.05);
    }
    assert_eq!((&noisy.ties, &noisy.marks), (&exact.ties, &exact.marks));
}

#[test]
fn perturbed_start_leaves_measurements_and_truth() {
    let exact = simulation("dike", 1);
    let mut wrong = exact.clone();
    let angle_rad = 0.1_f64.to_radians();
    let perturbation = Perturbation { focal_fraction: 0.005, position_m: 0.1, angle_rad, points: true };
    wrong.perturb_start(perturbation, 3).unwrap();
    assert_eq!((&wrong.truth, &wrong.block.ties), (&exact.truth, &exact.block.ties));
    assert_eq!((&wrong.block.marks, &wrong.block.surveyed), (&exact.block.marks, &exact.block.surveyed));
    assert!((wrong.block.cameras[0].interior[0] / 5510.09 - 1.005).abs() < 1e-12);
    assert!(wrong.block.tie_points.iter().all(|point| point.position.is_none()));
    let pairs = || wrong.block.images.iter().zip(&exact.block.images);
    let degrees = 3.0 * exact.block.images.len() as f64;
    let shift = (pairs().map(|(a, b)| (a.pose.centre - b.pose.centre).norm_squared()).sum::<f64>() / degrees).sqrt();
    let turn = |(a, b): (&Image, &Image)| a.pose.rotation.angle_to(&b.pose.rotation).powi(2);
    let turn = (pairs().map(turn).sum::<f64>() / degrees).sqrt();
    assert!((shift / 0.1 - 1.0).abs() < 0.15, "{shift}");
    assert!((turn / angle_rad - 1.0).abs() < 0.15, "{turn}");
    assert!(wrong.perturb_start(Perturbation { position_m: -1.0, ..perturbation }, 3).is_err());
    assert!(wrong.perturb_start(Perturbation { focal_fraction: -1.0, ..perturbation }, 3).is_err());
}

#[test]
fn twin_of_an_exact_block_is_the_block() {
    let exact = simulation("dike", 1);
    let twin = twin_of(&exact.block).unwrap();
    assert_eq!(twin.report.dropped.total(), 0);
    for (a, b) in [(&twin.block.ties, &exact.block.ties), (&twin.block.marks, &exact.block.marks)] {
        assert_eq!(a.len(), b.len());
        assert!(a.iter().zip(b).all(|(a, b)| (a.x - b.x).hypot(a.y - b.y) < 1e-7));
    }
    for (a, b) in twin.truth.surveyed.iter().zip(&exact.truth.surveyed) {
        assert!((a.position - b.position).norm() < 1e-9 && a.role == b.role);
    }
}

#[test]
fn twin_of_a_noisy_block_is_exact_and_counts_what_it_leaves_out() {
    let mut block = simulation("dike", 1).block;
    add_noise(&mut block, 0.5, 9).unwrap();
    // The first point keeps a single ray; the rays of the second run apart.
    let (lonely, apart) = (block.ties[0].point, block.tie_points[1].name.clone());
    let mut kept = 0;
    block.ties.retain(|tie| {
        kept += usize::from(tie.point == lonely);
        tie.point != lonely || kept == 1
    });
    for (number, tie) in block.ties.iter_mut().filter(|tie| tie.point.index() == 1).enumerate() {
        (tie.x, tie.y) = if number % 2 == 0 { (5.0, 5.0) } else { (5115.0, 3835.0) };
    }
    let twin = twin_of(&block).unwrap();
    println!("{}", twin.report);
    assert_eq!(twin.report.dropped.too_few_rays, 1);
    assert_eq!(twin.block.tie_points.len() + twin.block.surveyed.len() + twin.report.dropped.total(), 14_000 + 5010);
    assert!((2..100).contains(&twin.report.dropped.total()), "{:?}", twin.report.dropped);
    let gone = [&block.tie_points[lonely.index()].name, &apart];
    assert!(twin.block.tie_points.iter().all(|point| !gone.contains(&&point.name)));
    assert_exact(&twin, 0.0);
    // Antenna positions are error-free too.
    assert!(twin.block.images.iter().all(|image| image.gnss.is_some_and(|gnss| gnss.position == image.pose.centre)));
}

#[test]
fn twin_without_orientation_is_refused() {
    let mut block = simulation("closerange", 1).block;
    block.images.iter_mut().for_each(|image| image.pose.centre = Vector3::zeros());
    assert_eq!(
        twin_of(&block).unwrap_err().to_string(),
        "block closerange: no tie point intersects in front of its cameras: is the orientation given?"
    );
}

#[test]
fn wrong_parameters_are_named() {
    let message = |name: &str, key: &str, value: f64| {
        Scenario::preset(name, &BTreeMap::from([(key.to_string(), value)])).unwrap_err().to_string()
    };
    assert_eq!(
        Scenario::preset("dyke", &BTreeMap::new()).unwrap_err().to_string(),
        "unknown preset \"dyke\": expected one of dike, corridor, mapping, closerange"
    );
    assert_eq!(message("corridor", "length_m", 100.0), "corridor: length_m = 100: expected 200 to 10000");
    assert_eq!(message("corridor", "length_m", f64::NAN), "corridor: length_m = NaN: expected 200 to 10000");
    assert_eq!(
        message("dike", "lenght", 1.0),
        "dike has no parameter \"lenght\": expected one of check, points, tilt_deg"
    );
    assert_eq!(message("dike", "points", 1000.5), "dike: points = 1000.5: expected a whole number");
}

#[test]
fn wrong_scenarios_are_refused_by_line_or_key() {
    let dike = preset_text("dike").unwrap();
    let message = |from: &str, to: &str| {
        assert!(dike.contains(from), "{from}");
        match Scenario::from_toml(&dike.replacen(from, to, 1), "my.toml") {
            Err(error) => error.to_string(),
            Ok(scenario) => simulate(&scenario, 1).expect_err(to).to_string(),
        }
    };
    let typo = message("speed_mps = 5.0", "sped_mps = 5.0");
    let line = 1 + dike.lines().position(|line| line == "speed_mps = 5.0").unwrap();
    assert!(typo.starts_with("my.toml: ") && typo.contains(&format!("line {line}, column 1")), "{typo}");
    assert!(typo.contains("unknown field `sped_mps`"), "{typo}");
    let unclosed = message("name = \"dike\"", "name = \"dike");
    assert!(unclosed.contains("line "), "{unclosed}");
    let terrain = message("slope_run = 2.5", "slope = 2.5");
    assert!(terrain.contains("column 1") && terrain.contains("unexpected keys in table: slope"), "{terrain}");
    for (from, to, expected) in [
        ("f = 5510.09", "f = -1.0", "camera.0.f = -1.0: expected more than 0"),
        ("height_m = 50.0", "height_m = nan", "flight.0.height_m = NaN: expected more than 0"),
        ("[15, 14, 15]", "[15, 29]", "flight.0.images = [15, 29]: expected 3 numbers from 1 to a million"),
        ("images = [15, 14, 15]", "", "flight.0.images, forward_overlap = (None, None): expected one of the two"),
        ("[15, 14, 15]", "[900000, 900000, 1]", "flight.0.images = 1800001.0: expected at most a million"),
        (
            "control = { count = 10 }",
            "control = { count = 10_001 }",
            "surveyed.control.count = 10001: expected at most 10000",
        ),
        ("side_overlap = 0.7", "side_overlap = 1.0", "flight.0.side_overlap = 1.0: expected 0 to 0.99"),
        ("\"nadir50\"", "\"oblique50\"", "flight.name = \"oblique50\": expected a name of its own"),
        ("[[flight]]", "[[flight]]\ncamera = \"x\"", "flight.0.camera = Some(\"x\"): expected one of cam"),
        ("tilt_deg = 30.0", "tilt_deg = 80.0", "flight.0.tilt_deg = 80.0: expected -60 to 60"),
        ("best = 0.62", "best = 1.5", "ties.detection.best = 1.5: expected more than 0, at most 1"),
        ("count = 14000", "count = 0", "number of tie points = 0: expected 1 to 100 million"),
        ("length_m = 200.0", "length_m = inf", "terrain.length_m = inf: expected more than 0"),
        ("constant_s = 400.0", "constant_s = 0", "temperature.time_constant_s = 0.0: expected more than 0"),
        ("count = 5000", "count = 5, max_marks = 1", "surveyed.check.max_marks = Some(1): expected at least 3"),
        ("best = 0.62", "best = 1e-9", "no place found for a tie point: none of 1000 is seen by 2 images"),
    ] {
        assert_eq!(message(from, to), format!("dike: {expected}"));
    }
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

#[test]
fn twins_of_real_blocks_are_exact_and_complete() {
    let Some(data) = beside::shared("data") else { return };
    for name in ["dbat-camcal", "dbat-camcal-exom", "dbat-prague-cam", "dbat-sxb", "uav-caliterra", "uav-seneca"] {
        let block = read_block(&data.join(name)).unwrap_or_else(|error| panic!("{error}")).block;
        let twin = twin_of(&block).unwrap_or_else(|error| panic!("{error}"));
        println!("{name}\n{}", twin.report);
        assert_exact(&twin, 0.0);
        let points = block.tie_points.len() + block.surveyed.len();
        assert_eq!(twin.block.tie_points.len() + twin.block.surveyed.len() + twin.report.dropped.total(), points);
        // Nearly all of a measured block meets in front of its cameras; what is left out lies at the sensor's edges or is far away.
        assert!(twin.report.dropped.total() * 20 <= points, "{:?} of {points}", twin.report.dropped);
        // The twin is the block without its errors, not another block.
        let mut distances: Vec<f64> = Vec::new();
        let names = |block: &Block, tie: &Measurement| {
            let (image, point) = (&block.images[tie.image.index()].name, &block.tie_points[tie.point.index()].name);
            (image.clone(), point.clone())
        };
        let measured: BTreeMap<_, _> = block.ties.iter().map(|tie| (names(&block, tie), [tie.x, tie.y])).collect();
        for tie in &twin.block.ties {
            let [x, y] = measured[&names(&twin.block, tie)];
            distances.push((tie.x - x).hypot(tie.y - y));
        }
        distances.sort_by(f64::total_cmp);
        let median = distances[distances.len() / 2];
        println!("median {median:.3} px");
        // One block comes with a coarse orientation; the others are within 1 px.
        assert!(median < 0.02 * block.cameras[0].half_diagonal_px(), "{median}");
    }
}

#[test]
fn a_written_block_is_still_exact() {
    let folder = tempfile::tempdir().unwrap();
    let mut simulation = simulation("dike", 2);
    write_block(&simulation.block, folder.path()).unwrap();
    let read = read_block(folder.path()).unwrap();
    assert!(read.set_aside.is_empty(), "{}", read.set_aside);
    simulation.block = read.block;
    assert_exact(&simulation, 1.0);
    let images = |block: &Block| block.images.iter().map(|image| (image.time_s, image.gnss)).collect::<Vec<_>>();
    assert_eq!(images(&simulation.block), images(&simulation.truth));
}
