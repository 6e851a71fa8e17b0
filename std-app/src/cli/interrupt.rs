//! Ctrl-C and SIGTERM: the first ends the render with what there is, the second the program.

use super::failure::Failure;
use super::warn;
use core::sync::atomic::{AtomicBool, Ordering};

/// Raised by the first.
pub(super) static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Listens from now on.
pub(super) fn listen() -> Result<(), Failure> {
    let heard = || {
        if INTERRUPT.swap(true, Ordering::Relaxed) {
            halflight::save::abandon();
            std::process::exit(130);
        }
        warn("stopping; once more to stop at once, without a picture");
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
