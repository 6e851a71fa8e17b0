//! Fits of all blocks of one scale, and the picture that they give.

use super::fit::{Block, Fit, View, divisor};
use super::passes::for_both;
use super::surfaces::PixelSurfaces;
use super::window::{MOST_TERMS, Window, blocks, polynomial, terms};
use super::{Both, VALUES};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::Executor;

/// Least sum of fractions of the clusters of a mixed pixel that are fitted.
const LEAST_FRACTIONS: f32 = 0.98;

/// Values of a fit in memory: coefficients, range of light and mean albedo.
const fn stride(degree: usize) -> usize {
    terms(degree) * VALUES + 2 * VALUES + 3
}

/// Blocks of a scale, row by row.
pub(super) struct Scale<'m> {
    window: Window,
    across: usize,
    slots: usize,
    clusters: &'m mut [u32],
    values: &'m mut [f32],
}

/// Side of the blocks, degree of the polynomials, clusters of a block at most.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub side: usize,
    pub degree: usize,
    pub slots: usize,
}

impl<'m> Scale<'m> {
    pub(super) fn footprint([width, height]: [usize; 2], shape: Shape) -> Footprint {
        let slots = blocks(width, shape.side) * blocks(height, shape.side) * shape.slots;
        Footprint::default().slice::<u32>(slots).slice::<f32>(slots * stride(shape.degree))
    }

    pub(super) fn new(
        [width, height]: [usize; 2],
        shape: Shape,
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let across = blocks(width, shape.side);
        let slots = across * blocks(height, shape.side) * shape.slots;
        Ok(Self {
            window: Window::new(shape.side, shape.degree),
            across,
            slots: shape.slots,
            clusters: arena.slice(slots)?,
            values: arena.slice(slots * stride(shape.degree))?,
        })
    }

    /// Fits all blocks, a task for each row of them.
    pub(super) fn fit(&mut self, view: View, executor: &mut impl Executor) {
        let Self { window, across, slots, clusters, values } = self;
        let (across, slots, stride) = (*across, *slots, stride(window.degree));
        let window = &*window;
        let row = across * slots;
        for_both(executor, (clusters, row), (values, row * stride), |y, clusters, values| {
            for (x, clusters) in clusters.chunks_mut(slots).enumerate() {
                let values = &mut values[x * slots * stride..][..slots * stride];
                Block { window, block: [x, y] }.fit(&view, clusters, |slot, fit| {
                    write(&fit, &mut values[slot * stride..][..stride]);
                });
            }
        });
    }

    /// Light of the pixel in column `x` and row `y` by the fits of its clusters, a mixed pixel by their
    /// fractions; `None` where a cluster has no fit.
    pub(super) fn light(&self, surfaces: &PixelSurfaces, [x, y]: [usize; 2]) -> Option<Both> {
        if surfaces.is_whole() {
            return self.of_cluster(surfaces.clusters[0], Some(surfaces.albedo), [x, y]);
        }
        let (mut sum, mut fractions) = ([0.0; VALUES], 0.0);
        for (cluster, fraction) in surfaces.parts() {
            let light = self.of_cluster(cluster, None, [x, y])?;
            fractions += fraction;
            (0..VALUES).for_each(|c| sum[c] += fraction * light[c]);
        }
        (fractions > LEAST_FRACTIONS).then(|| sum.map(|sum| sum / fractions))
    }

    /// Light of a cluster, by `albedo` or the mean albedo of the fits.
    fn of_cluster(&self, cluster: u32, albedo: Option<[f32; 3]>, [x, y]: [usize; 2]) -> Option<Both> {
        let (step, stride) = (self.window.step(), stride(self.window.degree));
        let (mut sum, mut total) = ([0.0; VALUES], 0.0);
        let places = [x, y].map(|at| [(at / step, at % step + step), (at / step + 1, at % step)]);
        for (row, v) in places[1] {
            for (column, u) in places[0] {
                let first = (row * self.across + column) * self.slots;
                let clusters = &self.clusters[first..first + self.slots];
                let Some(slot) = clusters.iter().position(|c| *c == cluster) else { continue };
                let fit = &self.values[(first + slot) * stride..][..stride];
                let weight = self.window.weights[u] * self.window.weights[v];
                let at = [self.window.coordinates[u], self.window.coordinates[v]];
                let light = match self.window.degree {
                    0 => read::<1>(fit, at, albedo),
                    1 => read::<3>(fit, at, albedo),
                    _ => read::<6>(fit, at, albedo),
                };
                total += weight;
                (0..VALUES).for_each(|c| sum[c] += weight * light[c]);
            }
        }
        (total > 1e-6).then(|| sum.map(|sum| sum / total))
    }
}

fn write(fit: &Fit, out: &mut [f32]) {
    let terms = (out.len() - 3) / VALUES - 2;
    let values = fit.coefficients[..terms].iter().chain(&fit.range);
    for (out, values) in out.chunks_exact_mut(VALUES).zip(values) {
        out.copy_from_slice(values);
    }
    out[(terms + 2) * VALUES..].copy_from_slice(&fit.albedo);
}

fn read<const TERMS: usize>(fit: &[f32], [x, y]: [f32; 2], albedo: Option<[f32; 3]>) -> Both {
    let terms: [f32; MOST_TERMS] = polynomial(x, y);
    let mut light = [0.0; VALUES];
    for (coefficients, term) in fit.chunks_exact(VALUES).zip(&terms[..TERMS]) {
        (0..VALUES).for_each(|c| light[c] += term * coefficients[c]);
    }
    let (range, mean) = fit[TERMS * VALUES..].split_at(2 * VALUES);
    let mean = [mean[0], mean[1], mean[2]];
    if mean != [0.0; 3] {
        let by = divisor(albedo.unwrap_or(mean));
        (0..VALUES).for_each(|c| light[c] *= by[c % 3]);
    }
    // A polynomial beyond its pixels may leave the range of their light.
    (0..VALUES).for_each(|c| light[c] = light[c].max(range[c]).min(range[VALUES + c]));
    light
}
