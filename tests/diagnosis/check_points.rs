//! Height errors of the check points of blocks without a cause: as large as the covariance of each block says,
//! whatever fixes its datum.

use crate::common;
use misclosure::adjust::{CovarianceOf, Options};
use misclosure::block::{Block, Role};
use misclosure::math::statistics::{f_sf, kolmogorov_smirnov};
use misclosure::model::{Datum, Model, TieWeights};
use misclosure::null_model::SharedBase;
use misclosure::residuals::check_points::{Adjusted, Heights, heights};
use misclosure::run::Run;
use misclosure::scenario::{SurveyNoise, add_noise, add_survey_noise};
use nalgebra::{DMatrix, DVector};

/// px.
const NOISE: f64 = 0.3;
const SIGNIFICANCE: f64 = 1e-3;
/// Blocks of a test that runs each time. A wrong covariance (that of independent points) shows with these few.
const BLOCKS: u64 = 24;
/// Probability of a sample less uniform than this by chance alone, under seeds that are fixed.
const UNLIKELY: f64 = 1e-3;

/// A preset with so many of its control and check points.
#[derive(Debug, Clone, Copy)]
struct Few {
    preset: &'static str,
    overrides: &'static [(&'static str, f64)],
    control: usize,
    check: usize,
}

const DIKE: Few = Few { preset: "dike", overrides: &[("points", 1200.0), ("check", 60.0)], control: 4, check: 60 };
const MAPPING: Few = Few { preset: "mapping", overrides: &[("points", 1200.0)], control: 5, check: 60 };

fn block(few: Few, seed: u64) -> Block {
    let mut block = common::preset(few.preset, few.overrides, seed).block;
    add_noise(&mut block, NOISE, seed).unwrap();
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: true }, seed);
    keep(&mut block, Role::Control, few.control);
    keep(&mut block, Role::Check, few.check);
    block
}

/// Leaves the marks of so many points of a role, evenly taken; the others take no part in anything.
fn keep(block: &mut Block, role: Role, count: usize) {
    let all: Vec<usize> = (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == role).collect();
    assert!(all.len() >= count, "{} points of {role:?}", all.len());
    let last = (all.len() - 1).max(1) as f64;
    let kept: Vec<usize> =
        (0..count).map(|k| all[(k as f64 * last / (count - 1).max(1) as f64).round() as usize]).collect();
    block.marks.retain(|mark| {
        let point = mark.point.index();
        block.surveyed[point].role != role || kept.contains(&point)
    });
}

fn adjust(block: &Block, datum: Datum) -> (Model, Run) {
    let model = Model { datum, ..Model::default() };
    let options = Options { covariance: CovarianceOf::Nothing, ..Options::default() };
    let run = common::solve_native(block, &model, &options);
    (model, run)
}

fn tested(block: &Block, model: &Model, run: &Run) -> Result<Heights, &'static str> {
    let (problem, state, comparison) = (&run.problem, &run.solution().state, run.comparison.as_ref());
    let adjusted = Adjusted { block, model, problem, state, comparison, null_base: &SharedBase::default() };
    heights(&adjusted, SIGNIFICANCE, 1).expect("a fit that can be linearised")
}

/// p-values of plane and dome, and those of the test for independent points.
fn p_values(few: Few, datum: Datum) -> [[Vec<f64>; 2]; 2] {
    let (mut found, mut independently) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for seed in 1..=common::null_blocks(BLOCKS) {
        let block = block(few, seed);
        let (model, run) = adjust(&block, datum);
        let heights = tested(&block, &model, &run).expect("tested");
        // The sentence says of the dome what its p-value says.
        let allowed = heights.coefficients_m[3].abs() <= heights.dome_allowed_m;
        assert_eq!(allowed, heights.dome.p_value >= SIGNIFICANCE, "{heights:?}");
        assert_eq!(allowed, !heights.sentence.contains("do not allow it"), "{heights:?}");
        found[0].push(heights.plane.p_value);
        found[1].push(heights.dome.p_value);
        for (all, one) in independently.iter_mut().zip(independent(&run)) {
            all.push(one);
        }
    }
    [found, independently]
}

fn hold_uniform(few: Few, datum: Datum) {
    let [found, independently] = p_values(few, datum);
    for (k, name) in ["plane", "dome"].iter().enumerate() {
        let (distance, p) = kolmogorov_smirnov(&found[k], |x| x);
        println!("{} {datum:?} {name}: distance {distance:.3}, p = {p:.3}", few.preset);
        assert!(p > UNLIKELY, "{few:?} {datum:?} {name}: {distance}, p = {p}: {:?}", found[k]);
        // The tail, of which the distance above says little: the smallest of n is below UNLIKELY / n with that
        // probability.
        let smallest = found[k].iter().copied().fold(1.0, f64::min);
        assert!(smallest * found[k].len() as f64 > UNLIKELY, "{few:?} {datum:?} {name}: p = {smallest}");
        // So few blocks tell the one from the other; of the dome where control and GNSS hold a block, hundreds would.
        let (distance, p) = kolmogorov_smirnov(&independently[k], |x| x);
        println!("{} {datum:?} {name}: as if independent distance {distance:.3}, p = {p:.1e}", few.preset);
        assert!(p < UNLIKELY || k > 0, "{few:?} {datum:?} {name} as if independent: {distance}, p = {p}");
    }
}

