//! Threads to work on.

use super::NAME;
use crate::adjust::AdjustError;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// So many threads: those of the pool that one is in already, or of one of its own. A thread that hands its work to
/// another pool waits until that wakes up, and is woken up itself when it is done, again and again in a solution or a
/// diagnosis.
pub(crate) struct Pool {
    threads: usize,
    /// None where it was made in a pool of as many threads.
    own: Option<ThreadPool>,
}

impl Pool {
    /// So many; a pool of its own only where one is not in one of as many.
    ///
    /// # Errors
    /// Threads that the system does not give.
    pub fn new(threads: usize) -> Result<Self, AdjustError> {
        if in_pool_of(threads) {
            return Ok(Self { threads, own: None });
        }
        let failed = |error: ThreadPoolBuildError| {
            let reason = error.to_string();
            AdjustError::NoThreads { solver: NAME, threads, reason }
        };
        let own = pool_of(threads).map_err(failed)?;
        Ok(Self { threads, own: Some(own) })
    }

    /// Does `work` there, with what it asks to be done side by side.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.own {
            _ if in_pool_of(self.threads) => work(),
            Some(own) => own.install(work),
            // What was made in a pool is used outside of it after all.
            None => match pool_of(self.threads) {
                Ok(pool) => pool.install(work),
                Err(_) => work(),
            },
        }
    }
}

fn pool_of(threads: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    ThreadPoolBuilder::new().num_threads(threads).build()
}

/// Is this a thread of a pool of so many?
fn in_pool_of(threads: usize) -> bool {
    rayon::current_thread_index().is_some() && rayon::current_num_threads() == threads
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pool(threads: usize) -> Pool {
        Pool::new(threads).expect("a pool")
    }

    #[test]
    fn work_is_done_on_as_many_threads_as_were_asked_for() {
        for threads in [1, 2, 3] {
            let within = |threads: usize| pool(threads).install(rayon::current_num_threads);
            assert_eq!(within(threads), threads);
            assert_eq!(pool(2).install(|| within(threads)), threads, "in a pool of two");
            let made_inside = pool(threads).install(|| pool(threads));
            assert_eq!(made_inside.install(rayon::current_num_threads), threads, "outside of where it was made");
        }
    }

    #[test]
    fn a_pool_of_as_many_threads_is_stayed_in() {
        let outer = pool(2);
        let stays = |inner: &Pool| {
            let here = std::thread::current().id();
            inner.install(|| std::thread::current().id()) == here
        };
        assert!(outer.install(|| stays(&pool(2))));
        let (made_outside, other) = (pool(2), pool(3));
        assert!(outer.install(|| stays(&made_outside)));
        assert!(!outer.install(|| stays(&other)));
    }
}
