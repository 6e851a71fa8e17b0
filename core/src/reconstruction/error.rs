//! Error of a reconstructed picture from its halves, without a reference.
//!
//! F_A is made of half A alone and F_B of half B alone, both by one rule; s and t are their parts of the
//! samples. Whatever the rule and the noise, the mean of s t (F_A − F_B)² is the variance of s F_A + t F_B,
//! and that of (F_A − A)(F_B − B) is the squared bias.
//!
//! The true error minus this estimate is a sum of products of errors of A and B. Its standard error comes
//! from the squares of sums over blocks, which are large enough to be independent: of a tile for the products
//! of pixels, of three tiles for those of filtered errors, of a sixth of the picture where pixels share
//! records or photons.

use super::Both;
use super::passes::for_pieces;
use super::window::MOST;
use crate::estimate::{ErrorEstimate, NORMAL_95, student_quantile};
use crate::method::Executor;
use bytemuck::{Pod, Zeroable};

/// Side in pixels of the squares whose errors are summed.
pub(super) const SQUARE: usize = 16;

/// Least degrees of freedom of the interval: with fewer it says nothing.
const LEAST_FREEDOM: f64 = 2.0;

/// Sums over the pixels of a square: relative squared errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SquareError {
    /// Variance of the reconstructed picture.
    pub noise: f64,
    /// Its squared bias; may be negative.
    pub bias: f64,
    /// Variance of the picture that is not reconstructed.
    pub raw: f64,
}

/// Error of a reconstructed picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReconstructionError {
    /// Relative squared error and its 95 % interval.
    pub total: ErrorEstimate,
    /// Variance.
    pub noise: f64,
    /// Squared bias; may be negative.
    pub bias: f64,
    /// Variance of the picture that is not reconstructed, with the same weights.
    pub raw: f64,
}

impl ReconstructionError {
    /// Variance alone, with an interval as wide in proportion.
    pub fn variance(&self) -> ErrorEstimate {
        let by = self.noise / self.total.relmse.max(f64::MIN_POSITIVE);
        ErrorEstimate { relmse: self.noise, lower: by * self.total.lower, upper: by * self.total.upper }
    }
}

/// Sums of one pixel.
#[inline]
pub(super) fn of_pixel(filtered: &Both, raw: &Both, weights: &[f32; 3], product: f32) -> SquareError {
    let (mut noise, mut bias, mut of_raw) = (0.0, 0.0, 0.0);
    for c in 0..3 {
        let apart = filtered[c] - filtered[3 + c];
        noise += weights[c] * product * apart * apart;
        bias += weights[c] * (filtered[c] - raw[c]) * (filtered[3 + c] - raw[3 + c]);
        let apart = raw[c] - raw[3 + c];
        of_raw += weights[c] * product * apart * apart;
    }
    SquareError { noise: f64::from(noise), bias: f64::from(bias), raw: f64::from(of_raw) }
}

impl core::ops::AddAssign for SquareError {
    fn add_assign(&mut self, other: Self) {
        self.noise += other.noise;
        self.bias += other.bias;
        self.raw += other.raw;
    }
}

/// Sums over all squares of a picture, of the errors of its pixels by number.
pub(super) fn sum_squares(
    [width, height]: [usize; 2],
    squares: &mut [SquareError],
    of_pixel: impl Fn(usize) -> SquareError + Sync,
    executor: &mut impl Executor,
) {
    let across = width.div_ceil(SQUARE);
    for_pieces(executor, squares, across, |row, squares| {
        for (column, square) in squares.iter_mut().enumerate() {
            *square = SquareError::default();
            for y in row * SQUARE..((row + 1) * SQUARE).min(height) {
                let columns = column * SQUARE..((column + 1) * SQUARE).min(width);
                columns.for_each(|x| *square += of_pixel(y * width + x));
            }
        }
    });
}

/// Squares along the longer side whose errors are independent where pixels share records or photons.
const INDEPENDENT: usize = 6;

/// Error of a picture from the sums over its squares. `is_shared`: pixels nearby have errors in common.
pub(super) fn total(
    [width, height]: [usize; 2],
    squares: &[SquareError],
    is_shared: bool,
) -> ReconstructionError {
    const WIDE: usize = MOST / SQUARE;
    let across = width.div_ceil(SQUARE);
    let widest = if is_shared { width.max(height) / (INDEPENDENT * SQUARE) } else { 0 };
    let of_noise = WIDE.max(widest);
    let of_bias = if is_shared { of_noise } else { 1 };
    let (mut sum, mut moments) = (SquareError::default(), [0.0; 2]);
    squares.iter().for_each(|square| sum += *square);
    let mut add = |side: usize, of: &dyn Fn(&SquareError) -> f64| {
        for rows in squares.chunks((across * side).max(1)) {
            for column in (0..across).step_by(side) {
                let of_row = |row: &[SquareError]| row.iter().skip(column).take(side).map(of).sum::<f64>();
                let sum: f64 = rows.chunks(across).map(of_row).sum();
                let square = sum * sum;
                moments = [moments[0] + square, moments[1] + square * square];
            }
        }
    };
    add(of_bias, &|square| square.bias);
    add(of_noise, &|square| square.noise);
    let pixels = width * height;
    let values = 3.0 * pixels as f64;
    let [noise, bias, raw] = [sum.noise, sum.bias, sum.raw].map(|sum| sum / values);
    // A squared bias is not negative.
    let relmse = noise + bias.max(0.0);
    let [variance, fourths] = moments;
    let freedom = if fourths > 0.0 { (variance * variance / fourths).max(LEAST_FREEDOM) } else { 1.0 };
    let deviation = student_quantile(NORMAL_95, freedom) * libm::sqrt(variance) / values;
    let lower = relmse / (1.0 + deviation / relmse.max(f64::MIN_POSITIVE));
    ReconstructionError {
        total: ErrorEstimate { relmse, lower, upper: relmse + deviation },
        noise,
        bias,
        raw,
    }
}
