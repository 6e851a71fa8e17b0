//! The error of a picture from itself: its two halves are independent pictures, and what they disagree by
//! tells how far their mean is from the truth.

use halflight_core::Rgb;
use halflight_core::film::Film;

/// An estimate of the relMSE with the interval that holds it with 95 % confidence, as far as one picture can
/// tell: what no sample has met is not in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Estimated relMSE.
    pub relmse: f64,
    /// Lower end of the interval.
    pub lower: f64,
    /// Upper end of the interval.
    pub upper: f64,
}

/// Standard deviations on both sides of a normal mean that hold 95 %.
const NORMAL_95: f64 = 1.96;

/// relMSE divides by R² + this times the squared mean of the picture.
const FLOOR: f64 = 0.01;

impl ErrorEstimate {
    /// Estimates the error of `film`; `None` where a half is empty or the picture is black.
    ///
    /// With independent halves A and B of n_A and n_B samples and variance σ² of one sample, (A − B)² has the
    /// expectation σ² (1/n_A + 1/n_B), and their common mean the variance σ² / (n_A + n_B). Samples of one
    /// pixel are stratified over both halves, so the true error is smaller rather than larger.
    pub fn of(film: &Film) -> Option<ErrorEstimate> {
        let filled = || film.pixels().iter().filter(|pixel| pixel.count() > 0);
        let count = filled().count() as f64;
        let mean = filled().map(|pixel| f64::from(pixel.mean().element_sum())).sum::<f64>() / (3.0 * count);
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }
        let floor = FLOOR * mean * mean;
        let (mut sum, mut squares) = (0.0, 0.0);
        for pixel in filled() {
            let (even, odd) = (f64::from(pixel.even.count()), f64::from(pixel.odd.count()));
            if even == 0.0 || odd == 0.0 {
                return None;
            }
            let difference: Rgb = pixel.even.mean() - pixel.odd.mean();
            // (1/(n_A + n_B)) / (1/n_A + 1/n_B)
            let share = even * odd / ((even + odd) * (even + odd));
            let picture = pixel.mean().to_array();
            let channels = difference.to_array().into_iter().zip(picture).map(|(d, i)| {
                let (d, i) = (f64::from(d), f64::from(i));
                share * d * d / (i * i + floor)
            });
            let error = channels.sum::<f64>() / 3.0;
            sum += error;
            squares += error * error;
        }
        let relmse = sum / count;
        let variance = (squares / count - relmse * relmse).max(0.0) / (count - 1.0).max(1.0);
        let reach = NORMAL_95 * variance.sqrt();
        Some(ErrorEstimate { relmse, lower: (relmse - reach).max(0.0), upper: relmse + reach })
    }
}
