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
mod tests;
