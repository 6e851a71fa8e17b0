//! Ctrl-C, SIGTERM and SIGHUP: the first signal ends the render with the samples so far, the second ends the
//! program.

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
    ctrlc::set_handler(handler).map_err(|error| {
        Failure::new(format!("the handler of Ctrl-C could not be installed: {error}"))
            .advice("it needs a thread of its own: give fewer --threads, or raise the limit of processes")
    })
}

/// Blocks signals that must not end the program: those beyond the file size limit (`ulimit -f`), whose writes
/// become errors, and those that were ignored at the start, as by `nohup`, which ctrlc would handle.
///
/// To be called before other threads start, which inherit the signal mask.
pub(super) fn block_signals() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        let ignored = ignored(&std::fs::read_to_string("/proc/self/status").unwrap_or_default());
        let is_ignored = |signal: &Signal| ignored >> (*signal as i32 - 1) & 1 == 1;
        let handled = [Signal::SIGHUP, Signal::SIGINT, Signal::SIGTERM].into_iter();
        let blocked: SigSet = handled.filter(is_ignored).chain([Signal::SIGXFSZ]).collect();
        // On failure the signals keep their actions.
        let _ = blocked.thread_block();
    }
}

/// Signals that a process of this status (proc_pid_status(5)) ignores, as bits; none without a status.
#[cfg(unix)]
fn ignored(status: &str) -> u64 {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}
