//! Methods of rendering: one file each, in the order of its paper.
//!
//! A method takes its memory from a [`MemorySource`](crate::memory::MemorySource), learns in its constructor
//! what the scene needs, and adds samples to a film in [`Round`]s. An [`Executor`] of the caller runs the
//! tasks of its passes: no method knows of threads, clocks or files.

pub mod any;
pub mod bidirectional;
pub mod cache_resolution;
pub mod cached_paths;
pub mod cached_points;
pub mod caustics;
pub mod choice;
pub mod counts;
pub mod emission_guide;
pub mod environment_visibility;
pub mod executor;
pub mod hidden_light;
pub mod instant_radiosity;
pub mod irradiance_cache;
pub mod irradiance_points;
pub mod kind;
mod light_vertices;
pub mod metropolis;
pub mod options;
pub mod path;
pub mod photon_map;
pub mod photon_map_store;
pub mod photons;
pub mod pilot;
pub mod record_placement;
pub mod round;
pub mod setup;
mod splats;
pub mod sppm;
#[cfg(test)]
mod test_box;
mod tuned;
pub mod view_placement;
mod work;

pub use crate::cache::radiance::{Basis, LobeSettings};
pub use any::{AnyMethod, ChosenMethod};
pub use bidirectional::BidirectionalSettings;
pub use executor::{Executor, Loop, Passed, Worker};
pub use instant_radiosity::VirtualLightSettings;
pub use irradiance_points::{IrradiancePoints, PointMethod, WantedIrradiance};
pub use kind::MethodKind;
pub use metropolis::{MetropolisSettings, PrimarySpace};
pub use options::{CacheOptions, Method, MethodOptions, PathOptions};
pub use photon_map_store::{PhotonMapPair, PhotonMapStore};
pub use photons::{MapUse, PhotonSettings, PhotonUse};
pub use pilot::PilotSize;
pub use round::{RenderState, Round, Shard};
pub use setup::{Attempt, MethodPlan, MethodSetup};
pub use work::{rays_per_second, work_of_detail};

use crate::Level;
use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::findings::Findings;
use crate::light::{EmissionSampler, Focus, LightSampler};
use crate::memory::{Arena, OutOfMemory};
use crate::photon::PhotonMap;
use crate::scene::{PointLight, Scene};
use crate::transport::photon_mapping::focus::visible_focus;
use crate::transport::{PathIntegrator, PathSettings, RadiusSchedule, SceneContext};

/// A scene with the structures that all methods share, and the settings of its paths.
#[derive(Clone, Copy)]
pub struct RenderContext<'a> {
    /// Geometry, materials, camera.
    pub scene: &'a Scene<'a>,
    /// The hierarchy over its triangles.
    pub bvh: Bvh<'a>,
    /// The distribution over its lights.
    pub lights: LightSampler<'a>,
    /// Size of the picture, seed, length of paths.
    pub settings: PathSettings,
    /// Highest instruction set to use.
    pub level: Level,
    /// Size of the pilots.
    pub pilots: PilotSize,
}

impl<'a> RenderContext<'a> {
    /// The path tracer of the picture.
    pub fn integrator<F: Features>(&self) -> PathIntegrator<'a, F> {
        PathIntegrator::new(self.scene, &self.bvh, &self.lights, self.settings, self.level)
    }

    /// The scene for rays.
    pub fn scene_context<F: Features>(&self) -> SceneContext<'a, F> {
        SceneContext::new(self.scene, &self.bvh, &self.lights, self.level)
    }

    /// Kernel radii of one pixel.
    pub fn radii(&self) -> RadiusSchedule {
        let size = [self.settings.width, self.settings.height];
        RadiusSchedule::new((self.scene, &self.bvh), size, self.level)
    }

    /// Emission of photons by power, in an arena of [`EmissionSampler::footprint`].
    pub(crate) fn emission<'m>(&self, arena: &mut Arena<'m>) -> Result<EmissionSampler<'m>, OutOfMemory> {
        let is_distant = |light: &PointLight| matches!(light, PointLight::Directional { .. });
        let has_distant = self.scene.environment.is_some() || self.scene.lights.iter().any(is_distant);
        let size = [self.settings.width, self.settings.height];
        // Other lights need no focus: their photons start at surfaces.
        let focus = has_distant.then(|| visible_focus((self.scene, &self.bvh), size, self.level)).flatten();
        self.emission_around(focus, arena)
    }

    /// The same with this focus of the light from infinity.
    pub(crate) fn emission_around<'m>(
        &self,
        focus: Option<Focus>,
        arena: &mut Arena<'m>,
    ) -> Result<EmissionSampler<'m>, OutOfMemory> {
        EmissionSampler::build_around(self.scene, &self.lights, (&self.bvh.bounds(), focus), arena)
    }

    /// Pixels of the picture.
    pub fn pixels(&self) -> usize {
        self.settings.width as usize * self.settings.height as usize
    }
}

/// The last photon maps of a method.
#[derive(Default)]
pub struct LastMaps<'a> {
    /// Photons of reflected light or of all light.
    pub global: Option<PhotonMap<'a>>,
    /// Photons of caustics.
    pub caustic: Option<PhotonMap<'a>>,
}

/// A method at work on one scene.
///
/// Sample `n` of a pixel follows from the scene, the settings and `n`: neither from the division of samples
/// into rounds nor from threads. A structure that several pixels use is drawn anew, or kept twice, for even
/// and odd `n`: the halves of the film stay independent, and their difference shows all that is random.
pub trait RenderMethod {
    /// One round: brings the tiles of the film to their target, or less if the executor ends it early.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory>;

    /// Decisions and numbers of its parts, for reports.
    fn findings(&self) -> Findings {
        Findings::default()
    }

    /// Its last photon maps, if it has some.
    ///
    /// # Errors
    /// Those of [`PhotonMapStore::map`].
    fn last_maps(&mut self) -> Result<LastMaps<'_>, OutOfMemory> {
        Ok(LastMaps::default())
    }
}

#[cfg(test)]
mod tests;
