//! Ctrl-C and SIGTERM: the first signal ends the render with the samples so far, the second ends the program.

use super::failure::Failure;
use super::stdio::print_note;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::time::Instant;

/// Set by the first signal.
pub(super) static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Signals within this time count as one: `timeout` and shells signal a process and its group.
const SAME_SIGNAL: Duration = Duration::from_millis(300);

/// Installs the signal handler.
pub(super) fn install_handler() -> Result<(), Failure> {
    let mut first = None;
    let handler = move || {
        let now = Instant::now();
        if now.duration_since(*first.get_or_insert(now)) > SAME_SIGNAL {
            halflight::save::abandon();
            std::process::exit(130);
        }
        if !INTERRUPT.swap(true, Ordering::Relaxed) {
            print_note("stopping; press Ctrl-C again to end without a picture");
        }
    };
    ctrlc::set_handler(handler)
        .map_err(|error| Failure::new(format!("the handler of Ctrl-C could not be installed: {error}")))
}

/// Turns writes beyond the file size limit (`ulimit -f`) into errors instead of a fatal signal.
///
/// To be called before other threads start, which inherit the signal mask.
pub(super) fn block_file_size_signal() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        // On failure the signal stays fatal.
        let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    }
}
