//! Memory of a method in its usual size, known before anything is built.

use super::{MethodKind, MethodOptions};
use crate::bsdf::Features;
use crate::light::LightSampler;
use crate::memory::Footprint;
use crate::method::bidirectional::{Bidirectional, BidirectionalSettings};
use crate::method::cache_resolution::CacheResolution;
use crate::method::cached_paths::CachedPathTracing;
use crate::method::instant_radiosity::InstantRadiosity;
use crate::method::irradiance_cache::CacheSettings;
use crate::method::metropolis::Metropolis;
use crate::method::path::PathTracing;
use crate::method::photon_map::PhotonMapping;
use crate::method::record_placement::CacheBuilder;
use crate::method::sppm::ProgressivePhotonMapping;
use crate::method::view_placement::Views;
use crate::method::{RenderState, caustics, counts, emission_guide, environment_visibility};
use crate::scene::Scene;
use crate::transport::photon_mapping::deposit::PhotonFilter;

/// A picture before anything is built.
#[derive(Clone, Copy)]
pub(super) struct Unbuilt<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) size: [u32; 2],
    pub(super) options: &'a MethodOptions,
}

impl Unbuilt<'_> {
    fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    fn lights(&self) -> usize {
        LightSampler::count_in(self.scene)
    }

    /// Memory of the method of `kind` and of its prepasses.
    pub(super) fn footprint<F: Features>(&self, kind: MethodKind, cache: &CacheSettings) -> Footprint {
        let Self { scene, size, options, .. } = *self;
        let (pixels, lights) = (self.pixels(), self.lights());
        let guide = |filter| emission_guide::footprint(lights, size, filter);
        let guides = guide(PhotonFilter::All).and(guide(PhotonFilter::Caustic));
        match kind {
            MethodKind::Path => self.caustics(),
            MethodKind::IrradianceCache | MethodKind::RadianceCache => {
                self.caches(cache).and(self.caustics())
            }
            MethodKind::PhotonMap => {
                PhotonMapping::<F>::footprint(scene, pixels, &options.photons).and(guides)
            }
            MethodKind::ProgressivePhotons => {
                let guide = guide(PhotonFilter::Reflected);
                ProgressivePhotonMapping::<F>::footprint(pixels, &options.photons).and(guide)
            }
            MethodKind::LightTracing | MethodKind::Bidirectional | MethodKind::VertexMerging => {
                let counts = options.bidirectional.of(kind);
                let usual = Bidirectional::<F>::usual_footprint(scene, size, &counts);
                let pilot = match counts.is_complete() || kind == MethodKind::LightTracing {
                    true => Footprint::default(),
                    false => self.caustics(),
                };
                usual.and(guides).and(pilot)
            }
            MethodKind::InstantRadiosity | MethodKind::ClampedInstantRadiosity => {
                InstantRadiosity::<F>::usual_footprint(size, lights, &options.virtual_lights)
                    .and(guide(PhotonFilter::All))
            }
            MethodKind::Metropolis => Metropolis::<F>::usual_footprint(size, lights, &options.metropolis),
        }
    }

    /// Memory of the choice among methods: path tracing, which is tried, and the largest of those that may
    /// replace it.
    pub(super) fn footprint_of_all<F: Features>(
        &self,
        cache: impl Fn(MethodKind) -> CacheSettings,
    ) -> Footprint {
        let counts = BidirectionalSettings { merging: Some(false), ..self.options.bidirectional };
        let counts = MethodOptions { bidirectional: counts, ..*self.options };
        let of = |kind| Unbuilt { options: &counts, ..*self }.footprint::<F>(kind, &cache(kind));
        let caches = of(MethodKind::IrradianceCache).or(of(MethodKind::RadianceCache));
        let light_paths = of(MethodKind::Bidirectional);
        let photons =
            if caustics::are_possible(self.scene) { self.photon_pilot::<F>() } else { Footprint::default() };
        of(MethodKind::Path).and(caches.or(light_paths).or(photons))
    }

    /// Memory of the pilot of progressive photon mapping: a film beside the method.
    pub(super) fn photon_pilot<F: Features>(&self) -> Footprint {
        let photons = ProgressivePhotonMapping::<F>::footprint(self.pixels(), &self.options.photons);
        let guide = emission_guide::footprint(self.lights(), self.size, PhotonFilter::Reflected);
        photons.and(guide).and(RenderState::footprint(self.size[0], self.size[1]))
    }

    /// Memory of the visibility of the environment.
    pub(super) fn visibility(&self) -> Footprint {
        match self.scene.environment {
            Some(_) => environment_visibility::footprint(),
            None => Footprint::default(),
        }
    }

    /// Working memory of a worker that learns this visibility.
    pub(super) fn visibility_scratch<F: Features>(&self) -> Footprint {
        environment_visibility::scratch::<F>()
    }

    /// Working memory of a worker for the method of `kind` and its prepasses.
    pub(super) fn scratch<F: Features>(&self, kind: MethodKind, cache: &CacheSettings) -> Footprint {
        let of_paths = match self.may_have_caustics() {
            true => caustics::scratch::<F>(),
            false => PathTracing::<F>::scratch(),
        };
        match kind {
            MethodKind::Path => of_paths,
            MethodKind::IrradianceCache | MethodKind::RadianceCache => {
                // A picture whose time is limited may have a finer cache.
                let finest = CacheResolution::FINEST.strata as usize;
                let finer = CacheSettings { strata: cache.strata.max(finest), ..*cache };
                let settings = if self.options.cache.is_open() { &finer } else { cache };
                CachedPathTracing::<F>::scratch(settings, self.may_have_caustics())
            }
            MethodKind::PhotonMap => PhotonMapping::<F>::scratch(),
            MethodKind::ProgressivePhotons => ProgressivePhotonMapping::<F>::scratch(),
            MethodKind::LightTracing | MethodKind::Bidirectional | MethodKind::VertexMerging => {
                let counts = self.options.bidirectional.of(kind);
                let bidirectional = Bidirectional::<F>::scratch(&counts);
                match kind {
                    MethodKind::LightTracing => bidirectional,
                    _ => bidirectional.or(counts::scratch::<F>()).or(of_paths),
                }
            }
            MethodKind::InstantRadiosity | MethodKind::ClampedInstantRadiosity => {
                InstantRadiosity::<F>::scratch()
            }
            MethodKind::Metropolis => Metropolis::<F>::scratch(),
        }
    }

    /// Working memory of a worker for the choice among methods and for each of them.
    pub(super) fn scratch_of_all<F: Features>(
        &self,
        cache: impl Fn(MethodKind) -> CacheSettings,
    ) -> Footprint {
        let kinds = [MethodKind::IrradianceCache, MethodKind::RadianceCache, MethodKind::VertexMerging];
        let choice = crate::method::choice::scratch::<F>();
        kinds.into_iter().fold(choice, |scratch, kind| scratch.or(self.scratch::<F>(kind, &cache(kind))))
    }

    fn may_have_caustics(&self) -> bool {
        self.options.paths.caustics && caustics::are_possible(self.scene)
    }

    /// Memory of caustic photons and their prepass.
    fn caustics(&self) -> Footprint {
        match self.may_have_caustics() {
            true => caustics::footprint(self.lights(), self.pixels()),
            false => Footprint::default(),
        }
    }

    /// Memory of caches.
    fn caches(&self, cache: &CacheSettings) -> Footprint {
        let records = cache.records(self.pixels()).saturating_add(cache.fewest);
        let records = CacheBuilder::footprint(records, cache.representation());
        let lobes = match cache.lobes {
            Some(_) => cache.lobe_footprint(self.scene).and(Views::usual_footprint(self.pixels())),
            None => Footprint::default(),
        };
        cache.gathering_footprint().and(records).and(records).and(lobes)
    }
}
