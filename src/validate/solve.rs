//! Our solvers on the problems of the suite.

use super::certificate::{Certificate, certify, certify_null_space};
use super::problems::BundleProblem;
use super::score::{Score, score};
use crate::adjust::{AdjustError, CovarianceOf, Options, Solver, native::Native};
use crate::problem::Problem;
use anyhow::{Context, Result};
use std::ops::ControlFlow;
use std::time::Instant;

/// Digits of sigma that a result has to have.
pub const DIGITS: f64 = 6.0;
/// Relative difference of standard deviations that a result of six digits or more may have; with fewer, that of the
/// digits.
pub const SIGMA_REL: f64 = 1e-6;
/// Chi-square that a further step of a solver may change: a millionth of a sigma leaves 1e-12.
const CHI_SQUARE_CHANGE: f64 = 1e-15;
/// Images of a problem of which every pose and point gets its standard deviations.
const EVERY_SIGMA: usize = 150;

/// What one solver made of one problem.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The problem.
    pub problem: String,
    /// Who solved it.
    pub solver: String,
    /// Steps.
    pub iterations: Option<usize>,
    /// Wall-clock time of the solve, s.
    pub seconds: Option<f64>,
    /// Its score, or what became of it instead.
    pub verdict: Verdict,
}

/// What became of a problem.
#[derive(Debug, Clone)]
pub enum Verdict {
    /// It has a solution.
    Solved(Score),
    /// It has none, and the solver named the null space that was expected: so many directions.
    NullSpace(usize),
    /// It failed, or gave a solution to what has none.
    Failed(String),
}

impl Outcome {
    /// Is it good to so many digits?
    pub fn passes(&self, digits: f64) -> bool {
        match &self.verdict {
            Verdict::Solved(score) => {
                let allowed = SIGMA_REL.max(10_f64.powf(-digits));
                score.digits >= digits && score.sigma.is_none_or(|sigma| sigma < allowed)
            }
            Verdict::NullSpace(_) => true,
            Verdict::Failed(_) => false,
        }
    }
}

fn options(problem: &Problem, threads: usize) -> Options {
    let every = problem.layout().images <= EVERY_SIGMA;
    let covariance = if every { CovarianceOf::Everything } else { CovarianceOf::Shared };
    Options { chi_square_change: CHI_SQUARE_CHANGE, covariance, threads, ..Options::default() }
}

/// Solves a problem with each solver and scores what they find.
///
/// # Errors
/// A problem that cannot be made; a certificate of other measurements; too little memory.
pub fn solve(bundle: &BundleProblem, solvers: &[&dyn Solver], threads: usize) -> Result<Vec<Outcome>> {
    let of_problem = || format!("problem `{}`", bundle.name);
    let certificate = bundle.certificate()?;
    let problem = Problem::new(&bundle.block()?, &bundle.model()?).with_context(of_problem)?;
    let options = options(&problem, threads);
    let mut outcomes = Vec::new();
    for solver in solvers {
        let started = Instant::now();
        let found = solver.solve(&problem, &options, &mut |_| ControlFlow::Continue(()));
        let seconds = started.elapsed().as_secs_f64();
        let (verdict, iterations) = match found {
            Ok(_) if certificate.null_dimension > 0 => {
                (Verdict::Failed("gave a solution to what has none".into()), None)
            }
            Ok(solution) => {
                let score = score(&problem, &certificate, &solution.state, solution.covariance.as_ref());
                (Verdict::Solved(score.with_context(of_problem)?), Some(solution.iterations))
            }
            // Says nothing about the solver.
            Err(error @ (AdjustError::NoThreads { .. } | AdjustError::NoMemory { .. })) => {
                return Err(error).with_context(of_problem);
            }
            Err(error) => (null_space(&certificate, &error), None),
        };
        let (problem, solver) = (bundle.name.clone(), solver.name().to_owned());
        outcomes.push(Outcome { problem, solver, iterations, seconds: Some(seconds), verdict });
    }
    Ok(outcomes)
}

/// Is this error the null space that is certified? Each of its directions has to be led by a parameter of it.
fn null_space(certificate: &Certificate, error: &AdjustError) -> Verdict {
    let AdjustError::Singular { directions, .. } = error else { return Verdict::Failed(error.to_string()) };
    let expected = |name: &String| certificate.null_space.contains(name);
    let leading =
        |direction: &crate::adjust::NullDirection| direction.components.first().is_some_and(|c| expected(&c.0));
    if directions.len() == certificate.null_dimension && directions.iter().all(leading) {
        return Verdict::NullSpace(directions.len());
    }
    Verdict::Failed(format!(
        "expected {} directions among {}: {error}",
        certificate.null_dimension,
        certificate.null_space.join(", ")
    ))
}

/// Certifies a problem anew. The refinement begins where the native solver ends, and ends where extended precision
/// does.
///
/// # Errors
/// A problem that cannot be made or solved; a refinement that does not converge.
pub fn certify_anew(bundle: &BundleProblem, threads: usize) -> Result<Certificate> {
    let of_problem = || format!("problem `{}`", bundle.name);
    let problem = Problem::new(&bundle.block()?, &bundle.model()?).with_context(of_problem)?;
    if bundle.is_deficient() {
        let certificate = certify_null_space(&bundle.name, &problem, &bundle.null_space).with_context(of_problem)?;
        anyhow::ensure!(
            certificate.null_dimension == bundle.null_dimension,
            "problem `{}`: {} directions have no information, {} are stated",
            bundle.name,
            certificate.null_dimension,
            bundle.null_dimension
        );
        return Ok(certificate);
    }
    let options = Options { covariance: CovarianceOf::Nothing, ..options(&problem, threads) };
    let solution = Native.solve(&problem, &options, &mut |_| ControlFlow::Continue(())).with_context(of_problem)?;
    certify(&bundle.name, &problem, &solution.state).with_context(of_problem)
}
