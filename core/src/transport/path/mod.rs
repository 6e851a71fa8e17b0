//! Unidirectional path tracer with next-event estimation and multiple importance sampling (Kajiya 1986; Veach
//! 1997, chapter 9).
//!
//! The plain algorithm is [`single`]. Departures from it:
//! 1. All paths of a wave advance together (`wavefront.rs`).
//! 2. Shadow rays are traced after all vertices of the wave are shaded; their light is added to the path
//!    then.
//! 3. Code for features that the scene does not have is not compiled in ([`Features`]).
//! 4. A [`LightEstimator`] supplies part of the light at a vertex: a cache, photon maps, or photons to merge
//!    with. Without one the result equals the plain algorithm to the bit.
//! 5. If it pays, pixels of a circle share the light that their paths find ([`PathReuse`]).
//! 6. Pixels on the border of a lamp trace extra rays for its emission (`silhouette.rs`).
//! 7. Samples are taken in layers, one per pixel. With path reuse the pixels of a circle stay together;
//!    otherwise pixels follow the Z-curve, so that neighbours look up a cache together.
//!
//! The price: about 200 bytes per path of a wave. The radiance of a pixel depends only on (seed, sample) and
//! the pixels of its circle, no wave cuts a circle, and samples are summed in order: the picture has the same
//! bits for any wave size and any distribution of tasks.

mod connection;
mod direct;
pub(in crate::transport) mod estimator;
mod lanes;
pub(in crate::transport) mod pixels;
mod point_samples;
mod points;
#[cfg(feature = "reference")]
pub mod reference;
pub(in crate::transport) mod reuse;
pub mod reuse_pilot;
mod scalar;
pub(in crate::transport) mod sharing;
pub(in crate::transport) mod silhouette;
pub mod single;

pub use crate::transport::wavefront::WAVE;
pub use estimator::LightEstimator;
pub use points::{IrradiancePoint, LightPart};
pub use reuse::PathReuse;
pub use sharing::Sharing;

use crate::bsdf::Features;
use crate::bvh::{Bvh, Coherence};
use crate::film::{CIRCLE, CIRCLES, PIXELS_PER_TILE, Pixel, PixelSet, Tile};
use crate::geometry::Ray;
use crate::light::LightSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::block::Block;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::Wavefront;
use crate::{Level, Rgb};
use core::ops::Range;
use halflight_simd::kernels::shade::BLOCK;
use halflight_simd::kernels::shade::numbers::SampleBlock;
use lanes::Shading;
use sharing::PathWave;
use silhouette::silhouette_pixels;

