//! Works cases off: first those that nobody has, then those that others hold, should they die.

use super::folder::{Folder, MOST_DEATHS};
use super::lease::{Heart, Lease, Watch, generation, release};
use super::{Case, Outcome};
use anyhow::Result;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two looks at a case that somebody else has.
const LOOK: Duration = Duration::from_secs(1);
/// Pause of a worker that has nothing to look at.
const PAUSE: Duration = Duration::from_millis(50);

/// Which cases, and by how many at a time.
#[derive(Debug, Clone)]
pub struct Work {
    /// Cases at a time, a thread each.
    pub jobs: usize,
    /// This part of so many, from 1: every so many-th case. All: 1 of 1.
    pub shard: (usize, usize),
    /// Time after which a lease that stands still is that of a dead worker.
    pub lease: Duration,
}

/// What happens to a case, by its position in the plan.
#[derive(Debug, Clone)]
pub enum Event<'a> {
    /// It has an outcome; here, after so many seconds, or by somebody else.
    Done(usize, Option<f64>),
    /// An attempt failed.
    Failed(usize, &'a str),
    /// It is given up.
    GivenUp(usize),
}

/// Works a case; `folder`: of the campaign.
pub type Execute<'a> = dyn Fn(&Case, &Path) -> Result<Outcome> + Sync + 'a;

struct Worker<'a> {
    folder: &'a Folder,
    work: &'a Work,
    heart: Heart,
    execute: &'a Execute<'a>,
    watch: &'a (dyn Fn(Event<'_>) + Sync),
    /// Cases that nobody was known to have.
    open: Mutex<VecDeque<usize>>,
    /// Cases that somebody had, and when they were looked at.
    others: Mutex<VecDeque<(usize, Option<Instant>)>>,
    leases: Mutex<Watch>,
    /// Something failed that is no failure of a case.
    stopped: AtomicBool,
}

/// Works off all cases of a shard, and ends when each is done or given up.
///
/// # Errors
/// A folder that takes no file, or is full: what was kept stays.
pub fn run(folder: &Folder, work: &Work, execute: &Execute<'_>, watch: &(dyn Fn(Event<'_>) + Sync)) -> Result<()> {
    let (shard, shards) = work.shard;
    let own: Vec<usize> = (shard - 1..folder.cases.len()).step_by(shards).collect();
    // Workers that begin at different places seldom want the same case.
    let first = std::process::id() as usize % own.len().max(1);
    let open: VecDeque<usize> = own[first..].iter().chain(&own[..first]).copied().collect();
    let worker = Worker {
        folder,
        work,
        heart: Heart::start(),
        execute,
        watch,
        open: Mutex::new(open),
        others: Mutex::default(),
        leases: Mutex::default(),
        stopped: AtomicBool::new(false),
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..work.jobs.max(1)).map(|_| scope.spawn(|| worker.work())).collect();
        threads
            .into_iter()
            .try_for_each(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

impl Worker<'_> {
    fn work(&self) -> Result<()> {
        let done = self.work_open().and_then(|()| self.work_others());
        if done.is_err() {
            self.stopped.store(true, Ordering::Relaxed);
        }
        done
    }

    fn next<T>(&self, from: &Mutex<VecDeque<T>>) -> Option<T> {
        let stopped = self.stopped.load(Ordering::Relaxed);
        locked(from).pop_front().filter(|_| !stopped)
    }

    fn work_open(&self) -> Result<()> {
        while let Some(case) = self.next(&self.open) {
            let id = &self.folder.cases[case].id;
            if self.folder.is_done(id) {
                (self.watch)(Event::Done(case, None));
                continue;
            }
            match self.folder.claim(id, 1)? {
                Some(lease) => self.attempt(case, &lease)?,
                None => locked(&self.others).push_back((case, None)),
            }
        }
        Ok(())
    }

    fn work_others(&self) -> Result<()> {
        while let Some((case, looked)) = self.next(&self.others) {
            if looked.is_some_and(|looked| looked.elapsed() < LOOK) {
                std::thread::sleep(PAUSE);
                locked(&self.others).push_back((case, looked));
                continue;
            }
            let id = &self.folder.cases[case].id;
            if self.folder.is_done(id) {
                (self.watch)(Event::Done(case, None));
                continue;
            }
            let leases = self.folder.leases(id);
            let last = generation(&leases, id);
            if self.folder.is_given_up(id) {
                (self.watch)(Event::GivenUp(case));
                continue;
            }
            let is_free = last == 0
                || self.folder.has_failed(id, last)
                || locked(&self.leases).is_dead(&leases, id, last, self.work.lease);
            let lease = if is_free { self.folder.claim(id, last + 1)? } else { None };
            match lease {
                Some(lease) if last >= MOST_DEATHS + self.folder.attempts(id) => {
                    let reason = format!("{MOST_DEATHS} workers died over it");
                    self.folder.give_up(id, &lease, reason.clone())?;
                    (self.watch)(Event::Failed(case, &reason));
                    (self.watch)(Event::GivenUp(case));
                }
                Some(lease) => self.attempt(case, &lease)?,
                None => locked(&self.others).push_back((case, Some(Instant::now()))),
            }
        }
        Ok(())
    }

    fn attempt(&self, case: usize, lease: &Lease) -> Result<()> {
        let id = &self.folder.cases[case].id;
        // Its first worker may have finished it while this one took it over.
        if self.folder.is_done(id) {
            release(&self.folder.leases(id), id, lease.generation);
            (self.watch)(Event::Done(case, None));
            return Ok(());
        }
        self.heart.hold(lease);
        let begun = Instant::now();
        let root = self.folder.root();
        let worked = || Case::new(&self.folder.cases[case].case, root).and_then(|case| (self.execute)(&case, root));
        let outcome = catch_unwind(AssertUnwindSafe(worked)).unwrap_or_else(|_| Err(anyhow::anyhow!("a panic")));
        let kept = match &outcome {
            Ok(outcome) => self.folder.finish(id, lease, outcome.clone()),
            Err(error) => self.folder.fail(id, lease, format!("{error:#}")),
        };
        self.heart.let_go(lease);
        if kept.is_err() {
            // Nothing was kept: the case is free again.
            lease.abandon();
            return kept;
        }
        match outcome {
            Ok(_) => (self.watch)(Event::Done(case, Some(begun.elapsed().as_secs_f64()))),
            Err(error) => {
                (self.watch)(Event::Failed(case, &format!("{error:#}")));
                locked(&self.others).push_back((case, None));
            }
        }
        Ok(())
    }
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
