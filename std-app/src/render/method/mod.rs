//! Rendering methods: properties, interface and setup.
//!
//! A round consists of passes over a method's structures and of tiles of the picture, all run in parallel
//! ("The unit of work" in docs/architecture.md). A new method needs a variant and a row in
//! [`properties`], and an arm in [`set_up`].

mod bidirectional;
mod cache_settings;
mod choice;
mod irradiance_cache;
mod path;
mod photon_view;
mod prepared;
mod properties;
#[cfg(test)]
mod wrong;

pub use cache_settings::CacheSettings;
pub use halflight_core::cache::radiance::{Basis, LobeSettings};
pub use halflight_core::method::PhotonSettings;
pub use photon_view::{MapView, PhotonView};
pub use properties::Method;

use super::audit::Audit;
use super::memory::Memory;
use super::rewritten_file::RewrittenFile;
use super::run::path_settings;
use super::survey::Survey;
use super::threads::{ThreadedRound, Threads, Workers};
use super::{RenderError, RenderResult, Settings};
use crate::save::Patience;
use core::marker::PhantomData;
use halflight_core::bsdf::Features;
use halflight_core::bvh::Bvh;
use halflight_core::findings::{Findings, Value};
use halflight_core::light::LightSampler;
use halflight_core::memory::{Footprint, Line, OutOfMemory};
use halflight_core::method::cache_resolution::CachedPicture;
use halflight_core::method::caustics::CausticPathTracing;
use halflight_core::method::choice::Goal;
use halflight_core::method::counts::Choice;
use halflight_core::method::instant_radiosity::InstantRadiosity;
use halflight_core::method::metropolis::Metropolis;
use halflight_core::method::photon_map::PhotonMapping;
use halflight_core::method::sppm::ProgressivePhotonMapping;
use halflight_core::method::{Method as CoreMethod, PilotSize, RenderContext, rays_per_second};
use halflight_core::scene::Scene;
use halflight_core::transport::{CausticMerging, PathIntegrator, PathSettings};
use prepared::Prepared;

/// A method to set up, with the decisions of prepasses that have run.
pub(super) struct Plan<'a, F> {
    method: Method,
    /// Method to report: the requested one where path tracing replaces it.
    reported: Method,
    /// True if prepasses may choose another method.
    is_open: bool,
    /// Path tracing without caustic photons, by its prepass.
    paths: Option<Box<CausticPathTracing<'a, F>>>,
    /// Counts of bidirectional techniques.
    counts: Option<Choice>,
    /// Prediction of a picture with a cache.
    picture: Option<CachedPicture>,
    /// Findings of the prepasses.
    findings: Findings,
}

impl<F> From<Method> for Plan<'_, F> {
    fn from(method: Method) -> Self {
        let findings = Findings::default();
        Self { method, reported: method, is_open: false, paths: None, counts: None, picture: None, findings }
    }
}

impl<F> Plan<'_, F> {
    /// Path tracing, unless prepasses predict less error by another method.
    pub(super) fn open() -> Self {
        Self { is_open: true, ..Method::Path.into() }
    }

    /// Path tracing in place of the chosen method of `picture`, which cannot reach the requested error.
    pub(super) fn instead_of(picture: &RenderResult) -> Self {
        let mut finding = picture.findings.get("method").copied().unwrap_or_default();
        finding.topic = "method";
        finding.reason = "the chosen method cannot reach the requested error: path tracing takes its place";
        let findings = finding.with("given_up", Value::Name(picture.method.name())).into();
        Self { findings, ..Method::Path.into() }
    }

    /// A method with a cache that suits the predicted `picture`.
    fn with_cache(method: Method, picture: CachedPicture) -> Self {
        Self { picture: Some(picture), ..method.into() }
    }

    /// A bidirectional method with the counts of `choice`.
    fn with_counts(method: Method, choice: Choice) -> Self {
        Self { counts: Some(choice), findings: choice.findings(), ..method.into() }
    }
}

