//! Rendering methods: names, properties, interface and setup.
//!
//! A round consists of passes over a method's structures and of tiles of the picture, all run in parallel
//! ("The unit of work" in docs/architecture.md). A new method needs a variant of [`Method`] with its texts
//! and a line in [`Method::with`].

mod adapter;
mod bidirectional;
mod cache_memory;
mod cache_settings;
mod caustics;
mod irradiance_cache;
mod photon_view;
#[cfg(test)]
mod wrong;

pub use cache_settings::CacheSettings;
pub use halflight_core::method::PhotonSettings;
pub use photon_view::{MapView, PhotonView};

use super::memory::Memory;
use super::rewritten_file::RewrittenFile;
use super::run::path_settings;
use super::survey::Survey;
use super::threads::ThreadedRound;
use super::workers::Workers;
use super::{RenderError, Settings};
use crate::save::Patience;
use adapter::Adapter;
use halflight_core::bsdf::Features;
use halflight_core::bvh::Bvh;
use halflight_core::findings::Findings;
use halflight_core::light::LightSampler;
use halflight_core::method::RenderContext;
use halflight_core::method::instant_radiosity::InstantRadiosity;
use halflight_core::method::metropolis::Metropolis;
use halflight_core::method::path::PathTracing;
use halflight_core::method::photon_map::PhotonMapping;
use halflight_core::method::sppm::ProgressivePhotonMapping;
use halflight_core::scene::Scene;
use halflight_core::transport::{CausticMerging, PathIntegrator, PathSettings};

/// Rendering method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Path tracing with next-event estimation and multiple importance sampling.
    Path,
    /// Indirect light of diffuse surfaces from an irradiance cache.
    IrradianceCache,
    /// Photon mapping in two passes, with final gathering.
    PhotonMap,
    /// Stochastic progressive photon mapping.
    ProgressivePhotons,
    /// Path tracing with splats of light subpaths.
    LightTracing,
    /// Bidirectional path tracing.
    Bidirectional,
    /// Vertex connection and merging.
    VertexMerging,
    /// Instant radiosity; paths find the light that its bound cuts.
    InstantRadiosity,
    /// Instant radiosity without the cut light.
    ClampedInstantRadiosity,
    /// Metropolis light transport.
    Metropolis,
    /// Deliberately biased path tracing.
    #[cfg(test)]
    Wrong,
}

impl Method {
    /// All methods.
    pub const ALL: [Method; 10] = [
        Method::Path,
        Method::IrradianceCache,
        Method::PhotonMap,
        Method::ProgressivePhotons,
        Method::LightTracing,
        Method::Bidirectional,
        Method::VertexMerging,
        Method::InstantRadiosity,
        Method::ClampedInstantRadiosity,
        Method::Metropolis,
    ];

