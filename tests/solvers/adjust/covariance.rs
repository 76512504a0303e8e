//! With noise of known size: sigma0 is one, and errors of the estimates follow the covariance that the solvers state.

use crate::common::{SOLVERS, preset, solve_both_with, solve_native};
use misclosure::adjust::native::Native;
use misclosure::adjust::{AdjustError, CovarianceOf, Options, Solver};
use misclosure::math::statistics::{chi_square_quantile, chi_square_sf, mean, std};
use misclosure::model::{Datum, Model};
use misclosure::problem::Problem;
use misclosure::run::Run;
use misclosure::scenario::{Simulation, SurveyNoise, add_noise, add_survey_noise};
use nalgebra::{DMatrix, DVector, Vector3};
use std::ops::ControlFlow;

const NOISE_PX: f64 = 0.3;
const SEEDS: u64 = 60;
/// Of every statistical test here: a false alarm in a thousand such tests. Seeds are fixed, so one that passes keeps
/// passing.
const SIGNIFICANCE: f64 = 1e-3;
/// Seeds that both solvers adjust.
const BOTH: u64 = 3;

/// A thinner dike: fewer points, the same images.
fn noisy(seed: u64) -> Simulation {
    let mut simulation = preset("dike", &[("points", 2000.0), ("check", 50.0)], 100 + seed);
    add_noise(&mut simulation.block, NOISE_PX, 1000 + seed).expect("noise");
    add_survey_noise(&mut simulation.block, SurveyNoise { gnss: true, control: true, check: false }, 2000 + seed);
    simulation
}

/// `e' C^-1 e`, scaled to unit diagonal first: the parameters' units differ by twenty powers of ten.
fn normalised_square(error: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let sigma = covariance.diagonal().map(f64::sqrt);
    let n = sigma.len();
    let unit = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (sigma[i] * sigma[j]));
    let error = error.component_div(&sigma);
    error.dot(&unit.cholesky().expect("a positive covariance").solve(&error))
}

/// The camera's twelve errors against their covariance.
fn camera_square(run: &Run, simulation: &Simulation) -> f64 {
    let covariance = run.solution().covariance.as_ref().expect("a covariance");
    assert_eq!(covariance.shared_unknowns, (0..12).collect::<Vec<_>>());
    let found = run.solution().state.interiors[0];
    let error = DVector::from_fn(12, |k, _| found[k] - simulation.truth.cameras[0].interior[k]);
    normalised_square(&error, &covariance.shared)
}

/// Mean over the points, or over the poses, of `e' C^-1 e` by the number of coordinates.
fn point_mean(run: &Run, simulation: &Simulation) -> f64 {
    let solution = run.solution();
    let covariance = solution.covariance.as_ref().expect("a covariance");
    let squares: Vec<f64> = run
        .problem
        .point_sources
        .iter()
        .enumerate()
        .map(|(j, source)| {
            let truth: Vector3<f64> = match source {
                misclosure::problem::PointSource::Tie(id) => {
                    simulation.truth.tie_points[id.index()].position.expect("truth")
                }
                misclosure::problem::PointSource::Control(id) => simulation.truth.surveyed[id.index()].position,
            };
            let error = solution.state.points[j] - truth;
            error.dot(&covariance.points[j].cholesky().expect("positive").solve(&error)) / 3.0
        })
        .collect();
    mean(&squares)
}

fn pose_mean(run: &Run, simulation: &Simulation) -> f64 {
    let solution = run.solution();
    let covariance = solution.covariance.as_ref().expect("a covariance");
    let squares: Vec<f64> = (0..solution.state.poses.len())
        .map(|i| {
            let (found, truth) = (&solution.state.poses[i], &simulation.truth.images[i].pose);
            // Rotation errors as the increment w of R = exp([w]x) R_true.
            let turn = (found.rotation * truth.rotation.inverse()).scaled_axis();
            let shift = found.centre - truth.centre;
            let error = nalgebra::Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            error.dot(&covariance.poses[i].cholesky().expect("positive").solve(&error)) / 6.0
        })
        .collect();
    mean(&squares)
}

/// Kolmogorov-Smirnov: is the sample uniform on 0..1? Statistic against its critical value (Stephens 1974).
fn assert_uniform(sample: &[f64], what: &str) {
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let distance =
        sorted.iter().enumerate().map(|(i, p)| ((i as f64 + 1.0) / n - p).max(p - i as f64 / n)).fold(0.0, f64::max);
    // P(sqrt(n) D > c) = 2 exp(-2 c^2) in the limit.
    let critical = (-0.5 * (0.5 * SIGNIFICANCE).ln()).sqrt();
    let scaled = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    assert!(scaled < critical, "{what}: KS {scaled:.3} above {critical:.3}: {sorted:?}");
}

/// Is a sum of squares one of chi-square? Two-sided.
fn assert_chi_square(sum: f64, dof: f64, what: &str) {
    let (low, high) =
        (chi_square_quantile(0.5 * SIGNIFICANCE, dof), chi_square_quantile(1.0 - 0.5 * SIGNIFICANCE, dof));
    assert!(sum > low && sum < high, "{what}: {sum:.1} outside {low:.1} to {high:.1} ({dof} degrees of freedom)");
    println!("{what}: {sum:.1} of {dof} degrees of freedom ({low:.1} to {high:.1})");
}

#[test]
fn sigma0_of_the_dike_is_one() {
    let mut simulation = preset("dike", &[], 1);
    add_noise(&mut simulation.block, NOISE_PX, 2).expect("noise");
    let run = solve_both_with(&simulation.block, &Model::default(), &Options::default());
    // 1 % is eight times the standard deviation 1 / sqrt(2 r) of sigma0 for a redundancy of some 80 000.
    assert!((run.sigma0() - 1.0).abs() < 0.01, "sigma0 = {}", run.sigma0());
}

