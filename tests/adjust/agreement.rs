//! Both solvers agree on every kind of block and model: presets, datums, fixed subsets, losses, effects, cameras.

use crate::common::{SOLVERS, effect, errors_of_both, preset, solve_both, solve_both_with, try_both};
use misclosure::adjust::agreement::{JACOBIAN_REL, RESIDUAL_PX, jacobian_difference, residual_difference};
use misclosure::adjust::{AdjustError, Evaluation, Options, ReducedSystem};
use misclosure::block::{Block, CameraId};
use misclosure::camera::{GROUPS, parameter_indices};
use misclosure::inject;
use misclosure::model::{Datum, Loss, Model, PRIOR_KEY, Prior, TieWeights};
use misclosure::problem::{Problem, ProblemError};
use misclosure::scenario::{Perturbation, Simulation, SurveyNoise, add_noise, add_survey_noise};
use nalgebra::{DMatrix, DVector, Matrix3};

/// Preset, overridden parameters, noise in px.
type Case = (&'static str, &'static [(&'static str, f64)], f64);

const PRESETS: [Case; 4] = [
    ("dike", &[("points", 1500.0), ("check", 20.0)], 0.3),
    ("corridor", &[("length_m", 200.0), ("points", 1500.0), ("check", 20.0)], 0.3),
    ("mapping", &[("points", 1500.0)], 0.3),
    ("closerange", &[("points", 80.0)], 0.05),
];

/// A preset with noise everywhere and start values that are not the truth.
fn noisy(name: &str, overrides: &[(&str, f64)], noise_px: f64) -> Simulation {
    let mut simulation = preset(name, overrides, 11);
    add_noise(&mut simulation.block, noise_px, 12).expect("noise");
    add_survey_noise(&mut simulation.block, SurveyNoise { gnss: true, control: true, check: false }, 13);
    let size = if name == "closerange" { 0.002 } else { 0.05 };
    let start = Perturbation { focal_fraction: 0.002, position_m: size, angle_rad: 5e-4, points: true };
    simulation.perturb_start(start, 14).expect("a perturbation");
    for (i, image) in simulation.block.images.iter().enumerate() {
        let ties = simulation.block.ties.iter().filter(|row| row.image.index() == i).count();
        assert!(ties > 5, "{}: {ties} measurements do not orient it", image.name);
    }
    simulation
}

fn dike() -> Block {
    let (name, overrides, noise) = PRESETS[0];
    noisy(name, overrides, noise).block
}

fn closerange() -> Block {
    let (name, overrides, noise) = PRESETS[3];
    noisy(name, overrides, noise).block
}

#[test]
fn on_every_preset_and_datum() {
    for (name, overrides, noise) in PRESETS {
        let block = noisy(name, overrides, noise).block;
        let mut solved = 0;
        for datum in [Datum::Free, Datum::Control, Datum::Gnss, Datum::All] {
            let model = Model { datum, ..Model::default() };
            if matches!(Problem::new(&block, &model), Err(ProblemError::Datum { .. })) {
                assert_eq!((name, datum), ("closerange", Datum::Gnss), "the target field alone has no GNSS");
                continue;
            }
            let run = solve_both(&block, &model);
            assert!((run.sigma0() - 1.0).abs() < 0.1, "{name}, {datum:?}: sigma0 {}", run.sigma0());
            solved += 1;
        }
        assert!(solved >= 3);
    }
}

#[test]
fn with_every_group_held_and_with_the_centre_tied() {
    for block in [dike(), closerange()] {
        let model = Model { datum: Datum::Control, ..Model::default() };
        for (_, group) in GROUPS {
            let mut held = model.clone();
            group.iter().for_each(|k| held.free[*k] = false);
            let run = solve_both(&block, &held);
            for k in group.iter() {
                assert_eq!(run.solution().state.interiors[0][*k], block.cameras[0].interior[*k], "held is held");
            }
        }
        for name in ["f", "none"] {
            let mut few = Model { free: [false; 12], ..model.clone() };
            parameter_indices(name).expect("a name").into_iter().for_each(|k| few.free[k] = true);
            solve_both(&block, &few);
        }
        let run = solve_both(&block, &Model { tie_dc_to_pp: true, ..model });
        let interior = run.solution().state.interiors[0];
        assert_eq!((interior[1], interior[2]), (interior[3], interior[4]), "tied is tied");
    }
}

#[test]
fn with_every_robust_loss_and_outliers() {
    let mut block = dike();
    // Gross errors in points of four rays or more: of two or three it is not known which one errs, and Cauchy's cost has a minimum for each.
    let mut rays = vec![0; block.tie_points.len()];
    block.ties.iter().for_each(|row| rays[row.point.index()] += 1);
    let mut outliers = 0;
    for (k, row) in block.ties.iter_mut().enumerate().filter(|(k, row)| k % 97 == 5 && rays[row.point.index()] > 3) {
        outliers += 1;
        row.x += if k % 2 == 0 { 15.0 } else { -25.0 };
    }
    assert!(outliers > 20, "{outliers} outliers");
    let mut sigma0 = Vec::new();
    for loss in [Loss::None, Loss::Huber, Loss::Cauchy] {
        for datum in [Datum::Free, Datum::All] {
            // Reweighting without second derivatives is slow where the loss is not convex: Cauchy takes some hundred iterations.
            let options = Options { max_iterations: 1000, ..Options::default() };
            sigma0.push(solve_both_with(&block, &Model { loss, datum, ..Model::default() }, &options).sigma0());
        }
    }
    assert!(sigma0[0] > sigma0[2] && sigma0[2] > sigma0[4], "a loss that grows less sums to less: {sigma0:?}");
}

#[test]
fn with_weights_by_multiplicity_and_priors() {
    let block = dike();
    for tie_weights in [TieWeights::Multi, TieWeights::Pairs] {
        solve_both(&block, &Model { tie_weights, datum: Datum::All, ..Model::default() });
    }
    let prior = |parameter: &str, value: f64, sigma: f64| Prior {
        camera: "cam".into(),
        parameter: parameter.into(),
        value,
        sigma,
    };
    let priors = vec![prior("f", 5509.0, 0.5), prior("dcx", 2538.0, 2.0), prior("k3", 0.0, 1e-25)];
    let with = solve_both(&block, &Model { priors, ..Model::default() });
    let without = solve_both(&block, &Model::default());
    let sigma = |run: &misclosure::run::Run| run.solution().covariance.as_ref().expect("a covariance").shared[(0, 0)];
    assert!(sigma(&with) < sigma(&without), "a prior is information");
}

/// Every effect of the catalogue on a block that has what it needs, one at a time, from its nominal values. Many-parameter effects that
/// this block cannot determine are refused by every solver, and named.
#[test]
fn with_every_effect_of_the_catalogue() {
    use misclosure::effects::{Kind, Role, catalogue};
    let mut block = noisy("dike", &[("points", 1000.0), ("check", 0.0)], 0.3).block;
    for image in &mut block.images {
        image.angular_velocity = Some(nalgebra::Vector3::new(0.01, -0.02, 0.015));
        image.focus_m = Some(50.0);
    }
    let (mut failed, mut solved) = (Vec::new(), 0);
    for builtin in catalogue() {
        let descriptor = builtin.descriptor();
        let mut term = effect(&descriptor.id);
        // Where the flaw is cannot be told from measurements that have none.
        let searched = descriptor.parameters.iter().filter(|parameter| matches!(parameter.role, Role::Searched(_)));
        term.held = searched.map(|parameter| parameter.name.to_string()).collect();
        if descriptor.kind == Kind::Empirical {
            // What a field shares with the camera wants a prior, stated as a user would.
            term.values.insert(PRIOR_KEY.to_string(), 30.0);
        }
        let model = Model { datum: Datum::All, effects: vec![term], ..Model::default() };
        match try_both(&block, &model, &Options::default()) {
            Ok(_) => solved += 1,
            Err(text) if text.contains("do not determine") => {
                for error in errors_of_both(&block, &model) {
                    let named = matches!(&error, AdjustError::Singular { directions, .. }
                        if directions.iter().all(|d| d.components.iter().any(|(name, _)| name.starts_with(&*descriptor.id))));
                    if !named {
                        failed.push(format!("{}: {error}", descriptor.id));
                    }
                }
            }
            Err(text) => failed.push(format!("{}: {text}", descriptor.id)),
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert!(solved + 3 >= catalogue().len(), "only {solved} effects were determined");
}

/// Effects of every stage at once, each away from its nominal values and with a row that turns the camera: both solvers hand the same
/// pose and interior orientation from stage to stage.
#[test]
fn with_one_effect_of_every_stage_in_one_chain() {
    let mut block = noisy("dike", &[("points", 1000.0), ("check", 20.0)], 0.3).block;
    for image in &mut block.images {
        image.angular_velocity = Some(nalgebra::Vector3::new(0.3, -0.2, 0.15));
    }
    let values = [
        ("rolling-shutter", vec![("t", 0.03)]),
        ("refraction", Vec::new()),
        ("gravity-sag", vec![("sx_x", 3.0), ("sx_y", -2.0), ("sy_x", 1.0), ("sy_y", 4.0)]),
        ("unflatness", Vec::new()),
        ("gnss-lever-arm", vec![("lx", 0.1), ("lz", -0.2)]),
        ("map-scale", Vec::new()),
    ];
    let stages: std::collections::BTreeSet<_> =
        values.iter().map(|(id, _)| misclosure::effects::find(id).expect("an effect").descriptor().stage).collect();
    assert_eq!(stages.len(), misclosure::effects::Stage::ALL.len(), "{stages:?}");
    let effects = values.map(|(id, values)| {
        let mut term = effect(id);
        for parameter in &term.effect.clone().descriptor().parameters {
            let away = if matches!(parameter.role, misclosure::effects::Role::Estimated) {
                parameter.typical
            } else {
                continue;
            };
            term.values.insert(parameter.name.to_string(), away);
        }
        term.values.extend(values.into_iter().map(|(name, value)| (name.to_string(), value)));
        term
    });
    let model = Model { datum: Datum::All, effects: effects.into(), ..Model::default() };
    let problem = Problem::new(&block, &model).expect("a problem");
    let [a, b] = SOLVERS.map(|solver| solver.evaluate(&problem, &problem.start).expect("an evaluation"));
    let (residuals, jacobian) = (residual_difference(&problem, &a, &b), jacobian_difference(&problem, &a, &b).0);
    assert!(residuals < RESIDUAL_PX, "residuals {residuals:e} px");
    assert!(jacobian < JACOBIAN_REL, "Jacobian {jacobian:e}");
}

/// The contract from end to end: a cause is simulated by its own formula, its effect is estimated with everything else, and
/// each parameter comes back within its covariance.
fn found_again(cause: &str, id: &str, start: &[(&str, f64)], expected: &[(&str, f64)]) {
    let simulation = preset("dike", &[("points", 3000.0), ("check", 20.0)], 21);
    let injection = inject::parse(cause).unwrap_or_else(|error| panic!("{cause}: {error}"));
    let mut block = inject::apply(&simulation.block, &simulation.truth, &[injection], 22).expect("an injection").block;
    add_noise(&mut block, 0.3, 23).expect("noise");
    add_survey_noise(&mut block, SurveyNoise { gnss: true, control: true, check: false }, 24);
    let plain = Model { datum: Datum::All, ..Model::default() };
    let without = solve_both(&block, &plain);
    let mut term = effect(id);
    term.values = start.iter().map(|(name, value)| (name.to_string(), *value)).collect();
    let with = solve_both(&block, &Model { effects: vec![term], ..plain });
    // A drop of chi-square by 100 for a handful of parameters is ten sigma.
    let drop = without.chi_square() - with.chi_square();
    assert!(drop > 100.0, "{cause}: chi-square drops by {drop}");
    assert!((with.sigma0() - 1.0).abs() < 0.03, "{cause} is explained: sigma0 {}", with.sigma0());
    let covariance = with.solution().covariance.as_ref().expect("a covariance");
    for (name, expected) in expected {
        let name = format!("{id}.{name}");
        let t = with.problem.theta.iter().position(|entry| entry.name == name).expect("the parameter");
        let (value, sigma) = (with.solution().state.theta[t], covariance.theta_variances[t].sqrt());
        assert!(sigma > 0.0 && sigma < 0.1 * expected.abs().max(1.0), "{name}: sigma {sigma}");
        // Five sigma: a false alarm in two million.
        assert!((value - expected).abs() < 5.0 * sigma, "{name} = {value} +- {sigma}, expected {expected}");
    }
}

#[test]
fn a_growing_focal_length_is_found_by_focal_time() {
    // f (1 + b)^n over the 113 images, in the order of the table.
    let expected = 5510.09 * ((1.0f64 + 2e-5).powi(112) - 1.0);
    found_again("focal-growth:b=2e-5", "focal-time", &[("against", 1.0)], &[("a", expected)]);
}

#[test]
fn a_lever_arm_is_found_by_gnss_lever_arm() {
    found_again(
        "gnss-lever-arm:x=0.05,y=0.12,z=-0.2",
        "gnss-lever-arm",
        &[],
        &[("lx", 0.05), ("ly", 0.12), ("lz", -0.2)],
    );
}

#[test]
fn a_flaw_of_the_sensor_is_found_by_local_flaw() {
    let cause = "local-flaw:centre_x=1500,centre_y=1200,lambda=10,sigma=400,smooth=1";
    let start = [("lambda", 6.0), ("centre_x", 1450.0), ("centre_y", 1260.0), ("sigma", 330.0), ("smooth", 1.0)];
    // The cause moves what the lens made, the effect what the camera model gives: the same place on the sensor.
    let expected = [("lambda", 10.0), ("centre_x", 1500.0), ("centre_y", 1200.0), ("sigma", 400.0)];
    found_again(cause, "local-flaw", &start, &expected);
}

/// Every second image is taken by a camera of its own, with another focal length and an image-wise split of everything.
#[test]
fn with_two_cameras_in_one_block() {
    let mut block = dike();
    let mut second = block.cameras[0].clone();
    second.id = "second".into();
    second.interior[0] *= 1.001;
    block.cameras.push(second);
    for image in block.images.iter_mut().skip(1).step_by(2) {
        image.camera = CameraId(1);
    }
    for datum in [Datum::Free, Datum::All] {
        let run = solve_both(&block, &Model { datum, ..Model::default() });
        let covariance = run.solution().covariance.as_ref().expect("a covariance");
        assert_eq!(covariance.shared_unknowns.len(), 24);
        for k in 0..12 {
            let [a, b] = [0, 1].map(|c| run.solution().state.interiors[c][k]);
            let sigma = (covariance.shared[(k, k)] + covariance.shared[(12 + k, 12 + k)]).sqrt();
            // One camera took them all: the two estimates differ by their noise.
            assert!((a - b).abs() < 6.0 * sigma, "{}: {a} and {b}", misclosure::camera::PARAMETERS[k]);
        }
    }
    let effects = vec![effect("focal-time"), effect("pp-flight")];
    solve_both(&block, &Model { datum: Datum::All, effects, ..Model::default() });
}

/// Of entries of the reduced system, by the diagonal of the system before elimination (where rounding happens): a sum of some
/// thousand products of size 1 in double precision keeps twelve digits.
const REDUCED_REL: f64 = 1e-12;

/// `J'J` and `J'r` of an evaluation, and the same with the points taken out, by dense algebra that no solver uses.
fn eliminated(problem: &Problem, evaluation: &Evaluation) -> (DVector<f64>, ReducedSystem) {
    let layout = problem.layout();
    let points = layout.point(0, 0);
    let unknowns: Vec<usize> = (0..points).filter(|unknown| problem.free()[*unknown]).collect();
    let mut position = vec![usize::MAX; points];
    unknowns.iter().enumerate().for_each(|(i, unknown)| position[*unknown] = i);
    let n = unknowns.len();
    let mut matrix = DMatrix::<f64>::zeros(n, n);
    let mut gradient = DVector::<f64>::zeros(n);
    let mut v = vec![Matrix3::<f64>::zeros(); layout.points];
    let mut w = vec![DMatrix::<f64>::zeros(n, 3); layout.points];
    let mut g = vec![nalgebra::Vector3::<f64>::zeros(); layout.points];
    for row in 0..evaluation.residuals.len() {
        let entries: Vec<(usize, f64)> = (evaluation.row_start[row]..evaluation.row_start[row + 1])
            .map(|k| (evaluation.columns[k], evaluation.values[k]))
            .collect();
        let r = evaluation.residuals[row];
        for (a, x) in &entries {
            if *a < points {
                gradient[position[*a]] += x * r;
            } else {
                g[(a - points) / 3][(a - points) % 3] += x * r;
            }
            for (b, y) in &entries {
                match (*a < points, *b < points) {
                    (true, true) => matrix[(position[*a], position[*b])] += x * y,
                    (true, false) => w[(b - points) / 3][(position[*a], (b - points) % 3)] += x * y,
                    (false, false) => v[(a - points) / 3][((a - points) % 3, (b - points) % 3)] += x * y,
                    (false, true) => {}
                }
            }
        }
    }
    let diagonal = matrix.diagonal();
    for j in 0..layout.points {
        let inverse = v[j].cholesky().expect("a determined point").inverse();
        let y = &w[j] * inverse;
        matrix -= &y * w[j].transpose();
        gradient -= y * g[j];
    }
    (diagonal, ReducedSystem { unknowns, matrix, gradient: gradient.iter().copied().collect() })
}

/// Largest difference of two reduced systems: of the matrix by the diagonal before elimination, of the gradient also by the residuals' length.
fn difference(diagonal: &DVector<f64>, length: f64, a: &ReducedSystem, b: &ReducedSystem) -> (f64, f64) {
    assert_eq!(a.unknowns, b.unknowns);
    let n = a.unknowns.len();
    let (mut matrix, mut gradient) = (0.0f64, 0.0f64);
    for i in 0..n {
        gradient = gradient.max((a.gradient[i] - b.gradient[i]).abs() / (diagonal[i].sqrt() * length));
        for j in 0..n {
            let scale = (diagonal[i] * diagonal[j]).sqrt();
            matrix = matrix.max((a.matrix[(i, j)] - b.matrix[(i, j)]).abs() / scale);
        }
    }
    (matrix, gradient)
}

#[test]
fn reduced_systems_agree_with_each_other_and_with_dense_algebra() {
    let mut split = dike();
    let mut second = split.cameras[0].clone();
    second.id = "second".into();
    split.cameras.push(second);
    split.images.iter_mut().skip(1).step_by(2).for_each(|image| image.camera = CameraId(1));
    let effects = vec![effect("focal-time"), effect("gnss-lever-arm")];
    for (block, model) in [
        (dike(), Model::default()),
        (dike(), Model { datum: Datum::All, effects, ..Model::default() }),
        (dike(), Model { datum: Datum::Control, tie_dc_to_pp: true, loss: Loss::Cauchy, ..Model::default() }),
        (closerange(), Model { datum: Datum::Control, ..Model::default() }),
        (split, Model { datum: Datum::All, ..Model::default() }),
    ] {
        let problem = Problem::new(&block, &model).expect("a problem");
        let systems: Vec<ReducedSystem> = SOLVERS
            .iter()
            .map(|solver| solver.reduced_system(&problem, &problem.start).expect("a reduced system"))
            .collect();
        for (solver, system) in SOLVERS.iter().zip(&systems) {
            let evaluation = solver.evaluate(&problem, &problem.start).expect("an evaluation");
            let length = evaluation.residuals.iter().map(|r| r * r).sum::<f64>().sqrt();
            let (diagonal, expected) = eliminated(&problem, &evaluation);
            for (what, other) in [("dense algebra", &expected), ("the first solver", &systems[0])] {
                let (matrix, gradient) = difference(&diagonal, length, system, other);
                println!("{} against {what}: matrix {matrix:.1e}, gradient {gradient:.1e}", solver.name());
                assert!(matrix < REDUCED_REL, "{}: {} against {what}: matrix {matrix:e}", block.name, solver.name());
                assert!(
                    gradient < REDUCED_REL,
                    "{}: {} against {what}: gradient {gradient:e}",
                    block.name,
                    solver.name()
                );
            }
        }
    }
}
