//! Film of points: sums of samples, and the intervals that follow from them alone. Pixels are points along a
//! Z-curve.

use super::layout::Layout;
use super::value::PointIrradiance;
use crate::estimate::{POOLED_POINTS, half_width, point_variances};
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::{Executor, RenderState, Shard};
use crate::reconstruction::for_pieces;
use crate::transport::IrradiancePoint;
use glam::Vec3;

/// Offset of relative errors, in means of all points.
pub(super) const OFFSET: f32 = 0.1;

/// Film of points.
pub struct PointFilm<'a> {
    /// The points in the order of the film.
    pub points: &'a [IrradiancePoint],
    /// Place in the film of each replicate of each point.
    pub places: &'a [u32],
    /// Sums of the samples.
    pub state: RenderState<'a>,
    pub(super) layout: Layout,
    /// Half-width of each pixel after the last step.
    pub(super) half_widths: &'a mut [f32],
}

impl<'a> PointFilm<'a> {
    /// Memory of the film of so many points, beside `points` and `places`.
    pub fn footprint(points: usize) -> Footprint {
        Layout::of(points).of_film()
    }

    /// Pixels of so many points: several of few points.
    pub fn pixels(points: usize) -> usize {
        Layout::of(points).pixels()
    }

    /// An empty film of so many `points`.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`PointFilm::footprint`].
    pub fn new(
        count: usize,
        (points, places): (&'a [IrradiancePoint], &'a [u32]),
        shard: Shard,
        arena: &mut Arena<'a>,
    ) -> Result<Self, OutOfMemory> {
        let layout = Layout::of(count);
        let [width, height] = layout.size();
        let state = RenderState::new(width, height, shard, arena)?;
        let half_widths = arena.slice::<f32>(layout.pixels())?;
        half_widths.fill(f32::INFINITY);
        Ok(Self { points, places, state, layout, half_widths })
    }

    /// Irradiance of each point, in the order of the points.
    pub fn values(&self) -> impl Iterator<Item = PointIrradiance> + '_ {
        let Self { layout, places, state, half_widths, .. } = self;
        let each = places.chunks(layout.replicates);
        each.map(move |places| PointIrradiance::of_replicates(places, state.film.pixels(), half_widths))
    }

    /// Mean luminance of all points with samples.
    pub fn mean(&self) -> f64 {
        let pixels = self.state.film.pixels().iter().filter(|pixel| pixel.count() > 0);
        let (sum, count) = pixels
            .fold((0.0, 0u64), |(sum, count), pixel| (sum + f64::from(luminance(pixel.mean())), count + 1));
        sum / count.max(1) as f64
    }

    /// Estimates the half-widths of all points, whose squared bias relative to the value and a tenth of the
    /// mean is known.
    pub fn estimate(&mut self, executor: &mut impl Executor, bias: f32) {
        let offset = if bias > 0.0 { OFFSET * self.mean() as f32 } else { 0.0 };
        let (points, total, pixels) = (self.points, self.layout.pixels(), self.state.film.pixels());
        let place = |i: usize| {
            let point = points.get(i).copied().unwrap_or_default();
            (Vec3::from(point.position), Vec3::from(point.normal))
        };
        for_pieces(executor, self.half_widths, POOLED_POINTS, |block, out| {
            // The last block is a whole one as well.
            let end = ((block + 1) * POOLED_POINTS).min(total);
            let start = end.saturating_sub(POOLED_POINTS);
            let mut variances = [f32::INFINITY; POOLED_POINTS];
            point_variances(&pixels[start..end], |i| place(start + i), &mut variances);
            let skipped = block * POOLED_POINTS - start;
            let of_block = variances.iter().zip(&pixels[start..end]).skip(skipped);
            for (half, (variance, pixel)) in out.iter_mut().zip(of_block) {
                let square = match bias > 0.0 {
                    true => {
                        let value = luminance(pixel.mean());
                        bias * (value * value + offset * offset)
                    }
                    false => 0.0,
                };
                *half = half_width(*variance + square);
            }
        });
    }
}
