//! Reuse pilot: a test on a few tiles before the picture, whether path reuse pays.
//!
//! The same samples give both radiances of a pixel: of its own path alone, and with shares. Path reuse pays
//! if the variance falls by a larger factor than the work grows. It does not pay if most of the error is in
//! direct light, or behind mirrors and glass.

use super::PathIntegrator;
use super::TileSampler;
use super::estimator::LightEstimator;
use super::reuse::PathReuse;
use super::sharing::PathWave;
use super::sharing::Sharing;
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Pixel, Tile};
use crate::memory::{Arena, OutOfMemory};
use crate::transport::settings::Counters;
use crate::transport::walk::path_classes::PathClasses;
use bytemuck::Pod;

/// Samples per pixel of the pilot. The mean radiance of the picture comes from sample 0 alone.
pub const SAMPLES: u32 = 4;

/// Cost of a connection between two paths, in other rays including the shading of their hits (measured: 0.2
/// in a box, 0.3 in a room of 400,000 triangles).
const CONNECTION: f32 = 0.3;

/// Cost of a connection in scenes with cut-outs, where shadow rays advance from surface to surface.
const CONNECTION_THROUGH_CUTOUTS: f32 = 1.0;

/// Sums of a pilot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pilot {
    /// Relative variance of samples without sharing, summed over pixels.
    alone: f64,
    /// Relative variance of the same samples with sharing, summed over pixels.
    shared: f64,
    /// Number of rays of paths.
    rays: f64,
    /// Cost of all connections, in rays.
    connections: f64,
    /// Number of pairs of samples compared.
    pairs: f64,
    /// Variances without and with sharing, relative to the light of a block, summed over `blocks`.
    scatter: [f64; 2],
    blocks: f64,
    samples: f64,
}

/// Pixels per block of a tile, 8 × 8.
const BLOCK: usize = 64;

/// Sums over the pairs of samples of a block.
#[derive(Clone, Copy, Default)]
struct Block {
    light: f32,
    /// Squared differences without and with sharing.
    squares: [f32; 2],
    pairs: f32,
}

impl Pilot {
    /// Factor by which sharing reduces the variance.
    pub fn gain(&self) -> f32 {
        if self.shared > 0.0 { (self.alone / self.shared) as f32 } else { 1.0 }
    }

    /// Factor by which sharing increases the work.
    pub fn cost(&self) -> f32 {
        1.0 + (self.connections / self.rays.max(1.0)) as f32
    }

    /// Relative variance of a sample, as in relMSE. Each difference is relative to the light of its own pair,
    /// so that no sample counts more than its own light.
    pub fn noise(&self, shared: bool) -> f64 {
        // Sums of three channels, and of differences, whose variance is twice that of a sample.
        (if shared { self.shared } else { self.alone }) / (6.0 * self.pairs.max(1.0))
    }

    /// Relative variance of a sample over the light of blocks of 8 × 8 pixels, so that a sample counts by its
    /// deviation.
    pub fn scatter(&self, shared: bool) -> f64 {
        self.scatter[usize::from(shared)] / (6.0 * self.blocks.max(1.0))
    }

    /// Work of a sample of a pixel, in rays.
    pub fn work(&self, shared: bool) -> f64 {
        (self.rays + if shared { self.connections } else { 0.0 }) / self.samples.max(1.0)
    }

    /// True if sharing pays.
    pub fn pays(&self) -> bool {
        self.gain() > self.cost()
    }
}

impl core::ops::AddAssign for Pilot {
    fn add_assign(&mut self, other: Self) {
        self.alone += other.alone;
        self.shared += other.shared;
        self.rays += other.rays;
        self.connections += other.connections;
        self.pairs += other.pairs;
        self.scatter[0] += other.scatter[0];
        self.scatter[1] += other.scatter[1];
        self.blocks += other.blocks;
        self.samples += other.samples;
    }
}

