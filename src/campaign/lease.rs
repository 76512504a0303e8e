//! Leases: who works which case. No server, no lock of the file system, no clock that two machines would have to share.
//!
//! The lease of a case is a file that is made exclusively, `<id>.<generation>`. While its worker lives, it changes the
//! file every [`HEARTBEAT`]. A worker that waits for the case measures by its own monotonic clock how long the file has
//! not changed. After [`LEASE`] the holder counts as dead, and the worker that creates the next generation takes the
//! case over. A holder that was only slow gives the same bytes as its successor.

use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A worker shows that it lives so often. File systems of many machines take a change in well below a second.
pub const HEARTBEAT: Duration = Duration::from_secs(2);
/// A lease that stands still for so long is that of a dead worker: some ten heartbeats.
pub const LEASE: Duration = Duration::from_secs(30);

/// A lease that is held; dropping it leaves the file as that of a dead worker.
#[derive(Debug)]
pub struct Lease {
    path: PathBuf,
    /// From 1.
    pub generation: usize,
}

/// Takes the lease of a case, in the folder of leases that it has; `None`: somebody has this generation.
///
/// # Errors
/// A folder that takes no file.
pub fn claim(folder: &Path, id: &str, generation: usize) -> Result<Option<Lease>> {
    let path = file(folder, id, generation);
    match OpenOptions::new().write(true).create_new(true).open(&path) {
        Ok(_) => Ok(Some(Lease { path, generation })),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(None),
        Err(error) => Err(error).with_context(|| format!("{}: cannot make a lease", path.display())),
    }
}

fn file(folder: &Path, id: &str, generation: usize) -> PathBuf {
    folder.join(format!("{id}.{generation}"))
}

/// The last generation of a case; 0: nobody had it.
pub fn generation(folder: &Path, id: &str) -> usize {
    (1..).take_while(|generation| file(folder, id, *generation).exists()).last().unwrap_or(0)
}

/// Removes the leases of a finished case; one that cannot be removed does no harm.
pub fn release(folder: &Path, id: &str, last: usize) {
    for generation in 1..=last {
        let _ = fs::remove_file(file(folder, id, generation));
    }
}

impl Lease {
    /// Gives it back, with nothing done.
    pub fn abandon(&self) {
        let _ = fs::remove_file(&self.path);
    }

    /// A file of this worker's alone, for what it is about to finish.
    pub fn part(&self) -> PathBuf {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        self.path.with_file_name(format!("{name}.part"))
    }
}

/// Heartbeat: a thread that changes the lease files of this process.
pub struct Heart {
    held: Arc<Mutex<Vec<PathBuf>>>,
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Heart {
    /// Begins to beat.
    pub fn start() -> Self {
        let held: Arc<Mutex<Vec<PathBuf>>> = Arc::default();
        let (end, ended) = channel();
        let beating = Arc::clone(&held);
        let thread = std::thread::spawn(move || {
            let mut beats = 0_u64;
            while ended.recv_timeout(HEARTBEAT) == Err(RecvTimeoutError::Timeout) {
                beats += 1;
                let paths = beating.lock().unwrap_or_else(PoisonError::into_inner).clone();
                // One that has gone was finished in between, and a file system that takes no write just now may later.
                paths.iter().for_each(|path| drop(beat(path, beats)));
            }
        });
        Self { held, end: Some(end), thread: Some(thread) }
    }

    /// From now on `lease` is shown to be held.
    pub fn hold(&self, lease: &Lease) {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).push(lease.path.clone());
    }

    /// No longer.
    pub fn let_go(&self, lease: &Lease) {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != lease.path);
    }
}

impl Drop for Heart {
    fn drop(&mut self) {
        drop(self.end.take());
        self.thread.take().map(JoinHandle::join);
    }
}

fn beat(path: &Path, beats: u64) -> std::io::Result<()> {
    // Not made anew where it has gone.
    let mut file: File = OpenOptions::new().write(true).truncate(true).open(path)?;
    write!(file, "{} {beats}", std::process::id())
}

/// What is seen of leases that others hold.
#[derive(Default)]
pub struct Watch(BTreeMap<String, Seen>);

struct Seen {
    generation: usize,
    content: Vec<u8>,
    since: Instant,
}

impl Watch {
    /// Has the lease of a case stood still for `lease`? Looks at it.
    pub fn is_dead(&mut self, folder: &Path, id: &str, generation: usize, lease: Duration) -> bool {
        let content = fs::read(file(folder, id, generation)).unwrap_or_default();
        let seen = self.0.get(id).filter(|seen| seen.generation == generation && seen.content == content);
        match seen {
            Some(seen) => seen.since.elapsed() > lease,
            None => {
                self.0.insert(id.to_owned(), Seen { generation, content, since: Instant::now() });
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    #[test]
    fn a_case_is_taken_once_and_taken_over_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path();
        let first = claim(place, "a", 1).expect("a folder that takes files").expect("the lease");
        assert!(claim(place, "a", 1).expect("a folder").is_none(), "somebody has it");
        assert_eq!(generation(place, "a"), 1);
        let mut watch = Watch::default();
        let dead = |watch: &mut Watch, lease| watch.is_dead(place, "a", 1, lease);
        assert!(!dead(&mut watch, Duration::ZERO), "seen for the first time");
        std::thread::sleep(Duration::from_millis(20));
        assert!(dead(&mut watch, Duration::from_millis(10)));
        beat(&first.path, 1).expect("a beat");
        assert!(!dead(&mut watch, Duration::from_millis(10)), "it lives");
        // The clock of either machine jumps: times of files say nothing.
        for time in [SystemTime::UNIX_EPOCH, SystemTime::now() + Duration::from_secs(1 << 30)] {
            let file = OpenOptions::new().write(true).open(&first.path).expect("the lease");
            file.set_modified(time).expect("a time");
            assert!(!dead(&mut watch, Duration::from_secs(5)), "seen a moment ago");
        }
        assert_eq!(claim(place, "a", 2).expect("a folder").expect("the next").generation, 2);
        assert!(claim(place, "a", 2).expect("a folder").is_none());
        release(place, "a", 2);
        assert_eq!(generation(place, "a"), 0);
        assert!(beat(&first.path, 2).is_err(), "a finished case is not held again");
    }

    #[test]
    fn a_folder_that_takes_no_file_is_named() {
        let error = claim(Path::new("/proc/nothing"), "a", 1).expect_err("refused");
        assert!(format!("{error:#}").starts_with("/proc/nothing/a.1: cannot make a lease: "), "{error:#}");
    }
}
