//! Residual structure: nothing is seen where nothing is, and what is put in is found and described. What is put in
//! moves the image measurements themselves; no formula of the tests is used for it.

use crate::common;
use misclosure::adjust::{CovarianceOf, Options};
use misclosure::block::Block;
use misclosure::math::statistics::normal_quantile;
use misclosure::model::{Datum, Model};
use misclosure::null_model::SharedBase;
use misclosure::residuals::check_points::{Adjusted, Heights, heights};
use misclosure::residuals::{Structure, analyse};
use misclosure::run::{Run, default_diagnosis_datum};
use misclosure::scenario::{SurveyNoise, add_noise, add_survey_noise};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// px.
const NOISE: f64 = 0.3;
/// Of the family of tests.
const SIGNIFICANCE: f64 = 1e-3;

/// Blocks of each kind without a cause, in a test that runs each time.
const BLOCKS: u64 = 34;
/// Small blocks: preset, tie points, whether GNSS and control take part.
const SMALL: [(&str, f64, bool); 3] = [("dike", 1500.0, true), ("mapping", 1200.0, false), ("closerange", 60.0, false)];

fn block(preset: &str, points: f64, seed: u64) -> Block {
    let mut block = common::preset(preset, &[("points", points)], seed).block;
    add_noise(&mut block, NOISE, seed).unwrap();
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, seed);
    block
}

fn options() -> Options {
    Options { covariance: CovarianceOf::Nothing, ..Options::default() }
}

fn structure_of(run: &Run) -> Structure {
    with_heights(run, &Err("not asked for"))
}

fn with_heights(run: &Run, heights: &Result<Heights, &'static str>) -> Structure {
    analyse(&run.problem, &run.solution().state, heights, SIGNIFICANCE, 1).unwrap()
}

fn structure(block: &Block) -> Structure {
    let model = Model { datum: default_diagnosis_datum(block), ..Model::default() };
    structure_of(&common::solve_both_with(block, &model, &options()))
}

fn p_value(structure: &Structure, against: &str) -> f64 {
    structure.test(against).unwrap_or_else(|| panic!("{against} was not tested: {:?}", structure.skipped)).p_value
}

/// p-values of null blocks by test, and the smallest of each family.
fn null_p_values(blocks: u64) -> BTreeMap<&'static str, Vec<f64>> {
    let mut found: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
    for (preset, points, surveyed) in SMALL {
        for seed in 1..=blocks {
            let block = block(preset, points, seed);
            let datum = if surveyed { Datum::All } else { Datum::Free };
            let run = common::solve_native(&block, &Model { datum, ..Model::default() }, &options());
            let structure = structure_of(&run);
            let deciding = structure.tests.iter().filter(|test| test.decides);
            let mut family: f64 = 1.0;
            for test in deciding {
                found.entry(test.against).or_default().push(test.p_value);
                family = family.min(test.family_p_value);
            }
            assert_eq!(structure.family_wise().is_some(), family < SIGNIFICANCE);
            assert_eq!(structure.describe_unexplained().is_empty(), family >= SIGNIFICANCE);
            found.entry("family").or_default().push(family);
        }
    }
    found
}

/// Most of `n` trials of probability `p`, exceeded once in about thirty thousand.
fn most(n: usize, p: f64) -> f64 {
    let mean = n as f64 * p;
    // One more than the normal bound, since counts are whole; at small means the tail of Poisson is longer, hence the
    // quantile's square.
    let z = normal_quantile(1.0 - 3e-5);
    mean + z * mean.sqrt() + z * z / 3.0 + 1.0
}

fn hold_p_values(found: &BTreeMap<&'static str, Vec<f64>>) {
    let mut all = Vec::new();
    for (against, sample) in found {
        let mut sorted = sample.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        // One-sided: p-values may be too large (the corrections are conservative), never too small.
        let excess = sorted.iter().enumerate().map(|(k, p)| (k + 1) as f64 / n as f64 - p).fold(0.0, f64::max);
        let p_of_excess = (-2.0 * n as f64 * excess * excess).exp();
        let below = |level: f64| sorted.iter().filter(|p| **p < level).count();
        println!(
            "{against:16} n {n}: KS+ {excess:.3} (p {p_of_excess:.3}), below 0.05: {:.3}, 0.01: {:.4}, 0.001: {:.4}, \
             mean {:.3}",
            below(0.05) as f64 / n as f64,
            below(0.01) as f64 / n as f64,
            below(0.001) as f64 / n as f64,
            sorted.iter().sum::<f64>() / n as f64
        );
        assert!(p_of_excess > 1e-4, "{against}: p-values are too small: {excess}");
        for level in [0.05, 0.01, 0.001] {
            assert!((below(level) as f64) <= most(n, level), "{against}: {} of {n} below {level}", below(level));
        }
        if *against != "family" {
            all.extend(sorted);
        }
    }
    // The tail, over all tests.
    let beyond = all.iter().filter(|p| **p < 0.001).count();
    println!("{} p-values, {beyond} below 0.001", all.len());
    assert!((beyond as f64) <= most(all.len(), 0.001));
}

