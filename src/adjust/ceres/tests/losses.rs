//! Robust losses.

use super::*;
use approx::assert_relative_eq;
use std::sync::Arc;

#[test]
fn losses_follow_their_formulas() {
    for loss in [Loss::None, Loss::Huber, Loss::Cauchy] {
        let (_, mut problem) = problem();
        add_noise(&mut problem, 0.2, 10);
        for k in [3, 77, 311] {
            Arc::make_mut(&mut problem.observations)[k].x += 5.0;
        }
        problem.loss = loss;
        disturb(&mut problem, 11);
        let solution = solve(&problem).unwrap();
        let residuals = Ceres.evaluate(&problem, &solution.state).unwrap().residuals;
        let a2 = LOSS_SCALE * LOSS_SCALE;
        let rho = |s: f64| match loss {
            Loss::None => s,
            Loss::Huber if s <= a2 => s,
            Loss::Huber => 2.0 * LOSS_SCALE * s.sqrt() - a2,
            Loss::Cauchy => a2 * (1.0 + s / a2).ln(),
        };
        let expected: f64 = residuals.chunks_exact(2).map(|r| 0.5 * rho(r[0] * r[0] + r[1] * r[1])).sum();
        assert_relative_eq!(solution.cost, expected, max_relative = 1e-10);
        // A minimum: any other state costs more.
        let mut elsewhere = problem.clone();
        elsewhere.start = moved(&problem, &solution.state, problem.layout().point(3, 2), 0.01);
        let mut first = None;
        let stop = &mut |iteration: &Iteration| {
            first = Some(iteration.cost);
            ControlFlow::Break(())
        };
        assert!(matches!(Ceres.solve(&elsewhere, &options(), stop), Err(AdjustError::Cancelled { .. })));
        assert!(first.unwrap() > solution.cost);
    }
}
