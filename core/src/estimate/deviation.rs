//! Mean brightness deviation of a part of a picture, from a few of its pixels.

use super::metric::ROUNDING;
use libm::{erfc, fabs, log, sqrt};

/// Mean excess brightness of a part of a picture, relative to the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Estimate; negative if too dark.
    pub mean: f64,
    /// Standard error of the estimate.
    pub error: f64,
    /// Number of pixels.
    pub pixels: u32,
}

impl Deviation {
    /// Deviation from the values of some pixels.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        // Welford 1962.
        let (mut pixels, mut mean, mut squares) = (0, 0.0, 0.0);
        for value in values {
            pixels += 1;
            let before = value - mean;
            mean += before / f64::from(pixels);
            squares += before * (value - mean);
        }
        let n = f64::from(pixels);
        let error =
            if pixels > 1 { sqrt(squares / (n * (n - 1.0)) + ROUNDING * ROUNDING) } else { f64::INFINITY };
        Self { mean, error, pixels }
    }

    /// Probability of at least this deviation by chance: both tails of Student's t after Wallace (1959), with
    /// a relative error of a few hundredths from three degrees of freedom on.
    pub fn chance(&self) -> f64 {
        if self.pixels < 4 || !self.error.is_finite() {
            return 1.0;
        }
        let freedom = f64::from(self.pixels - 1);
        let t = fabs(self.mean) / self.error;
        let z = (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * sqrt(freedom * log(1.0 + t * t / freedom));
        erfc(z * core::f64::consts::FRAC_1_SQRT_2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pixel_and_roundings_say_nothing() {
        assert_eq!(Deviation::of([1.0].into_iter()).chance(), 1.0);
        // Two pictures of the same lamp, summed in different orders.
        let same = [1e-7, -1e-7, 1e-7, 1e-7].into_iter();
        assert!(Deviation::of(same).chance() > 0.5);
    }

    #[test]
    fn chances_are_those_of_the_tables() {
        for (freedom, t, chance) in [(4, 2.776, 0.05), (15, 4.073, 0.001), (60, 2.0, 0.05)] {
            let found = Deviation { mean: t, error: 1.0, pixels: freedom + 1 }.chance();
            assert!((found / chance - 1.0).abs() < 0.06, "{found} {chance}");
        }
    }
}
