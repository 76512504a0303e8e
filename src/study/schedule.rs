//! Runs many cases on a bounded number of threads and keeps what is finished.

use super::case::Case;
use super::execute::{Simulations, execute};
use super::outcome::Outcome;
use super::store::Store;
use crate::adjust::Solver;
use anyhow::{Context, Result, bail};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What happens to a case.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// It was finished by an earlier run.
    Kept(&'a Case),
    /// It begins.
    Started(&'a Case),
    /// It is done, after so many seconds.
    Finished(&'a Case, &'a Outcome, f64),
}

/// Each solver of a case works on one thread: the cases are what runs in parallel.
const THREADS_PER_CASE: usize = 1;

/// Runs the cases that the store does not have yet on `threads` threads; outcomes in the order of the cases, whatever
/// the threads.
///
/// # Errors
/// The first case that fails (a singular block is no failure); the cases finished until then are kept.
pub fn run(
    cases: &[Case],
    store: &Store,
    solvers: &[&dyn Solver],
    threads: usize,
    watch: &(dyn Fn(Event<'_>) + Sync),
) -> Result<Vec<Outcome>> {
    let mut outcomes: Vec<Option<Outcome>> = Vec::with_capacity(cases.len());
    for case in cases {
        outcomes.push(store.load(case).inspect(|_| watch(Event::Kept(case))));
    }
    let open: Vec<usize> = (0..cases.len()).filter(|index| outcomes[*index].is_none()).collect();
    let simulations = Simulations::default();
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let done: Mutex<Vec<(usize, Result<Outcome>)>> = Mutex::new(Vec::new());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build()?;
    // Every thread takes the next case when it is free. A parallel iterator would let a thread that waits inside one
    // case begin another, and so hold more blocks in memory than there are threads.
    pool.broadcast(|_| {
        while let Some(index) = open.get(next.fetch_add(1, Ordering::Relaxed)).copied() {
            if failed.load(Ordering::Relaxed) {
                break;
            }
            let result = finish(&cases[index], store, &simulations, solvers, watch);
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((index, result));
        }
    });
    for (index, result) in done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        outcomes[index] = Some(result.with_context(|| format!("case `{}`", cases[index].key))?);
    }
    let Some(outcomes) = outcomes.into_iter().collect() else { bail!("a case has no outcome") };
    Ok(outcomes)
}

fn finish(
    case: &Case,
    store: &Store,
    simulations: &Simulations,
    solvers: &[&dyn Solver],
    watch: &(dyn Fn(Event<'_>) + Sync),
) -> Result<Outcome> {
    watch(Event::Started(case));
    let started = std::time::Instant::now();
    let outcome = execute(case, simulations, solvers, THREADS_PER_CASE)?;
    store.save(case, &outcome)?;
    watch(Event::Finished(case, &outcome, started.elapsed().as_secs_f64()));
    Ok(outcome)
}
