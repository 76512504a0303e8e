//! Both solvers agree on every kind of block and model: presets, datums, fixed subsets, losses, effects, cameras.

use crate::adjust::noisy::{PRESETS, closerange, dike, noisy, noisy_half_dike, two_cameras};
use crate::common::{SOLVERS, effect, errors_of_both, solve_both, solve_both_with, try_both};
use misclosure::adjust::agreement::{JACOBIAN_REL, RESIDUAL_PX, jacobian_difference, residual_difference};
use misclosure::adjust::native::Native;
use misclosure::adjust::{AdjustError, Options, Solver};
use misclosure::camera::{GROUPS, parameter_indices};
use misclosure::model::{Datum, Loss, Model, PRIOR_KEY, Prior, TieWeights};
use misclosure::problem::{Problem, ProblemError};
use std::ops::ControlFlow;

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

/// Steps that the native solver needs with a robust loss: it has the second derivative, where weights alone creep.
const NATIVE_STEPS: usize = 60;

#[test]
fn at_the_solution_no_further_step_is_tried() {
    for loss in [Loss::None, Loss::Huber] {
        let mut problem = Problem::new(&dike(), &Model { loss, ..Model::default() }).expect("a problem");
        let solve = |problem: &Problem| Native.solve(problem, &Options::default(), &mut |_| ControlFlow::Continue(()));
        let first = solve(&problem).expect("a solution");
        assert!(first.iterations > 1);
        problem.start = first.state;
        assert_eq!(solve(&problem).expect("the solution again").iterations, 0, "{loss:?}");
    }
}

#[test]
fn with_every_robust_loss_and_outliers() {
    let mut block = dike();
    // Gross errors in points of four rays or more: of two or three it is not known which one errs, and Cauchy's cost
    // has a minimum for each.
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
            // Ceres has the weights of a loss without its second derivative where that is negative: Cauchy takes it
            // some hundred iterations.
            let options = Options { max_iterations: 1000, ..Options::default() };
            let run = solve_both_with(&block, &Model { loss, datum, ..Model::default() }, &options);
            let (name, native) = &run.solutions[1];
            assert!(*name == "native" && native.iterations <= NATIVE_STEPS, "{loss:?}: {} steps", native.iterations);
            sigma0.push(run.sigma0());
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

/// Every effect of the catalogue on a block that has what it needs, one at a time, from its nominal values.
/// Many-parameter effects that this block cannot determine are refused by every solver, and named.
#[test]
fn with_every_effect_of_the_catalogue() {
    use misclosure::effects::{Kind, Role, catalogue};
    let mut block = noisy_half_dike();
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

/// Effects of every stage at once, each away from its nominal values and with a row that turns the camera: both solvers
/// hand the same pose and interior orientation from stage to stage.
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
        ("earth-curvature", Vec::new()),
    ];
    let stages: std::collections::BTreeSet<_> =
        values.iter().map(|(id, _)| misclosure::effects::find(id).expect("an effect").descriptor().stage).collect();
    // Control has no effect of the catalogue.
    let of_catalogue: std::collections::BTreeSet<_> =
        misclosure::effects::catalogue().iter().map(|effect| effect.descriptor().stage).collect();
    assert_eq!(stages, of_catalogue);
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

#[test]
fn with_two_cameras_in_one_block() {
    let block = two_cameras();
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
