//! How a picture came to be: what was known after each round. Comparing with a reference is measuring, not
//! rendering, so the clock stands still meanwhile.

use super::ErrorEstimate;
use crate::compare::compare;
use crate::save::Image;
use core::time::Duration;
use halflight_core::estimate::Difference;
use std::time::Instant;

/// What was known after a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Seconds of rendering up to here.
    pub seconds: f64,
    /// Samples of each pixel.
    pub spp: u32,
    /// Rays of every kind.
    pub rays: u64,
    /// The error as estimated; of the last round, and of each that has an eighth more samples than the last with it.
    pub error: Option<ErrorEstimate>,
    /// The error against the reference, where there is one.
    pub reference: Option<Against>,
}

/// The error against a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Against {
    /// MSE and relMSE.
    pub linear: Difference,
    /// Mean LDR-FLIP error; of every round whose time is a tenth longer than that of the last one with it.
    pub flip: Option<f64>,
}

/// FLIP is computed again when this many times as much time has passed: more would not be seen on
/// logarithmic axes, and it takes as long as a short round.
const FLIP_EVERY: f64 = 1.1;

/// A reference, and when FLIP was last taken against it.
pub(super) struct Reference<'a> {
    image: &'a Image,
    flip_at: f64,
}

impl<'a> Reference<'a> {
    pub(super) fn new(image: &'a Image) -> Self {
        Self { image, flip_at: 0.0 }
    }

    /// The error of `image`, of the size of the reference, after `seconds`.
    pub(super) fn compare(&mut self, image: &Image, seconds: f64) -> Against {
        if seconds >= self.flip_at
            && let Ok(comparison) = compare(image, self.image)
        {
            self.flip_at = seconds * FLIP_EVERY;
            return Against { linear: comparison.linear, flip: Some(comparison.flip) };
        }
        Against { linear: Difference::between(image.colours(), self.image.colours()), flip: None }
    }
}

/// Time of rendering: wall-clock time without the pauses.
pub(super) struct Clock {
    start: Instant,
    paused: Duration,
    before: f64,
}

impl Clock {
    /// `before` seconds were spent in earlier runs.
    pub(super) fn start(before: f64) -> Self {
        Self { start: Instant::now(), paused: Duration::ZERO, before }
    }

    pub(super) fn seconds(&self) -> f64 {
        self.before + self.start.elapsed().saturating_sub(self.paused).as_secs_f64()
    }

    /// Runs `work` while the clock stands still.
    pub(super) fn pause<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        self.paused += begin.elapsed();
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_stands_still_in_a_pause() {
        let mut clock = Clock::start(0.0);
        clock.pause(|| std::thread::sleep(Duration::from_millis(60)));
        assert!(clock.seconds() < 0.05);
    }

    #[test]
    fn flip_is_taken_when_it_would_be_seen() {
        let white = Image { width: 4, height: 4, pixels: vec![[1.0; 3]; 16] };
        let mut reference = Reference::new(&white);
        let taken = [1.0, 1.05, 1.11, 1.2, 1.3].map(|seconds| {
            let against = reference.compare(&Image::black(4, 4), seconds);
            assert_eq!(against.linear.mse, 1.0);
            against.flip.is_some()
        });
        assert_eq!(taken, [true, false, true, false, true]);
    }
}
