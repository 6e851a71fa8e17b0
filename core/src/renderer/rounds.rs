//! Rounds of a picture: number of samples of the next round, and the stop rules.

use crate::audit::Audited;
use crate::estimate::ErrorEstimate;
use libm::{cbrt, ceil};

/// Stop rules; the first that holds ends the render. Without rules: [`Stop::DEFAULT_SPP`] samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Samples per pixel.
    pub spp: Option<u32>,
    /// Seconds of rendering.
    pub seconds: Option<f64>,
    /// Upper end of the interval of relMSE.
    pub error: Option<f64>,
}

impl Stop {
    /// Samples per pixel without rules.
    pub const DEFAULT_SPP: u32 = 256;

    /// Default rules of the command line: an error below the threshold of visibility, or a minute.
    pub const SENSIBLE: Self = Self { spp: None, seconds: Some(60.0), error: Some(1e-3) };

    /// Largest number of samples per pixel, if limited.
    pub fn most_samples(&self) -> Option<u32> {
        if *self == Self::default() { Some(Self::DEFAULT_SPP) } else { self.spp }
    }
}

/// The rule that ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopRule {
    /// Samples per pixel.
    Samples,
    /// Seconds of rendering.
    Time,
    /// Upper end of the interval of relMSE.
    Error,
}

/// Largest number of samples per pixel: the sampler repeats after 2^32 points, and the counter of a half-film
/// must not overflow.
const MOST_SAMPLES: u32 = 1 << 30;

/// Longest round in seconds, for regular progress and quick reaction to interrupts.
const LONGEST_ROUND: f64 = 0.5;

/// Samples at the first error estimate: one for each quarter of the film.
const FIRST_ESTIMATE: u32 = 4;

/// Without an error target, later estimates come at multiples of this number of samples.
const SELDOM: u32 = 16;

/// Fewest samples at which an error estimate may end a render.
const FEWEST_FOR_ERROR: u32 = 16;

/// Noise is shared by all samples once it exceeds 1/n extrapolation of earlier noise by this factor.
const SHARED: f64 = 2.0;

/// Fewest samples per audited pixel at which bias may end a render: below, some light is rarely sampled.
const FEWEST_FOR_BIAS: u32 = 64;

/// Largest ratio of noise to the requested error while the audit continues alone.
const ENOUGH: f64 = 0.5;

/// The rounds of a picture. Time is an argument: without a clock it stands still at 0.
#[derive(Clone, Copy, Debug)]
pub struct Rounds {
    stop: Stop,
    spp: u32,
    count: u32,
    /// Samples at the next error estimate. They follow from samples and estimates alone, not from the clock:
    /// a picture that stops by its error has the same bits in each run.
    next_estimate: u32,
    /// Number of samples and error of the last of these estimates.
    decision: Option<(u32, ErrorEstimate)>,
    /// Number of samples and noise of the first estimate that is precise enough for comparison.
    first_noise: Option<(u32, f64)>,
    /// Samples and seconds at the start of this run.
    began: (u32, f64),
    seconds: f64,
}

/// State of error estimation: last and next estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimates {
    /// Samples at the next estimate.
    pub next: u32,
    /// Number of samples and error of the last estimate.
    pub last: Option<(u32, ErrorEstimate)>,
    /// Number of samples and upper end of noise of the first estimate that is precise enough for comparison.
    pub first_noise: Option<(u32, f64)>,
}

/// Plan of a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Samples per pixel at its end.
    pub target: u32,
    /// Clock reading in seconds at which the round is cut.
    pub deadline: Option<f64>,
    /// True if it is the first round, which is completed even past the deadline, so that every pixel has a
    /// sample.
    pub first: bool,
    /// Seconds per sample of all pixels, if known.
    pub each: Option<f64>,
}

impl Rounds {
    /// Rounds until a rule of `stop` holds.
    pub fn new(stop: Stop) -> Self {
        let stop = Stop { spp: stop.most_samples(), ..stop };
        Self {
            stop,
            spp: 0,
            count: 0,
            next_estimate: FIRST_ESTIMATE,
            decision: None,
            first_noise: None,
            began: (0, 0.0),
            seconds: 0.0,
        }
    }

    /// Continues after `count` rounds that took `spp` samples per pixel in `seconds`.
    pub fn resumed(self, spp: u32, count: u32, seconds: f64, estimates: Estimates) -> Self {
        let Estimates { next, last, first_noise } = estimates;
        Self {
            spp,
            count,
            seconds,
            began: (spp, seconds),
            first_noise,
            next_estimate: next.max(FIRST_ESTIMATE),
            decision: last,
            ..self
        }
    }

