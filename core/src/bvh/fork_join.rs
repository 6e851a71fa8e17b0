//! Fork and join of parallel builds. The caller supplies the threads; the core owns none.

/// Runs two independent tasks, possibly in parallel.
pub trait ForkJoin: Sync {
    /// Runs both and returns when both are done.
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send);

    /// True if builds should end early. The result of a build during which this becomes true is of no use.
    fn is_over(&self) -> bool {
        false
    }
}

/// Runs one task after the other.
#[derive(Clone, Copy, Debug)]
pub struct Serial;

impl ForkJoin for Serial {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        a();
        b();
    }
}
