//! The thread that carries out steps, one at a time, in the order in which they were asked for.

use super::change::Change;
use super::events::Event;
use super::job::Job;
use super::node::State;
use super::state::Lab;
use super::step::Step;
use crate::adjust::Stop;
use crate::diagnose::competition::Next;
use crate::diagnose::weights;
use anyhow::{Result, bail};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

/// Steps that "do all" makes at most: far more than any block asked for.
const MOST_STEPS: usize = 20;
/// What "do all" says where it has nothing to do.
const NOTHING_TO_DO: &str = "Nothing to do: no other set of hypotheses has a lower objective.";

/// Works until the queue ends.
pub fn work(lab: &Lab, jobs: &Receiver<Job>) {
    while let Ok(job) = jobs.recv() {
        match job.change {
            Change::Improve => improve(lab, &job),
            _ => {
                carry_out(lab, &job);
            }
        }
    }
}

/// Carries out one step; did it come to its end?
fn carry_out(lab: &Lab, job: &Job) -> bool {
    let Job { id, parent, change, stop } = job;
    if stop.is_raised() {
        lab.set(*id, State::Cancelled);
        return false;
    }
    lab.set(*id, State::Running(Instant::now()));
    let step = Step { lab, id: *id, parent: *parent, change, stop };
    let outcome = catch_unwind(AssertUnwindSafe(|| step.run())).unwrap_or_else(|_| {
        Err(anyhow::anyhow!("internal error, described where the program runs: please report it with this step"))
    });
    end(
        lab,
        *id,
        stop,
        outcome.map(|(saved, live)| {
            lab.keep(*id, Arc::new(live));
            State::Done(Box::new(saved))
        }),
    )
}

fn end(lab: &Lab, id: u32, stop: &Stop, outcome: Result<State>) -> bool {
    let failed = |state: State, error: String| {
        lab.release(id);
        lab.set(id, state);
        lab.tell(Event::Failed { node: id, error });
        false
    };
    match outcome {
        Ok(state) => {
            lab.set(id, state);
            lab.tell(Event::Done { node: id });
            true
        }
        Err(_) if stop.is_raised() => failed(State::Cancelled, "cancelled".into()),
        Err(error) => {
            let error = format!("{error:#}");
            failed(State::Failed(error.clone()), error)
        }
    }
}

/// Carries out what lowers the objective, a step of its own each, until nothing does.
fn improve(lab: &Lab, job: &Job) {
    let Some(mut parent) = job.parent else { return };
    let mut waiting = Some(job.id);
    for _ in 0..MOST_STEPS {
        let asked = catch_unwind(AssertUnwindSafe(|| asked(lab, parent, &job.stop)))
            .unwrap_or_else(|_| Err(anyhow::anyhow!("internal error, described where the program runs")));
        let change = match asked {
            Ok(Some(change)) if !job.stop.is_raised() => change,
            Ok(_) if waiting.is_none() => return,
            Ok(_) if job.stop.is_raised() => {
                end(lab, job.id, &job.stop, Err(anyhow::anyhow!("cancelled")));
                return;
            }
            Ok(_) => {
                // Nothing to do is no failure, and no step.
                lab.forget(job.id);
                lab.tell(Event::Nothing { node: job.id, text: NOTHING_TO_DO.into() });
                return;
            }
            Err(error) => {
                let id = waiting.unwrap_or_else(|| {
                    lab.insert(Some(parent), Change::Improve, State::Running(Instant::now()), job.stop.clone())
                });
                end(lab, id, &job.stop, Err(error));
                return;
            }
        };
        let id = match waiting.take() {
            Some(id) => {
                lab.rename(id, change.clone());
                id
            }
            None => lab.insert(Some(parent), change.clone(), State::Waiting, job.stop.clone()),
        };
        let optional = change == Change::SearchOutliers;
        if !carry_out(lab, &Job { id, parent: Some(parent), change, stop: job.stop.clone() }) {
            // A search that found nothing is no step.
            if optional && !job.stop.is_raised() && id != job.id {
                lab.forget(id);
            }
            return;
        }
        parent = id;
    }
}

/// What the objective asks for at a node: weights and outliers first once something was added, then what enters or
/// leaves.
fn asked(lab: &Lab, parent: u32, stop: &Stop) -> Result<Option<Change>> {
    let live = lab.live(parent)?;
    let saved = lab.saved(parent)?;
    let tell = |_: &str| {};
    let settings = lab.settings(stop, lab.setup.snoop, &tell);
    if matches!(saved.change, Change::Add { .. } | Change::SearchOutliers)
        && weights::reweighted(&live.block, live.fit(), &live.improvement.parts, &settings)?.is_some()
    {
        return Ok(Some(Change::EstimateWeights));
    }
    match &live.next {
        Some(Next::Add(effect)) => Ok(Some(Change::Add { effect: effect.clone(), values: Default::default() })),
        Some(Next::Remove(effect)) => Ok(Some(Change::Remove { effect: effect.clone() })),
        // With the effects in the model, outliers that they hid stand out.
        _ if saved.change != Change::SearchOutliers && !live.improvement.added.is_empty() && lab.setup.snoop => {
            Ok(Some(Change::SearchOutliers))
        }
        _ => Ok(None),
    }
    .and_then(|change| if stop.is_raised() { bail!("cancelled") } else { Ok(change) })
}
