//! Memory that the system refuses: the program says so and ends with a code, whoever was refused.
//!
//! Rust ends a program with a signal where an allocation fails, and lets nobody change that. `faults` catches
//! the signal; it has to know that memory was the reason.

#![allow(unsafe_code)] // the allocator's interface, and its one setting

use crate::faults::{end_if_memory_is_short, memory_was_refused};
use std::alloc::{GlobalAlloc, Layout, System};
use std::panic;

/// What a thread, its stack or its signal stack is refused with: the end of a panic's message.
const REFUSALS: [&str; 3] = ["Cannot allocate memory", "(os error 12)", "Resource temporarily unavailable"];

/// The system's allocator. It notes that memory was refused.
#[derive(Debug)]
pub struct Allocator;

/// Passes a pointer on; null is a refusal.
fn noted(pointer: *mut u8) -> *mut u8 {
    if pointer.is_null() {
        memory_was_refused();
    }
    pointer
}

// SAFETY: each function is the system allocator's, with its arguments and its result unchanged.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        noted(unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        noted(unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        noted(unsafe { System.realloc(pointer, layout, size) })
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Sets the mmap threshold of glibc's malloc to 4 MiB: malloc maps each larger allocation by itself, and `free` returns
/// it to the system. Rust and C++ share this allocator. For a program; a library leaves it to its program.
///
/// By default glibc raises the threshold with each large block that is freed. A diagnosis of two million measurements
/// then holds a quarter of a gigabyte more than it needs. At 1 MiB each fit of a small block would map and unmap its
/// matrices, a quarter of its time. Other C libraries keep their defaults.
pub(crate) fn map_large_allocations() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: takes two numbers.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 4 << 20);
    }
}

/// Memory that is free for this program, swap included, bytes; `None` where the system does not say.
pub(crate) fn available() -> Option<u64> {
    let system = std::fs::read_to_string("/proc/meminfo").ok()?;
    let kilobytes = |name: &str| -> Option<u64> {
        let line = system.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
        line.trim().strip_suffix("kB")?.trim().parse().ok()
    };
    let free = 1024 * (kilobytes("MemAvailable")? + kilobytes("SwapFree").unwrap_or(0));
    // A container may have less than the machine.
    let group = std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|most| most.trim().parse().ok());
    Some(group.map_or(free, |group: u64| group.min(free)))
}

/// A panic for want of memory, such as that of a thread that cannot be started, is no bug: it ends the program with the
/// message about memory.
pub(crate) fn watch_panics() {
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let payload = info.payload();
        let text =
            payload.downcast_ref::<&str>().copied().or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        let text = text.unwrap_or_default();
        if REFUSALS.iter().any(|refusal| text.contains(refusal)) {
            memory_was_refused();
        }
        end_if_memory_is_short();
        usual(info);
    }));
}
