//! The audit: what a biased picture is off by, from a few of its pixels that an unbiased estimator renders as
//! well (docs/decisions/0011).
//!
//! A and B are a pixel's halves in the picture, U and V those of the audit, all independent of each other. (A
//! − U) and (B − V) both have the pixel's bias for their mean and share no noise, so their product has the
//! square of the bias for its mean, whatever the noise of either is. With the mean of both halves in place of
//! A and B it would be the squared error of the pixel: the difference, ((A − B) / 2)², is the variance that
//! the picture tells of itself, in all of its pixels instead of a few.

use super::interval::ErrorEstimate;
use super::metric::{DARK, ROUNDING};
use super::student::NORMAL_95 as Z;
use crate::Rgb;
use crate::film::Pixel;
use libm::{cbrt, fabs, hypot, sqrt};

/// The unknown reference in a denominator comes from the part of the audit that is not in the numerator: what
/// made a pixel of the picture bright by chance must not make its error small. Where light is rare the part
/// may lack it, so that the reference is taken for no darker than the filtered picture over this; a pixel
/// that shines where it should not is off by as much at most.
const DOUBT: f64 = 4.0;

/// The normal distribution lies below this with 95 %.
const ONE_SIDED: f64 = 1.644_853_626_951_472_7;

/// What an audited pixel says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Estimate of its squared bias over R² + 0.01 m², in the mean of its channels; may be negative.
    pub bias: f64,
    /// By how much it is too bright, over the root of that.
    pub deviation: f64,
    /// The variances of the pixel in the picture and in the audit, over that.
    pub variances: [f64; 2],
}

impl Finding {
    /// Of a pixel of the `picture`, its `truth`, and what it is after filtering, in a picture of mean `mean`.
    /// `None` where the picture has no two samples, or the truth no four.
    pub fn of(picture: &Pixel, truth: &Pixel, filtered: Rgb, mean: f64) -> Option<Self> {
        if picture.even.count() == 0 || picture.odd.count() == 0 {
            return None;
        }
        let ([u1, u2], [v1, v2]) = (truth.even.parts()?, truth.odd.parts()?);
        let scaled = |colour: Rgb| colour.to_array().map(|value| f64::from(value) / mean);
        let [a, b, both, filtered] =
            [picture.even.mean(), picture.odd.mean(), picture.mean(), filtered].map(scaled);
        let [u1, u2, v1, v2] = [u1, u2, v1, v2].map(scaled);
        let (mut bias, mut deviation, mut variances) = (0.0, 0.0, [0.0; 2]);
        for c in 0..3 {
            let weight = |truth: f64| {
                let r = truth.max(filtered[c] / DOUBT);
                1.0 / (r * r + DARK)
            };
            // Halves know nothing of each other; quarters of one half do, for what one has met the other does
            // not meet again, and where samples are few a deviation over the other quarter would be below
            // zero in the mean.
            let halves = [0.5 * (u1[c] + u2[c]), 0.5 * (v1[c] + v2[c])];
            for (half, other) in [(halves[0], halves[1]), (halves[1], halves[0])] {
                deviation += 0.5 * (both[c] - half) * sqrt(weight(other));
            }
            // Numerator from one part of the truth, denominator from the other, and the other way round.
            for (u, v, other) in [(u1[c], v1[c], u2[c] + v2[c]), (u2[c], v2[c], u1[c] + v1[c])] {
                let weight = weight(0.5 * other);
                bias += 0.5 * ((a[c] - u) * (b[c] - v) + (a[c] - v) * (b[c] - u)) * weight;
                let squares = [a[c] - b[c], u - v].map(|halves| 0.25 * halves * halves * weight / 6.0);
                variances = [variances[0] + squares[0], variances[1] + 0.5 * squares[1]];
            }
        }
        Some(Self { bias: bias / 6.0, deviation: deviation / 3.0, variances })
            .filter(|finding| finding.bias.is_finite() && finding.deviation.is_finite())
    }
}

