//! Ctrl-C and SIGTERM: the first ends the render with what there is, the second the program.

use super::failure::Failure;
use super::warn;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::time::Instant;

/// Raised by the first.
pub(super) static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Signals closer together are one: `timeout` and shells send theirs to a process and to its group.
const SAME_SIGNAL: Duration = Duration::from_millis(300);

/// Listens from now on.
pub(super) fn listen() -> Result<(), Failure> {
    let mut first = None;
    let heard = move || {
        let now = Instant::now();
        if now.duration_since(*first.get_or_insert(now)) > SAME_SIGNAL {
            halflight::save::abandon();
            std::process::exit(130);
        }
        if !INTERRUPT.swap(true, Ordering::Relaxed) {
            warn("stopping; once more to stop at once, without a picture");
        }
    };
    ctrlc::set_handler(heard).map_err(|error| Failure::new(format!("Ctrl-C cannot be listened for: {error}")))
}

/// Makes an error of a write beyond the size that files may have (`ulimit -f`), which is a signal that ends the program
/// otherwise. To be called before there are other threads, which inherit it.
pub(super) fn outlive_limits() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        // Without it such a write is what it was.
        let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    }
}
