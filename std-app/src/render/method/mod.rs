//! The methods: ways to make a picture. One file each; this one says what a method is, and sets it up.
//!
//! A round of a method is made of passes over its structures and of tiles of the picture, all of which the
//! [`Crew`] runs in parallel ("The unit of work" in docs/architecture.md). To add a method: a variant of [`Method`]
//! with its words, a file with its [`Renderer`], a line in [`Method::with`].

mod bidirectional;
mod cache_memory;
mod cache_settings;
mod caustics;
mod instant_radiosity;
mod irradiance_cache;
mod metropolis;
mod path;
mod photon_map;
mod photon_view;
mod sppm;
#[cfg(test)]
mod wrong;

pub use cache_settings::{CacheSettings, CacheUse};
pub use halflight_core::method::caustics::CausticUse;
pub use halflight_core::method::instant_radiosity::VirtualLightUse;
pub use halflight_core::method::metropolis::ChainUse;
pub use halflight_core::method::{MapUse, PhotonSettings, PhotonUse};
pub use photon_view::{MapView, PhotonView};

use super::crew::Crew;
use super::memory::Memory;
use super::rewritten_file::RewrittenFile;
use super::run::path_settings;
use super::survey::Survey;
use super::workers::Workers;
use super::{RenderError, Reuse, Settings};
use crate::save::Patience;
use halflight_core::bsdf::Features;
use halflight_core::bvh::Bvh;
use halflight_core::light::LightSampler;
use halflight_core::method::RenderContext;
use halflight_core::scene::Scene;
use halflight_core::transport::{CausticMerging, PathIntegrator, PathSettings};

/// A way to make a picture.
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
    /// Path tracing with splats of light paths.
    LightTracing,
    /// Bidirectional path tracing.
    Bidirectional,
    /// Vertex connection and merging.
    VertexMerging,
    /// Instant radiosity; paths find what its bound cuts.
    InstantRadiosity,
    /// Instant radiosity without what its bound cuts.
    ClampedInstantRadiosity,
    /// Metropolis light transport.
    Metropolis,
    /// Path tracing that is wrong on purpose.
    #[cfg(test)]
    Wrong,
}

impl Method {
    /// All of them.
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

    /// Its name on the command line, in films and in reports.
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

    /// What it does, in half a line.
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

    /// The method of that name.
    pub fn named(name: &str) -> Option<Method> {
        Method::ALL.into_iter().find(|method| method.name() == name)
    }

    /// Whether its pictures converge to another one than that of the scene: no noise of their own tells of that.
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

    /// Whether enough samples bring its pictures as near to that of the scene as anybody wishes.
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

    /// Whether it finds light that path tracing may miss: that of small lamps through mirrors and glass.
    pub const fn finds_caustics(self) -> bool {
        matches!(self, Method::PhotonMap | Method::ProgressivePhotons | Method::VertexMerging)
    }

    /// Whether samples of pixels far from each other err together, through a structure that they share: their errors
    /// are independent between even and odd samples then, not between tiles.
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

    /// Takes the memory that it needs, sets it up on `stage`, and hands it to `then`.
    pub(super) fn with<'a, F: Features, T>(
        self,
        stage: &Stage<'a>,
        memory: &mut Memory<'a>,
        then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        match self {
            Method::Path if caustics::are_possible(stage) => caustics::with::<F, T>(stage, memory, then),
            Method::Path => then(&mut path::Paths::<F>::new(stage, memory)?, memory),
            Method::IrradianceCache => irradiance_cache::with::<F, T>(stage, memory, then),
            Method::PhotonMap => then(&mut photon_map::TwoPasses::<F>::new(stage, memory)?, memory),
            Method::ProgressivePhotons => {
                then(&mut sppm::ProgressivePhotons::<F>::new(stage, memory)?, memory)
            }
            Method::LightTracing | Method::Bidirectional | Method::VertexMerging => {
                then(&mut bidirectional::BidirectionalPaths::<F>::new(stage, memory, self)?, memory)
            }
            Method::InstantRadiosity | Method::ClampedInstantRadiosity => {
                then(&mut instant_radiosity::VirtualLights::<F>::new(stage, memory, self)?, memory)
            }
            Method::Metropolis => then(&mut metropolis::Chains::<F>::new(stage, memory)?, memory),
            #[cfg(test)]
            Method::Wrong => then(&mut wrong::Wrong::<F>::new(stage, memory)?, memory),
        }
    }
}

