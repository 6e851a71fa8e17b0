//! Strength of one step from a coarser picture to a finer one: the James-Stein weight that the other group
//! of pixels nearby gives.
//!
//! With H the coarse picture, F the fine one and δ = H − F, the squared error of F + ρ δ is a quadratic of ρ
//! whose coefficients are sums over pixels: the halves estimate both the variance and the squared bias. A
//! weight that a pixel's own noise chose would make its error look too small. The sums for pixels of one
//! group are therefore over those of the other, and whole pixels and mixed ones are apart.

use super::passes::for_pieces;
use super::{Both, VALUES};
use crate::method::Executor;

/// Side of a cell in pixels.
pub(super) const CELL: usize = 4;

/// Sums of a cell for pixels of a group and kind: linear coefficient, quadratic one, square of the linear
/// one.
pub(super) type CellSums = [[f64; 3]; KINDS];

/// Two groups of whole pixels, then two of mixed pixels.
pub(super) const KINDS: usize = 4;

/// Strengths of a cell for pixels of each group and kind.
pub(super) type CellStrengths = [f32; KINDS];

/// Least quadratic coefficient.
const LEAST_SQUARE: f64 = 1e-12;

/// Group and kind of a pixel.
#[inline]
pub(super) fn kind(group: u8, is_whole: bool) -> usize {
    usize::from(group & 1) + if is_whole { 0 } else { 2 }
}

/// A pixel of a step: coarse picture, fine one, the one against which its bias is measured, weights.
pub(super) struct Step<'p> {
    pub coarse: &'p Both,
    pub fine: &'p Both,
    pub reference: &'p Both,
    pub weights: &'p [f32; 3],
}

impl Step<'_> {
    /// Linear and quadratic coefficient of the squared error. `product` is that of the parts of the samples.
    pub(super) fn coefficients(&self, product: f32) -> [f32; 2] {
        let Step { coarse, fine, reference, weights } = self;
        let (mut linear, mut square) = (0.0, 0.0);
        for c in 0..3 {
            let delta = [coarse[c] - fine[c], coarse[3 + c] - fine[3 + c]];
            let bias = [fine[c] - reference[c], fine[3 + c] - reference[3 + c]];
            let (apart, fine) = (delta[0] - delta[1], fine[c] - fine[3 + c]);
            linear += weights[c] * (2.0 * product * fine * apart + bias[0] * delta[1] + bias[1] * delta[0]);
            square += weights[c] * (product * apart * apart + delta[0] * delta[1]);
        }
        [linear, square]
    }
}

/// Cells along an axis.
pub(super) const fn cells(size: usize) -> usize {
    size.div_ceil(CELL)
}

/// Sums by tents of half width `radii`, in pixels, for whole pixels and mixed ones; then the strengths. The
/// coarser picture wins within `doubt` standard errors. `rows` is working memory.
pub(super) fn strengths(
    [across, down]: [usize; 2],
    (radii, doubt): ([f32; 2], f64),
    (sums, rows): (&[CellSums], &mut [CellSums]),
    strengths: &mut [CellStrengths],
    executor: &mut impl Executor,
) {
    let reach = radii.map(|radius| ((radius + 1.0) / CELL as f32) as usize);
    let tent = |kind: usize, distance: usize| {
        let radius = f64::from(radii[kind / 2]) + 1.0;
        (1.0 - (distance * CELL) as f64 / radius).max(0.0)
    };
    let along = |at: usize, size: usize, value: &dyn Fn(usize, usize) -> [f64; 3]| -> CellSums {
        core::array::from_fn(|kind| {
            let mut sum = [0.0; 3];
            let reach = reach[kind / 2];
            for other in at.saturating_sub(reach)..(at + reach + 1).min(size) {
                let weight = tent(kind, at.abs_diff(other));
                let value = value(other, kind);
                (0..3).for_each(|i| sum[i] += weight * value[i]);
            }
            sum
        })
    };
    for_pieces(executor, rows, across, |y, out| {
        let row = &sums[y * across..][..across];
        for (x, out) in out.iter_mut().enumerate() {
            *out = along(x, across, &|other, kind| row[other][kind]);
        }
    });
    let rows = &*rows;
    for_pieces(executor, strengths, across, |y, out| {
        for (x, out) in out.iter_mut().enumerate() {
            let sums = along(y, down, &|other, kind| rows[other * across + x][kind]);
            // The group of the pixels that have these strengths is the other one.
            *out = core::array::from_fn(|kind| strength(sums[kind ^ 1], doubt));
        }
    });
}

/// Minimum of the squared error, or of that less so many standard errors of its linear coefficient.
fn strength([linear, square, variance]: [f64; 3], doubt: f64) -> f32 {
    let linear = linear - doubt * libm::sqrt(variance.max(0.0));
    if square > LEAST_SQUARE { (-linear / (2.0 * square)).clamp(0.0, 1.0) as f32 } else { 1.0 }
}

/// Strength of a pixel, bilinear between the centres of cells.
pub(super) fn at(
    strengths: &[CellStrengths],
    [across, down]: [usize; 2],
    [x, y]: [usize; 2],
    kind: usize,
) -> f32 {
    let split = |at: usize, size: usize| {
        let position = ((at as f32 + 0.5) / CELL as f32 - 0.5).max(0.0);
        let first = (position as usize).min(size - 1);
        (first, (first + 1).min(size - 1), (position - first as f32).min(1.0))
    };
    let ((left, right, u), (top, bottom, v)) = (split(x, across), split(y, down));
    let row = |y: usize| {
        let [a, b] = [left, right].map(|x| strengths[y * across + x][kind]);
        a + u * (b - a)
    };
    let [a, b] = [row(top), row(bottom)];
    a + v * (b - a)
}

/// F + ρ (H − F).
#[inline]
pub(super) fn mixed(coarse: &Both, fine: &Both, strength: f32) -> Both {
    let mut out = [0.0; VALUES];
    (0..VALUES).for_each(|c| out[c] = fine[c] + strength * (coarse[c] - fine[c]));
    out
}
