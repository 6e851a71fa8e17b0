//! How a build uses more than one core without the core owning a thread: the caller brings the fork.

/// Runs two independent pieces of work, perhaps at the same time.
pub trait ForkJoin: Sync {
    /// Runs both and returns when both are done.
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send);
}

/// One after the other.
#[derive(Clone, Copy, Debug)]
pub struct Serial;

impl ForkJoin for Serial {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        a();
        b();
    }
}
