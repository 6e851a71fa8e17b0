//! Setup of a method: prepasses choose what is left open, then the method takes its memory.

mod choice;
mod light_paths;
mod memory;
mod paths;

use super::any::{AnyMethod, ChosenMethod};
use super::cache_resolution::CachedPicture;
use super::cached_paths::{self, CachedPathTracing, KeptCaches};
use super::caustics::{self, CausticPathTracing, CausticUse};
use super::choice::Goal;
use super::counts::Choice;
use super::executor::Executor;
use super::instant_radiosity::InstantRadiosity;
use super::irradiance_cache::CacheSettings;
use super::metropolis::Metropolis;
use super::path::PathTracing;
use super::photon_map::PhotonMapping;
use super::sppm::ProgressivePhotonMapping;
use super::{CacheOptions, MethodKind, MethodOptions, RenderContext, RenderMethod};
use crate::bsdf::Features;
use crate::findings::{Finding, Findings, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::scene::Scene;

/// Everything by which a method is set up.
#[derive(Clone, Copy)]
pub struct MethodSetup<'a, 's> {
    /// The scene, and the settings of its paths.
    pub context: RenderContext<'a>,
    /// Options of all methods.
    pub options: MethodOptions,
    /// End of the picture.
    pub goal: Goal,
    /// Parts in which the picture is rendered.
    pub shards: u32,
    /// Bytes that stay free for an audit: of unbiased methods, and of biased ones.
    pub reserve: [usize; 2],
    /// True if biased methods are audited, so that they may be chosen.
    pub is_audited: bool,
    /// True if the picture is reconstructed, so that the noise of its samples counts less.
    pub is_reconstructed: bool,
    /// Records that caches begin with.
    pub kept: KeptCaches<'s>,
    /// True if records become wider where there was no time to fill the caches. Records in files do not.
    pub widens: bool,
    /// True if gather rays and density of records are those of the options, since files hold the records.
    pub has_fixed_records: bool,
    /// True if there is no room for the working memory of caustic photons.
    pub lacks_memory: bool,
}

impl MethodSetup<'_, '_> {
    /// True if the scene can have caustics and photons are enabled.
    fn may_have_caustics(&self) -> bool {
        !self.lacks_memory && self.has_caustics()
    }

    /// True if the scene can have caustics and photons are enabled, whether there is memory or not.
    fn has_caustics(&self) -> bool {
        self.options.paths.caustics && caustics::are_possible(self.context.scene)
    }

    /// Use of photons that have no prepass.
    fn without_prepass(&self) -> CausticUse {
        CausticUse { lacks_memory: self.lacks_memory && self.has_caustics(), ..CausticUse::default() }
    }

    /// True if rays and density of records may be chosen: time alone ends the picture, and neither options
    /// nor files fix them.
    pub fn has_open_cache(&self) -> bool {
        self.goal.rays_alone().is_some() && self.options.cache.is_open() && !self.has_fixed_records
    }

    /// Picture of a requested cache, if its time is limited.
    fn cached_picture(&self) -> Option<CachedPicture> {
        Some(CachedPicture::of_time(self.goal.rays? / f64::from(self.shards)))
    }

    fn reserve(&self, kind: MethodKind) -> usize {
        self.reserve[usize::from(kind.is_biased())]
    }

    /// Settings of the caches of `kind`.
    fn cache_settings(&self, kind: MethodKind) -> CacheSettings {
        CacheSettings {
            fewest: self.kept.halves.iter().map(|half| half.records.len()).max().unwrap_or(0),
            reserve: self.reserve(kind),
            widens: self.widens,
            ..self.options.cache_settings(kind)
        }
    }

    /// Settings of the caches of `kind` in a picture with this prediction.
    fn settings_for(&self, kind: MethodKind, picture: Option<CachedPicture>) -> CacheSettings {
        let picture = picture.or_else(|| self.cached_picture()).filter(|_| self.has_open_cache());
        CacheSettings { picture, ..self.cache_settings(kind) }
    }
}

impl MethodOptions {
    /// Settings of the caches of `kind`.
    fn cache_settings(&self, kind: MethodKind) -> CacheSettings {
        let CacheOptions { metric, records, .. } = self.cache;
        CacheSettings {
            metric,
            error: self.cache.allowed(),
            strata: self.cache.strata() as usize,
            records,
            fewest: 0,
            reserve: 0,
            widens: true,
            lobes: (kind == MethodKind::RadianceCache).then_some(self.lobes),
            picture: None,
        }
    }
}

/// A method to set up, with the decisions of prepasses that have run.
#[derive(Clone, Copy)]
pub struct MethodPlan<'a, F> {
    kind: MethodKind,
    /// Kind to report: the requested one where path tracing replaces it.
    reported: MethodKind,
    /// True if prepasses may choose another method.
    is_open: bool,
    /// Path tracing without caustic photons, by its prepass.
    paths: Option<(PathTracing<'a, F>, CausticUse)>,
    /// Counts of bidirectional techniques.
    counts: Option<Choice>,
    /// Prediction of a picture with a cache.
    picture: Option<CachedPicture>,
    /// Findings of the prepasses.
    findings: Findings,
}

/// Outcome of setting a method up.
#[expect(clippy::large_enum_variant, reason = "the core has no heap to box a variant in")]
pub enum Attempt<'a, 'm, F> {
    /// The method, with its structures in memory.
    Ready(ChosenMethod<'m, F>),
    /// A prepass prefers this plan. The memory of the attempt is of no more use.
    Instead(MethodPlan<'a, F>),
}

impl<F> From<MethodKind> for MethodPlan<'_, F> {
    fn from(kind: MethodKind) -> Self {
        let findings = Findings::default();
        Self { kind, reported: kind, is_open: false, paths: None, counts: None, picture: None, findings }
    }
}

impl<'a, F: Features> MethodPlan<'a, F> {
    /// Path tracing, unless prepasses predict less error by another method.
    pub fn open() -> Self {
        Self { is_open: true, ..MethodKind::Path.into() }
    }

    /// Path tracing in place of the chosen method of `kind`, which cannot reach the requested error;
    /// `findings` are its own.
    pub fn instead_of(kind: MethodKind, findings: &Findings) -> Self {
        let mut finding: Finding = findings.get("method").copied().unwrap_or_default();
        finding.topic = "method";
        finding.reason = "the chosen method cannot reach the requested error: path tracing takes its place";
        let findings = finding.with("given_up", Value::Name(kind.name())).into();
        Self { findings, ..MethodKind::Path.into() }
    }

    /// Memory of the method of `options` in its usual size, its prepasses included, for a picture of `size`
    /// of `scene`; `None` leaves the method open. And working memory of a worker for all plans that it may
    /// lead to.
    pub fn required_memory(
        kind: Option<MethodKind>,
        options: &MethodOptions,
        (scene, size): (&Scene, [u32; 2]),
    ) -> [Footprint; 2] {
        let unbuilt = memory::Unbuilt { scene, size, options };
        let cache = |kind: MethodKind| options.cache_settings(kind);
        let structures = match kind {
            Some(kind) => unbuilt.footprint::<F>(kind, &cache(kind)),
            None => unbuilt.footprint_of_all::<F>(cache),
        };
        let scratch = match kind {
            Some(kind) => unbuilt.scratch::<F>(kind, &cache(kind)),
            None => unbuilt.scratch_of_all::<F>(cache),
        };
        [structures.and(unbuilt.visibility()), scratch.or(unbuilt.visibility_scratch::<F>())]
    }

    /// Kind of the method.
    pub fn kind(&self) -> MethodKind {
        self.kind
    }

    /// A bidirectional method with the counts of `choice`.
    fn with_counts(kind: MethodKind, choice: Choice) -> Self {
        Self { counts: Some(choice), findings: choice.findings(), ..kind.into() }
    }

    /// Working memory of a worker for the prepasses and the picture of this plan. Plans that it leads to have
    /// their own.
    pub fn scratch(&self, setup: &MethodSetup) -> Footprint {
        match self.kind {
            MethodKind::Path => match (self.is_open, setup.may_have_caustics()) {
                (true, _) => super::choice::scratch::<F>().or(super::counts::scratch::<F>()),
                (false, true) => caustics::scratch::<F>(),
                (false, false) => PathTracing::<F>::scratch(),
            },
            MethodKind::IrradianceCache | MethodKind::RadianceCache => {
                let settings = setup.settings_for(self.kind, self.picture);
                CachedPathTracing::<F>::scratch(&settings, setup.may_have_caustics())
            }
            MethodKind::PhotonMap => PhotonMapping::<F>::scratch(),
            MethodKind::ProgressivePhotons => ProgressivePhotonMapping::<F>::scratch(),
            MethodKind::LightTracing | MethodKind::Bidirectional | MethodKind::VertexMerging => {
                light_paths::scratch(self, setup)
            }
            MethodKind::InstantRadiosity | MethodKind::ClampedInstantRadiosity => {
                InstantRadiosity::<F>::scratch()
            }
            MethodKind::Metropolis => Metropolis::<F>::scratch(),
        }
    }

    /// Setup without caustic photons, where `workers` have too little memory for them within `available`
    /// bytes beside the least that the method needs; otherwise `setup`.
    pub fn within_memory<'s>(
        &self,
        setup: MethodSetup<'a, 's>,
        workers: usize,
        available: usize,
    ) -> MethodSetup<'a, 's> {
        let without = MethodSetup { lacks_memory: true, ..setup };
        let [scratch, least_scratch] =
            [&setup, &without].map(|setup| self.scratch(setup).bytes().saturating_mul(workers));
        let may_have = match self.kind {
            MethodKind::IrradianceCache | MethodKind::RadianceCache => {
                let settings = setup.settings_for(self.kind, self.picture);
                let least = cached_paths::least_memory(&settings, setup.context.scene);
                // Records and photons share the memory equally, and records keep at least half of it.
                let reserved = least.saturating_add(caustics::least_footprint().bytes());
                let photons = caustics::least_memory(setup.context.lights.count(), reserved);
                let rest = available.saturating_sub(least_scratch.saturating_add(least));
                available.checked_sub(scratch.saturating_add(photons)).is_some_and(|left| left >= rest / 2)
            }
            _ => scratch <= available,
        };
        if may_have { setup } else { without }
    }

    /// Takes memory and sets up the method.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` is too small, or the executor's scratch is smaller than
    /// [`MethodPlan::scratch`].
    pub fn set_up<'m>(
        self,
        setup: &MethodSetup<'a, '_>,
        memory: &mut impl MemorySource<'m>,
        executor: &mut impl Executor,
    ) -> Result<Attempt<'a, 'm, F>, OutOfMemory>
    where
        'a: 'm,
    {
        let MethodSetup { context, options, goal, .. } = setup;
        let (kind, reserve) = (self.kind, setup.reserve(self.kind));
        let method = match kind {
            MethodKind::Path => return paths::set_up(self, setup, memory, executor),
            MethodKind::LightTracing | MethodKind::Bidirectional | MethodKind::VertexMerging => {
                return light_paths::set_up(self, setup, memory, executor);
            }
            MethodKind::IrradianceCache | MethodKind::RadianceCache => {
                let settings = setup.settings_for(kind, self.picture);
                let photons = match setup.may_have_caustics() {
                    true => Ok(goal.rays),
                    false => Err(setup.without_prepass()),
                };
                let begin = (&setup.kept, photons);
                AnyMethod::Cached(CachedPathTracing::new(context, settings, begin, memory, executor)?)
            }
            MethodKind::PhotonMap => {
                AnyMethod::PhotonMap(PhotonMapping::new(context, options.photons, reserve, memory, executor)?)
            }
            MethodKind::ProgressivePhotons => AnyMethod::ProgressivePhotons(ProgressivePhotonMapping::new(
                context,
                options.photons,
                reserve,
                memory,
                executor,
            )?),
            MethodKind::InstantRadiosity | MethodKind::ClampedInstantRadiosity => {
                let form = (kind == MethodKind::ClampedInstantRadiosity, options.paths.reuse);
                let lights = &options.virtual_lights;
                AnyMethod::VirtualLights(InstantRadiosity::new(
                    context, lights, form, memory, executor, reserve,
                )?)
            }
            MethodKind::Metropolis => {
                let settings = &options.metropolis;
                AnyMethod::Chains(Metropolis::new(context, settings, memory, executor, reserve)?)
            }
        };
        Ok(Attempt::Ready(self.chosen(method)))
    }

    /// Findings of the paths that a prepass has made.
    fn findings_of_paths(&self) -> Findings {
        let Some((paths, caustics)) = self.paths else { return Findings::default() };
        CausticPathTracing::without_photons(paths, caustics).findings()
    }

    /// `method`, with the findings of the plan.
    fn chosen<'m>(self, method: AnyMethod<'m, F>) -> ChosenMethod<'m, F> {
        ChosenMethod { method, kind: self.reported, findings: self.findings }
    }
}