/// Outcome of setting a method up.
pub(super) enum Attempt<'a, 'm, F> {
    /// The method, with its structures in memory.
    Ready(Box<dyn Renderer + 'm>),
    /// A prepass prefers this plan, for which the memory of the attempt is to be released first.
    Instead(Box<Plan<'a, F>>),
}

/// Takes memory and sets up the method of `plan`.
pub(super) fn set_up<'a: 'm, 'm, F: Features>(
    plan: Plan<'a, F>,
    setup: &RenderSetup<'a>,
    memory: &mut Memory<'m>,
) -> Result<Attempt<'a, 'm, F>, RenderError> {
    let (context, settings, method) = (&setup.context(), setup.settings, plan.method);
    let (reported, findings) = (plan.reported, plan.findings);
    let renderer: Box<dyn Renderer + 'm> = match method {
        Method::Path => match path::set_up(plan, setup, memory)? {
            Attempt::Ready(renderer) => renderer,
            instead => return Ok(instead),
        },
        Method::IrradianceCache | Method::RadianceCache => {
            let picture = plan.picture.or_else(|| setup.cached_picture()).filter(|_| setup.has_open_cache());
            Box::new(irradiance_cache::Cached::<F>::new((method, picture), setup, memory)?)
        }
        Method::PhotonMap => {
            let scratch = PhotonMapping::<F>::scratch();
            Adapter::<F, _>::boxed(setup, memory, (method, scratch), |memory, executor, reserve| {
                PhotonMapping::<F>::new(context, settings.photons, reserve, memory, executor)
            })?
        }
        Method::ProgressivePhotons => {
            let scratch = ProgressivePhotonMapping::<F>::scratch();
            Adapter::<F, _>::boxed(setup, memory, (method, scratch), |memory, executor, reserve| {
                ProgressivePhotonMapping::<F>::new(context, settings.photons, reserve, memory, executor)
            })?
        }
        Method::LightTracing | Method::Bidirectional | Method::VertexMerging => {
            match bidirectional::set_up(plan, setup, memory)? {
                Attempt::Ready(renderer) => renderer,
                instead => return Ok(instead),
            }
        }
        Method::InstantRadiosity | Method::ClampedInstantRadiosity => {
            let form = (method == Method::ClampedInstantRadiosity, settings.reuse);
            let scratch = InstantRadiosity::<F>::scratch();
            Adapter::<F, _>::boxed(setup, memory, (method, scratch), |memory, executor, reserve| {
                let lights = &settings.virtual_lights;
                InstantRadiosity::<F>::new(context, lights, form, memory, executor, reserve)
            })?
        }
        Method::Metropolis => {
            let scratch = Metropolis::<F>::scratch();
            Adapter::<F, _>::boxed(setup, memory, (method, scratch), |memory, executor, reserve| {
                Metropolis::<F>::new(context, &settings.metropolis, memory, executor, reserve)
            })?
        }
        #[cfg(test)]
        Method::Wrong => Box::new(wrong::Wrong::<F>::new(setup, memory)?),
    };
    let renderer: Box<dyn Renderer + 'm> = match findings == Findings::default() {
        true => renderer,
        false => Box::new(Prepared { renderer, reported, findings }),
    };
    Ok(Attempt::Ready(renderer))
}

/// Structures that all methods use.
#[derive(Clone, Copy)]
pub(super) struct RenderSetup<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) bvh: Bvh<'a>,
    pub(super) lights: LightSampler<'a>,
    pub(super) settings: &'a Settings,
    pub(super) workers: &'a Workers<'a>,
}