/// What all methods stand on.
#[derive(Clone, Copy)]
pub(super) struct Stage<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) bvh: &'a Bvh<'a>,
    pub(super) lights: &'a LightSampler<'a>,
    pub(super) settings: &'a Settings,
    pub(super) workers: &'a Workers<'a>,
}

impl<'a> Stage<'a> {
    /// Paths of the picture, or of one by another `seed`.
    pub(super) fn paths<F: Features>(&self, seed: u32) -> PathIntegrator<'a, F> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        let paths = PathSettings { seed, ..path_settings(settings) };
        PathIntegrator::new(scene, bvh, lights, paths, settings.level)
    }

    /// The same for methods of the core.
    pub(super) fn context(&self) -> RenderContext<'a> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        RenderContext { scene, bvh, lights, settings: path_settings(settings), level: settings.level }
    }
}

/// What paths do with photons of caustics.
pub(super) type Borrower<'b> = dyn FnMut(Option<CausticMerging>) -> Result<(), RenderError> + 'b;

/// A method at work on one scene. Its structures are its own; the film is the crew's.
pub(super) trait Renderer {
    /// Another method than was thought, where a first look has chosen it.
    fn chosen(&self) -> Option<Method> {
        None
    }

    /// One round: brings the tiles of `crew` to their targets, or less where the round is cut.
    ///
    /// What sample `n` of a pixel sees follows from the scene, the settings, and `n`, and from the weights that
    /// a film keeps: neither from how samples are cut
    /// into rounds, nor from threads, nor from what was rendered before a film was resumed. What samples of several
    /// pixels share is drawn anew, or kept twice, for even and odd `n`: the halves of the film stay independent, and
    /// their difference tells of all that is random.
    ///
    /// # Errors
    /// Memory that does not suffice.
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError>;

    /// Lends `then` the photons of caustics that the picture has now, for paths without records; none where it has none.
    ///
    /// # Errors
    /// Those of `then`.
    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        then(None)
    }

    /// Whether neighbouring pixels share what their paths find.
    fn reuse(&self) -> Reuse {
        Reuse::default()
    }

    /// Of each pixel, row by row, how large the square of its bias may be, relative to that of others;
    /// nothing where it does not know.
    ///
    /// # Errors
    /// Memory that does not suffice.
    fn risks(&mut self, _workers: &Workers) -> Result<Vec<f32>, RenderError> {
        Ok(Vec::new())
    }

    /// What its irradiance cache looks like and how wrong it is, where the settings ask for that.
    ///
    /// # Errors
    /// Memory that does not suffice.
    fn survey(&mut self, _workers: &Workers) -> Result<Option<Survey>, RenderError> {
        Ok(None)
    }

    /// Whether paths are joined with photons of caustics, and what came of it.
    fn caustics(&self) -> CausticUse {
        CausticUse::default()
    }

    /// What became of its irradiance cache.
    fn cache(&self) -> Option<CacheUse> {
        None
    }

    /// Writes what it keeps in a file for the last time.
    fn finish(&mut self, _patience: Patience) {}

    /// That file.
    fn kept(&self) -> Option<&RewrittenFile<'_>> {
        None
    }

    /// Its last maps of photons, as the camera sees them.
    ///
    /// # Errors
    /// Memory that does not suffice.
    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        Ok(None)
    }

    /// The use of its virtual lights.
    fn virtual_lights(&self) -> Option<VirtualLightUse> {
        None
    }

    /// Use of its Markov chains.
    fn chains(&self) -> Option<ChainUse> {
        None
    }

    /// What became of its photons.
    fn photons(&self) -> Option<PhotonUse> {
        None
    }
}