    /// Samples per pixel; those of the least sampled pixel after a cut round.
    pub fn spp(&self) -> u32 {
        self.spp
    }

    /// Rounds begun.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// State for a resumed render.
    pub fn estimates(&self) -> Estimates {
        Estimates { next: self.next_estimate, last: self.decision, first_noise: self.first_noise }
    }

    /// True if an error estimate is due.
    pub fn estimate_is_due(&self) -> bool {
        self.spp >= self.next_estimate
    }

    /// Records an estimate, which costs a tenth of a sample, or a quarter of a cheap one. The next estimate
    /// is due after an eighth more samples, at a multiple of sixteen. With an error target it is due when the
    /// target can be reached at the earliest, since errors fall at best with the squared number of samples
    /// while intervals narrow: after 1/32 more samples at least, and twice as many at most.
    pub fn estimated(&mut self, error: Option<ErrorEstimate>) {
        let spp = self.spp;
        let next = match (self.stop.error, error) {
            (Some(wanted), Some(error)) => {
                let growth = cbrt(error.upper / wanted).clamp(1.0 + 1.0 / 32.0, 2.0);
                (f64::from(spp) * growth) as u32
            }
            _ => (spp + (spp / 8).max(SELDOM)) / SELDOM * SELDOM,
        };
        self.next_estimate = next.max(spp + 1).next_multiple_of(4);
        self.decision = error.map(|error| (spp, error));
    }

    /// Next round at `seconds`, `None` if a stop rule holds. Rounds double the samples until they last long
    /// enough; `reserve` seconds stay free at the end.
    pub fn next(&self, seconds: f64, reserve: f64) -> Option<Plan> {
        let most = self.stop.spp.unwrap_or(MOST_SAMPLES).clamp(1, MOST_SAMPLES);
        if self.spp >= most || self.error_reached() {
            return None;
        }
        let first = self.spp == 0;
        let deadline = self.stop.seconds.map(|limit| limit - reserve);
        if !first && deadline.is_some_and(|deadline| seconds >= deadline) {
            return None;
        }
        let here = self.spp - self.began.0;
        let each = (here > 0).then(|| (self.seconds - self.began.1) / f64::from(here));
        let mut samples = here.max(1);
        if let Some(each) = each {
            samples = samples.min((LONGEST_ROUND / each) as u32);
            if let Some(deadline) = deadline {
                samples = samples.min(ceil((deadline - seconds) / each) as u32);
            }
        }
        let target = self.spp.saturating_add(samples.max(1)).min(most);
        // Up to the next estimate at most.
        let target = if self.spp < self.next_estimate { target.min(self.next_estimate) } else { target };
        Some(Plan { target, deadline: deadline.filter(|_| !first), first, each })
    }

    /// Records a round after which the least sampled pixel has `spp` samples, at `seconds`.
    pub fn completed(&mut self, spp: u32, seconds: f64) {
        self.spp = spp;
        self.seconds = seconds;
        self.count += 1;
    }

    /// Estimated seconds until the first rule holds: errors fall with 1 over the number of samples.
    pub fn seconds_left(&self, seconds: f64, error: Option<ErrorEstimate>) -> Option<f64> {
        let by_samples =
            self.stop.spp.map(|spp| seconds * (f64::from(spp) / f64::from(self.spp.max(1)) - 1.0));
        let by_time = self.stop.seconds.map(|limit| limit - seconds);
        let by_error = match (self.stop.error, error) {
            (Some(wanted), Some(error)) => Some(seconds * (error.upper / wanted - 1.0)),
            _ => None,
        };
        [by_samples, by_time, by_error].into_iter().flatten().reduce(f64::min).map(|left| left.max(0.0))
    }

    /// True if only the audit keeps the render from its end: its pixels are noisier than the picture's, and
    /// its uncertainty is more than half of the requested error.
    pub(super) fn waits_for(&self, audited: &Audited) -> bool {
        let Some(wanted) = self.stop.error.filter(|_| self.spp >= FEWEST_FOR_ERROR) else { return false };
        let is_open = audited.bias.least() <= wanted && audited.total.upper > wanted;
        is_open && audited.noise.upper <= ENOUGH * wanted && audited.imbalance > 1.0
    }