/// The squared bias of a picture in units of relMSE, which its own noise knows nothing of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasEstimate {
    /// Estimate; below 0 where there is none, or none that is larger than noise.
    pub relmse: f64,
    /// Lower end of the interval of 95 %, not below 0.
    pub lower: f64,
    /// Upper end, not below 0.
    pub upper: f64,
    /// The smallest that would have been told from none, at a level of 2.5 %.
    pub detectable: f64,
    /// Standard error of the estimate.
    pub error: f64,
}

impl BiasEstimate {
    /// From the findings of all strata, one of each, in an order in which neighbours are alike; with the
    /// share of the picture that each stands for, over the mean share. `None` for fewer than eight.
    ///
    /// What neighbours differ by is taken for chance: too much where strata differ, so that the interval is
    /// rather too wide than too narrow.
    pub fn of(findings: impl Iterator<Item = (Finding, f64)>) -> Option<Self> {
        let (mut count, mut differences) = (0.0, 0.0);
        let (mut sum, mut squares, mut cubes) = (0.0, 0.0, 0.0);
        let mut ends = None;
        for (finding, share) in findings {
            let value = finding.bias * share;
            let (first, before) = ends.unwrap_or((value, value));
            differences += (value - before) * (value - before);
            ends = Some((first, value));
            count += 1.0;
            sum += value;
            squares += value * value;
            cubes += value * value * value;
        }
        let (first, last) = ends?;
        if count < 8.0 {
            return None;
        }
        // A ring, so that each finding is part of two differences.
        differences += (first - last) * (first - last);
        let mean = sum / count;
        let second = squares - sum * mean;
        let third = cubes - mean * (3.0 * squares - 2.0 * sum * mean);
        let variance = differences / (2.0 * count * count);
        Some(Self::known(mean, variance, third / (second * sqrt(second)), 0.0))
    }

    /// From an estimate, its variance and how skew its noise is; `unsure` is what else is not known of it, as
    /// a share of it.
    ///
    /// Its noise is a sum of products that are as often negative as positive. Over the root of their squares
    /// such a sum has lighter tails than the normal distribution, however heavy those of the products are
    /// (Efron 1969): Student's t would be for squares that are not known as well. Where few products have
    /// most of it, they are rather positive.
    pub(super) fn known(relmse: f64, variance: f64, skewness: f64, unsure: f64) -> Self {
        let error = sqrt(variance).max(ROUNDING * ROUNDING / Z);
        let detectable = error * studentised(skewness);
        let [below, above] = [detectable / Z, error].map(|error| hypot(error, unsure * relmse / Z));
        Self { relmse, lower: ends(relmse, below)[0], upper: ends(relmse, above)[1], detectable, error }
    }

    /// A lower end that holds however often it is looked at: about four standard errors below.
    pub fn least(&self) -> f64 {
        (self.relmse - 2.0 * (self.upper - self.relmse)).max(0.0)
    }

    /// Whether there is a bias, at a level of 2.5 %.
    pub fn is_found(&self) -> bool {
        self.relmse > self.detectable
    }
}

/// The ends of the interval of 95 % for what is 0 or more, of a normal estimate with this standard error, in
/// the order of likelihood ratios (Feldman & Cousins 1998): an estimate below 0 does not make it empty, and
/// where there is nothing it errs in 5 % as everywhere. Their lower end between the one-sided and twice the
/// two-sided quantile, and their upper end below 0, are within 0.1 standard errors of these; so is what they
/// hold of 95 %, within 1 %.
fn ends(estimate: f64, error: f64) -> [f64; 2] {
    let x = estimate / error;
    let lower = (Z * (x - ONE_SIDED) / (2.0 * Z - ONE_SIDED)).max(x - Z).max(0.0);
    // x + hypot(x, Z), without its cancellation.
    let upper = if x > 0.0 { x + Z } else { Z * Z / (hypot(x, Z) - x) };
    [lower * error, upper * error]
}

/// An estimated mean is above the true one by less than so many standard errors with 97.5 %. Both are the
/// larger the further single values lie above, so that it is less for skew ones: Hall 1992, On the removal of
/// skewness by transformation. `skewness` is the sum of their third moments over the 3/2 power of that of
/// their second, from −1 to 1.
fn studentised(skewness: f64) -> f64 {
    // Where all are the same it is what rounding makes of nothing.
    let skewness = skewness.clamp(-1.0, 1.0);
    if fabs(skewness) >= 1e-4 {
        3.0 / skewness * (cbrt(1.0 + skewness * (Z - skewness / 6.0)) - 1.0)
    } else {
        Z
    }
}