#[test]
fn p_values_are_uniform_with_control_alone() {
    hold_uniform(DIKE, Datum::Control);
    hold_uniform(MAPPING, Datum::Control);
}

#[test]
fn p_values_are_uniform_with_gnss_alone() {
    hold_uniform(DIKE, Datum::Gnss);
    hold_uniform(MAPPING, Datum::Gnss);
}

#[test]
fn p_values_are_uniform_with_both() {
    hold_uniform(DIKE, Datum::All);
    hold_uniform(MAPPING, Datum::All);
}

#[test]
fn p_values_are_uniform_after_a_similarity() {
    hold_uniform(MAPPING, Datum::Free);
}

/// p-values of plane and dome against the scatter of the single points: the test for points that are independent.
fn independent(run: &Run) -> [f64; 2] {
    let rows = run.comparison.iter().flat_map(|comparison| &comparison.rows);
    let rows: Vec<_> = rows.filter(|row| row.role == Role::Check).collect();
    let n = rows.len() as f64;
    let centre = rows.iter().map(|row| row.position).sum::<nalgebra::Vector3<f64>>() / n;
    let height = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.d.z));
    let rest = |terms: usize| {
        let design = DMatrix::from_fn(rows.len(), terms, |k, term| {
            let arm = (rows[k].position - centre) / 100.0;
            [1.0, arm.x, arm.y, arm.xy().norm_squared()][term]
        });
        let solved = design.clone().svd(true, true).solve(&height, 1e-12).expect("a fit");
        (&height - design * solved).norm_squared()
    };
    let [none, plane, dome] = [height.norm_squared(), rest(3), rest(4)];
    [
        f_sf((none - plane) / 3.0 / (plane / (n - 3.0)), 3.0, n - 3.0),
        f_sf((plane - dome) / (dome / (n - 4.0)), 1.0, n - 4.0),
    ]
}

#[test]
fn a_bent_block_is_told() {
    let mut block = block(MAPPING, 1);
    let (model, run) = adjust(&block, Datum::All);
    let before = tested(&block, &model, &run).expect("tested");
    assert!(before.dome.p_value > SIGNIFICANCE && before.sentence.contains("this block's control and GNSS allow"));
    // What is wrong of the survey of check points reaches no other part of the fit.
    let (reach, n) = (before.reach_m, before.n as f64);
    let checks: Vec<usize> = (0..block.surveyed.len()).filter(|k| block.surveyed[*k].role == Role::Check).collect();
    let rows: Vec<_> = run.comparison.as_ref().unwrap().rows.iter().filter(|row| row.role == Role::Check).collect();
    let centre = rows.iter().map(|row| row.position).sum::<nalgebra::Vector3<f64>>() / n;
    let height = 3.0 * before.dome_allowed_m;
    for k in checks {
        let place = &mut block.surveyed[k].position;
        place.z += height * (*place - centre).xy().norm_squared() / (reach * reach);
    }
    let (model, run) = adjust(&block, Datum::All);
    let after = tested(&block, &model, &run).expect("tested");
    println!("{}", after.sentence);
    let change = after.coefficients_m[3] - before.coefficients_m[3];
    assert!((change + height).abs() < 1e-9, "{change} {height}");
    assert!(
        after.sentence.contains("show a dome of") && after.sentence.contains("do not allow it"),
        "{}",
        after.sentence
    );
}

#[test]
fn no_covariance_no_p_value() {
    let few = block(MAPPING, 1);
    let (model, run) = adjust(&few, Datum::All);
    let weighted = Model { tie_weights: TieWeights::Multi, ..model };
    assert!(tested(&few, &weighted, &run).unwrap_err().contains("weights"));

    let mut unknown = few.clone();
    unknown.sigma.control_z_m = f64::INFINITY;
    let (model, run) = adjust(&few, Datum::Gnss);
    assert!(tested(&unknown, &model, &run).unwrap_err().contains("precisions"));

    let mut alone = few;
    keep(&mut alone, Role::Check, 7);
    let (model, run) = adjust(&alone, Datum::All);
    assert_eq!(tested(&alone, &model, &run).unwrap_err(), "too few check points");
}
