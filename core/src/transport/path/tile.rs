//! The samples of a tile: in which order they are taken, how their paths begin, and what becomes of their light.
//!
//! Layer after layer, one sample of each pixel. Where pixels share their paths, those of a
//! circle stay together; else all go along the Z-curve, so that neighbours ask caches together.

use crate::Rgb;
use crate::bsdf::Features;
use crate::film::{CIRCLE, CIRCLES, PIXELS_PER_TILE, Pixel, PixelSet, Tile};
use crate::geometry::{MISS, Ray};
use crate::memory::{Arena, OutOfMemory};
use crate::sampling::Sampler;
use crate::transport::estimator::{Counters, PathSettings};
use crate::transport::path::reuse::ReuseState;
use crate::transport::path::silhouette::outlined;
use crate::transport::path::state::{Components, PathState, Wavefront};
use crate::transport::path::{LIGHT_SAMPLES, PathIntegrator};
use core::ops::Range;

/// All samples of a tile that are still to be taken.
pub(in crate::transport) struct TileSampler {
    tile: Tile,
    left: Range<u32>,
    /// The next circle of the layer; where nothing is shared, the next pixel.
    next: usize,
    /// Pixels whose paths leave the lamp that they see to others.
    outlined: PixelSet,
}

impl TileSampler {
    pub(in crate::transport) fn new(tile: Tile, samples: Range<u32>) -> Self {
        Self { tile, left: samples, next: 0, outlined: PixelSet::default() }
    }

    /// The next of the `count` parts of a layer, and which of their samples.
    fn next_of(&mut self, count: usize) -> Option<(usize, u32)> {
        if self.next == count {
            (self.next, self.left.start) = (0, self.left.start.saturating_add(1));
        }
        if self.left.is_empty() {
            return None;
        }
        self.next += 1;
        Some((self.next - 1, self.left.start))
    }
}

impl<F: Features> PathIntegrator<'_, F> {
    /// Traces `samples` of tile `task` and adds them to `out`, the tile's pixels of the film.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PathIntegrator::scratch`] bytes.
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
        // No larger than there are paths: the memory of a wave is cleared.
        let most = samples.len().saturating_mul(PIXELS_PER_TILE);
        let mut places = TileSampler::new(tile, samples);
        places.outlined = outlined(self.context.scene, self.context.lights, &self.settings, tile);
        let mut wave = Wavefront::new(wave.min(most), &mut arena)?;
        let has_outlines = !places.outlined.is_empty();
        loop {
            let count = self.start(&mut places, &mut wave);
            if count == 0 {
                return Ok(counters);
            }
            counters.paths += count as u64;
            self.advance(&mut wave, count, &mut counters);
            if self.settings.reuse {
                self.share(&mut wave, count, &mut counters);
            }
            if has_outlines {
                let outlined = |place| places.outlined.contains(place as usize);
                self.look_at_lamps(outlined, &mut wave, count, &mut counters);
            }
            for (i, (path, exchange)) in wave.paths.iter().zip(&*wave.exchanges).take(count).enumerate() {
                let lamps = if has_outlines { Rgb::from(wave.shadow_light[i]) } else { Rgb::ZERO };
                let seen = exchange.seen(path) + lamps;
                let Some(pixel) = out.get_mut(path.place as usize) else { continue };
                if pixel.add(path.sample, seen, &mut counters.dropped) {
                    pixel.add_blur(path.sample, Rgb::from(path.blur));
                }
            }
        }
    }

    /// Fills the wave with camera rays; returns how many. Circles stay together.
    pub(in crate::transport) fn start(&self, places: &mut TileSampler, wave: &mut Wavefront) -> usize {
        let mut count = 0;
        if self.settings.reuse {
            while count + CIRCLE <= wave.paths.len()
                && let Some((circle, sample)) = places.next_of(CIRCLES)
            {
                // Another number for each circle that a wave can hold.
                let exchange = ReuseState::new(sample.wrapping_mul(CIRCLES as u32) + circle as u32);
                for place in places.tile.circle(circle, self.settings.seed, sample) {
                    self.begin(places, place, sample, exchange, wave, &mut count);
                }
            }
            return count;
        }
        while count < wave.paths.len()
            && let Some((place, sample)) = places.next_of(PIXELS_PER_TILE)
        {
            self.begin(places, place, sample, ReuseState::new(0), wave, &mut count);
        }
        count
    }

    /// Puts a path into the wave, where there is such a pixel.
    #[inline]
    fn begin(
        &self,
        places: &TileSampler,
        place: usize,
        sample: u32,
        exchange: ReuseState,
        wave: &mut Wavefront,
        count: &mut usize,
    ) {
        let PathSettings { width, seed, .. } = self.settings;
        let Some((x, y)) = places.tile.pixel(place) else { return };
        let index = y * width + x;
        let ray = self.camera_ray([x, y], &Sampler::new(seed, index, sample));
        wave.rays[*count] = Ray { tag: *count as u32, ..ray };
        wave.paths[*count] = PathState {
            throughput: [1.0; 3],
            pdf: f32::INFINITY,
            pixel: index,
            place: place as u32,
            sample,
            segments: 1,
            share: if places.outlined.contains(place) { Components::BESIDE_LAMP } else { Components::ALL },
            triangle: MISS,
            eta_squared: 1.0,
            lights: if self.context.has_cutouts { 1 } else { LIGHT_SAMPLES as u16 },
            ..PathState::default()
        };
        wave.exchanges[*count] = exchange;
        *count += 1;
    }
}
