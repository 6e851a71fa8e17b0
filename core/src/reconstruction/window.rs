//! Blocks of one scale: squares that overlap by half a side, their windows and polynomials.
//!
//! The window is sin²(π (x + ½) / side) along each axis: those of overlapping blocks sum to one. Coordinates
//! run from −1 to 1.

use core::f32::consts::PI;

/// Side of the largest blocks in pixels.
pub(super) const MOST: usize = 48;

/// Terms of the largest polynomial: 1, x, y, x², xy, y².
pub(super) const MOST_TERMS: usize = 6;

/// Powers of a coordinate in the moments of a polynomial of the second degree: 0 to 4.
pub(super) const POWERS: usize = 5;

/// Powers of x and y of each term.
pub(super) const EXPONENTS: [(usize, usize); MOST_TERMS] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];

/// Window of a scale along one axis.
#[derive(Debug)]
pub(super) struct Window {
    /// Side of a block in pixels, even.
    pub side: usize,
    /// Degree of the polynomial, 0 to 2.
    pub degree: usize,
    /// Window.
    pub weights: [f32; MOST],
    /// Coordinates.
    pub coordinates: [f32; MOST],
    /// Sums of the window times powers of the coordinate over the positions before each one.
    pub moments: [[f64; POWERS]; MOST + 1],
    /// Sums of the squared window over the positions before each one.
    pub squares: [f64; MOST + 1],
}

impl Window {
    /// Window of `side` pixels, even and at most [`MOST`].
    pub(super) fn new(side: usize, degree: usize) -> Self {
        let (mut weights, mut coordinates) = ([0.0; MOST], [0.0; MOST]);
        let (mut moments, mut squares) = ([[0.0; POWERS]; MOST + 1], [0.0; MOST + 1]);
        for i in 0..side {
            let sine = libm::sinf(PI * (i as f32 + 0.5) / side as f32);
            weights[i] = sine * sine;
            coordinates[i] = (2 * i + 1) as f32 / side as f32 - 1.0;
            let (weight, x) = (f64::from(weights[i]), f64::from(coordinates[i]));
            let mut power = weight;
            moments[i + 1] = moments[i].map(|sum| {
                let next = sum + power;
                power *= x;
                next
            });
            squares[i + 1] = squares[i] + weight * weight;
        }
        Self { side, degree, weights, coordinates, moments, squares }
    }

    /// Distance of neighbouring blocks.
    pub(super) const fn step(&self) -> usize {
        self.side / 2
    }

    /// Sum of the window over a block.
    pub(super) fn total(&self) -> f64 {
        self.moments[self.side][0] * self.moments[self.side][0]
    }
}

/// Terms of a polynomial of this degree.
pub(super) const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Blocks of side `side` along an axis of `size` pixels. Block i begins at (i − 1) side / 2.
pub(super) const fn blocks(size: usize, side: usize) -> usize {
    size.div_ceil(side / 2) + 1
}

/// Terms at a point.
pub(super) fn polynomial(x: f32, y: f32) -> [f32; MOST_TERMS] {
    [1.0, x, y, x * x, x * y, y * y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overlapping_windows_sum_to_one() {
        for side in [6, 12, 24, 48] {
            let window = Window::new(side, 2);
            for i in 0..side / 2 {
                assert!((window.weights[i] + window.weights[i + side / 2] - 1.0).abs() < 1e-6);
            }
        }
    }
}
