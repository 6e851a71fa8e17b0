//! History of a picture: its state after each round. Comparison with a reference is no part of rendering, so
//! it pauses the clock.

use super::ErrorEstimate;
use crate::compare::{Observer, visible};
use crate::save::Image;
use core::time::Duration;
use halflight_core::estimate::Difference;
use std::time::Instant;

/// State after a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    /// Seconds of rendering up to here.
    pub seconds: f64,
    /// Samples per pixel.
    pub spp: u32,
    /// Rays of every kind.
    pub rays: u64,
    /// Estimated error, of the last round and of each round at which an estimate was due.
    pub error: Option<ErrorEstimate>,
    /// Error against the reference, if there is one.
    pub reference: Option<Against>,
}

/// Error against a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Against {
    /// MSE and relMSE.
    pub linear: Difference,
    /// Mean LDR-FLIP error.
    pub flip: f64,
}

/// A reference, prepared for FLIP.
pub(super) struct Reference<'a> {
    image: &'a Image,
    observer: Observer,
}

impl<'a> Reference<'a> {
    pub(super) fn new(image: &'a Image) -> Self {
        Self { image, observer: Observer::of(image) }
    }

    /// Error of `image`, which has the size of the reference.
    pub(super) fn compare(&self, image: &Image) -> Against {
        let linear = Difference::between(image.colours(), self.image.colours());
        Against { linear, flip: visible(&linear, self.observer.mean(image)) }
    }
}

/// Time of rendering: wall-clock time without the pauses.
pub(super) struct Clock {
    start: Instant,
    paused: Duration,
    before: f64,
}

impl Clock {
    /// Starts after `before` seconds of earlier runs.
    pub(super) fn start(before: f64) -> Self {
        Self { start: Instant::now(), paused: Duration::ZERO, before }
    }

    pub(super) fn seconds(&self) -> f64 {
        self.before + self.start.elapsed().saturating_sub(self.paused).as_secs_f64()
    }

    /// Runs `work` with the clock paused.
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
    fn a_picture_is_compared_in_linear_light_and_as_it_is_seen() {
        let white = Image { width: 4, height: 4, pixels: vec![[1.0; 3]; 16] };
        let reference = Reference::new(&white);
        let black = reference.compare(&Image::black(4, 4));
        assert_eq!(black.linear.mse, 1.0);
        assert!(black.flip > 0.9, "{}", black.flip);
        assert_eq!(reference.compare(&white).flip, 0.0);
    }
}