impl<F: Features, E: LightEstimator<F>> PathIntegrator<'_, F, E> {
    /// Tiles of a pilot, `count` at most, spread over the picture.
    pub fn pilot_tasks(&self, count: usize) -> impl Iterator<Item = usize> + use<F, E> {
        Tile::spread_over(self.settings.width, self.settings.height, count)
    }

    /// Mean radiance of one tile, by one sample per pixel.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::scratch_with`] bytes.
    pub fn pilot_mean(&self, task: usize, wave: usize, scratch: &mut Arena) -> Result<f32, OutOfMemory> {
        self.mean_of(None, task, wave, scratch)
    }

    /// Mean radiance beside the photons of [`PathIntegrator::with_caustics`]: emission hit by BSDF sampling
    /// counts by its weight; emitters that the camera sees, directly or by mirrors and glass, do not count.
    ///
    /// # Errors
    /// As [`PathIntegrator::pilot_mean`].
    pub fn pilot_rest(&self, task: usize, wave: usize, scratch: &mut Arena) -> Result<f32, OutOfMemory> {
        self.mean_of(Some(PathClasses::WITHOUT_VISIBLE_EMITTERS), task, wave, scratch)
    }

    /// Mean radiance of `classes`, or of all light.
    fn mean_of(
        &self,
        classes: Option<PathClasses>,
        task: usize,
        wave: usize,
        scratch: &mut Arena,
    ) -> Result<f32, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut wave = PathWave::<E::State, ()>::new(wave, &mut arena)?;
        let tile = Tile::new(self.settings.width, self.settings.height, task);
        let (mut sum, mut all) = (0.0, 0);
        let mut places = TileSampler::new(tile, 0..1);
        loop {
            let count = self.start(&mut places, &mut wave);
            if count == 0 {
                return Ok(sum / all.max(1) as f32);
            }
            for path in &mut wave.wave.paths[..count] {
                path.classes = classes.unwrap_or(path.classes);
            }
            self.advance(&mut wave, count, &mut Counters::default());
            let paths = &wave.wave.paths[..count];
            let light = paths.iter().map(|path| Rgb::from(path.radiance).element_sum() / 3.0);
            sum += light.filter(|light| light.is_finite()).sum::<f32>();
            all += count;
        }
    }

    /// Runs the pilot on one tile of a picture of about this `mean` radiance; no sample reaches the film.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::scratch_with`] bytes.
    #[inline(never)]
    pub fn pilot(
        &self,
        task: usize,
        mean: f32,
        wave: usize,
        scratch: &mut Arena,
    ) -> Result<Pilot, OutOfMemory> {
        let sharing = self.with_reuse().with_firefly_limit(mean);
        let connection = if self.context.has_cutouts { CONNECTION_THROUGH_CUTOUTS } else { CONNECTION };
        let mut arena = scratch.scratch();
        let mut wave = PathWave::<E::State, PathReuse>::new(wave, &mut arena)?;
        let tile = Tile::new(self.settings.width, self.settings.height, task);
        let mut pilot = Pilot::default();
        // One sample of all pixels after another, in batches of the wave's capacity.
        let mut places = TileSampler::new(tile, 0..SAMPLES);
        loop {
            let count = sharing.start(&mut places, &mut wave);
            if count == 0 {
                return Ok(pilot);
            }
            let mut counters = Counters::default();
            sharing.advance(&mut wave, count, &mut counters);
            pilot.rays += (counters.rays + counters.shadow_rays) as f64;
            // The throughput of an ended path is free: it holds the radiance without sharing.
            for (path, state) in wave.wave.paths.iter_mut().zip(&*wave.memory.shared).take(count) {
                path.throughput = state.unshared_radiance(path).to_array();
            }
            let before = counters.shadow_rays;
            let context = (&self.context, self.is_limited());
            sharing.sharing.distribute(context, &mut wave, count, &mut counters);
            pilot.connections += f64::from(connection) * (counters.shadow_rays - before) as f64;
            pilot.samples += count as f64;
            pilot.compare(&wave, count, mean);
        }
    }
}

impl Pilot {
    /// The pilot of points by four samples of each of `pixels`, whose light is `scale` times that of samples
    /// and of about this `mean`.
    pub fn of_points(pixels: &[Pixel], (scale, mean): (f32, f32), counters: &Counters) -> Self {
        let rays = (counters.rays + counters.shadow_rays) as f64;
        let mut pilot = Self { rays, samples: counters.paths as f64, ..Self::default() };
        let pairs = pixels.iter().enumerate().flat_map(|(place, pixel)| {
            let halves = pixel.even.parts().zip(pixel.odd.parts());
            let pairs =
                halves.map(|(even, odd)| [0, 1].map(|i| [even[i], odd[i]].map(|light| scale * light)));
            pairs.into_iter().flatten().map(move |[a, b]| (place, [a, b], a - b))
        });
        pilot.add_pairs(pairs, mean);
        pilot
    }

    /// Adds the squared differences between samples of the same pixel.
    fn compare<S: Pod>(&mut self, wave: &PathWave<S, PathReuse>, count: usize, mean: f32) {
        let paths = &wave.wave.paths;
        let layer = paths[..count].iter().take_while(|path| path.sample == paths[0].sample).count();
        let pairs = (layer..count).map(|i| {
            let shared = [i, i - layer].map(|i| wave.radiance(i));
            let [a, b] = [i, i - layer].map(|i| Rgb::from(paths[i].throughput));
            (paths[i].place as usize, shared, a - b)
        });
        self.add_pairs(pairs, mean);
    }

    /// Adds pairs of samples of the pixel at a place of the tile: both with sharing, and their difference
    /// without.
    fn add_pairs(&mut self, pairs: impl Iterator<Item = (usize, [Rgb; 2], Rgb)>, mean: f32) {
        let mut blocks = [Block::default(); PIXELS_PER_TILE / BLOCK];
        for (place, [a, b], alone) in pairs {
            let light = (a + b).element_sum() / 6.0;
            let weight = 1.0 / (light * light + 0.01 * mean * mean);
            let squares = [alone.length_squared(), (a - b).length_squared()];
            // Skip pairs without light, or with light that is not finite.
            let [alone, shared] = squares.map(|square| square * weight);
            if alone.is_finite() && shared.is_finite() {
                self.alone += f64::from(alone);
                self.shared += f64::from(shared);
                self.pairs += 1.0;
                if let Some(block) = blocks.get_mut(place / BLOCK) {
                    block.light += light;
                    block.squares = [0, 1].map(|k| block.squares[k] + squares[k]);
                    block.pairs += 1.0;
                }
            }
        }
        for Block { light, squares, pairs } in blocks.into_iter().filter(|block| block.pairs > 0.0) {
            let light = light / pairs;
            let weight = 1.0 / (pairs * (light * light + 0.01 * mean * mean));
            if squares.iter().all(|square| (square * weight).is_finite()) {
                self.scatter = [0, 1].map(|k| self.scatter[k] + f64::from(squares[k] * weight));
                self.blocks += 1.0;
            }
        }
    }
}
