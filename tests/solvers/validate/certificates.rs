//! Certificates are what extended precision finds anew, and both solvers meet them.

use misclosure::adjust::{BUILT, agreement};
use misclosure::math::DoubleDouble;
use misclosure::problem::Problem;
use misclosure::validate::certificate::Certificate;
use misclosure::validate::forward::ExtendedState;
use misclosure::validate::lineariser::{Curvature, Lineariser};
use misclosure::validate::problems::{Size, find, problems};
use misclosure::validate::solve::{DIGITS, certify_anew, solve};

/// A part of the suite: every datum, loss and stage once. `misclosure validate` runs all of it.
const PART: [&str; 12] = [
    "pair",
    "radial-f-pp-k1-k2",
    "targets-twelve",
    "area-gnss",
    "two-cameras",
    "camera-priors",
    "rolling-shutter-turning",
    "flat-port",
    "focal-image",
    "lever-arm-delay",
    "huber",
    "shift-of-everything",
];

#[test]
fn both_solvers_meet_the_certificates() -> anyhow::Result<()> {
    for name in PART {
        for outcome in solve(find(name)?, BUILT, 2)? {
            assert!(outcome.passes(DIGITS), "{name}: {outcome:?}");
        }
    }
    Ok(())
}

/// Relative difference of two numbers.
fn apart(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { ((a - b) / a.abs().max(b.abs())).abs() }
}

/// Largest relative difference of what two certificates say, values against their sigma.
fn difference(a: &Certificate, b: &Certificate) -> f64 {
    let mut worst = apart(a.cost[0], b.cost[0]);
    let mut one = |(x, sx): (f64, f64), (y, sy): (f64, f64)| {
        worst = worst.max(apart(sx, sy));
        if sx > 0.0 {
            worst = worst.max(((x - y) / sx).abs());
        }
    };
    for ((_, x), (_, y)) in a.cameras.iter().zip(&b.cameras) {
        x.iter().zip(y).for_each(|(x, y)| one(*x, *y));
    }
    for (x, y) in a.effects.iter().zip(&b.effects) {
        one((x.1, x.2), (y.1, y.2));
    }
    for (x, y) in a.poses.iter().zip(&b.poses) {
        (0..3).for_each(|k| one((x.2[k], x.3[3 + k]), (y.2[k], y.3[3 + k])));
    }
    for (x, y) in a.points.iter().zip(&b.points) {
        (0..3).for_each(|k| one((x.1[k], x.2[k]), (y.1[k], y.2[k])));
    }
    worst
}

#[test]
fn certificates_are_found_again() -> anyhow::Result<()> {
    for name in ["pair", "radial-f-k1", "flat-port", "cauchy-radial", "no-distortion"] {
        let (stored, anew) = (find(name)?.certificate()?, certify_anew(find(name)?, 2)?);
        assert_eq!((&stored.fingerprint, stored.sizes), (&anew.fingerprint, anew.sizes), "{name}");
        assert_eq!((stored.null_dimension, &stored.null_space), (anew.null_dimension, &anew.null_space), "{name}");
        // The start of the refinement may differ from machine to machine; twelve digits do not.
        let worst = difference(&stored, &anew);
        assert!(worst < 1e-12, "{name}: {worst}");
    }
    Ok(())
}

#[test]
fn every_certificate_is_of_a_refined_solution() -> anyhow::Result<()> {
    for bundle in problems()? {
        let certificate = bundle.certificate()?;
        assert_eq!(certificate.null_dimension, bundle.null_dimension, "{}", bundle.name);
        assert!(certificate.last_step_sigma < 1e-13, "{}", bundle.name);
        let solved = certificate.cost[0] > 0.0 && !certificate.points.is_empty();
        assert_eq!(solved, !bundle.is_deficient(), "{}", bundle.name);
    }
    assert!(problems()?.iter().any(|bundle| bundle.size == Size::Large));
    Ok(())
}

/// The third derivation against the two others, at the start values of problems with effects of every stage.
#[test]
fn the_forward_model_of_certificates_is_that_of_the_solvers() -> anyhow::Result<()> {
    for name in [
        "targets-twelve",
        "rolling-shutter-turning",
        "forward-motion",
        "refraction",
        "flat-port",
        "focal-time",
        "focal-flight",
        "focal-image",
        "pp-time",
        "gravity-sag",
        "radial-high",
        "decentring-high",
        "lever-arm-delay",
        "gnss-drift",
        "map-scale-curvature",
        "camera-priors",
    ] {
        let bundle = find(name)?;
        let mut problem = Problem::new(&bundle.block()?, &bundle.model()?)?;
        // Effects of their typical size: at their nominal values they say nothing.
        for (entry, value) in problem.theta.iter().zip(&mut problem.start.theta) {
            if entry.free && *value == 0.0 {
                *value = 0.5 * entry.scale;
            }
        }
        let normal = Lineariser::new(&problem)?.linearise(&ExtendedState::from(&problem.start), Curvature::Weights)?;
        for solver in BUILT {
            let rows = solver.evaluate(&problem, &problem.start)?;
            let mut descent = vec![0.0; problem.layout().total()];
            let mut size = vec![0.0; problem.layout().total()];
            for row in 0..rows.residuals.len() {
                for k in rows.row_start[row]..rows.row_start[row + 1] {
                    descent[rows.columns[k]] -= rows.values[k] * rows.residuals[row];
                    size[rows.columns[k]] += (rows.values[k] * rows.residuals[row]).abs();
                }
            }
            for (unknown, ours) in normal.unknowns.iter().zip(&normal.descent) {
                let difference = (ours.hi - descent[*unknown]).abs() / size[*unknown];
                assert!(
                    difference < agreement::JACOBIAN_REL,
                    "{name}, {}: {}: {difference}",
                    solver.name(),
                    problem.unknown_name(*unknown)
                );
            }
            let cost =
                rows.residuals.iter().fold(DoubleDouble::ZERO, |sum, v| sum + DoubleDouble::from(*v) * *v).hi * 0.5;
            assert!(apart(cost, normal.cost.hi) < 1e-11, "{name}: {cost} {}", normal.cost.hi);
        }
    }
    Ok(())
}
