//! The end of a render: a time limit or an interruption. Passes check it before each task.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::sync::OnceLock;
use std::time::Instant;

/// Time after the end that prepasses may take: the picture gains by them, and most take less.
const PREPASS_GRACE: Duration = Duration::from_secs(2);

/// Time after the end that the first sample of each pixel may take, with its preparation.
const FIRST_SAMPLE_GRACE: Duration = Duration::from_secs(5);

/// Time after the end that the samples of tiles may take of it, and least time for them. A larger picture is
/// cut then, and its gaps are filled (`gaps.rs`).
const TILES_GRACE: Duration = Duration::from_millis(100);
const TILES_TIME: Duration = Duration::from_millis(250);

/// A time limit, an interrupt flag, or both; by default the render never ends.
#[derive(Default)]
pub(super) struct Deadline<'w> {
    interrupt: Option<&'w AtomicBool>,
    deadline: Option<Instant>,
    /// Time at which the interruption was noticed.
    noticed: OnceLock<Instant>,
}

impl<'w> Deadline<'w> {
    /// Ends when `interrupt` is raised.
    pub(super) fn until(interrupt: &'w AtomicBool) -> Self {
        Self { interrupt: Some(interrupt), ..Self::default() }
    }

    /// Adds an end `seconds` from now; `None` means no limit.
    pub(super) fn within(self, seconds: Option<f64>) -> Self {
        let later = |seconds: f64| Duration::try_from_secs_f64(seconds.max(0.0)).ok();
        let deadline = seconds.and_then(later).and_then(|later| Instant::now().checked_add(later));
        Self { deadline, ..self }
    }

    /// End of a `fraction`, 0 to 1, of the time that is left; `None` without a limit.
    pub(super) fn after(&self, fraction: f32) -> Option<Instant> {
        let now = Instant::now();
        let left = self.deadline?.saturating_duration_since(now);
        now.checked_add(left.mul_f32(fraction.clamp(0.0, 1.0)))
    }

    /// True if the interrupt flag is raised.
    pub(super) fn is_interrupted(&self) -> bool {
        let is_raised = self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if is_raised {
            self.noticed.get_or_init(Instant::now);
        }
        is_raised
    }

    /// True if prepasses must end.
    pub(super) fn is_over(&self) -> bool {
        self.has_ended_for(PREPASS_GRACE)
    }

    /// True if the first sample of each pixel must end.
    pub(super) fn is_late(&self) -> bool {
        self.has_ended_for(FIRST_SAMPLE_GRACE)
    }

    /// True if the first samples of tiles, begun at `start`, are to end.
    pub(super) fn ends_samples_since(&self, start: Instant) -> bool {
        start.elapsed() >= TILES_TIME && self.has_ended_for(TILES_GRACE)
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

/// End of a pass.
#[derive(Clone, Copy)]
pub(super) enum End {
    /// Prepasses: some seconds after the end of the render.
    Prepass,
    /// First round: some seconds later still, so that every pixel has a sample.
    FirstRound(Option<Instant>),
    /// Samples of tiles in it, from their start on: they have some time of their own. Where they are cut,
    /// every tile has its chance, and gaps are filled (`gaps.rs`).
    FirstSamples(Option<Instant>, Instant),
    /// Every other round: at its deadline and when the user interrupts.
    Round(Option<Instant>),
    /// A sketch after the end of the render: at a time.
    Sketch(Instant),
    /// Estimates of the error: none, since they are short.
    Never,
}

impl End {
    pub(super) fn is_over(self, render: &Deadline) -> bool {
        let is_past = |deadline: Option<Instant>| deadline.is_some_and(|deadline| Instant::now() >= deadline);
        match self {
            End::Prepass => render.is_over(),
            End::FirstRound(deadline) => render.is_late() || is_past(deadline),
            End::FirstSamples(deadline, start) => {
                render.is_late() || is_past(deadline) || render.ends_samples_since(start)
            }
            End::Round(deadline) => render.is_interrupted() || is_past(deadline),
            End::Sketch(end) => is_past(Some(end)),
            End::Never => false,
        }
    }

    pub(super) fn deadline(self) -> Option<Instant> {
        match self {
            End::Prepass | End::Never => None,
            End::FirstRound(deadline) | End::FirstSamples(deadline, _) | End::Round(deadline) => deadline,
            End::Sketch(end) => Some(end),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sample_has_a_grace_whatever_ends_the_render() {
        let flag = AtomicBool::new(false);
        let [never, timed, interrupted] =
            [None, Some(0.0), None].map(|end| Deadline::until(&flag).within(end));
        assert!(!never.is_over() && !never.is_late());
        assert!(!timed.is_over() && !timed.is_interrupted() && !timed.is_late());
        flag.store(true, Ordering::Relaxed);
        assert!(interrupted.is_interrupted() && !interrupted.is_over() && !interrupted.is_late());
        let ago = |time: Duration| Instant::now().checked_sub(time).unwrap();
        let noticed = |at: Instant| Deadline { noticed: at.into(), ..Deadline::until(&flag) };
        assert!(noticed(ago(PREPASS_GRACE)).is_over() && !noticed(ago(PREPASS_GRACE)).is_late());
        assert!(noticed(ago(FIRST_SAMPLE_GRACE)).is_late());
        let timed = Deadline { deadline: Some(ago(FIRST_SAMPLE_GRACE)), ..Deadline::default() };
        assert!(timed.is_over() && timed.is_late());
        let timed = Deadline { deadline: Some(ago(TILES_GRACE)), ..Deadline::default() };
        assert!(timed.ends_samples_since(ago(TILES_TIME)) && !timed.ends_samples_since(Instant::now()));
        assert!(!Deadline::default().ends_samples_since(ago(TILES_TIME)));
        assert!(!Deadline::default().within(Some(1e300)).is_over());
    }

    #[test]
    fn a_fraction_is_one_of_the_time_that_is_left() {
        let left = |deadline: &Deadline, fraction| {
            deadline.after(fraction).map(|end| end.saturating_duration_since(Instant::now()).as_secs_f64())
        };
        let hour = Deadline::default().within(Some(3600.0));
        let [quarter, half] = [0.25, 0.5].map(|fraction| left(&hour, fraction).unwrap());
        assert!((800.0..=900.0).contains(&quarter) && (1700.0..=1800.0).contains(&half), "{quarter} {half}");
        let past = Deadline { deadline: Some(Instant::now()), ..Deadline::default() };
        assert_eq!((left(&past, 0.5), left(&Deadline::default(), 0.5)), (Some(0.0), None));
    }
}
