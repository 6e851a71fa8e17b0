//! Samples of a tile: their order, the start of their paths, and the sum of their light.
//!
//! Samples are taken in layers, one per pixel. With path reuse the pixels of a circle stay together;
//! otherwise pixels follow the Z-curve, so that neighbours look up a cache together.

use super::PathIntegrator;
use super::estimator::LightEstimator;
use super::sharing::PathWave;
use super::sharing::Sharing;
use super::silhouette::silhouette_pixels;
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::{CIRCLE, CIRCLES, PIXELS_PER_TILE, Pixel, PixelSet, Tile};
use crate::geometry::Ray;
use crate::memory::{Arena, OutOfMemory};
use crate::sampling::Sampler;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::PathState;
use core::ops::Range;

/// Remaining samples of a tile.
pub(in crate::transport) struct TileSampler {
    tile: Tile,
    remaining: Range<u32>,
    /// Next circle of the layer, or next pixel without path reuse.
    next: usize,
    /// Pixels whose camera paths leave direct emission to extra rays.
    silhouette_pixels: PixelSet,
}

impl TileSampler {
    pub(in crate::transport) fn new(tile: Tile, samples: Range<u32>) -> Self {
        Self { tile, remaining: samples, next: 0, silhouette_pixels: PixelSet::default() }
    }

    /// Next of the `count` parts of a layer, and its sample number.
    fn next_of(&mut self, count: usize) -> Option<(usize, u32)> {
        if self.next == count {
            (self.next, self.remaining.start) = (0, self.remaining.start.saturating_add(1));
        }
        if self.remaining.is_empty() {
            return None;
        }
        self.next += 1;
        Some((self.next - 1, self.remaining.start))
    }
}

impl<F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'_, F, E, R> {
    /// Traces `samples` of tile `task` and adds them to `out`, the tile's pixels of the film.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::scratch_with`] bytes.
    pub fn run(
        &self,
        task: usize,
        samples: Range<u32>,
        wave: usize,
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let tile = Tile::new(self.settings.width, self.settings.height, task);
        let mut counters = Counters::default();
        // At most the number of paths, since the memory of a wave is cleared.
        let most = samples.len().saturating_mul(PIXELS_PER_TILE);
        let mut sampler = TileSampler::new(tile, samples);
        sampler.silhouette_pixels =
            silhouette_pixels(self.context.scene, self.context.lights, &self.settings, tile);
        let mut wave = PathWave::<E::State, R>::new(wave.min(most), &mut arena)?;
        let has_silhouette = !sampler.silhouette_pixels.is_empty();
        loop {
            let count = self.start(&mut sampler, &mut wave);
            if count == 0 {
                return Ok(counters);
            }
            counters.paths += count as u64;
            self.advance(&mut wave, count, &mut counters);
            self.sharing.distribute((&self.context, self.is_limited()), &mut wave, count, &mut counters);
            if has_silhouette {
                let on_silhouette = |place| sampler.silhouette_pixels.contains(place as usize);
                self.trace_silhouettes(on_silhouette, &mut wave.wave, count, &mut counters);
            }
            for i in 0..count {
                let path = wave.wave.paths[i];
                let emission = if has_silhouette { Rgb::from(wave.wave.shadow_light[i]) } else { Rgb::ZERO };
                let radiance = wave.radiance(i) + emission + self.estimator.splat(path.place);
                let Some(pixel) = out.get_mut(path.place as usize) else { continue };
                if pixel.add(path.sample, radiance, &mut counters.dropped) {
                    pixel.add_blur(path.sample, Rgb::from(path.blur));
                }
            }
        }
    }

    /// Fills the wave with camera rays and returns their number. With path reuse no circle is cut.
    pub(in crate::transport) fn start(
        &self,
        sampler: &mut TileSampler,
        wave: &mut PathWave<E::State, R>,
    ) -> usize {
        let mut count = 0;
        let capacity = wave.wave.paths.len();
        if R::IN_CIRCLES {
            while count + CIRCLE <= capacity
                && let Some((circle, sample)) = sampler.next_of(CIRCLES)
            {
                // Distinct for all circles in a wave.
                let number = sample.wrapping_mul(CIRCLES as u32) + circle as u32;
                for place in sampler.tile.circle(circle, self.settings.seed, sample) {
                    self.begin(sampler, (place, sample), number, wave, &mut count);
                }
            }
            return count;
        }
        while count < capacity
            && let Some((place, sample)) = sampler.next_of(PIXELS_PER_TILE)
        {
            self.begin(sampler, (place, sample), 0, wave, &mut count);
        }
        count
    }

    /// Puts a path into the wave, if the tile has a pixel at `place`.
    #[inline]
    fn begin(
        &self,
        sampler: &TileSampler,
        (place, sample): (usize, u32),
        circle: u32,
        wave: &mut PathWave<E::State, R>,
        count: &mut usize,
    ) {
        let Some((x, y)) = sampler.tile.pixel(place) else { return };
        self.begin_path(
            wave,
            *count,
            ([x, y], place as u32, sample),
            sampler.silhouette_pixels.contains(place),
            circle,
        );
        *count += 1;
    }

    /// Starts path `index` of the wave: a sample of the pixel in column `x` and row `y`, stored at `place`.
    #[inline]
    pub(super) fn begin_path(
        &self,
        wave: &mut PathWave<E::State, R>,
        index: usize,
        ([x, y], place, sample): ([u32; 2], u32, u32),
        is_on_silhouette: bool,
        circle: u32,
    ) {
        let PathSettings { width, seed, .. } = self.settings;
        let pixel = y * width + x;
        let ray = self.camera_ray([x, y], &Sampler::new(seed, pixel, sample));
        let components = if is_on_silhouette { PathClasses::WITHOUT_EMISSION } else { PathClasses::ALL };
        wave.wave.rays[index] = Ray { tag: index as u32, ..ray };
        wave.wave.paths[index] = PathState::new(pixel, place, sample, components);
        wave.begin(index, circle);
    }
}
