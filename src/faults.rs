//! How the program ends where no error can be returned: memory that is refused to code without a way out, and libraries
//! that crash or end it.
//!
//! A handler of a signal may run in the middle of anything. It allocates nothing, takes no lock, and calls only
//! functions that POSIX allows there.

#![allow(unsafe_code)] // signals, and the functions that end a process

use std::ffi::{c_int, c_void};
use std::process;
use std::ptr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, Ordering::SeqCst};

/// Exit code of a failure that no other code names.
const FAILURE: c_int = 1;
/// Address space to ask the system for as a test, bytes: what the stack of a thread needs. A healthy program gets it.
const PROBE: usize = 8 << 20;
/// Signals of a crash, after that of an abort.
const SIGNALS: [c_int; 5] = [libc::SIGABRT, libc::SIGSEGV, libc::SIGBUS, libc::SIGILL, libc::SIGFPE];

/// 0 until the faults are watched. A child between fork() and exec() has another number and ends as it likes.
static WATCHED_PROCESS: AtomicI32 = AtomicI32::new(0);
static IS_DONE: AtomicBool = AtomicBool::new(false);
/// Set by the first thread that ends the process early: it alone speaks.
static IS_ENDING: AtomicBool = AtomicBool::new(false);
static WAS_REFUSED: AtomicBool = AtomicBool::new(false);
/// Names of libraries; null without any. Never freed: a handler may read it at any time.
static SUSPECTS: AtomicPtr<String> = AtomicPtr::new(ptr::null_mut());
/// What was done at each of [`SIGNALS`] before.
static EARLIER: [OnceLock<libc::sigaction>; SIGNALS.len()] = [const { OnceLock::new() }; SIGNALS.len()];

/// From now on a lack of memory that would abort or crash the program ends it with a message and code 1. So does a
/// library that calls exit(), quick_exit() or _exit() before [`work_is_done`]: its code would be taken for the
/// program's own. Nothing in the process can stop a library that makes the system call itself.
pub(crate) fn watch() {
    WATCHED_PROCESS.store(own_process(), SeqCst);
    for (number, earlier) in SIGNALS.into_iter().zip(&EARLIER) {
        let handler = if number == libc::SIGABRT { on_abort } else { on_crash };
        // SAFETY: zeros are an action without flags that blocks no further signal; both pointers are to whole actions.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = handler as extern "C" fn(c_int) as *const () as usize;
            // On the other stack, where there is one: a recursion without end leaves no room on its own.
            action.sa_flags = libc::SA_ONSTACK;
            let mut before = action;
            if libc::sigaction(number, &action, &mut before) == 0 {
                let _ = earlier.set(before);
            }
        }
    }
    // SAFETY: the handler is a function of this program, which lives as long as it.
    unsafe { libc::atexit(on_exit) };
}

/// Libraries of the user's that are loaded from now on: a crash names them.
pub(crate) fn suspect(libraries: String) {
    SUSPECTS.store(Box::into_raw(Box::new(libraries)), SeqCst);
}

/// An allocator was refused memory: what ends the program next has this reason.
pub(crate) fn memory_was_refused() {
    WAS_REFUSED.store(true, SeqCst);
}

/// Ends the program with the message about memory where memory is short.
pub(crate) fn end_if_memory_is_short() {
    if is_watched() && is_memory_short() {
        end_by_memory();
    }
}

/// The program ends by itself from now on.
pub(crate) fn work_is_done() {
    IS_DONE.store(true, SeqCst);
}

/// Ends the program with the message about memory.
pub(crate) fn end_by_memory() -> ! {
    say("error: there is too little memory for this; allow the program more, or use fewer threads (--threads) or a \
         smaller block\n");
    end(FAILURE)
}

fn own_process() -> c_int {
    // A number of a process always fits: pid_t is an int.
    process::id().cast_signed()
}

fn is_watched() -> bool {
    WATCHED_PROCESS.load(SeqCst) == own_process()
}

fn suspects() -> Option<&'static str> {
    // SAFETY: null, or a string that is never freed nor changed.
    unsafe { SUSPECTS.load(SeqCst).as_ref() }.map(String::as_str)
}

fn say(text: &str) {
    // SAFETY: as many bytes as the text has.
    unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
}

/// Ends the process without destructors and handlers. Not by _exit(), which is below.
fn end(code: c_int) -> ! {
    #[cfg(target_os = "linux")]
    loop {
        // SAFETY: takes a number alone.
        unsafe { libc::syscall(libc::SYS_exit_group, code) };
    }
    #[cfg(not(target_os = "linux"))]
    // SAFETY: takes a number alone.
    unsafe {
        libc::_exit(code)
    }
}