impl ErrorEstimate {
    /// Of noise and bias together: both add up, and so do the squares of how unsure they are. A squared bias
    /// b counts as b − 2 σ² / b, with the standard error σ, and not at all below the root of that: one
    /// audited pixel with a firefly is enough for a b of many times the error, and for a σ nearly as large.
    /// Its lower end has only the bias that is certain by four standard errors: where the audit is much
    /// noisier than the picture, a bias found by chance, in 2.5 % of pictures, is many times the error.
    pub fn with_bias(self, bias: BiasEstimate) -> Self {
        let error = bias.error;
        let squared = if bias.relmse > 0.0 { bias.relmse - 2.0 * error * error / bias.relmse } else { 0.0 };
        let squared = squared.max(0.0);
        let skew = bias.detectable / (Z * error);
        let certain = (bias.relmse - skew * (bias.upper - bias.relmse)).clamp(0.0, bias.least());
        let relmse = self.relmse + squared;
        let below = hypot(self.relmse - self.lower, (squared - certain).max(0.0));
        let above = hypot(self.upper - self.relmse, (bias.upper - squared).max(0.0));
        Self { relmse, lower: relmse - below, upper: relmse + above }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Deviation;
    use crate::film::Dropped;
    use crate::sampling::Random;
    use libm::log;
    use std::vec::Vec;

    /// A pixel of `light` and uniform noise of ± 1 a sample.
    fn pixel(light: f32, samples: u32, random: Random) -> Pixel {
        let mut pixel = Pixel::default();
        for sample in 0..samples {
            let noise = |channel| 2.0 * random.single(3 * sample + channel) - 1.0;
            let colour = Rgb::splat(light) + Rgb::new(noise(0), noise(1), noise(2));
            pixel.add(sample, colour, &mut Dropped::default());
        }
        pixel
    }

    /// Findings of `count` pixels of light 2 in a picture of mean 2, `bias` too bright.
    fn findings(count: u32, bias: f32, seed: u32) -> Vec<Finding> {
        let of = |i: u32| {
            let picture = pixel(2.0 + bias, 8, Random::new(seed, 2 * i));
            let truth = pixel(2.0, 16, Random::new(seed, 2 * i + 1));
            Finding::of(&picture, &truth, Rgb::splat(2.0 + bias), 2.0).unwrap()
        };
        (0..count).map(of).collect()
    }

    fn estimate(findings: &[Finding]) -> BiasEstimate {
        BiasEstimate::of(findings.iter().map(|finding| (*finding, 1.0))).unwrap()
    }

    #[test]
    fn what_is_not_there_is_found_as_often_as_said_in_skew_findings() {
        // A product of two values above −1, each −log of what is random: 1 in the mean.
        let (runs, count) = (4000, 256);
        let found = |sign: f64| {
            let run = |run| {
                let random = Random::new(3, run);
                let value = |i: u32| {
                    (0..2).map(|half| -log(1.0 - f64::from(random.single(2 * i + half)))).product::<f64>()
                };
                let finding =
                    |i| Finding { bias: sign * (value(i) - 1.0), deviation: 0.0, variances: [0.0; 2] };
                BiasEstimate::of((0..count).map(|i| (finding(i), 1.0))).unwrap().is_found()
            };
            (0..runs).filter(|i| run(*i)).count() as f64 / f64::from(runs)
        };
        // 0.8 and 5.6 % by the normal distribution; one standard error is 0.25 %.
        assert!((found(1.0) - 0.025).abs() < 0.008, "{}", found(1.0));
        assert!((found(-1.0) - 0.025).abs() < 0.015, "{}", found(-1.0));
    }

    #[test]
    fn what_all_findings_agree_on_is_found() {
        for bias in [0.1, 1e-3, 3.3e5] {
            let finding = Finding { bias, deviation: 0.0, variances: [0.0; 2] };
            let of = |sign: f64| {
                let finding = Finding { bias: sign * bias, ..finding };
                BiasEstimate::of((0..256).map(|_| (finding, 1.0))).unwrap()
            };
            assert!(
                of(1.0).is_found() && of(1.0).detectable > 0.0 && of(1.0).lower > 0.99 * bias,
                "{:?}",
                of(1.0)
            );
            assert!(!of(-1.0).is_found() && of(-1.0).upper >= 0.0, "{:?}", of(-1.0));
        }
    }

    #[test]
    fn one_firefly_is_no_bias_wherever_it_is() {
        for place in [0, 1, 128, 255] {
            let finding = |i| Finding {
                bias: if i == place { 200.0 } else { 0.01 },
                deviation: 0.0,
                variances: [0.0; 2],
            };
            let bias = BiasEstimate::of((0..256).map(|i| (finding(i), 1.0))).unwrap();
            assert!(bias.relmse > 0.7 && !bias.is_found(), "{place} {bias:?}");
        }
    }

    #[test]
    fn what_is_certain_of_a_bias_is_nothing_below_four_standard_errors() {
        for relmse in [-1e9, -10.0, -2.0, -0.5, 0.0, 0.5, 2.0, 3.9] {
            assert_eq!(BiasEstimate::known(relmse, 1.0, 0.0, 0.0).least(), 0.0, "{relmse}");
        }
        for relmse in [4.0, 10.0, 1e9] {
            let least = BiasEstimate::known(relmse, 1.0, 0.0, 0.0).least();
            assert!((least - (relmse - 2.0 * Z)).abs() < 1e-9 * relmse, "{relmse} {least}");
        }
    }

    #[test]
    fn no_bias_is_found_where_there_is_none() {
        let (mut found, mut strange, runs) = (0, 0, 400);
        for seed in 0..runs {
            let findings = findings(64, 0.0, seed);
            found += u32::from(estimate(&findings).is_found());
            let deviation = Deviation::of(findings.iter().map(|finding| finding.deviation));
            strange += u32::from(deviation.chance() < 0.05);
        }
        // 2.5 % of 400 are 10, more than 20 have a chance of 0.2 %; 5 % are 20, more than 35 one of 0.1 %.
        assert!(found <= 20, "{found} of {runs}");
        assert!((8..=35).contains(&strange), "{strange} of {runs}");
    }

    #[test]
    fn what_quarters_know_of_each_other_is_no_deviation() {
        // Each quarter of a half has as much too much as the other has too little.
        for signs in [[0.9, 0.9], [0.9, -0.9], [-0.9, 0.5]] {
            let mut truth = Pixel::default();
            for (sample, half) in [0, 1, 0, 1].into_iter().enumerate() {
                let sign = if sample < 2 { signs[half] } else { -signs[half] };
                truth.add(sample as u32, Rgb::splat(1.0 + sign), &mut Dropped::default());
            }
            let mut picture = Pixel::default();
            for sample in 0..2 {
                picture.add(sample, Rgb::ONE, &mut Dropped::default());
            }
            let finding = Finding::of(&picture, &truth, Rgb::ONE, 1.0).unwrap();
            assert!(finding.deviation.abs() < 1e-6, "{finding:?}");
        }
    }

    #[test]
    fn both_variances_are_known() {
        let findings = findings(1000, 0.0, 9);
        let mean = |of: usize| findings.iter().map(|finding| finding.variances[of]).sum::<f64>() / 1000.0;
        // A third for a sample, over 2² + 0.01 · 2²; means of squares of 1000 pixels of three channels.
        for (found, samples) in [(mean(0), 8.0), (mean(1), 16.0)] {
            let expected = 1.0 / 3.0 / samples / 4.04;
            assert!((found / expected - 1.0).abs() < 0.12, "{found} {expected}");
        }
    }

    #[test]
    fn the_sum_of_noise_and_no_bias_errs_hardly_more_often_than_each() {
        let (mut missed, runs) = (0, 100_000);
        let random = Random::new(1, 2);
        for run in 0..runs {
            // Box and Muller. The noise is 1, and known to a tenth; the audit knows a bias to 1.
            let [radius, angle] = [0, 1].map(|i| f64::from(random.single(2 * run + i)));
            let (sine, cosine) = libm::sincos(core::f64::consts::TAU * angle);
            let radius = sqrt(-2.0 * log(1.0 - radius));
            let relmse = 1.0 + 0.1 * radius * sine;
            let noise = ErrorEstimate { relmse, lower: relmse - 0.1 * Z, upper: relmse + 0.1 * Z };
            let sum = noise.with_bias(BiasEstimate::known(radius * cosine, 1.0, 0.0, 0.0));
            missed += u32::from(!(sum.lower..=sum.upper).contains(&1.0));
        }
        // 6.1 %; it would be 7.1 % with the lower end that likelihood ratios give the bias. One standard
        // error is 0.08 %.
        assert!(missed * 1000 < runs * 65, "{missed} of {runs}");
    }

    #[test]
    fn a_bias_found_by_chance_leaves_the_lower_end_to_noise() {
        let noise = ErrorEstimate { relmse: 1.0, lower: 0.9, upper: 1.1 };
        for error in [1.0, 10.0, 1e3] {
            for found in [0.0, 1.0, 2.4, 3.0, 3.9] {
                let sum = noise.with_bias(BiasEstimate::known(found * error, error * error, 0.0, 0.0));
                assert!(sum.lower <= noise.relmse, "{found} standard errors of {error}: {sum:?}");
                assert!(sum.upper >= noise.upper + found * error);
            }
            // Twenty standard errors are no chance.
            let sum = noise.with_bias(BiasEstimate::known(20.0 * error, error * error, 0.0, 0.0));
            assert!(sum.lower > 15.0 * error, "{sum:?}");
        }
    }

    #[test]
    fn the_interval_holds_the_bias() {
        // 10 % too bright: 0.2² / (2² + 0.01 · 2²).
        let truth = 0.04 / 4.04;
        let (mut held, mut sum, runs) = (0, 0.0, 200);
        for seed in 0..runs {
            let bias = estimate(&findings(64, 0.2, seed));
            held += u32::from((bias.lower..=bias.upper).contains(&truth));
            sum += bias.relmse;
        }
        // The noise of a denominator makes its inverse larger by three times its square, 3 %; what is left is
        // chance.
        let mean = sum / f64::from(runs);
        assert!((0.93..1.13).contains(&(mean / truth)), "{mean} {truth}");
        // 95 % of 200 are 190; fewer than 180 have a chance of 0.2 %.
        assert!(held >= 180, "{held} of {runs}");
    }

    #[test]
    fn intervals_hold_what_is_nothing_or_something() {
        for truth in [0.0f64, 0.1, 0.3, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 3.0, 5.0] {
            // Simpson's rule would not see the ends; a step of a thousandth is as good as they are.
            let held = |x: &f64| {
                let [lower, upper] = ends(3.0 * x, 3.0);
                (lower..=upper).contains(&(3.0 * truth))
            };
            let density = |x: f64| (-0.5 * (x - truth).powi(2)).exp() / core::f64::consts::TAU.sqrt();
            let share: f64 = (-8000..12000).map(|i| f64::from(i) * 1e-3).filter(held).map(density).sum();
            assert!((share * 1e-3 - 0.955).abs() < 0.008, "{truth}: {share}");
        }
        assert!(ends(-30.0, 1.0)[1] > 0.0);
    }

    #[test]
    fn a_leak_does_not_hide_behind_its_own_brightness() {
        let (picture, truth) = (pixel(40.0, 8, Random::new(0, 0)), pixel(2.0, 400, Random::new(0, 1)));
        let finding = Finding::of(&picture, &truth, Rgb::splat(40.0), 2.0).unwrap();
        // (40 − 2)² over (40 / 4)² instead of 40².
        assert!(finding.bias > 14.0 && finding.deviation > 3.5, "{finding:?}");
    }

    #[test]
    fn too_little_to_say_anything() {
        assert!(BiasEstimate::of([].into_iter()).is_none());
        let truth = pixel(2.0, 3, Random::new(0, 1));
        assert!(Finding::of(&pixel(2.0, 8, Random::new(0, 0)), &truth, Rgb::ONE, 1.0).is_none());
    }
}