    /// True if the bias exceeds the requested error, judged by enough samples.
    pub(super) fn is_out_of_reach(&self, audited: &Audited) -> bool {
        let enough = self.spp >= FEWEST_FOR_ERROR && audited.work.samples >= FEWEST_FOR_BIAS;
        enough && !audited.is_blind && self.stop.error.is_some_and(|wanted| audited.bias.least() > wanted)
    }

    /// True if the requested error is below the `least` that the picture has.
    pub(super) fn is_below(&self, least: f64) -> bool {
        self.spp >= FEWEST_FOR_ERROR && self.stop.error.is_some_and(|wanted| least > wanted)
    }

    /// True if `noise` shared by all samples stays above the requested error. Noise falls as a + b/n with n
    /// samples; a is significant if the lower end of noise is far above the extrapolated b/n.
    pub(super) fn has_floor(&mut self, noise: ErrorEstimate) -> bool {
        let Some(wanted) = self.stop.error.filter(|_| self.spp >= FEWEST_FOR_ERROR) else { return false };
        let (before, was) = *self.first_noise.get_or_insert((self.spp, noise.upper));
        let [n, m] = [before, self.spp].map(f64::from);
        noise.lower * m > SHARED * was * n && noise.upper * m - was * n > wanted * (m - n)
    }

    /// The rule that holds. The clock is not read: without another rule it is time.
    pub fn rule(&self) -> StopRule {
        match self.stop.spp {
            _ if self.error_reached() => StopRule::Error,
            Some(most) if self.spp >= most => StopRule::Samples,
            _ => StopRule::Time,
        }
    }

    fn error_reached(&self) -> bool {
        let (Some(wanted), Some((spp, error))) = (self.stop.error, self.decision) else { return false };
        self.spp == spp && spp >= FEWEST_FOR_ERROR && error.upper <= wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs rounds of a picture that takes `each` seconds per sample; returns (spp, seconds).
    fn run(stop: Stop, each: f64) -> (u32, f64) {
        let mut rounds = Rounds::new(stop);
        let mut clock = 0.0;
        while let Some(plan) = rounds.next(clock, 0.0) {
            let full = clock + each * f64::from(plan.target - rounds.spp());
            let cut = plan.deadline.is_some_and(|deadline| deadline < full);
            clock = if cut { plan.deadline.unwrap() } else { full };
            rounds.completed(if cut { rounds.spp() } else { plan.target }, clock);
            let relmse = 1.0 / f64::from(rounds.spp());
            if rounds.estimate_is_due() {
                rounds.estimated(Some(ErrorEstimate { relmse, lower: 0.9 * relmse, upper: 1.1 * relmse }));
            }
        }
        (rounds.spp(), clock)
    }

    #[test]
    fn the_first_rule_that_holds_stops() {
        let none = Stop::default();
        assert_eq!(run(none, 0.01).0, Stop::DEFAULT_SPP);
        assert_eq!(run(Stop { spp: Some(37), ..none }, 0.3).0, 37);
        let (_, seconds) = run(Stop { seconds: Some(2.0), ..none }, 0.003);
        assert!((seconds - 2.0).abs() < 1e-9);
        assert_eq!(run(Stop { seconds: Some(2.0), spp: Some(5), ..none }, 0.003).0, 5);
    }

    #[test]
    fn the_error_stops_where_it_is_reached_whatever_the_speed() {
        let stop = Stop { error: Some(0.001), ..Stop::default() };
        let (spp, _) = run(stop, 0.003);
        assert!((1100..=1170).contains(&spp), "{spp}");
        for each in [1e-6, 0.1, 3.0] {
            assert_eq!(run(stop, each).0, spp);
        }
    }

    #[test]
    fn noise_that_samples_share_is_found_and_a_slope_is_none() {
        for (shared, expected) in [(0.0, None), (8e-4, None), (1.1e-3, Some(256)), (0.01, Some(64))] {
            let mut rounds = Rounds::new(Stop { error: Some(1e-3), ..Stop::default() });
            let found = (4..20).map(|k| 1 << k).find(|&spp| {
                rounds.completed(spp, 0.0);
                let relmse = shared + 0.1 / f64::from(spp);
                rounds.has_floor(ErrorEstimate { relmse, lower: 0.9 * relmse, upper: 1.1 * relmse })
            });
            assert_eq!(found, expected, "{shared}");
        }
    }

    #[test]
    fn a_picture_slower_than_its_time_is_still_made_once() {
        assert_eq!(run(Stop { seconds: Some(0.5), ..Stop::default() }, 10.0).0, 1);
    }
}
