//! Audit: the bias of a picture, estimated from a few pixels that an unbiased estimator renders as well
//! (docs/decisions/error-estimate.md).
//!
//! A and B are the halves of a pixel in the picture, U and V its halves in the audit, all independent. (A −
//! U) and (B − V) both have the bias of the pixel as mean and share no noise, so that their product has the
//! squared bias as mean, for any noise. With the mean of both halves in place of A and B, the mean would be
//! the squared error of the pixel. The difference ((A − B) / 2)² is the variance, which the picture itself
//! provides for all of its pixels instead of a few.

use super::interval::ErrorEstimate;
use super::metric::{RELMSE_OFFSET, ROUNDING};
use super::student::NORMAL_95 as Z;
use crate::Rgb;
use crate::film::Pixel;
use bytemuck::{Pod, Zeroable};
use libm::{cbrt, fabs, hypot, sqrt};

/// Divisor of the filtered picture that bounds R in denominators from below. R comes from the part of the
/// audit that is not in the numerator, so that chance brightness of a pixel does not reduce its error. Where
/// light is rare this part may lack it, hence the bound. The relative error of a wrongly bright pixel is then
/// at most this number.
const FILTERED_DIVISOR: f64 = 4.0;

/// 95 % quantile of the normal distribution.
const NORMAL_95_ONE_SIDED: f64 = 1.644_853_626_951_472_7;

/// Result of an audited pixel.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PixelBias {
    /// Estimate of the squared bias over R² + 0.01 m², averaged over channels; may be negative.
    pub bias: f64,
    /// Excess brightness over the root of R² + 0.01 m².
    pub deviation: f64,
    /// Variances of the pixel in the picture and in the audit, over R² + 0.01 m².
    pub variances: [f64; 2],
}

impl PixelBias {
    /// Bias of a pixel of the `picture`, its `truth` by the audit, and its `filtered` value, in a picture
    /// of mean `mean`. `None` if the picture has no two samples, or the audit no four.
    pub fn of(picture: &Pixel, truth: &Pixel, filtered: Rgb, mean: f64) -> Option<Self> {
        if picture.even.count() == 0 || picture.odd.count() == 0 {
            return None;
        }
        Self::of_halves([picture.even.mean(), picture.odd.mean(), picture.mean()], truth, filtered, mean)
    }