#[test]
fn nothing_is_seen_in_blocks_with_noise_alone() {
    let found = null_p_values(common::null_blocks(BLOCKS));
    assert!(found.len() > 12, "{:?}", found.keys());
    hold_p_values(&found);
    // F tests without a correction for a search are exact: not too large either.
    for against in ["flight", "time", "row", "radius", "direction"] {
        let mean = found[against].iter().sum::<f64>() / found[against].len() as f64;
        // The mean of so many uniform numbers; a normal one is five standard deviations off once in two million.
        let deviation = (1.0 / 12.0 / found[against].len() as f64).sqrt();
        assert!((mean - 0.5).abs() < 5.0 * deviation, "{against}: mean p-value {mean}");
    }
}

/// Adds to every tie measurement what `displacement(image, from the middle in half widths)` gives, px.
fn displace(block: &mut Block, displacement: impl Fn(usize, [f64; 2]) -> [f64; 2]) {
    for k in 0..block.ties.len() {
        let row = block.ties[k];
        let camera = block.camera_of(row.image);
        let half = [0.5 * f64::from(camera.width_px), 0.5 * f64::from(camera.height_px)];
        let d = displacement(row.image.index(), [(row.x - half[0]) / half[0], (row.y - half[1]) / half[0]]);
        block.ties[k].x += d[0];
        block.ties[k].y += d[1];
    }
}

#[test]
fn a_periodic_pattern_is_found_below_the_cells() {
    let mut block = block("mapping", 4000.0, 3);
    let width = f64::from(block.cameras[0].width_px);
    let (wavelength, direction) = (130.0, 30f64.to_radians());
    displace(&mut block, |_, [x, y]| {
        let along = 0.5 * width * (x * direction.cos() + y * direction.sin());
        [0.12 * (TAU * along / wavelength).sin(), 0.0]
    });
    let structure = structure(&block);
    let peak = structure.pictures.peaks[0];
    println!("{:?}\n{:?}", structure.family_wise(), peak);
    assert_eq!(structure.family_wise().unwrap().against, "spectrum");
    // A frequency is resolved to half a step of 1 / (2 width).
    assert!((peak.wavelength / wavelength - 1.0).abs() < 0.02, "{peak:?}");
    assert!((peak.direction_deg - 30.0).abs() < 2.0, "{peak:?}");
    assert!((0.08..0.16).contains(&peak.amplitude[0]) && peak.amplitude[1] < 0.05, "{peak:?}");
    assert!(p_value(&structure, "sensor") > SIGNIFICANCE, "a pattern far below the cells");
    assert!(structure.describe_unexplained()[0].contains("repeats every"));
}

#[test]
fn a_local_displacement_is_found_where_it_is() {
    let mut block = block("mapping", 4000.0, 4);
    displace(&mut block, |_, [x, y]| {
        let share = (1.0 - ((x - 0.5).powi(2) + (y + 0.3).powi(2)) / 0.04).max(0.0);
        [0.5 * share, -0.5 * share]
    });
    let structure = structure(&block);
    assert!(p_value(&structure, "sensor") < 1e-6);
    let cells = &structure.pictures.sensor[0].cells;
    let size = |cell: &&misclosure::residuals::Cell| cell.displacement[0].hypot(cell.displacement[1]);
    let worst = cells.iter().filter(|cell| cell.p_value < 1e-6).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap();
    let camera = &block.cameras[0];
    let half = 0.5 * f64::from(camera.width_px);
    let place = [worst.centre[0] / half - 1.0, (worst.centre[1] - 0.5 * f64::from(camera.height_px)) / half];
    println!("{worst:?} at {place:?}; {:?}", structure.describe_unexplained());
    assert!((place[0] - 0.5).hypot(place[1] + 0.3) < 0.15, "{place:?}");
    assert!((0.25..1.0).contains(&size(&worst)) && worst.displacement[0] > 0.0 && worst.displacement[1] < 0.0);
    assert!(
        structure.describe_unexplained().iter().any(|line| line.starts_with("sensor") && line.contains("displaced"))
    );
}

#[test]
fn a_scale_that_jumps_from_image_to_image_is_found() {
    let mut block = block("closerange", 300.0, 5);
    displace(&mut block, |image, [x, y]| {
        let size = if image == 7 { 6.0 } else { 0.0 };
        [size * x, size * y]
    });
    let structure = structure(&block);
    println!("{:?}", structure.test("image"));
    assert!(p_value(&structure, "image") < 1e-6);
    let significance = |value: &&misclosure::residuals::ImageValue| (value.scale / value.scale_sigma).abs();
    let images = structure.pictures.images.iter().filter(|value| value.scale_sigma > 0.0);
    let worst = images.max_by(|a, b| significance(a).total_cmp(&significance(b))).unwrap();
    assert_eq!(worst.image, 7);
}

