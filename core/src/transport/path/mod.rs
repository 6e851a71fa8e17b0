//! The path tracer that renders: unidirectional, with next-event estimation and multiple importance sampling
//! (Kajiya 1986; Veach 1997, chapter 9).
//!
//! The plain algorithm is [`crate::transport::path::reference`]. Departures from it:
//! 1. All paths of a wave advance together, one segment at a time, so that the tracer sees batches of rays:
//!    first alike (camera rays along the Z-curve of a tile), then in no order (bounces).
//! 2. Queues are compacted in place: the ray of a path that goes on overwrites one that was already shaded.
//! 3. Shadow rays are traced after all vertices of the wave are shaded, or as many as there is room for; light is added to
//!    the path then.
//! 4. Code for what the scene does not have is not compiled in ([`Features`]).
//! 5. Where that pays, pixels of a circle share what their paths find (`reuse.rs`).
//! 6. Where an irradiance cache knows the indirect light of a diffuse point, the path need not find it (`lookup.rs`), or a
//!    map of photons does one bounce later, and may ask several points of lights; nor where photons do (`density.rs`, `final_gather.rs`).
//! 7. Pixels at the border of a lamp look at it with rays of their own (`silhouette.rs`).
//! 8. Where photons of caustics lie, paths and photons share the light that both find (`merge.rs`).
//!
//! The price: about 400 bytes for each path of a wave. What a pixel sees depends on (seed, sample) and the pixels of
//! its circle only, no wave cuts a circle, and samples are summed in their order: the picture has the same bits for
//! any size of wave and any distribution of tasks.

mod direct;
mod driver;
pub(in crate::transport) mod pixels;
pub mod reference;
pub(in crate::transport) mod reuse;
pub mod reuse_pilot;
mod scatter;
mod shade;
mod shadow_rays;
pub(in crate::transport) mod silhouette;
pub(in crate::transport) mod state;
pub(in crate::transport) mod tile;

use crate::Level;
use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::cache::irradiance::{CachedIrradiance, IrradianceCache, POINTS};
use crate::film::Tile;
use crate::geometry::Ray;
use crate::light::LightSampler;
use crate::memory::Footprint;
use crate::sampling::Sampler;
use crate::scene::{Scene, SurfacePoint};
use crate::transport::cached::lookup::CacheView;
use crate::transport::caustics::merge::CausticMerging;
use crate::transport::estimator::{PathSettings, dimension};
use crate::transport::path::state::Wavefront;
use crate::transport::photon_mapping::density::PhotonLight;
use crate::transport::photon_mapping::final_gather::PhotonMaps;
use crate::transport::walk::context::SceneContext;

/// Paths that advance together where memory allows: enough to fill the tracer's batches, few enough to
/// stay in the second cache.
pub const WAVE: usize = 2048;

/// Vertices that are looked at together before they are shaded.
pub(super) const BLOCK: usize = POINTS;

/// Light samples of a path of the picture at a vertex whose other light a cache knows.
pub(super) const LIGHT_SAMPLES: usize = 4;

/// Path tracing of one scene: a pass whose tasks are the tiles of the picture.
#[derive(Clone, Copy)]
pub struct PathIntegrator<'a, F> {
    pub(super) context: SceneContext<'a, F>,
    pub(super) settings: PathSettings,
    pub(super) caches: Option<CacheView<'a>>,
    photons: Option<PhotonLight<'a>>,
    /// Of even and of odd samples.
    maps: Option<&'a [PhotonMaps<'a>; 2]>,
    merging: Option<CausticMerging<'a>>,
    /// Light that is not all shared, for each sample; see `reuse.rs`.
    pub(super) flash: f32,
}

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// A path tracer over frozen structures. `F` has at least the features of the scene
    /// ([`crate::census`] tells which).
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &'a Bvh<'a>,
        lights: &'a LightSampler<'a>,
        settings: PathSettings,
        level: Level,
    ) -> Self {
        Self {
            context: SceneContext::new(scene, bvh, lights, level),
            settings,
            caches: None,
            photons: None,
            maps: None,
            merging: None,
            flash: f32::INFINITY,
        }
    }

    /// The same, where diffuse points have their indirect light from a cache as far as it reaches: even samples from the
    /// first, odd ones from the second. Pixels must not share their paths as well. Where depth is limited only the
    /// first point of a path is served, for records do not know how far they are from the camera.
    pub fn with_caches(&self, caches: [&'a IrradianceCache<'a>; 2]) -> Self {
        Self { caches: Some(CacheView::Pair(caches)), ..*self }
    }

    /// The same, for rays that gather for the cache itself, as it is now.
    pub fn with_growing_cache(&self, cache: &'a IrradianceCache<'a>) -> Self {
        Self { caches: Some(CacheView::UnderConstruction(cache)), ..*self }
    }

    /// The same, where surfaces with a diffuse part have from photons what light is reflected onto them. Pixels must
    /// not share their paths as well. Where depth is limited only the first point of a path is served, for photons do
    /// not know how far they are from their light.
    pub fn with_photons(&self, photons: PhotonLight<'a>) -> Self {
        Self { photons: Some(photons), ..*self }
    }

    /// The same, where surfaces with a diffuse part have caustics from photons, and rays that gather from there end in a
    /// map of photons: even samples in the first, odd ones in the second. Pixels must not share their paths as well.
    /// Where depth is limited only the first point of a path is served.
    pub fn with_maps(&self, maps: &'a [PhotonMaps<'a>; 2]) -> Self {
        Self { maps: Some(maps), ..*self }
    }

    /// The same, joined with photons of caustics.
    pub fn with_caustics(&self, merging: CausticMerging<'a>) -> Self {
        Self { merging: Some(merging), ..*self }
    }

    /// The same, where pixels share what their paths find, or do not.
    pub fn with_reuse(&self, reuse: bool) -> Self {
        Self { settings: PathSettings { reuse, ..self.settings }, ..*self }
    }

    /// Whether paths have a limit of depth.
    pub fn is_limited(&self) -> bool {
        self.settings.is_limited()
    }

    /// Number of tasks: tiles of the film.
    pub fn tasks(&self) -> usize {
        Tile::count(self.settings.width, self.settings.height)
    }

    /// Working memory of one task that advances `wave` paths together.
    pub fn scratch(wave: usize) -> Footprint {
        Wavefront::footprint(wave)
    }

    /// The camera ray of a sample of the pixel in column `x` and row `y`.
    #[inline]
    pub(super) fn camera_ray(&self, [x, y]: [u32; 2], sampler: &Sampler) -> Ray {
        let PathSettings { width, height, .. } = self.settings;
        let [dx, dy] = sampler.pair(dimension::PIXEL);
        let has_lens = self.context.scene.camera.lens_radius > 0.0;
        let lens = if has_lens { sampler.pair(dimension::LENS) } else { [0.0; 2] };
        self.context.scene.camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens)
    }
}

/// A vertex that is about to be shaded.
#[derive(Clone, Copy)]
pub(super) struct SurfaceInteraction<'a> {
    pub(super) point: SurfacePoint<'a>,
    /// What a cache says of it.
    pub(super) indirect: Option<CachedIrradiance>,
}