    /// Name on the command line, in films and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Method::Path => "path",
            Method::IrradianceCache => "irradiance-cache",
            Method::PhotonMap => "photon-map",
            Method::ProgressivePhotons => "sppm",
            Method::LightTracing => "light",
            Method::Bidirectional => "bdpt",
            Method::VertexMerging => "vcm",
            Method::InstantRadiosity => "instant-radiosity",
            Method::ClampedInstantRadiosity => "instant-radiosity-clamped",
            Method::Metropolis => "mlt",
            #[cfg(test)]
            Method::Wrong => "wrong",
        }
    }

    /// Description in half a line.
    pub const fn about(self) -> &'static str {
        match self {
            Method::Path => "Path tracing with next-event estimation and multiple importance sampling",
            Method::IrradianceCache => {
                "Path tracing, but for the indirect light of diffuse surfaces, which is interpolated"
            }
            Method::PhotonMap => {
                "Photon mapping: caustics from photons, indirect light by gather rays that end in a map of photons"
            }
            Method::ProgressivePhotons => {
                "Stochastic progressive photon mapping: reflected light from photons, blurred ever less"
            }
            Method::LightTracing => "Path tracing, and light paths whose vertices the camera sees",
            Method::Bidirectional => "Bidirectional path tracing with a cache of light vertices",
            Method::VertexMerging => {
                "Vertex connection and merging: bidirectional path tracing, and photons of caustics behind mirrors and glass"
            }
            Method::InstantRadiosity => "Virtual point lights, and paths for the light that their bound cuts",
            Method::ClampedInstantRadiosity => {
                "Virtual point lights with a bounded geometry term: dark corners"
            }
            Method::Metropolis => {
                "Metropolis light transport, beside path tracing of light that it finds well"
            }
            #[cfg(test)]
            Method::Wrong => "Wrong on purpose",
        }
    }

    /// Method with this name.
    pub fn named(name: &str) -> Option<Method> {
        Method::ALL.into_iter().find(|method| method.name() == name)
    }

    /// Whether pictures converge to wrong radiance, or are biased until they converge; their noise does not
    /// reveal that.
    pub const fn is_biased(self) -> bool {
        match self {
            Method::Path
            | Method::LightTracing
            | Method::Bidirectional
            | Method::InstantRadiosity
            | Method::Metropolis => false,
            Method::IrradianceCache
            | Method::PhotonMap
            | Method::ProgressivePhotons
            | Method::VertexMerging
            | Method::ClampedInstantRadiosity => true,
            #[cfg(test)]
            Method::Wrong => true,
        }
    }

    /// Whether the error vanishes as samples increase.
    pub const fn converges(self) -> bool {
        match self {
            Method::Path
            | Method::ProgressivePhotons
            | Method::LightTracing
            | Method::Bidirectional
            | Method::VertexMerging
            | Method::InstantRadiosity
            | Method::Metropolis => true,
            Method::IrradianceCache | Method::PhotonMap | Method::ClampedInstantRadiosity => false,
            #[cfg(test)]
            Method::Wrong => false,
        }
    }

    /// Whether the method finds light that path tracing may miss: caustics of small lamps.
    pub const fn finds_caustics(self) -> bool {
        matches!(self, Method::PhotonMap | Method::ProgressivePhotons | Method::VertexMerging)
    }

    /// Whether distant pixels share a structure, which correlates their errors: then errors are independent
    /// between even and odd samples, but not between tiles.
    pub const fn shares(self) -> bool {
        match self {
            Method::Path => false,
            Method::IrradianceCache
            | Method::PhotonMap
            | Method::ProgressivePhotons
            | Method::LightTracing
            | Method::Bidirectional
            | Method::VertexMerging
            | Method::InstantRadiosity
            | Method::ClampedInstantRadiosity
            | Method::Metropolis => true,
            #[cfg(test)]
            Method::Wrong => false,
        }
    }

    /// Allocates memory, sets up the method on `stage` and calls `then` with it.
    pub(super) fn with<'a, F: Features, T>(
        self,
        stage: &Stage<'a>,
        memory: &mut Memory<'a>,
        then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let (context, settings) = (&stage.context(), stage.settings);
        match self {
            Method::Path => path_tracing::<F, T>(stage, memory, then),
            Method::IrradianceCache => irradiance_cache::with::<F, T>(stage, memory, then),
            Method::PhotonMap => {
                let scratch = (self, PhotonMapping::<F>::scratch());
                let mut maps = Adapter::<F, _>::new(stage, memory, scratch, |memory, executor, reserve| {
                    PhotonMapping::<F>::new(context, settings.photons, reserve, memory, executor)
                })?;
                then(&mut maps, memory)
            }
            Method::ProgressivePhotons => then(&mut progressive_photons::<F>(stage, memory)?, memory),
            Method::LightTracing | Method::Bidirectional | Method::VertexMerging => {
                bidirectional::with::<F, T>(stage, memory, self, then)
            }
            Method::InstantRadiosity | Method::ClampedInstantRadiosity => {
                let form = (self == Method::ClampedInstantRadiosity, settings.reuse);
                let scratch = (self, InstantRadiosity::<F>::scratch());
                let mut lights =
                    Adapter::<F, _>::new(stage, memory, scratch, |memory, executor, reserve| {
                        let settings = &settings.virtual_lights;
                        InstantRadiosity::<F>::new(context, settings, form, memory, executor, reserve)
                    })?;
                then(&mut lights, memory)
            }
            Method::Metropolis => {
                let scratch = (self, Metropolis::<F>::scratch());
                let mut chains =
                    Adapter::<F, _>::new(stage, memory, scratch, |memory, executor, reserve| {
                        Metropolis::<F>::new(context, &settings.metropolis, memory, executor, reserve)
                    })?;
                then(&mut chains, memory)
            }
            #[cfg(test)]
            Method::Wrong => then(&mut wrong::Wrong::<F>::new(stage, memory)?, memory),
        }
    }
}