impl<'a> RenderSetup<'a> {
    /// Path tracer of the picture, with another `seed`.
    pub(super) fn paths<F: Features>(&self, seed: u32) -> PathIntegrator<'a, F> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        let paths = PathSettings { seed, ..path_settings(settings) };
        PathIntegrator::new(scene, &bvh, &lights, paths, settings.level)
    }

    /// Rays that the time of the picture allows, if it is limited.
    pub(super) fn most_rays(&self) -> Option<f64> {
        let seconds = self.settings.stop.seconds?;
        let rays = rays_per_second(self.scene.mesh.triangles.len());
        Some(seconds * self.workers.count() as f64 * rays)
    }

    /// End of the picture.
    pub(super) fn goal(&self) -> Goal {
        let stop = &self.settings.stop;
        Goal { rays: self.most_rays(), samples: stop.most_samples(), error: stop.error }
    }

    /// Size of pilots.
    fn pilots(&self) -> PilotSize {
        self.goal().rays_alone().map_or(PilotSize::USUAL, PilotSize::of_picture)
    }

    /// Whether rays and density of records may be chosen: time alone ends the picture, and neither settings
    /// nor files fix them.
    pub(super) fn has_open_cache(&self) -> bool {
        let Settings { cache, load_cache, save_cache, .. } = self.settings;
        self.goal().rays_alone().is_some() && cache.is_open() && load_cache.is_none() && save_cache.is_none()
    }

    /// Picture of a requested cache, if its time is limited.
    fn cached_picture(&self) -> Option<CachedPicture> {
        Some(CachedPicture::of_time(self.most_rays()? / f64::from(self.settings.shard.count)))
    }

    /// Context for methods of the core.
    pub(super) fn context(&self) -> RenderContext<'a> {
        let Self { scene, bvh, lights, settings, .. } = *self;
        let (paths, pilots) = (path_settings(settings), self.pilots());
        RenderContext { scene, bvh, lights, settings: paths, level: settings.level, pilots }
    }
}

/// Callback of paths that borrow caustic photons.
pub(super) type Borrower<'b> = dyn FnMut(Option<CausticMerging>) -> Result<(), RenderError> + 'b;

/// A method at work on one scene. It owns its structures, but not the film.
pub(super) trait Renderer {
    /// The method to report in films and results.
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

/// A method with working memory for each thread.
struct Adapter<'a, F, M> {
    setup: RenderSetup<'a>,
    method: M,
    scratch: Vec<Vec<Line>>,
    chosen: Method,
    features: PhantomData<F>,
}

impl<'a, F: Features, M: CoreMethod> Adapter<'a, F, M> {
    /// The method that `new` makes with `scratch` for each thread, besides the bytes of the audit.
    fn boxed<'s: 'a>(
        setup: &RenderSetup<'s>,
        memory: &mut Memory<'a>,
        (chosen, scratch): (Method, Footprint),
        new: impl FnOnce(&mut Memory<'a>, &mut Threads, usize) -> Result<M, OutOfMemory>,
    ) -> Result<Box<dyn Renderer + 'a>, RenderError>
    where
        M: 'a,
    {
        let mut scratch = memory.take_each("paths", scratch, setup.workers.count())?;
        let reserve = Audit::bytes::<F>(setup, chosen.is_biased());
        let method = new(memory, &mut Threads::new(setup.workers, &mut scratch), reserve)?;
        Ok(Box::new(Self::with(setup, (chosen, scratch), method)))
    }

    /// A method that is set up.
    fn with(setup: &RenderSetup<'a>, (chosen, scratch): (Method, Vec<Vec<Line>>), method: M) -> Self {
        Self { setup: *setup, method, scratch, chosen, features: PhantomData }
    }
}

impl<F: Features, M: CoreMethod> Renderer for Adapter<'_, F, M> {
    fn chosen(&self) -> Method {
        self.chosen
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        Ok(round.run(&mut self.scratch, |round| self.method.round(round))?)
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        Ok(photon_view::render::<F>(&self.setup, &self.method.last_maps()?)?)
    }

    fn findings(&self) -> Findings {
        self.method.findings()
    }
}
