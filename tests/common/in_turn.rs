//! Work on many blocks, two at a time.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Blocks that are worked on at the same time.
const AT_A_TIME: usize = 2;

/// `work` on each of `items`, [`AT_A_TIME`] at a time; the results in the order of the items.
///
/// Plain threads: one of rayon's that waits for a part of a block's work begins the next block meanwhile, and with
/// hundreds of blocks in the queue they pile up on its stack until it overflows.
pub fn in_turn<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            scope.spawn(|| {
                while let Some((number, item)) = {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    items.get(number).map(|item| (number, item))
                } {
                    let result = work(item);
                    done.lock().expect("no other thread panicked").push((number, result));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no thread panicked");
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}
