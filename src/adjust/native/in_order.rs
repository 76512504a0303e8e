//! Parts that are made side by side and added in their order: the sum is the same for every number of threads, and no
//! thread waits for another.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Parts that are made and not yet added, by number.
type Made<P, E> = BTreeMap<usize, Result<P, E>>;

/// What has been added: all parts before the next one.
struct Sum<'a, P, E> {
    next: usize,
    add: &'a mut (dyn FnMut(&P) + Send),
    error: Option<E>,
}

/// Fills `count` parts, numbered from 0, on the threads of the current pool, and adds each. Those in `spare` are filled
/// again before new ones are made; all end up there.
///
/// # Errors
/// Of the first part, in their order, that cannot be filled.
pub fn add_in_order<P: Send, E: Send>(
    count: usize,
    spare: &Mutex<Vec<P>>,
    new: impl Fn() -> P + Sync,
    fill: impl Fn(usize, &mut P) -> Result<(), E> + Sync,
    mut add: impl FnMut(&P) + Send,
) -> Result<(), E> {
    let claimed = AtomicUsize::new(0);
    let waiting = Mutex::new(Made::new());
    let sum = Mutex::new(Sum { next: 0, add: &mut add, error: None });
    let add_waiting = |sum: &mut Sum<'_, P, E>| {
        loop {
            let next = locked(&waiting).remove(&sum.next);
            match next {
                Some(Ok(part)) => {
                    (sum.add)(&part);
                    sum.next += 1;
                    locked(spare).push(part);
                }
                Some(Err(error)) => {
                    sum.error = Some(error);
                    // Nobody begins another.
                    claimed.store(count, Ordering::Relaxed);
                    return;
                }
                None => return,
            }
        }
    };
    let work = || {
        loop {
            let number = claimed.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return;
            }
            let again = locked(spare).pop();
            let mut part = again.unwrap_or_else(&new);
            let made = fill(number, &mut part).map(|()| part);
            locked(&waiting).insert(number, made);
            // Another that adds now may miss this one; it is added with the next, or at the end.
            if let Ok(mut sum) = sum.try_lock() {
                add_waiting(&mut sum);
            }
        }
    };
    rayon::scope(|scope| (0..rayon::current_num_threads()).for_each(|_| scope.spawn(|_| work())));
    let mut sum = locked(&sum);
    if sum.error.is_none() {
        add_waiting(&mut sum);
    }
    sum.error.take().map_or(Ok(()), Err)
}

/// A panic of another thread is passed on by the pool; what it left does not matter then.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(work)
    }

    #[test]
    fn parts_are_added_in_their_order_whoever_is_slow() {
        for threads in [1, 2, 4] {
            let mut added = Vec::new();
            let slow_first = |number: usize, part: &mut usize| {
                std::thread::sleep(Duration::from_millis(if number.is_multiple_of(3) { 3 } else { 0 }));
                *part = number;
                Ok::<(), ()>(())
            };
            let done =
                on_threads(threads, || add_in_order(20, &Mutex::default(), || 0, slow_first, |part| added.push(*part)));
            assert_eq!((done, added), (Ok(()), (0..20).collect()), "{threads} threads");
        }
    }

    #[test]
    fn the_first_error_in_order_is_the_one_that_counts() {
        for threads in [1, 2, 4] {
            let mut added = Vec::new();
            let fails = |number: usize, part: &mut usize| {
                std::thread::sleep(Duration::from_millis(if number == 5 { 10 } else { 0 }));
                *part = number;
                if number == 5 || number == 6 { Err(number) } else { Ok(()) }
            };
            let done =
                on_threads(threads, || add_in_order(20, &Mutex::default(), || 0, fails, |part| added.push(*part)));
            assert_eq!((done, added), (Err(5), (0..5).collect()), "{threads} threads");
        }
    }
}