/// Path tracing on `stage` with all of its means.
fn path_tracing<'a, F: Features, T>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    if caustics::are_possible(stage) {
        return caustics::with::<F, T>(stage, memory, then);
    }
    let scratch = (Method::Path, PathTracing::<F>::scratch());
    let mut paths = Adapter::<F, _>::new(stage, memory, scratch, |_, executor, _| {
        PathTracing::<F>::new(&stage.context(), stage.settings.reuse, executor)
    })?;
    then(&mut paths, memory)
}

/// Stochastic progressive photon mapping on `stage`.
fn progressive_photons<'a, F: Features>(
    stage: &Stage<'a>,
    memory: &mut Memory<'a>,
) -> Result<Adapter<'a, F, ProgressivePhotonMapping<'a, F>>, RenderError> {
    let scratch = (Method::ProgressivePhotons, ProgressivePhotonMapping::<F>::scratch());
    Adapter::new(stage, memory, scratch, |memory, executor, reserve| {
        let (context, settings) = (stage.context(), stage.settings.photons);
        ProgressivePhotonMapping::new(&context, settings, reserve, memory, executor)
    })
}

/// Structures that all methods use.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) bvh: &'a Bvh<'a>,
    pub(super) lights: &'a LightSampler<'a>,
    pub(super) settings: &'a Settings,
    pub(super) workers: &'a Workers<'a>,
}

impl<'a> Stage<'a> {
    /// Path tracer of the picture, with another `seed`.
    pub(super) fn paths<F: Features>(&self, seed: u32) -> PathIntegrator<'a, F> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        let paths = PathSettings { seed, ..path_settings(settings) };
        PathIntegrator::new(scene, bvh, lights, paths, settings.level)
    }

    /// Context for methods of the core.
    pub(super) fn context(&self) -> RenderContext<'a> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        RenderContext { scene, bvh, lights, settings: path_settings(settings), level: settings.level }
    }
}

/// Callback of paths that borrow caustic photons.
pub(super) type Borrower<'b> = dyn FnMut(Option<CausticMerging>) -> Result<(), RenderError> + 'b;

/// A method at work on one scene. It owns its structures, but not the film.
pub(super) trait Renderer {
    /// The method; a prepass may have chosen another one than the settings.
    fn chosen(&self) -> Method;

    /// One round: brings the tiles of the film to the target, or less if the round is cut.
    ///
    /// Sample `n` of a pixel is determined by the scene, the settings, `n`, and the weights stored with a
    /// film. It does not depend on rounds, on threads, or on earlier runs of a resumed film. Structures
    /// shared by several pixels are drawn anew for even and odd `n`, or exist twice: the half-films stay
    /// independent, and their difference estimates all noise.
    ///
    /// # Errors
    /// Insufficient memory.
    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError>;

    /// Calls `then` with the current caustic photons of the picture, or with none, for paths without records.
    ///
    /// # Errors
    /// Errors of `then`.
    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        then(None)
    }

    /// Relative upper estimate of the squared bias of each pixel, row by row; empty if unknown.
    ///
    /// # Errors
    /// Insufficient memory.
    fn risks(&mut self, _workers: &Workers) -> Result<Vec<f32>, RenderError> {
        Ok(Vec::new())
    }

    /// Survey of the irradiance cache, if the settings ask for one.
    ///
    /// # Errors
    /// Insufficient memory.
    fn survey(&mut self, _workers: &Workers) -> Result<Option<Survey>, RenderError> {
        Ok(None)
    }

    /// Writes the method's file for the last time.
    fn finish(&mut self, _patience: Patience) {}

    /// The file that the method writes.
    fn kept(&self) -> Option<&RewrittenFile<'_>> {
        None
    }

    /// Views of its last photon maps.
    ///
    /// # Errors
    /// Insufficient memory.
    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        Ok(None)
    }

    /// Decisions and numbers of its parts.
    fn findings(&self) -> Findings;
}
