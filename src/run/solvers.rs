//! The solvers of a run on one problem: each from the same start values, then held against each other.
//!
//! Two solvers that stop a little apart in a flat valley, or one that creeps where the other does not, are no
//! contradiction: each is started once more from where the other ended. What they find then counts, and the agreement
//! says that it was found that way.

use super::{Progress, distortion_centre, loose_poses};
use crate::adjust::agreement::{self, Agreement};
use crate::adjust::native::Native;
use crate::adjust::{AdjustError, Options, Solution, Solver};
use crate::problem::{Problem, State};

/// What the solvers found.
pub struct Solved {
    /// Name of each solver that found something, in the order asked for.
    pub solutions: Vec<(&'static str, Solution)>,
    /// Those that failed, where another did not.
    pub failures: Vec<(&'static str, AdjustError)>,
    /// Of two that found something.
    pub agreement: Option<Agreement>,
}

/// Solves with each solver in turn.
///
/// # Errors
/// The first failure where none found a solution; at once what no other solver can mend (bad start values, a wish to
/// cancel).
pub fn solve(
    problem: &Problem,
    solvers: &[&dyn Solver],
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Solved, AdjustError> {
    let mut found = Vec::with_capacity(solvers.len());
    for solver in solvers {
        let outcome = attempt(problem, *solver, options, progress);
        if let Err(
            error @ (AdjustError::Cancelled { .. }
            | AdjustError::BadStart { .. }
            | AdjustError::Unsupported { .. }
            | AdjustError::NoThreads { .. }),
        ) = outcome
        {
            return Err(error);
        }
        found.push(outcome);
    }
    let mut pair = Pair { problem, solvers, options, progress };
    let mut agreement = None;
    if let [a, b] = found.as_mut_slice() {
        let polished = pair.follow(0, a, b)? || pair.follow(1, b, a)?;
        if let (Ok(a), Ok(b)) = (a, b) {
            let mut found = pair.compare(a, b)?;
            found.polished = polished;
            agreement = Some(if found.agree || !found.same_problem() { found } else { pair.polish(a, b, found)? });
        }
    }
    if found.iter().all(Result::is_err)
        && let Some(Err(failure)) = found.drain(..).next()
    {
        return Err(distortion_centre::explain(failure, problem, solvers[0], options, progress));
    }
    if let [Ok(solution)] = found.as_slice() {
        agreement::check_own_derivatives(problem, &Native, &solution.state)?;
    }
    let mut solved = Solved { solutions: Vec::new(), failures: Vec::new(), agreement };
    for (solver, outcome) in solvers.iter().zip(found) {
        match outcome {
            Ok(solution) => solved.solutions.push((solver.name(), solution)),
            Err(failure) => solved.failures.push((solver.name(), failure)),
        }
    }
    Ok(solved)
}

/// One solver, and what its solution must fulfil.
fn attempt(
    problem: &Problem,
    solver: &dyn Solver,
    options: &Options,
    progress: &mut Progress<'_>,
) -> Result<Solution, AdjustError> {
    let name = solver.name();
    let solution = solver.solve(problem, options, &mut |iteration| progress(name, iteration))?;
    loose_poses::check(problem, name, &solution)?;
    distortion_centre::check(problem, name, &solution)?;
    Ok(solution)
}

struct Pair<'a, 'p> {
    problem: &'a Problem,
    solvers: &'a [&'a dyn Solver],
    options: &'a Options,
    progress: &'a mut Progress<'p>,
}

impl Pair<'_, '_> {
    /// Solver number `which` from another start.
    fn from(&mut self, which: usize, start: &State) -> Result<Solution, AdjustError> {
        let problem = Problem { start: start.clone(), ..self.problem.clone() };
        attempt(&problem, self.solvers[which], self.options, self.progress)
    }

    /// Where solver number `which` did not converge and the other did, it starts once more from there. Did that help?
    fn follow(
        &mut self,
        which: usize,
        own: &mut Result<Solution, AdjustError>,
        other: &Result<Solution, AdjustError>,
    ) -> Result<bool, AdjustError> {
        let (Err(AdjustError::NotConverged { iterations, .. }), Ok(other)) = (&*own, other) else { return Ok(false) };
        let before = *iterations;
        match self.from(which, &other.state) {
            Err(cancelled @ AdjustError::Cancelled { .. }) => Err(cancelled),
            // What it said first stands.
            Err(_) => Ok(false),
            Ok(solution) => {
                *own = Ok(Solution { iterations: before + solution.iterations, ..solution });
                Ok(true)
            }
        }
    }

    fn compare(&self, a: &Solution, b: &Solution) -> Result<Agreement, AdjustError> {
        agreement::compare(self.problem, (self.solvers[0], a), (self.solvers[1], b))
    }

    /// Starts each solver from the other's solution. Where they agree then, that replaces what they found; else it
    /// stays with `found`.
    fn polish(&mut self, a: &mut Solution, b: &mut Solution, found: Agreement) -> Result<Agreement, AdjustError> {
        let (next_a, next_b) = (self.from(0, &b.state), self.from(1, &a.state));
        if let Some(cancelled) = [&next_a, &next_b].into_iter().find_map(cancelled) {
            return Err(cancelled);
        }
        let (Ok(next_a), Ok(next_b)) = (next_a, next_b) else { return Ok(found) };
        let next = self.compare(&next_a, &next_b)?;
        if !next.agree {
            return Ok(found);
        }
        for (solution, next) in [(a, next_a), (b, next_b)] {
            let (iterations, seconds) = (solution.iterations + next.iterations, solution.seconds + next.seconds);
            *solution = Solution { iterations, seconds, ..next };
        }
        Ok(Agreement { polished: true, ..next })
    }
}

fn cancelled(outcome: &Result<Solution, AdjustError>) -> Option<AdjustError> {
    outcome.as_ref().err().filter(|error| matches!(error, AdjustError::Cancelled { .. })).cloned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adjust::{Covariance, Evaluation, ReducedSystem};
    use crate::model::Model;
    use crate::scenario::{Scenario, add_noise, simulate};
    use std::collections::BTreeMap;
    use std::ops::ControlFlow;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// The native solver with a fault of its own in its first solves.
    struct Faulty {
        fault: Fault,
        /// Solves that have it.
        solves: usize,
        solved: AtomicUsize,
    }

    #[derive(Clone, Copy)]
    enum Fault {
        /// Stops a tenth of the focal length's sigma away.
        Early,
        /// Does not converge.
        Lost,
        /// Stops a hundred-thousandth of the focal length's sigma away, where the standard deviations are others by a
        /// thousandth.
        Jumps,
        /// The same, and says so of every other place.
        Wrong,
    }

    impl Faulty {
        fn new(fault: Fault, solves: usize) -> Self {
            Self { fault, solves, solved: AtomicUsize::new(0) }
        }
    }

    impl Solver for Faulty {
        fn name(&self) -> &'static str {
            "faulty"
        }

        fn solve(
            &self,
            problem: &Problem,
            options: &Options,
            progress: &mut crate::adjust::Progress<'_>,
        ) -> Result<Solution, AdjustError> {
            let mut solution = Native.solve(problem, options, progress)?;
            if self.solved.fetch_add(1, Ordering::Relaxed) < self.solves {
                match self.fault {
                    Fault::Early => {
                        let covariance = solution.covariance.as_ref().expect("a covariance");
                        solution.state.interiors[0][0] += 0.1 * covariance.shared[(0, 0)].sqrt();
                    }
                    Fault::Lost => {
                        let reason = "lost".into();
                        return Err(AdjustError::NotConverged { solver: "faulty", iterations: 200, reason });
                    }
                    Fault::Jumps | Fault::Wrong => {
                        let covariance = solution.covariance.as_mut().expect("a covariance");
                        solution.state.interiors[0][0] += 1e-5 * covariance.shared[(0, 0)].sqrt();
                        covariance.shared *= OTHER;
                    }
                }
            }
            Ok(solution)
        }

        fn evaluate(&self, problem: &Problem, state: &State) -> Result<Evaluation, AdjustError> {
            Native.evaluate(problem, state)
        }

        fn reduced_system(&self, problem: &Problem, state: &State) -> Result<ReducedSystem, AdjustError> {
            Native.reduced_system(problem, state)
        }

        fn covariance_at(&self, problem: &Problem, state: &State) -> Result<Covariance, AdjustError> {
            let mut covariance = Native.covariance_at(problem, state)?;
            if matches!(self.fault, Fault::Wrong) {
                covariance.shared *= OTHER;
            }
            Ok(covariance)
        }
    }

    /// Factor on variances that makes standard deviations differ by a thousandth.
    const OTHER: f64 = 1.002;

    fn problem() -> Problem {
        let few = BTreeMap::from([("points".to_string(), 600.0), ("check".to_string(), 10.0)]);
        let mut block = simulate(&Scenario::preset("dike", &few).unwrap(), 5).unwrap().block;
        add_noise(&mut block, 0.3, 6).unwrap();
        Problem::new(&block, &Model { tie_dc_to_pp: true, ..Model::default() }).unwrap()
    }

    fn with(a: &dyn Solver, b: &dyn Solver) -> Result<Solved, AdjustError> {
        solve(&problem(), &[a, b], &Options::default(), &mut |_, _| ControlFlow::Continue(()))
    }

    #[test]
    fn solvers_that_stop_apart_start_once_more_from_each_other() {
        let solved = with(&Native, &Faulty::new(Fault::Early, 1)).unwrap();
        let agreement = solved.agreement.unwrap();
        assert!(agreement.agree && agreement.polished, "{agreement:?}");
        assert_eq!((solved.solutions.len(), solved.failures.len()), (2, 0));
        let agreement = with(&Native, &Native).unwrap().agreement.unwrap();
        assert!(agreement.agree && !agreement.polished, "{agreement:?}");
    }

    #[test]
    fn standard_deviations_that_differ_are_compared_at_one_place() {
        let agreement = with(&Native, &Faulty::new(Fault::Jumps, usize::MAX)).unwrap().agreement.unwrap();
        assert!(agreement.agree && agreement.covariance_max_rel < 1e-9, "{agreement:?}");
        let agreement = with(&Native, &Faulty::new(Fault::Wrong, usize::MAX)).unwrap().agreement.unwrap();
        assert!(!agreement.agree && (agreement.covariance_max_rel / 1e-3 - 1.0).abs() < 0.01, "{agreement:?}");
    }

    #[test]
    fn solvers_that_stay_apart_disagree_and_both_results_stay() {
        let solved = with(&Native, &Faulty::new(Fault::Early, usize::MAX)).unwrap();
        let agreement = solved.agreement.unwrap();
        assert!(!agreement.agree && !agreement.polished && agreement.same_problem(), "{agreement:?}");
        assert!((agreement.parameter_max_sigma / 0.1 - 1.0).abs() < 0.01, "{agreement:?}");
        assert_eq!(solved.solutions.len(), 2);
    }

    #[test]
    fn a_solver_that_is_lost_follows_the_other() {
        let lost = || Faulty::new(Fault::Lost, 1);
        for solved in [with(&Native, &lost()).unwrap(), with(&lost(), &Native).unwrap()] {
            let agreement = solved.agreement.unwrap();
            assert!(agreement.agree && agreement.polished && solved.failures.is_empty(), "{agreement:?}");
            let of_lost = &solved.solutions.iter().find(|(name, _)| *name == "faulty").unwrap().1;
            assert!(of_lost.iterations >= 200, "the steps before count: {}", of_lost.iterations);
        }
    }

    #[test]
    fn one_solver_that_fails_does_not_take_the_other_s_result_along() {
        let lost = || Faulty::new(Fault::Lost, usize::MAX);
        let solved = with(&lost(), &Native).unwrap();
        assert_eq!((solved.solutions[0].0, solved.failures[0].0), ("native", "faulty"));
        assert!(solved.agreement.is_none());
        assert!(matches!(with(&lost(), &lost()), Err(AdjustError::NotConverged { .. })));
    }
}