#[test]
fn neighbours_that_err_together_are_found() {
    let mut block = block("mapping", 3000.0, 6);
    // A wave of its own place and direction in every image, as heat above the ground would make.
    displace(&mut block, |image, [x, y]| {
        let k = image as f64;
        let (phase, direction) = (2.4 * k, 1.7 * k);
        let along = x * direction.cos() + y * direction.sin();
        let size = 0.35 * (TAU * along / 0.35 + phase).sin();
        [size, -size]
    });
    let structure = structure(&block);
    println!("{:?}", structure.tests);
    assert!(p_value(&structure, "autocorrelation") < 1e-6);
}

#[test]
fn rows_that_err_together_are_found() {
    let mut block = block("mapping", 3000.0, 6);
    // Four periods while the image is read, of a phase of its own in every image: nearest neighbours are too far apart
    // to see much of them.
    displace(&mut block, |image, [_, y]| {
        let size = 0.1 * (TAU * 4.0 * y / 1.5 + 2.4 * image as f64).sin();
        [size, size]
    });
    let structure = structure(&block);
    println!("{:?}", structure.tests);
    assert!(p_value(&structure, "row-autocorrelation") < 1e-6);
    assert!(p_value(&structure, "row-autocorrelation") < 1e-3 * p_value(&structure, "autocorrelation"));
    let spectrum = structure.test("row-spectrum").expect("tested");
    assert!(spectrum.ln_p_value < -50.0 && spectrum.description.contains("strongest: 4 periods"), "{spectrum:?}");
}

#[test]
fn poses_that_gnss_holds_leave_no_correlation_behind() {
    // Few points an image and precise antennas: the fit of a pose takes much less out of neighbours than its
    // measurements alone would let it.
    let seeds = 1..=16;
    let statistics: Vec<[f64; 2]> = seeds
        .map(|seed| {
            let mut block = common::preset("dike", &[("points", 1500.0)], seed).block;
            for antenna in block.images.iter_mut().filter_map(|image| image.gnss.as_mut()) {
                (antenna.sigma_xy, antenna.sigma_z) = (Some(1e-3), Some(1e-3));
            }
            add_noise(&mut block, NOISE, seed).unwrap();
            add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, seed);
            let run = common::solve_native(&block, &Model { datum: Datum::All, ..Model::default() }, &options());
            let structure = structure_of(&run);
            let spectrum = structure.test("row-spectrum").expect("tested").p_value;
            // Sixteen seeds, of which none may be called unlikely together.
            assert!(spectrum > SIGNIFICANCE / 16.0, "{spectrum}");
            ["autocorrelation", "row-autocorrelation"].map(|name| structure.test(name).expect("tested").statistic)
        })
        .collect();
    for test in 0..2 {
        let count = statistics.len() as f64;
        let mean = statistics.iter().map(|both| both[test]).sum::<f64>() / count;
        // Standard normal each, or below.
        assert!(mean * count.sqrt() < normal_quantile(1.0 - 1e-3), "mean {mean} of {statistics:?}");
    }
}

#[test]
fn images_of_few_points_leave_no_pattern_behind() {
    // Eight points an image. GNSS positions and control determine a large part of the poses. A redundancy that ignores
    // them is a third too small, and overestimates the variance factor.
    for seed in 1..=10 {
        let block = block("mapping", 150.0, seed);
        let run = common::solve_native(&block, &Model { datum: Datum::All, ..Model::default() }, &options());
        let structure = structure_of(&run);
        assert!(structure.family_wise().is_none(), "{seed}: {:?}", structure.describe_unexplained());
    }
}

#[test]
fn a_late_antenna_shows_along_the_track_alone() {
    let mut block = block("dike", 2000.0, 7);
    let centres: Vec<_> = block.images.iter().map(|image| image.pose.centre).collect();
    let velocities: Vec<Vector3<f64>> =
        misclosure::problem::context::image_contexts(&block, &centres).iter().map(|image| image.velocity).collect();
    for (image, velocity) in block.images.iter_mut().zip(velocities) {
        image.gnss.as_mut().unwrap().position += velocity * 0.02;
    }
    let structure = structure(&block);
    println!("{:?}", structure.tests.iter().filter(|t| t.against.starts_with("gnss")).collect::<Vec<_>>());
    assert!(p_value(&structure, "gnss-along") < 1e-6);
    assert!(p_value(&structure, "gnss-across") > SIGNIFICANCE);
    assert!(structure.describe_unexplained().iter().any(|line| line.starts_with("gnss-along")));
}

#[test]
fn check_points_describe_and_decide_nothing() {
    let block = block("mapping", 1200.0, 8);
    let model = Model { datum: default_diagnosis_datum(&block), ..Model::default() };
    let run = common::solve_both_with(&block, &model, &options());
    let (problem, state, comparison) = (&run.problem, &run.solution().state, run.comparison.as_ref());
    let null_base = &SharedBase::default();
    let adjusted = Adjusted { block: &block, model: &model, problem, state, comparison, null_base };
    let structure = with_heights(&run, &heights(&adjusted, SIGNIFICANCE, 1).unwrap());
    assert!(structure.check_points.as_ref().is_some_and(|sentence| sentence.starts_with("Check points show a ")));
    for name in ["check-plane", "check-dome"] {
        assert!(!structure.test(name).unwrap().decides);
    }
    assert!(structure.family_wise().is_none());
}