fn end_by_suspects(what: &str, names: &str) -> ! {
    for part in ["error: ", what, "; these plug-ins were loaded and are the likely cause: ", names, "\n"] {
        say(part);
    }
    end(FAILURE)
}

/// Asks the system, not malloc: a handler may.
fn probe_fails() -> bool {
    let (access, kind) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
    // SAFETY: a new mapping, which nobody else knows and which is given back whole.
    unsafe {
        let probe: *mut c_void = libc::mmap(ptr::null_mut(), PROBE, access, kind, -1, 0);
        probe == libc::MAP_FAILED || libc::munmap(probe, PROBE) != 0
    }
}

fn last_call_was_refused() -> bool {
    std::io::Error::last_os_error().raw_os_error() == Some(libc::ENOMEM)
}

/// Three signs, none of which is always there: a large allocation fails while a small probe succeeds, a message that
/// was printed since sets errno anew, and a thread's stack or the growth of the main one is refused to no allocator.
fn is_memory_short() -> bool {
    last_call_was_refused() || WAS_REFUSED.load(SeqCst) || probe_fails()
}

/// Puts back what was done at this signal before the faults were watched.
fn put_back(number: c_int) {
    let earlier = SIGNALS.iter().position(|signal| *signal == number).and_then(|k| EARLIER[k].get());
    let earlier = earlier.map_or(ptr::null(), ptr::from_ref);
    // SAFETY: a whole action, or null, which changes nothing.
    unsafe { libc::sigaction(number, earlier, ptr::null_mut()) };
}

extern "C" fn on_abort(number: c_int) {
    if is_memory_short() {
        end_by_memory();
    }
    if let Some(names) = suspects() {
        end_by_suspects("the program was aborted", names);
    }
    put_back(number);
    // SAFETY: takes a number alone.
    unsafe { libc::raise(number) };
}

/// A library that does not check what malloc gave, or a stack that cannot grow, crashes for lack of memory too.
extern "C" fn on_crash(number: c_int) {
    if is_memory_short() {
        end_by_memory();
    }
    if let Some(names) = suspects() {
        let what = match number {
            libc::SIGSEGV => "the program crashed: a memory access that is not allowed (SIGSEGV)",
            libc::SIGBUS => "the program crashed: a memory access that is not possible (SIGBUS)",
            libc::SIGILL => "the program crashed: an instruction that the processor does not have (SIGILL)",
            _ => "the program crashed: arithmetic that has no result (SIGFPE)",
        };
        end_by_suspects(what, names);
    }
    // The instruction is tried again, for the earlier handler: Rust's names a stack overflow.
    put_back(number);
}

extern "C" fn on_exit() {
    if IS_DONE.load(SeqCst) {
        return;
    }
    // A second thread waits until the first has spoken and ended the process for both.
    while IS_ENDING.swap(true, SeqCst) {
        // SAFETY: takes nothing.
        unsafe { libc::pause() };
    }
    if last_call_was_refused() || WAS_REFUSED.load(SeqCst) {
        end_by_memory();
    }
    if let Some(names) = suspects() {
        end_by_suspects("a library ended the program before its work was done", names);
    }
    say("error: a library ended the program before its work was done; the message above, where there is one, is its \
         reason\n");
    end(FAILURE)
}

/// These functions take the place of the C library's, for the libraries that the program loads as well (`build.rs`
/// exports them). _exit() and _Exit() run no handler of atexit(). exit() and quick_exit() do, but each handler runs
/// once: of two threads that call exit() together, the second finds none and would end the program with its own code.
#[cfg(target_os = "linux")]
mod in_place_of_the_c_library {
    use super::{end, is_watched, on_exit};
    use std::ffi::{CStr, c_int};

    #[unsafe(no_mangle)]
    extern "C" fn _exit(code: c_int) -> ! {
        if is_watched() {
            on_exit();
        }
        end(code)
    }

    #[unsafe(no_mangle)]
    extern "C" fn _Exit(code: c_int) -> ! {
        _exit(code)
    }

    #[unsafe(no_mangle)]
    extern "C" fn exit(code: c_int) -> ! {
        end_by_library(c"exit", code)
    }

    #[unsafe(no_mangle)]
    extern "C" fn quick_exit(code: c_int) -> ! {
        end_by_library(c"quick_exit", code)
    }

    /// Calls the C library's function of this name.
    fn end_by_library(name: &CStr, code: c_int) -> ! {
        if is_watched() {
            on_exit();
        }
        // SAFETY: the C library's functions of these names take a number and do not return.
        unsafe {
            let function = libc::dlsym(libc::RTLD_NEXT, name.as_ptr());
            if !function.is_null() {
                std::mem::transmute::<*mut libc::c_void, extern "C" fn(c_int)>(function)(code);
            }
        }
        end(code)
    }
}
