//! Unidirectional path tracer with next-event estimation and multiple importance sampling (Kajiya 1986; Veach
//! 1997, chapter 9).
//!
//! The plain algorithm is [`crate::transport::path::reference`]. Departures from it:
//! 1. All paths of a wave advance together (`wavefront/`).
//! 2. Shadow rays are traced after all vertices of the wave are shaded; their light is added to the path
//!    then.
//! 3. Code for features that the scene does not have is not compiled in ([`Features`]).
//! 4. An [`LightEstimator`] supplies part of the light at a vertex: a cache, photon maps, or photons to merge
//!    with. Without one the result equals the plain algorithm to the bit.
//! 5. If it pays, pixels of a circle share the light that their paths find ([`PathReuse`]).
//! 6. Pixels on the border of a lamp trace extra rays for its emission (`silhouette.rs`).
//!
//! The price: about 200 bytes per path of a wave. The radiance of a pixel depends only on (seed, sample) and
//! the pixels of its circle, no wave cuts a circle, and samples are summed in order: the picture has the same
//! bits for any wave size and any distribution of tasks.

mod connection;
mod direct;
pub(in crate::transport) mod estimator;
pub(in crate::transport) mod pixels;
pub mod reference;
pub(in crate::transport) mod reuse;
pub mod reuse_pilot;
mod scatter;
mod shade;
pub(in crate::transport) mod sharing;
pub(in crate::transport) mod silhouette;
pub(in crate::transport) mod tile;
pub(in crate::transport) mod vertex;

pub use crate::transport::wavefront::WAVE;
pub use estimator::LightEstimator;
pub use reuse::PathReuse;
pub use sharing::Sharing;

use crate::Level;
use crate::bsdf::Features;
use crate::bvh::{Bvh, Coherence};
use crate::film::Tile;
use crate::geometry::Ray;
use crate::light::LightSampler;
use crate::memory::Footprint;
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::transport::path::shade::Shading;
use crate::transport::path::sharing::PathWave;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;

/// Path tracing of one scene: a pass whose tasks are the tiles of the picture. The estimator `E` supplies
/// part of the light; the rule `R` shares the light of paths among pixels.
#[derive(Clone, Copy)]
pub struct PathIntegrator<'a, F, E = (), R = ()> {
    pub(in crate::transport) context: SceneContext<'a, F>,
    pub(in crate::transport) settings: PathSettings,
    pub(in crate::transport) estimator: E,
    pub(in crate::transport) sharing: R,
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// A path tracer over frozen structures. `F` has at least the features of the scene ([`crate::census`]).
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &'a Bvh<'a>,
        lights: &'a LightSampler<'a>,
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
    pub(in crate::transport) fn trace_to_end(
        &self,
        PathWave { wave, memory }: &mut PathWave<E::State, R>,
        count: usize,
        counters: &mut Counters,
    ) {
        wave.follow(&self.context, count, &mut Shading { integrator: self, memory }, counters);
    }
}
