//! How many samples the next round takes, and whether there is one: the stop rules.

use super::ErrorEstimate;
use core::ops::Range;

/// When to stop: the first rule that holds. Without any rule, [`Stop::DEFAULT_SPP`] samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Seconds of rendering.
    pub seconds: Option<f64>,
    /// relMSE: the upper end of its interval is below this.
    pub error: Option<f64>,
}

impl Stop {
    /// Samples per pixel where no rule is given.
    pub const DEFAULT_SPP: u32 = 256;
}

/// Samples that a pixel can have at most: the sampler's points repeat after 2^32, and a half must count.
const MOST_SAMPLES: u32 = 1 << 30;

/// A round should be no longer than this many seconds, so that progress is seen and flags are heeded.
const LONGEST_ROUND: f64 = 0.5;

/// Below this many samples an error estimate is too vague to stop on.
const FEWEST_FOR_ERROR: u32 = 16;

/// The rounds of a picture.
pub(super) struct Rounds {
    stop: Stop,
    spp: u32,
    count: u32,
    seconds: f64,
}

impl Rounds {
    pub(super) fn new(stop: Stop) -> Self {
        let nothing = stop == Stop::default();
        let spp = if nothing { Some(Stop::DEFAULT_SPP) } else { stop.spp };
        Self { stop: Stop { spp, ..stop }, spp: 0, count: 0, seconds: 0.0 }
    }

    /// Samples of each pixel in completed rounds.
    pub(super) fn spp(&self) -> u32 {
        self.spp
    }

    /// Completed rounds.
    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// The samples of the next round; `None` when it is time to stop. Rounds double the samples until they
    /// last long enough; the first one is done whatever the time, so that there is a picture.
    pub(super) fn next(&self, seconds: f64, error: Option<ErrorEstimate>) -> Option<Range<u32>> {
        let most = self.stop.spp.unwrap_or(MOST_SAMPLES).clamp(1, MOST_SAMPLES);
        if self.spp >= most || self.error_reached(error) {
            return None;
        }
        let mut samples = self.spp.max(1);
        if self.spp > 0 {
            let each = self.seconds / f64::from(self.spp);
            samples = samples.min((LONGEST_ROUND / each) as u32).max(1);
            if let Some(limit) = self.stop.seconds {
                // To the nearest whole sample: half of the time over, half of the time under.
                let left = ((limit - seconds) / each + 0.5) as u32;
                if left == 0 {
                    return None;
                }
                samples = samples.min(left);
            }
        }
        Some(self.spp..(self.spp.saturating_add(samples)).min(most))
    }

    /// Takes note of a round, `seconds` after the first one began.
    pub(super) fn completed(&mut self, samples: Range<u32>, seconds: f64) {
        self.spp = samples.end;
        self.seconds = seconds;
        self.count += 1;
    }

    /// Seconds until the first rule holds, if all goes on as before: errors fall like one over the samples.
    pub(super) fn seconds_left(&self, seconds: f64, error: Option<ErrorEstimate>) -> Option<f64> {
        let by_samples = self.stop.spp.map(|spp| seconds * (f64::from(spp) / f64::from(self.spp) - 1.0));
        let by_time = self.stop.seconds.map(|limit| limit - seconds);
        let by_error = match (self.stop.error, error) {
            (Some(wanted), Some(error)) => Some(seconds * (error.upper / wanted - 1.0)),
            _ => None,
        };
        [by_samples, by_time, by_error].into_iter().flatten().reduce(f64::min).map(|left| left.max(0.0))
    }

    fn error_reached(&self, error: Option<ErrorEstimate>) -> bool {
        let (Some(wanted), Some(error)) = (self.stop.error, error) else { return false };
        self.spp >= FEWEST_FOR_ERROR && error.upper <= wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs rounds with a picture that takes `each` seconds a sample; returns (spp, seconds).
    fn run(stop: Stop, each: f64) -> (u32, f64) {
        let mut rounds = Rounds::new(stop);
        let mut clock = 0.0;
        let mut error = None;
        while let Some(samples) = rounds.next(clock, error) {
            assert_eq!(samples.start, rounds.spp());
            clock += each * f64::from(samples.end - samples.start);
            rounds.completed(samples, clock);
            let relmse = 1.0 / f64::from(rounds.spp());
            error = Some(ErrorEstimate { relmse, lower: 0.9 * relmse, upper: 1.1 * relmse });
        }
        (rounds.spp(), clock)
    }

    #[test]
    fn the_first_rule_that_holds_stops() {
        let none = Stop::default();
        assert_eq!(run(none, 0.01).0, Stop::DEFAULT_SPP);
        assert_eq!(run(Stop { spp: Some(37), ..none }, 0.3).0, 37);
        let (_, seconds) = run(Stop { seconds: Some(2.0), ..none }, 0.003);
        assert!((seconds - 2.0).abs() < 0.003);
        assert_eq!(run(Stop { seconds: Some(2.0), spp: Some(5), ..none }, 0.003).0, 5);
        let (spp, _) = run(Stop { error: Some(0.01), ..none }, 0.003);
        assert!((110..=220).contains(&spp), "{spp}");
    }

    #[test]
    fn a_picture_slower_than_its_time_is_still_made_once() {
        assert_eq!(run(Stop { seconds: Some(0.5), ..Stop::default() }, 10.0).0, 1);
    }
}