#[test]
fn errors_of_the_camera_follow_their_covariance_in_the_free_datum() {
    let model = Model::default();
    let options = Options { covariance: CovarianceOf::Shared, ..Options::default() };
    let squares: Vec<f64> = (0..SEEDS)
        .map(|seed| {
            let simulation = noisy(seed);
            let run = if seed < BOTH {
                solve_both_with(&simulation.block, &model, &options)
            } else {
                solve_native(&simulation.block, &model, &options)
            };
            camera_square(&run, &simulation)
        })
        .collect();
    assert_chi_square(squares.iter().sum(), 12.0 * SEEDS as f64, "camera, free datum");
    assert_uniform(&squares.iter().map(|s| chi_square_sf(*s, 12.0)).collect::<Vec<_>>(), "camera, free datum");
}

#[test]
fn errors_of_everything_follow_their_covariance_with_control_and_gnss() {
    let model = Model { datum: Datum::All, ..Model::default() };
    let options = Options::default();
    let (mut cameras, mut points, mut poses) = (Vec::new(), Vec::new(), Vec::new());
    let (mut chi_square, mut redundancy) = (0.0, 0);
    for seed in 0..SEEDS {
        let simulation = noisy(seed);
        let run = if seed < BOTH {
            solve_both_with(&simulation.block, &model, &options)
        } else {
            solve_native(&simulation.block, &model, &options)
        };
        cameras.push(camera_square(&run, &simulation));
        points.push(point_mean(&run, &simulation));
        poses.push(pose_mean(&run, &simulation));
        chi_square += run.chi_square();
        redundancy += run.problem.redundancy().2;
    }
    assert_chi_square(chi_square, redundancy as f64, "v'Pv of all seeds");
    assert_chi_square(cameras.iter().sum(), 12.0 * SEEDS as f64, "camera, datum all");
    assert_uniform(&cameras.iter().map(|s| chi_square_sf(*s, 12.0)).collect::<Vec<_>>(), "camera, datum all");
    // Errors within a block are correlated, blocks are not: the mean over the blocks against its own standard
    // deviation. 3.46 is the quantile of Student's t with 59 degrees of freedom at the significance, two-sided.
    for (what, means) in [("points", &points), ("poses", &poses)] {
        let t = (mean(means) - 1.0) / (std(means) / (SEEDS as f64).sqrt());
        println!(
            "{what}: mean square {:.4}, standard deviation over the seeds {:.4}, t = {t:.2}",
            mean(means),
            std(means)
        );
        assert!(t.abs() < 3.46, "{what}: mean square of normalised errors {:.4}, t = {t:.2}", mean(means));
        // A standard deviation wrong by a tenth must show: else the test says nothing.
        assert!(3.46 * std(means) / (SEEDS as f64).sqrt() < 0.2, "{what}: too few seeds");
    }
}

/// Adjustments in which something is held have the covariances that the parts of one without say.
#[test]
fn parts_of_the_covariance_of_points_are_those_of_adjustments_with_more_known() {
    let mut simulation = preset("closerange", &[("points", 60.0)], 1);
    add_noise(&mut simulation.block, NOISE_PX, 2).expect("noise");
    let free = Problem::new(&simulation.block, &Model { datum: Datum::All, ..Model::default() }).expect("a problem");
    let solve = |solver: &dyn Solver, problem: &Problem, covariance: CovarianceOf| {
        solver.solve(problem, &Options { covariance, ..Options::default() }, &mut |_| ControlFlow::Continue(()))
    };
    let with_parts = solve(&Native, &free, CovarianceOf::WithParts).expect("a solution");
    let covariance = with_parts.covariance.expect("a covariance");
    let shared = covariance.shared.clone().cholesky().expect("a positive covariance");
    let mut free = free;
    free.start = with_parts.state;
    let mut f_known = free.clone();
    f_known.camera_free[0][0] = false;
    let mut cameras_known = free.clone();
    cameras_known.camera_free[0] = [false; 12];
    let mut rays = cameras_known.clone();
    rays.pose_free.fill([false; 6]);
    rays.gnss.clear();
    for (what, problem) in [("f", f_known), ("cameras", cameras_known), ("rays", rays)] {
        for solver in SOLVERS {
            let mut most = 0.0_f64;
            let held =
                solve(solver, &problem, CovarianceOf::Everything).unwrap_or_else(|error| panic!("{what}: {error}"));
            for (j, found) in held.covariance.expect("a covariance").points.iter().enumerate() {
                let (all, parts) = (covariance.points[j], &covariance.point_parts[j]);
                let x = &parts.with_shared;
                let expected = match what {
                    "f" => all - x.column(0) * x.column(0).transpose() / covariance.shared[(0, 0)],
                    "cameras" => all - x * shared.solve(&x.transpose()),
                    _ => parts.rays,
                };
                let difference = (found - expected).abs().max() / all.diagonal().max();
                assert!(difference < 1e-6, "{what} known, {}, point {j}: {difference:e}", solver.name());
                most = most.max((all - found).diagonal().max() / all.diagonal().max());
            }
            // What is known makes points more precise, f least: a test in which nothing changed would show nothing.
            assert!(most > 1e-3, "{what} known: {most:e} of a variance at most");
        }
    }
    for solver in SOLVERS.iter().filter(|solver| solver.name() != Native.name()) {
        let refused = solve(*solver, &free, CovarianceOf::WithParts);
        assert!(matches!(refused, Err(AdjustError::Unsupported { .. })), "{}", solver.name());
    }
}
