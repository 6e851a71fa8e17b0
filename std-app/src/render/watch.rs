//! When a render comes to its end: at a time, or when somebody says so. Whoever works on it asks from task to task.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::sync::OnceLock;
use std::time::Instant;

/// How long after its end first looks may go on: the picture is the better for them, and mostly they take less.
const LOOKING: Duration = Duration::from_secs(2);

/// How long after its end the first sample of each pixel, and what it needs, may go on. A picture of ordinary size
/// takes less; a larger one is cut then, and its gaps are filled (`gaps.rs`).
const GRACE: Duration = Duration::from_secs(5);

/// See the file. By default it never ends.
#[derive(Default)]
pub(super) struct Watch<'w> {
    interrupt: Option<&'w AtomicBool>,
    deadline: Option<Instant>,
    /// Start of the render, and its seconds where they are limited.
    limit: Option<(Instant, f64)>,
    /// When the interruption was noticed.
    noticed: OnceLock<Instant>,
}

impl<'w> Watch<'w> {
    /// Ends when `interrupt` is raised.
    pub(super) fn until(interrupt: &'w AtomicBool) -> Self {
        Self { interrupt: Some(interrupt), ..Self::default() }
    }

    /// The same, which ends after so many `seconds` from now as well; `None` is never.
    pub(super) fn within(self, seconds: Option<f64>) -> Self {
        let later = |seconds: f64| Duration::try_from_secs_f64(seconds.max(0.0)).ok();
        let deadline = seconds.and_then(later).and_then(|later| Instant::now().checked_add(later));
        let limit = seconds.map(|seconds| (Instant::now(), seconds.max(0.0)));
        Self { deadline, limit, ..self }
    }

    /// The end of a `fraction` of the seconds of the render; `None` where they are not limited.
    pub(super) fn after(&self, fraction: f32) -> Option<Instant> {
        let (start, seconds) = self.limit?;
        start.checked_add(Duration::try_from_secs_f64(f64::from(fraction) * seconds).ok()?)
    }

    /// Whether somebody said so.
    pub(super) fn is_interrupted(&self) -> bool {
        let is_raised = self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if is_raised {
            self.noticed.get_or_init(Instant::now);
        }
        is_raised
    }

    /// Whether first looks are to end: a picture can be made without them.
    pub(super) fn is_over(&self) -> bool {
        self.has_ended_for(LOOKING)
    }

    /// Whether the first sample of each pixel is to end.
    pub(super) fn is_late(&self) -> bool {
        self.has_ended_for(GRACE)
    }

    fn has_ended_for(&self, time: Duration) -> bool {
        self.is_interrupted();
        let ends = [self.deadline, self.noticed.get().copied()];
        ends.into_iter()
            .flatten()
            .min()
            .and_then(|end| end.checked_add(time))
            .is_some_and(|end| Instant::now() >= end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sample_has_a_grace_whatever_ends_the_render() {
        let flag = AtomicBool::new(false);
        let [never, timed, told] = [None, Some(0.0), None].map(|end| Watch::until(&flag).within(end));
        assert!(!never.is_over() && !never.is_late());
        assert!(!timed.is_over() && !timed.is_interrupted() && !timed.is_late());
        flag.store(true, Ordering::Relaxed);
        assert!(told.is_interrupted() && !told.is_over() && !told.is_late());
        let ago = |time: Duration| Instant::now().checked_sub(time).unwrap();
        let noticed = |at: Instant| Watch { noticed: at.into(), ..Watch::until(&flag) };
        assert!(noticed(ago(LOOKING)).is_over() && !noticed(ago(LOOKING)).is_late());
        assert!(noticed(ago(GRACE)).is_late());
        let timed = Watch { deadline: Some(ago(GRACE)), ..Watch::default() };
        assert!(timed.is_over() && timed.is_late());
        assert!(!Watch::default().within(Some(1e300)).is_over());
    }
}
