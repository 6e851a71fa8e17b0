//! Sums of the contributions of edges to the derivatives of irradiance, each times the jump of radiance
//! across the edge. Every level keeps sixteen sums and reduces them in one order, which gives the same bits
//! everywhere.

use super::edge::Flux;
use crate::lanes::Lanes;

/// Weights of red, green and blue in the luminance of linear sRGB (BT.709).
pub const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Derivatives of the irradiance of an environment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// ∂/∂x and ∂/∂y of each channel.
    pub gradient: [[f32; 2]; 3],
    /// n × ∂/∂n of each channel, x and y.
    pub rotation: [[f32; 2]; 3],
    /// ∂²/∂x², ∂²/∂x∂y, ∂²/∂y² of the luminance.
    pub hessian: [f32; 3],
}

impl Sums {
    /// Adds an edge whose left side is brighter by `jump`. Scalar reference of [`Lanes16::add`].
    pub fn add(&mut self, jump: [f32; 3], flux: &Flux<f32>) {
        for ((gradient, rotation), jump) in self.gradient.iter_mut().zip(&mut self.rotation).zip(jump) {
            *gradient = [gradient[0] + jump * flux.gradient[0], gradient[1] + jump * flux.gradient[1]];
            *rotation = [rotation[0] + jump * flux.rotation[0], rotation[1] + jump * flux.rotation[1]];
        }
        let jump = LUMINANCE[0] * jump[0] + LUMINANCE[1] * jump[1] + LUMINANCE[2] * jump[2];
        for (sum, flux) in self.hessian.iter_mut().zip(flux.hessian) {
            *sum += jump * flux;
        }
    }
}

/// Sixteen [`Sums`].
#[derive(Clone, Copy)]
pub struct Lanes16<L> {
    gradient: [[L; 2]; 3],
    rotation: [[L; 2]; 3],
    hessian: [L; 3],
}

impl<L: Lanes<Array = [f32; 16]>> Lanes16<L> {
    /// Empty sums.
    #[inline(always)]
    pub fn new(zero: L) -> Self {
        Self { gradient: [[zero; 2]; 3], rotation: [[zero; 2]; 3], hessian: [zero; 3] }
    }

    /// Adds an edge in each lane, whose left side is brighter by `jump`.
    #[inline(always)]
    pub fn add(&mut self, all: impl Fn(f32) -> L, jump: [L; 3], flux: &Flux<L>) {
        for ((gradient, rotation), jump) in self.gradient.iter_mut().zip(&mut self.rotation).zip(jump) {
            *gradient = [gradient[0] + jump * flux.gradient[0], gradient[1] + jump * flux.gradient[1]];
            *rotation = [rotation[0] + jump * flux.rotation[0], rotation[1] + jump * flux.rotation[1]];
        }
        let [r, g, b] = LUMINANCE;
        let jump = all(r) * jump[0] + all(g) * jump[1] + all(b) * jump[2];
        for (sum, flux) in self.hessian.iter_mut().zip(flux.hessian) {
            *sum = *sum + jump * flux;
        }
    }

    /// Sums over all lanes.
    #[inline(always)]
    pub fn total(&self) -> Sums {
        let [r, g, b] = self.gradient;
        let [s, h, c] = self.rotation;
        Sums {
            gradient: [[total(r[0]), total(r[1])], [total(g[0]), total(g[1])], [total(b[0]), total(b[1])]],
            rotation: [[total(s[0]), total(s[1])], [total(h[0]), total(h[1])], [total(c[0]), total(c[1])]],
            hessian: [total(self.hessian[0]), total(self.hessian[1]), total(self.hessian[2])],
        }
    }
}

/// Sum of sixteen lanes by repeated halving. Loops over the halves are compiled to additions in memory.
#[inline(always)]
pub(super) fn total<L: Lanes<Array = [f32; 16]>>(lanes: L) -> f32 {
    let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = lanes.to_array();
    let four = [(a + i) + (e + m), (b + j) + (f + n), (c + k) + (g + o), (d + l) + (h + p)];
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Largest number of strata along a side.
pub const SIDE_MAX: usize = 128;

/// One value per stratum of a row, the first at index 1, with room to read sixteen from any index.
pub(super) type Row = [f32; SIDE_MAX + 32];

/// Sixteen values of a row from `start` on.
#[inline(always)]
pub(super) fn sixteen(row: &Row, start: usize) -> &[f32; 16] {
    row.get(start..).and_then(|rest| rest.first_chunk()).unwrap_or(&[0.0; 16])
}

#[cfg(test)]
mod tests;