/// Path tracing of one scene: a pass whose tasks are the tiles of the picture. The estimator `E` supplies
/// part of the light; the rule `R` shares the light of paths among pixels.
#[derive(Clone, Copy)]
pub struct PathIntegrator<'a, F, E = (), R = ()> {
    pub(in crate::transport) context: SceneContext<'a, F>,
    pub(in crate::transport) settings: PathSettings,
    pub(in crate::transport) estimator: E,
    pub(in crate::transport) sharing: R,
}

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

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// A path tracer over frozen structures. `F` has at least the features of the scene ([`crate::census`]).
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &Bvh<'a>,
        lights: &LightSampler<'a>,
        settings: PathSettings,
        level: Level,
    ) -> Self {
        let context = SceneContext::new(scene, bvh, lights, level);
        Self { context, settings, estimator: (), sharing: () }
    }

    /// Scratch memory of one task that advances `wave` paths together.
    pub fn scratch(wave: usize) -> Footprint {
        Self::scratch_with::<(), ()>(wave)
    }

    /// Scratch memory with an estimator and a sharing rule.
    pub fn scratch_with<E: LightEstimator<F>, R: Sharing>(wave: usize) -> Footprint {
        PathWave::<E::State, R>::footprint(wave)
    }
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// This path tracer with another estimator.
    pub(in crate::transport) fn with_estimator<O>(&self, estimator: O) -> PathIntegrator<'a, F, O, R> {
        let Self { context, settings, sharing, .. } = *self;
        PathIntegrator { context, settings, estimator, sharing }
    }

    /// This path tracer with another sharing rule.
    pub(in crate::transport) fn with_sharing<O>(&self, sharing: O) -> PathIntegrator<'a, F, E, O> {
        let Self { context, settings, estimator, .. } = *self;
        PathIntegrator { context, settings, estimator, sharing }
    }

    /// True if the depth of paths is limited.
    pub fn is_limited(&self) -> bool {
        self.settings.is_limited()
    }

    /// Number of tasks, the tiles of the film.
    pub fn tasks(&self) -> usize {
        Tile::count(self.settings.width, self.settings.height)
    }

    /// Traces `samples` of tile `task` and adds them to `out`, the tile's pixels of the film.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::scratch_with`] bytes.
    #[inline(never)]
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
            silhouette_pixels(self.context.scene, &self.context.lights, &self.settings, tile);
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
                let emission = if has_silhouette { Rgb::from(wave.wave.shadows.light[i]) } else { Rgb::ZERO };
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
            self.aim(&mut wave.wave, count);
            return count;
        }
        while count < capacity
            && let Some((place, sample)) = sampler.next_of(PIXELS_PER_TILE)
        {
            self.begin(sampler, (place, sample), 0, wave, &mut count);
        }
        self.aim(&mut wave.wave, count);
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
    /// Its ray starts at the pixel until [`Self::aim`].
    #[inline]
    fn begin_path(
        &self,
        wave: &mut PathWave<E::State, R>,
        index: usize,
        ([x, y], place, sample): ([u32; 2], u32, u32),
        is_on_silhouette: bool,
        circle: u32,
    ) {
        let pixel = y * self.settings.width + x;
        let classes = if is_on_silhouette { PathClasses::WITHOUT_EMISSION } else { PathClasses::ALL };
        wave.wave.rays[index].origin = [x as f32, y as f32, 0.0];
        wave.wave.paths[index].begin(pixel, place, sample, classes);
        wave.begin(index, circle);
    }

    /// Replaces the pixels of the first `count` paths by their camera rays, sixteen at a time.
    #[inline(never)]
    pub(in crate::transport) fn aim(&self, wave: &mut Wavefront, count: usize) {
        let PathSettings { width, height, seed, .. } = self.settings;
        let (level, camera) = (self.context.level, &self.context.scene.camera);
        let mut samples = SampleBlock::EMPTY;
        let mut raster = [[0.0; BLOCK]; 2];
        let mut aimed = [[0.0; 8]; BLOCK];
        for start in (0..count).step_by(BLOCK) {
            let end = count.min(start + BLOCK);
            for (i, path) in wave.paths[start..end].iter().enumerate() {
                (samples.place[i & 15], samples.index[i & 15]) =
                    Sampler::place(seed, path.pixel, path.sample);
            }
            let [dx, dy] = samples.pairs(level, dimension::PIXEL);
            let rays = &mut wave.rays[start..end];
            for (i, ray) in rays.iter().enumerate() {
                let [x, y, _] = ray.origin;
                (raster[0][i & 15], raster[1][i & 15]) = (x + dx[i & 15], y + dy[i & 15]);
            }
            if camera.rays(level, [width, height], &raster, &mut aimed) {
                for (i, (ray, aimed)) in rays.iter_mut().zip(&aimed).enumerate() {
                    *ray = bytemuck::cast(*aimed);
                    ray.tag = (start + i) as u32;
                }
                continue;
            }
            for (i, (ray, path)) in rays.iter_mut().zip(&wave.paths[start..end]).enumerate() {
                let sampler = Sampler::new(seed, path.pixel, path.sample);
                let lens = if camera.lens_radius > 0.0 { sampler.pair(dimension::LENS) } else { [0.0; 2] };
                let aimed = camera.ray(width, height, raster[0][i & 15], raster[1][i & 15], lens);
                *ray = Ray { tag: (start + i) as u32, ..aimed };
            }
        }
    }

    /// Camera ray of a sample of the pixel in column `x` and row `y`.
    #[inline]
    pub(in crate::transport) fn camera_ray(&self, [x, y]: [u32; 2], sampler: &Sampler) -> Ray {
        let PathSettings { width, height, .. } = self.settings;
        let camera = &self.context.scene.camera;
        let [dx, dy] = sampler.pair(dimension::PIXEL);
        let lens = if camera.lens_radius > 0.0 { sampler.pair(dimension::LENS) } else { [0.0; 2] };
        camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens)
    }

    /// Traces the first `count` rays of the wave and follows their paths to the end.
    pub(in crate::transport) fn advance(
        &self,
        wave: &mut PathWave<E::State, R>,
        count: usize,
        counters: &mut Counters,
    ) {
        wave.wave.trace(&self.context, count, Coherence::Coherent, counters);
        self.trace_to_end(wave, count, counters);
    }

    /// Follows the paths of the first `count` rays, already traced, to the end.
    #[inline(never)]
    pub(in crate::transport) fn trace_to_end(
        &self,
        PathWave { wave, memory }: &mut PathWave<E::State, R>,
        count: usize,
        counters: &mut Counters,
    ) {
        let mut shading = Shading { integrator: self, memory, block: Block::new() };
        wave.follow(&self.context, count, &mut shading, counters);
    }
}
