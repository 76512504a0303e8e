use super::*;
use nalgebra::{DMatrix, DVector};
use std::cell::Cell;
use std::ops::ControlFlow;

/// Residuals and their Jacobian (residuals x unknowns).
type Linearised = (DVector<f64>, DMatrix<f64>);

/// A problem of two unknowns.
struct Small {
    residuals: fn(&DVector<f64>) -> Linearised,
    /// The unknowns in which it is far from linear.
    nonlinear: &'static [usize],
    /// Whether a step brings the system after it along.
    brings: bool,
    /// How often residuals were computed.
    passes: Cell<usize>,
}

impl Small {
    fn new(residuals: fn(&DVector<f64>) -> Linearised, nonlinear: &'static [usize]) -> Self {
        Self { residuals, nonlinear, brings: false, passes: Cell::new(0) }
    }

    fn at(&self, x: &DVector<f64>) -> Linearised {
        self.passes.update(|passes| passes + 1);
        (self.residuals)(x)
    }
}

/// A linearisation: normal matrix, gradient, chi-square.
struct Normal(DMatrix<f64>, DVector<f64>, f64);

impl Iterated for Small {
    type State = DVector<f64>;
    type System = Normal;
    type Increments = DVector<f64>;

    fn name(&self) -> &'static str {
        "small"
    }

    fn is_robust(&self) -> bool {
        false
    }

    fn linearise(&self, x: &DVector<f64>, _: f64, _: Curvature) -> Result<Normal, AdjustError> {
        let (r, jacobian) = self.at(x);
        Ok(Normal(jacobian.tr_mul(&jacobian), -jacobian.tr_mul(&r), r.norm_squared()))
    }

    fn chi_square(&self, system: &Normal) -> f64 {
        system.2
    }

    fn gradient_max(&self, system: &Normal) -> f64 {
        system.1.amax()
    }

    fn solve(&self, Normal(normal, gradient, _): &Normal, damping: f64) -> Option<DVector<f64>> {
        let damped = normal + damping * DMatrix::from_diagonal(&normal.diagonal());
        Some(damped.cholesky()?.solve(gradient))
    }

    fn decrement(&self, system: &Normal, step: &DVector<f64>) -> f64 {
        step.dot(&system.1)
    }

    fn attempt(
        &self,
        x: &DVector<f64>,
        Normal(normal, gradient, _): &Normal,
        step: &DVector<f64>,
        damping: f64,
        _: Curvature,
    ) -> Option<Attempt<DVector<f64>>> {
        let state = x + step;
        let chi_square = self.at(&state).0.norm_squared();
        let damped = damping * step.component_mul(step).dot(&normal.diagonal());
        Some(Attempt { state, chi_square, predicted_drop: step.dot(gradient) + damped })
    }

    fn advance(
        &self,
        x: &DVector<f64>,
        system: &Normal,
        step: &DVector<f64>,
        damping: f64,
        curvature: Curvature,
        next: f64,
    ) -> Option<Advanced<Self>> {
        if !self.brings {
            return Some((self.attempt(x, system, step, damping, curvature)?, None));
        }
        let state = x + step;
        let after = self.linearise(&state, next, curvature).ok()?;
        let damped = damping * step.component_mul(step).dot(&system.0.diagonal());
        Some((Attempt { state, chi_square: after.2, predicted_drop: step.dot(&system.1) + damped }, Some(after)))
    }

    fn part(&self, step: &DVector<f64>, share: f64) -> DVector<f64> {
        share * step
    }

    fn followed(&self, x: &DVector<f64>, damping: f64) -> Option<Attempt<DVector<f64>>> {
        if self.nonlinear.is_empty() {
            return None;
        }
        let mut system = self.linearise(x, damping, Curvature::Weights).ok()?;
        for k in self.nonlinear {
            system.0.row_mut(*k).fill(0.0);
            system.0.column_mut(*k).fill(0.0);
            (system.0[(*k, *k)], system.1[*k]) = (1.0, 0.0);
        }
        self.attempt(x, &system, &self.solve(&system, damping)?, damping, Curvature::Weights)
    }

    fn stuck(&self, _: &DVector<f64>, iterations: usize, _: f64) -> AdjustError {
        AdjustError::NotConverged { solver: self.name(), iterations, reason: "stuck".into() }
    }
}

/// Where the iterations end, and how many they are.
fn minimum(problem: &Small, start: [f64; 2]) -> (DVector<f64>, usize) {
    let options = Options { chi_square_change: 1e-10, ..Options::default() };
    let start = DVector::from_column_slice(&start);
    let found = minimise(problem, start, &options, &mut |_| ControlFlow::Continue(())).expect("convergence");
    (found.state, found.iterations)
}

/// Rosenbrock (1960): a narrow valley along `v = u^2`, in which a step along a straight line goes hardly anywhere.
fn valley(x: &DVector<f64>) -> Linearised {
    let (u, v) = (x[0], x[1]);
    let jacobian = DMatrix::from_row_slice(2, 2, &[-200.0 * u, 100.0, -1.0, 0.0]);
    (DVector::from_column_slice(&[100.0 * (v - u * u), 1.0 - u]), jacobian)
}

