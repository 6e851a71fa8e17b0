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
            std::process::exit(130);
        }
        warn("stopping; once more to stop at once, without a picture");
    };
    ctrlc::set_handler(heard).map_err(|error| Failure::new(format!("Ctrl-C cannot be listened for: {error}")))
}