    /// The same of a pixel with these halves and their mean.
    pub fn of_halves(picture: [Rgb; 3], truth: &Pixel, filtered: Rgb, mean: f64) -> Option<Self> {
        let [a, b, both] = picture;
        let ([u1, u2], [v1, v2]) = (truth.even.parts()?, truth.odd.parts()?);
        let scaled = |colour: Rgb| colour.to_array().map(|value| f64::from(value) / mean);
        let [a, b, both, filtered] = [a, b, both, filtered].map(scaled);
        let [u1, u2, v1, v2] = [u1, u2, v1, v2].map(scaled);
        let (mut bias, mut deviation, mut variances) = (0.0, 0.0, [0.0; 2]);
        for c in 0..3 {
            let weight = |truth: f64| {
                let r = truth.max(filtered[c] / FILTERED_DIVISOR);
                1.0 / (r * r + RELMSE_OFFSET)
            };
            // R of the other half: halves are independent, quarters of one half are not, since light met by
            // one quarter is not met again by the other. With few samples a deviation over the other quarter
            // would be negative in the mean.
            let halves = [0.5 * (u1[c] + u2[c]), 0.5 * (v1[c] + v2[c])];
            for (half, other) in [(halves[0], halves[1]), (halves[1], halves[0])] {
                deviation += 0.5 * (both[c] - half) * sqrt(weight(other));
            }
            // Numerator and denominator from different parts of the audit, in both ways.
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

/// Squared bias of a picture in units of relMSE, beside its noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasEstimate {
    /// Estimate; may be negative if there is no bias above the noise.
    pub relmse: f64,
    /// Lower end of the 95 % interval, at least 0.
    pub lower: f64,
    /// Upper end of the 95 % interval, at least 0.
    pub upper: f64,
    /// Smallest estimate that is significant at a level of 2.5 %.
    pub detectable: f64,
    /// Standard error of the estimate.
    pub error: f64,
}

impl BiasEstimate {
    /// Estimate from the findings of all strata, one per stratum, in an order in which neighbours are
    /// similar. Each comes with its share of the picture over the mean share. `None` for fewer than eight.
    ///
    /// Differences of neighbours count as chance. This overestimates the variance if strata differ, so that
    /// the interval is rather too wide than too narrow.
    #[doc(hidden)]
    pub fn of(findings: impl Iterator<Item = (PixelBias, f64)>) -> Option<Self> {
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
        // Circular: each finding is part of two differences.
        differences += (first - last) * (first - last);
        let mean = sum / count;
        let second = squares - sum * mean;
        let third = cubes - mean * (3.0 * squares - 2.0 * sum * mean);
        let variance = differences / (2.0 * count * count);
        Some(Self::from_moments(mean, variance, third / (second * sqrt(second)), 0.0))
    }

    /// Estimate with known variance and skewness of its noise; `unsure` is its remaining relative
    /// uncertainty.
    ///
    /// The noise is a sum of products that are as often negative as positive. Divided by the root of their
    /// sum of squares, such a sum has lighter tails than the normal distribution, for products of any tails
    /// (Efron 1969). Student's t would apply to less certain squares. If few products dominate, they tend to
    /// be positive.
    pub(super) fn from_moments(relmse: f64, variance: f64, skewness: f64, unsure: f64) -> Self {
        let error = sqrt(variance).max(ROUNDING * ROUNDING / Z);
        let detectable = error * studentised(skewness);
        let [below, above] = [detectable / Z, error].map(|error| hypot(error, unsure * relmse / Z));
        Self {
            relmse,
            lower: confidence_interval(relmse, below)[0],
            upper: confidence_interval(relmse, above)[1],
            detectable,
            error,
        }
    }

    /// Lower end that holds for repeated tests: about four standard errors below the estimate.
    pub fn least(&self) -> f64 {
        (self.relmse - 2.0 * (self.upper - self.relmse)).max(0.0)
    }

    /// True if the bias is significant at a level of 2.5 %.
    pub fn is_significant(&self) -> bool {
        self.relmse > self.detectable
    }
}

/// 95 % interval of a non-negative quantity from a normal estimate with standard error `error`, in the order
/// of likelihood ratios (Feldman & Cousins 1998): not empty for an estimate below 0, and wrong in 5 % for any
/// true value, including 0. This is an approximation: the lower end between the one-sided and twice the
/// two-sided quantile, and the upper end below 0, are within 0.1 standard errors of theirs, the coverage
/// within 1 % of 95 %.
fn confidence_interval(estimate: f64, error: f64) -> [f64; 2] {
    let x = estimate / error;
    let lower = (Z * (x - NORMAL_95_ONE_SIDED) / (2.0 * Z - NORMAL_95_ONE_SIDED)).max(x - Z).max(0.0);
    // x + hypot(x, Z), without cancellation.
    let upper = if x > 0.0 { x + Z } else { Z * Z / (hypot(x, Z) - x) };
    [lower * error, upper * error]
}

/// 97.5 % quantile of the error of an estimated mean, in standard errors (Hall 1992, On the removal of
/// skewness by transformation). High outliers enlarge both the mean and its standard error, so that the
/// quantile falls with skewness. `skewness` is the sum of third moments over the
/// sum of second moments to the power 3/2, from −1 to 1.
fn studentised(skewness: f64) -> f64 {
    // For equal findings the skewness is mere rounding.
    let skewness = skewness.clamp(-1.0, 1.0);
    if fabs(skewness) >= 1e-4 {
        3.0 / skewness * (cbrt(1.0 + skewness * (Z - skewness / 6.0)) - 1.0)
    } else {
        Z
    }
}

impl ErrorEstimate {
    /// Estimate of noise and bias together: both add, and so do their squared uncertainties. A squared bias b
    /// with standard error σ counts as b − 2 σ² / b, and as 0 for b below √2 σ: one audited pixel with a
    /// firefly suffices for a b of many times the error, with a σ nearly as large. The lower end includes
    /// only the bias that is certain by four standard errors: if the audit is much noisier than the picture,
    /// a bias found by chance, in 2.5 % of pictures, is many times the error.
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