#[test]
fn what_is_linear_follows_what_bends() {
    let [straight, following] = [&[][..], &[0]].map(|nonlinear| minimum(&Small::new(valley, nonlinear), [-1.2, 1.0]));
    for (x, _) in [&straight, &following] {
        assert!((x - DVector::from_column_slice(&[1.0, 1.0])).amax() < 1e-6, "{x}");
    }
    // One step to `u = 1`, `v` follows, and what the damping of 1e-7 left of both.
    assert!(following.1 <= 3, "{} steps", following.1);
    assert!(straight.1 > 3 * following.1, "{} steps without", straight.1);
}

/// A residual of 7 that hardly changes adds 0.7 to the curvature of `u`: full steps go 1.7 times too far, back and
/// forth.
fn overshooting(x: &DVector<f64>) -> Linearised {
    let (u, v) = (x[0], x[1]);
    let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.1 * u, 0.0]);
    (DVector::from_column_slice(&[u, v - 3.0, 7.0 + 0.05 * u * u]), jacobian)
}

#[test]
fn a_step_beyond_the_minimum_is_taken_back_to_it() {
    let (x, iterations) = minimum(&Small::new(overshooting, &[]), [0.5, 0.0]);
    assert!(x[0].abs() < 1e-5 && (x[1] - 3.0).abs() < 1e-6, "{x}");
    // Each full step would leave 0.7 of `u`, and half of what it promised: 15 of them to a chi-square of 1e-10.
    assert!(iterations <= 6, "{iterations} steps");
}

/// The same along a valley, which `v` follows.
fn overshooting_valley(x: &DVector<f64>) -> Linearised {
    let (u, v) = (x[0], x[1]);
    let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, -200.0 * u, 100.0, 0.1 * u, 0.0]);
    (DVector::from_column_slice(&[u, 100.0 * (v - u * u), 7.0 + 0.05 * u * u]), jacobian)
}

#[test]
fn a_step_beyond_the_minimum_is_taken_back_along_the_valley_that_was_followed() {
    let (x, iterations) = minimum(&Small::new(overshooting_valley, &[0]), [0.5, 0.25]);
    assert!(x.amax() < 1e-5, "{x}");
    assert!(iterations <= 6, "{iterations} steps");
}

#[test]
fn what_does_not_converge_is_given_only_where_that_is_asked_for() {
    let problem = Small::new(valley, &[]);
    let start = DVector::from_column_slice(&[-1.2, 1.0]);
    let begun = valley(&start).0.norm_squared();
    let few = Options { max_iterations: 4, ..Options::default() };
    let solve = |options| minimise(&problem, start.clone(), &options, &mut |_| ControlFlow::Continue(()));
    let Err(AdjustError::NotConverged { iterations: 4, .. }) = solve(few.clone()) else { panic!("converged") };
    let found = solve(Options { may_stay_unconverged: true, ..few }).expect("a state");
    assert!(found.iterations == 4 && found.system.2 < begun, "{} steps, {}", found.iterations, found.system.2);
}

#[test]
fn a_step_to_nowhere_makes_the_next_one_cautious_at_once() {
    let mut search =
        StepControl { damping: START_DAMPING, tighten: TIGHTEN, careful: 0, curvature: Curvature::Weights };
    search.lost();
    assert_eq!((search.damping, search.careful), (CAUTIOUS_DAMPING, CAREFUL_STEPS));
    search.lost();
    assert!(search.damping > CAUTIOUS_DAMPING, "and more so where that did not help: {:e}", search.damping);
}

#[test]
fn a_step_is_looked_at_again_where_it_brought_much_less_than_predicted() {
    let brings = |chi_square| is_poor(&Attempt { state: (), chi_square, predicted_drop: 8.0 }, 10.0);
    assert_eq!([9.0, 4.5, 3.5, 2.0].map(brings), [true, true, false, false]);
}

#[test]
fn a_system_that_a_step_brings_along_saves_a_pass_and_changes_nothing() {
    for (residuals, start) in [(valley as fn(&_) -> _, [0.9, 0.8]), (overshooting, [0.5, 0.0])] {
        let [alone, bringing] = [false, true].map(|brings| Small { brings, ..Small::new(residuals, &[]) });
        let found = [&alone, &bringing].map(|problem| minimum(problem, start));
        assert_eq!(found[0], found[1]);
        assert!(bringing.passes < alone.passes, "{:?} passes for {:?}", bringing.passes, alone.passes);
    }
}

/// A plane, and what no step changes.
fn flat(x: &DVector<f64>) -> Linearised {
    let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    (DVector::from_column_slice(&[x[0], x[1] - 3.0, 2.0]), jacobian)
}

#[test]
fn after_a_short_step_the_last_one_is_asked_for_at_once() {
    let problem = Small { brings: true, ..Small::new(flat, &[]) };
    let (x, iterations) = minimum(&problem, [1e-3, 3.0]);
    // What the damping of 1e-7 left.
    assert!(x[0].abs() < 2e-10 && iterations == 1, "{x} after {iterations} steps");
    // At the start, after the step, and after the one that finds nothing more.
    assert_eq!(problem.passes.get(), 3);
}
