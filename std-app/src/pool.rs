//! Pools of threads. A command runs on one, so that loading, rendering and comparing share its threads, and
//! no other pool starts behind it.

use core::num::NonZero;
use core::time::Duration;
pub use rayon::ThreadPoolBuildError;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::thread::{available_parallelism, sleep};

/// Time in which threads end that were started before the system refused others.
const ENDING: Duration = Duration::from_millis(50);

/// Runs `work` on a pool of `threads` threads, or fewer if the system refuses them; `None`: all of the
/// machine. Its renders and parallel iterators run there.
///
/// # Errors
/// The system refuses a single thread.
pub fn in_pool<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> Result<T, ThreadPoolBuildError> {
    Ok(start(threads)?.install(work))
}

/// A pool as of [`in_pool`].
pub(crate) fn start(threads: Option<usize>) -> Result<ThreadPool, ThreadPoolBuildError> {
    let available = || available_parallelism().map_or(1, NonZero::get);
    // Rayon reads 0 as the number of its environment variable, or as all of the machine.
    let mut count = threads.unwrap_or(0);
    loop {
        match ThreadPoolBuilder::new().num_threads(count).build() {
            Err(_) if count != 1 => count = (if count == 0 { available() } else { count } / 2).max(1),
            built => return built,
        }
        sleep(ENDING);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallel_work_runs_on_the_pool() {
        for threads in [1, 3] {
            let count = in_pool(Some(threads), rayon::current_num_threads);
            assert_eq!(count.unwrap(), threads);
        }
    }
}
