//! Long work: on a separate thread, while the caller's thread gives way to others of Python, hands on progress and
//! looks for Ctrl-C. The work never calls Python.
//!
//! An interrupted job is told to stop and left alone: the caller goes on at once, whatever the job is doing.

use crate::errors::{INTERNAL, exception, input, raised};
use anyhow::Context;
use misclosure::adjust::{Options, Stop};
use misclosure::shared::{Exit, Host};
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// How often a signal is looked for.
const GLANCE: Duration = Duration::from_millis(50);
/// Of the thread that begins the work: that of a program's main thread.
const STACK: usize = 8 << 20;
/// As the program allows (`--threads`).
const MOST_THREADS: usize = 64;

/// From the work to the caller.
enum Said<R> {
    Step(String),
    Message(String),
    Done(anyhow::Result<R>),
    Panicked,
}

struct Teller<R> {
    sender: Mutex<Sender<Said<R>>>,
    tells_steps: bool,
}

impl<R> Teller<R> {
    fn send(&self, said: Said<R>) {
        // A caller that was interrupted hears nothing any more.
        let _ = self.sender.lock().unwrap_or_else(std::sync::PoisonError::into_inner).send(said);
    }
}

impl<R: Send> Host for Teller<R> {
    fn message(&self, text: &str) {
        self.send(Said::Message(text.to_owned()));
    }

    fn step(&self, text: &str) {
        if self.tells_steps {
            self.send(Said::Step(text.to_owned()));
        }
    }
}

/// Does `work` with `threads` threads (`None`: one per processor), and gives its result and its messages. `progress` is
/// called with every step; what it raises ends the work.
pub fn work<R: Send + 'static>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Options, &dyn Host) -> anyhow::Result<R> + Send + 'static,
) -> PyResult<(R, Vec<String>)> {
    let available = Options::default().threads;
    let threads = threads.unwrap_or(available);
    let most = MOST_THREADS.max(available);
    if threads == 0 || threads > most {
        return Err(input(py, &format!("threads={threads}: expected a number from 1 to {most}, or None")));
    }
    let (sender, mut receiver) = channel();
    let stop = Stop::default();
    let options = Options { threads, stop: stop.clone(), ..Options::default() };
    let tells_steps = progress.is_some();
    let begun = std::thread::Builder::new().name("misclosure".into()).stack_size(STACK).spawn(move || {
        let teller = Teller { sender: Mutex::new(sender), tells_steps };
        let done = catch_unwind(AssertUnwindSafe(|| {
            // A separate pool, which ends with the work: the global one would not survive a fork.
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.with_context(|| format!("{threads} threads cannot be started; ask for fewer"))?;
            pool.install(|| work(&options, &teller))
        }));
        teller.send(done.map_or(Said::Panicked, Said::Done));
    });
    if let Err(error) = begun {
        let text = format!("no thread can be started: {error}; there is too little memory for it");
        return Err(exception(py, "ResourceError", &text, Exit::Other as u8));
    }
    let mut messages = Vec::new();
    loop {
        let heard = py.detach(|| receiver_timeout(&mut receiver));
        let heard = match heard {
            Ok(said) => Some(said),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Said::Panicked),
        };
        match heard {
            Some(Said::Done(Ok(done))) => return Ok((done, messages)),
            Some(Said::Done(Err(error))) => return Err(raised(py, &error)),
            Some(Said::Panicked) => {
                let text = "internal error, described on standard error: please report it with the call that led to it";
                return Err(exception(py, INTERNAL, text, Exit::Other as u8));
            }
            Some(Said::Message(text)) => messages.push(text),
            Some(Said::Step(text)) => {
                let told = progress.map_or(Ok(()), |progress| progress.call1((text,)).map(drop));
                told.inspect_err(|_| stop.raise())?;
            }
            None => {}
        }
        py.check_signals().inspect_err(|_| stop.raise())?;
    }
}

fn receiver_timeout<R>(receiver: &mut std::sync::mpsc::Receiver<Said<R>>) -> Result<Said<R>, RecvTimeoutError> {
    receiver.recv_timeout(GLANCE)
}
