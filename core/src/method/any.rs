//! A method at work, of any kind.

use super::bidirectional::Bidirectional;
use super::cached_paths::CachedPathTracing;
use super::caustics::CausticPathTracing;
use super::executor::Executor;
use super::instant_radiosity::InstantRadiosity;
use super::metropolis::Metropolis;
use super::photon_map::PhotonMapping;
use super::sppm::ProgressivePhotonMapping;
use super::{LastMaps, MethodKind, RenderMethod, Round};
use crate::bsdf::Features;
use crate::findings::Findings;
use crate::memory::OutOfMemory;

/// A method with its structures in memory.
#[expect(clippy::large_enum_variant, reason = "the core has no heap to box a variant in")]
pub enum AnyMethod<'a, F> {
    /// Path tracing, with caustic photons where they pay.
    Paths(CausticPathTracing<'a, F>),
    /// Irradiance or radiance caching.
    Cached(CachedPathTracing<'a, F>),
    /// Photon mapping with final gathering.
    PhotonMap(PhotonMapping<'a, F>),
    /// Stochastic progressive photon mapping.
    ProgressivePhotons(ProgressivePhotonMapping<'a, F>),
    /// Light tracing, bidirectional path tracing, and vertex connection and merging.
    LightPaths(Bidirectional<'a, F>),
    /// Instant radiosity.
    VirtualLights(InstantRadiosity<'a, F>),
    /// Metropolis light transport.
    Chains(Metropolis<'a, F>),
}

/// A method that is set up, and the decisions of the prepasses that chose it.
pub struct ChosenMethod<'a, F> {
    /// The method.
    pub method: AnyMethod<'a, F>,
    /// Kind to report in films and results: the requested one where path tracing takes its place.
    pub kind: MethodKind,
    /// Findings of the prepasses.
    pub(super) findings: Findings,
}

/// Runs `$work` on the method in `$any`.
macro_rules! of_any {
    ($any:expr, $method:ident => $work:expr) => {
        match $any {
            AnyMethod::Paths($method) => $work,
            AnyMethod::Cached($method) => $work,
            AnyMethod::PhotonMap($method) => $work,
            AnyMethod::ProgressivePhotons($method) => $work,
            AnyMethod::LightPaths($method) => $work,
            AnyMethod::VirtualLights($method) => $work,
            AnyMethod::Chains($method) => $work,
        }
    };
}

impl<'a, F: Features> ChosenMethod<'a, F> {
    /// The caches, if the method has some.
    pub fn cached(&self) -> Option<&CachedPathTracing<'a, F>> {
        match &self.method {
            AnyMethod::Cached(cached) => Some(cached),
            _ => None,
        }
    }
}

impl<F: Features> RenderMethod for ChosenMethod<'_, F> {
    fn round<E: Executor>(&mut self, round: &mut Round<E>) -> Result<(), OutOfMemory> {
        of_any!(&mut self.method, method => method.round(round))
    }

    fn findings(&self) -> Findings {
        self.findings.and(of_any!(&self.method, method => method.findings()))
    }

    fn last_maps(&mut self) -> Result<LastMaps<'_>, OutOfMemory> {
        of_any!(&mut self.method, method => method.last_maps())
    }
}
