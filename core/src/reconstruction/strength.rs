//! Strength of one step from a coarser picture to a finer one: the James-Stein weight that the other group
//! of pixels nearby gives.
//!
//! With H the coarse picture, F the fine one and δ = H − F, the squared error of F + ρ δ is a quadratic of ρ
//! whose coefficients are sums over pixels: the halves estimate both the variance and the squared bias. A
//! weight that a pixel's own noise chose would make its error look too small. The sums for pixels of one
//! group are therefore over those of the other, and whole pixels and mixed ones are apart. Where pixels
//! nearby share records or photons, the sums are over pixels further away, and those near edges are apart.

use super::passes::{for_both, for_pieces};
use super::{Both, VALUES};
use crate::method::Executor;

/// Least side of a cell in pixels.
pub(super) const CELL: usize = 4;

/// Sums of a cell for pixels of a group and kind: linear coefficient, quadratic one, square of the linear
/// one.
pub(super) type CellSums = [[f64; 3]; KINDS];

/// Two groups of whole pixels, then two of mixed pixels. Where pixels further away judge, whole pixels far
/// from edges and near them are the first two.
pub(super) const KINDS: usize = 4;

/// Strengths of a cell for pixels of each group and kind.
pub(super) type CellStrengths = [f32; KINDS];

/// Largest ratio of a weight of strengths to that of the light of the samples.
const MOST_RATIO: f32 = 4.0;

/// Least squared light.
const LEAST_LIGHT: f32 = 1e-12;

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

/// Weights of errors in the sums for strengths, of a pixel whose samples have this light. A highlight that
/// the weights do not know would rule the strengths around. Strengths may have any weights.
#[inline]
pub(super) fn limited(weights: [f32; 3], light: [f32; 3]) -> [f32; 3] {
    core::array::from_fn(|c| weights[c].min(MOST_RATIO / (light[c] * light[c] + LEAST_LIGHT)))
}

/// Cells of `side` pixels along an axis.
pub(super) const fn cells(size: usize, side: usize) -> usize {
    size.div_ceil(side)
}

/// Pixels that choose the strengths of a step for those of a cell.
#[derive(Clone, Copy)]
pub(super) struct Judges {
    /// Half widths in pixels of tents around the cell, of whole pixels and mixed ones.
    pub radii: [f32; 2],
    /// Side of a cell in pixels.
    pub cell: usize,
    /// Cells on each side whose pixels may have errors in common with those of the cell, and do not judge.
    /// `None` where the other group of pixels judges.
    pub hole: Option<usize>,
    /// Standard errors of the linear coefficient within which the finer picture wins.
    pub doubt: f64,
}

/// Strengths of all cells, by the sums over their judges. `rows` is working memory: sums over whole rows, and
/// over rows without the hole.
pub(super) fn strengths(
    [across, down]: [usize; 2],
    Judges { radii, cell, hole, doubt }: Judges,
    (sums, [rows, holed]): (&[CellSums], [&mut [CellSums]; 2]),
    strengths: &mut [CellStrengths],
    executor: &mut impl Executor,
) {
    let reach = radii.map(|radius| ((radius + 1.0) / cell as f32) as usize);
    let is_outside = |distance: usize| hole.is_none_or(|hole| distance > hole);
    let tent = |kind: usize, distance: usize| {
        let radius = f64::from(radii[kind / 2]) + 1.0;
        (1.0 - (distance * cell) as f64 / radius).max(0.0)
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
    for_both(executor, (&mut *rows, across), (&mut *holed, across), |y, rows, holed| {
        let row = &sums[y * across..][..across];
        for (x, out) in rows.iter_mut().enumerate() {
            *out = along(x, across, &|other, kind| row[other][kind]);
        }
        for (x, out) in holed.iter_mut().enumerate().filter(|_| hole.is_some()) {
            let outside = |other: usize| f64::from(u8::from(is_outside(other.abs_diff(x))));
            *out = along(x, across, &|other, kind| row[other][kind].map(|sum| sum * outside(other)));
        }
    });
    let (rows, holed) = (&*rows, &*holed);
    for_pieces(executor, strengths, across, |y, out| {
        for (x, out) in out.iter_mut().enumerate() {
            let sums = along(y, down, &|other, kind| {
                let rows = if is_outside(other.abs_diff(y)) { rows } else { holed };
                rows[other * across + x][kind]
            });
            let judge = |kind: usize| if hole.is_some() { kind } else { kind ^ 1 };
            *out = core::array::from_fn(|kind| strength(sums[judge(kind)], doubt));
        }
    });
}

/// Minimum of the squared error, with so many standard errors more as its linear coefficient.
fn strength([linear, square, variance]: [f64; 3], doubt: f64) -> f32 {
    let linear = linear + doubt * libm::sqrt(variance.max(0.0));
    if square > LEAST_SQUARE { (-linear / (2.0 * square)).clamp(0.0, 1.0) as f32 } else { 1.0 }
}

/// Strength of a pixel, bilinear between the centres of cells of side `cell`.
pub(super) fn at(
    (strengths, cell): (&[CellStrengths], usize),
    [across, down]: [usize; 2],
    [x, y]: [usize; 2],
    kind: usize,
) -> f32 {
    let split = |at: usize, size: usize| {
        let position = ((at as f32 + 0.5) / cell as f32 - 0.5).max(0.0);
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

/// Fractions of a pixel by origin: the picture before the first step, and the finer ones. The last step, of
/// fireflies, is none of them.
pub(super) fn origins<const N: usize>(
    (strengths, cell): (&[CellStrengths], usize),
    grid: [usize; 2],
    pixel: [usize; 2],
    kind: usize,
) -> [f32; N] {
    let (mut fractions, mut rest) = ([0.0; N], 1.0);
    let steps = strengths.chunks(grid[0] * grid[1]).zip(&mut fractions[1..]);
    for (strengths, fraction) in steps.rev() {
        let strength = at((strengths, cell), grid, pixel, kind);
        *fraction = rest * (1.0 - strength);
        rest *= strength;
    }
    fractions[0] = rest;
    fractions
}

/// F + ρ (H − F).
#[inline]
pub(super) fn mixed(coarse: &Both, fine: &Both, strength: f32) -> Both {
    let mut out = [0.0; VALUES];
    (0..VALUES).for_each(|c| out[c] = fine[c] + strength * (coarse[c] - fine[c]));
    out
}
