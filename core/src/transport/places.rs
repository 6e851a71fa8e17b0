//! The samples of a tile: in which order they are taken, how their paths begin, and what becomes of their light.
//!
//! Layer after layer, one sample of each pixel that is to have any more. Where pixels share their paths, those of a circle
//! stay together; else all go along the Z-curve, so that neighbours ask caches together.

use super::estimator::{Counters, PathSettings};
use super::outline::outlined;
use super::path::PathTracer;
use super::reuse::Exchange;
use super::wave::{Path, Share, Wave};
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::{CIRCLE, CIRCLES, GROUP, PIXELS_PER_TILE, Pixel, PixelSet, Samples, Tile};
use crate::geometry::{MISS, Ray};
use crate::memory::{Arena, OutOfMemory};
use crate::sampling::Sampler;

/// All samples of a tile that are still to be taken.
pub(super) struct Places {
    tile: Tile,
    left: Samples,
    /// The next circle of a layer; where nothing is shared, the next pixel, and how many layers are done.
    next: usize,
    layer: u32,
    /// Pixels whose paths leave the lamp that they see to others.
    outlined: PixelSet,
}

impl Places {
    pub(super) fn new(tile: Tile, samples: Samples) -> Self {
        Self { tile, left: samples, next: 0, layer: 0, outlined: PixelSet::default() }
    }

    /// The next circle, and which sample of its pixels.
    fn next_circle(&mut self) -> Option<(usize, u32)> {
        for _ in 0..CIRCLES {
            let circle = self.next;
            self.next = (circle + 1) % CIRCLES;
            let group = circle / (CIRCLES / self.left.from.len());
            let (next, end) = (self.left.from.get_mut(group)?, *self.left.to.get(group)?);
            if *next < end {
                let sample = *next;
                // Those of a group take their samples one after the other.
                *next += (circle % (GROUP / CIRCLE) == GROUP / CIRCLE - 1) as u32;
                return Some((circle, sample));
            }
        }
        None
    }

    /// The next pixel along the Z-curve, and which of its samples.
    fn next_pixel(&mut self) -> Option<(usize, u32)> {
        loop {
            if self.next == PIXELS_PER_TILE {
                (self.next, self.layer) = (0, self.layer + 1);
            }
            if self.next == 0 {
                let layer = self.layer;
                let mut groups = self.left.from.iter().zip(&self.left.to);
                groups.find(|(from, to)| from.checked_add(layer).is_some_and(|sample| sample < **to))?;
            }
            let place = self.next;
            self.next += 1;
            let group = Tile::group(place);
            let sample = self.left.from.get(group)?.checked_add(self.layer);
            if let Some(sample) =
                sample.filter(|sample| self.left.to.get(group).is_some_and(|to| sample < to))
            {
                return Some((place, sample));
            }
        }
    }
}

impl<F: Features> PathTracer<'_, F> {
    /// Traces `samples` of tile `task` and adds them to `out`, the tile's pixels of the film.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`PathTracer::scratch`] bytes.
    pub fn run(
        &self,
        task: usize,
        samples: impl Into<Samples>,
        wave: usize,
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let samples = samples.into();
        let tile = Tile::new(self.settings.width, self.settings.height, task);
        let mut counters = Counters::default();
        let mut places = Places::new(tile, samples);
        places.outlined = outlined(self.scene, self.lights, &self.settings, tile);
        // No larger than there are paths: the memory of a wave is cleared.
        let most = usize::try_from(samples.count().saturating_mul(GROUP as u64)).unwrap_or(usize::MAX);
        let mut wave = Wave::new(wave.min(most), &mut arena)?;
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
    pub(super) fn start(&self, places: &mut Places, wave: &mut Wave) -> usize {
        let mut count = 0;
        if self.settings.reuse {
            while count + CIRCLE <= wave.paths.len()
                && let Some((circle, sample)) = places.next_circle()
            {
                // Another number for each circle that a wave can hold.
                let exchange = Exchange::new(sample.wrapping_mul(CIRCLES as u32) + circle as u32);
                for place in places.tile.circle(circle, self.settings.seed, sample) {
                    self.begin(places, place, sample, exchange, wave, &mut count);
                }
            }
            return count;
        }
        while count < wave.paths.len()
            && let Some((place, sample)) = places.next_pixel()
        {
            self.begin(places, place, sample, Exchange::new(0), wave, &mut count);
        }
        count
    }

    /// Puts a path into the wave, where there is such a pixel.
    #[inline]
    fn begin(
        &self,
        places: &Places,
        place: usize,
        sample: u32,
        exchange: Exchange,
        wave: &mut Wave,
        count: &mut usize,
    ) {
        let PathSettings { width, seed, .. } = self.settings;
        let Some((x, y)) = places.tile.pixel(place) else { return };
        let index = y * width + x;
        let ray = self.camera_ray([x, y], &Sampler::new(seed, index, sample));
        wave.rays[*count] = Ray { tag: *count as u32, ..ray };
        wave.paths[*count] = Path {
            throughput: [1.0; 3],
            pdf: f32::INFINITY,
            pixel: index,
            place: place as u32,
            sample,
            segments: 1,
            share: if places.outlined.contains(place) { Share::BESIDE_LAMP } else { Share::ALL },
            triangle: MISS,
            eta_squared: 1.0,
            lights: self.asked as u16,
            ..Path::default()
        };
        wave.exchanges[*count] = exchange;
        *count += 1;
    }
}
