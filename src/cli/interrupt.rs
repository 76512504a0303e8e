//! Ctrl-C: the program ends at once, and leaves no temporary folder. Results appear when they are complete
//! ([`super::staging`]), so that the output is as it was before the command.

use crate::files::scratch;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level::emulate_default_handler;
use std::thread;

/// Starts the thread that handles SIGINT and SIGTERM. Where it cannot start, the signals keep their default: they end
/// the program.
pub fn watch() {
    let waiting = || {
        let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else { return };
        if let Some(signal) = signals.forever().next() {
            scratch::remove_all();
            // Whoever started the program sees that the signal ended it.
            let _ = emulate_default_handler(signal);
        }
    };
    let _ = thread::Builder::new().name("interrupt".into()).spawn(waiting);
}
