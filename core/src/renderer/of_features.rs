//! Renderer compiled for one set of features.

use super::reconstructing;
use super::rounds::{Estimates, Rounds, Stop};
use super::{RenderError, RequiredMemory, Settings, Until};
use crate::audit::{Audit, AuditSettings, ErrorReport, ExtraTime, MethodAtWork, Spent, audit_fraction};
use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::film::{Film, PIXELS_PER_TILE, Pixel};
use crate::findings::Findings;
use crate::light::LightSampler;
use crate::memory::{Arena, Buffer, OutOfMemory};
use crate::method::cached_paths::KeptCaches;
use crate::method::caustics;
use crate::method::environment_visibility::learn;
use crate::method::hidden_light::HiddenLight;
use crate::method::{
    Attempt, ChosenMethod, Executor, Loop, MethodKind, MethodPlan, MethodSetup, PilotSize, RenderContext,
    RenderMethod, RenderState, Round, Shard,
};
use crate::reconstruction::FilmReconstruction;
use crate::scene::Scene;

/// Reading of a clock that does not exist.
const NO_CLOCK: f64 = 0.0;

/// Samples of a tile between two questions whether the executor is over.
const STEP: u32 = 8;

/// Samples at which an audit begins: one for each quarter of the film.
const FIRST_OF_AUDIT: u32 = 4;

/// A [`Renderer`](super::Renderer) of scenes that have no other features than `F`.
pub struct FeatureRenderer<'a, F> {
    method: ChosenMethod<'a, F>,
    state: RenderState<'a>,
    audit: Option<Audit<'a, F>>,
    reconstruction: Option<FilmReconstruction<'a>>,
    /// Light that the method cannot find.
    hidden: Option<HiddenLight>,
    /// True if the audit may continue alone, since its fraction of the work is not requested.
    is_audit_open: bool,
    /// Memory that the audit borrows.
    memory: Buffer<'a>,
    /// Number of samples and upper end of the first estimate of noise.
    first_noise: Option<(u32, f64)>,
}

impl<'a, F: Features> FeatureRenderer<'a, F> {
    /// See [`Renderer::required_memory`](super::Renderer::required_memory).
    pub fn required_memory(scene: &Scene, settings: &Settings) -> RequiredMemory {
        let [width, height] = settings.size;
        let options = settings.method.options();
        let kind = settings.method.kind();
        let [method, scratch] = MethodPlan::<F>::required_memory(kind, &options, (scene, settings.size));
        let bvh = Bvh::footprint_of(&scene.mesh);
        let lights = LightSampler::footprint(scene).and(LightSampler::scratch(scene));
        let film = RenderState::footprint(width, height);
        // Prepasses may choose a biased method.
        let is_biased = kind.is_none_or(MethodKind::is_biased);
        let (audit, audit_scratch) = match audit_fraction(settings.audit, is_biased) {
            Some(_) => {
                let lights = LightSampler::count_in(scene);
                (Audit::<F>::reserve(settings.size, lights, is_biased), Audit::<F>::scratch())
            }
            None => Default::default(),
        };
        // Light is hidden where it has no extent.
        let (hidden, hidden_scratch) = match !scene.lights.is_empty() && caustics::are_possible(scene) {
            true => {
                let hidden = HiddenLight::footprint(LightSampler::count_in(scene), settings.size);
                (hidden, MethodAtWork::scratch::<F>())
            }
            false => Default::default(),
        };
        let [kept, search] = reconstructing::footprints::<F>(scene, settings);
        let later = kept.and(method).and(audit).and(hidden).or(search);
        let structures = bvh.and(lights).and(film).and(later).bytes();
        let scratch = scratch.or(audit_scratch).or(hidden_scratch);
        RequiredMemory { structures, scratch: scratch.or(reconstructing::scratch::<F>(settings)).bytes() }
    }

    /// See [`Renderer::new`](super::Renderer::new).
    ///
    /// # Errors
    /// Those of [`Renderer::new`](super::Renderer::new).
    pub fn new(
        scene: &'a Scene<'a>,
        settings: &Settings,
        arena: &mut Arena<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, RenderError> {
        settings.check()?;
        scene.mesh.validate(scene.materials.len()).map_err(RenderError::Triangle)?;
        let needed = Self::required_memory(scene, settings).structures;
        if arena.available() < needed {
            return Err(OutOfMemory { needed, available: arena.available() }.into());
        }
        let bvh = Bvh::build_with(&scene.mesh, arena, settings.level, executor.fork())?;
        let lights = LightSampler::build(scene, arena)?.with_level(settings.level);
        let [width, height] = settings.size;
        let state = RenderState::new(width, height, settings.shard, arena)?;
        let pilots = settings.goal.rays_alone().map_or(PilotSize::USUAL, PilotSize::of_picture);
        let (paths, level) = (settings.paths(), settings.level);
        let context = RenderContext { scene, bvh, lights, settings: paths, level, pilots };
        let reconstruction = reconstructing::set_up::<F>(&context, settings, arena, executor)?;
        let mut memory = Buffer::new(arena.slice(arena.available())?);
        let lights = learn_visibility::<F>(&context, settings, &mut memory, executor)?;
        let setup = MethodSetup {
            context: RenderContext { lights, ..context },
            options: settings.method.options(),
            goal: settings.goal,
            shards: settings.shard.count,
            reserve: [false, true].map(|is_biased| {
                let reserve = Audit::<F>::reserve(settings.size, lights.count(), is_biased).bytes();
                audit_fraction(settings.audit, is_biased).map_or(0, |_| reserve)
            }),
            is_audited: audit_fraction(settings.audit, true).is_some(),
            is_reconstructed: reconstruction.is_some(),
            kept: KeptCaches::default(),
            widens: true,
            has_fixed_records: false,
            lacks_memory: false,
        };
        let mut plan = settings.method.kind().map_or_else(MethodPlan::open, MethodPlan::from);
        let method = loop {
            match plan.set_up(&setup, &mut memory, executor)? {
                Attempt::Ready(method) => break method,
                Attempt::Instead(better) => plan = better,
            }
        };
        let (context, kind) = (&setup.context, method.kind);
        let reconstruction = reconstruction.map(|made| made.shared(kind.has_common_errors()));
        let audit = match audit_fraction(settings.audit, kind.is_biased()) {
            Some(fraction) => {
                let of_rays = AuditSettings { fraction, shard: settings.shard, by_clock: false };
                Some(Audit::new(context, kind, of_rays, &mut memory, executor)?)
            }
            None => None,
        };
        let at_work = MethodAtWork { kind, options: &setup.options, findings: &method.findings() };
        let hidden = at_work.hidden_light::<F>(context, settings.goal.samples, &mut memory, executor)?;
        let state = RenderState { is_correlated: kind.shares(), ..state };
        let is_audit_open = settings.audit.is_none();
        Ok(Self { method, state, audit, reconstruction, hidden, is_audit_open, memory, first_noise: None })
    }

    /// See [`Renderer::step`](super::Renderer::step).
    ///
    /// # Errors
    /// Those of [`Renderer::step`](super::Renderer::step).
    pub fn step(&mut self, executor: &mut impl Executor, until: Until) -> Result<(), RenderError> {
        match until {
            Until::Samples(target) => {
                self.add_samples(executor, target)?;
                self.step_audit(executor)?;
            }
            Until::Error(wanted) => self.render_until(wanted, executor)?,
        }
        let Self { audit, reconstruction, state, .. } = self;
        if reconstruction.is_some() {
            ErrorReport::new(state, reconstruction.as_mut(), audit.as_mut(), executor);
        } else if let Some(audit) = audit
            && let Some(mean) = state.film.mean_radiance(executor)
        {
            audit.compare(&state.film, None, mean, executor);
        }
        Ok(())
    }

    /// Adds samples until the error is at most `wanted`, or out of reach.
    fn render_until(&mut self, wanted: f64, executor: &mut impl Executor) -> Result<(), RenderError> {
        let stop = Stop { error: Some(wanted), ..Stop::default() };
        let known = Estimates { first_noise: self.first_noise, ..Estimates::default() };
        let mut rounds = Rounds::new(stop).resumed(self.samples(), 0, NO_CLOCK, known);
        loop {
            if rounds.estimate_is_due() {
                let report = self.estimate(&rounds, executor)?;
                let lost = rounds.out_of_reach(&report, self.method.kind.converges());
                rounds.estimated(report.error());
                self.first_noise = rounds.estimates().first_noise;
                if lost.is_some() {
                    return Ok(());
                }
            }
            let Some(plan) = rounds.next(NO_CLOCK, 0.0) else { return Ok(()) };
            self.add_samples(executor, plan.target)?;
            if executor.is_over() || self.samples() == rounds.spp() {
                return Ok(());
            }
            rounds.completed(self.samples(), NO_CLOCK);
        }
    }

    /// Takes the samples of the audit that are due, and estimates the error.
    fn estimate<E: Executor>(
        &mut self,
        rounds: &Rounds,
        executor: &mut E,
    ) -> Result<ErrorReport, OutOfMemory> {
        self.step_audit(executor)?;
        let Self { method, state, audit, reconstruction, hidden, is_audit_open, .. } = self;
        let report = ErrorReport::new(state, reconstruction.as_mut(), audit.as_mut(), executor);
        let report = report.lacking(hidden.as_ref(), &state.film);
        let Some(audit) = audit else { return Ok(report) };
        let time = ExtraTime { may_take: &mut |_| true, clock: &|| NO_CLOCK };
        let time = is_audit_open.then_some(time);
        rounds.extend_audit((audit, method), (state, reconstruction.as_ref(), report), time, executor)
    }

    /// Takes the samples of the audit that are due.
    fn step_audit(&mut self, executor: &mut impl Executor) -> Result<(), OutOfMemory> {
        let is_due = self.samples() >= FIRST_OF_AUDIT;
        let Self { method, state, audit, memory, .. } = self;
        let Some(audit) = audit.as_mut().filter(|_| is_due) else { return Ok(()) };
        let rays = state.counters.all_rays();
        let spent = Spent { rays, seconds: NO_CLOCK, left: None, clock: &|| NO_CLOCK };
        audit.step(method, (&state.film, &spent), memory, executor)
    }

    fn add_samples(&mut self, executor: &mut impl Executor, target: u32) -> Result<(), RenderError> {
        let Self { method, state, .. } = self;
        Ok(method.round(&mut Round { executor, state, target, step: STEP })?)
    }

    /// See [`Renderer::error_report`](super::Renderer::error_report).
    pub fn error_report(&self) -> ErrorReport {
        let RenderState { film, is_correlated, .. } = &self.state;
        let reconstructed = self.reconstruction.as_ref().and_then(FilmReconstruction::error);
        let audit = |_: f64, noise, _: &mut Loop| self.audit.as_ref()?.verdict(noise);
        let report =
            ErrorReport::of_film(film, (*is_correlated, reconstructed), audit, &mut Loop::new(&mut []));
        report.lacking(self.hidden.as_ref(), film)
    }

    /// Sums of the samples.
    pub fn film(&self) -> &Film<'a> {
        &self.state.film
    }

    /// See [`Renderer::take_tiles`](super::Renderer::take_tiles).
    pub fn take_tiles(&mut self, shard: Shard, pixels: &[Pixel], samples: u32) {
        let RenderState { film, samples: of_tiles, .. } = &mut self.state;
        let tiles = film.pixels_mut().chunks_mut(PIXELS_PER_TILE).zip(pixels.chunks(PIXELS_PER_TILE));
        let tiles = tiles.zip(of_tiles.iter_mut()).enumerate().filter(|(tile, _)| shard.owns(*tile));
        for (_, ((own, other), of_tile)) in tiles {
            if own.len() == other.len() {
                own.copy_from_slice(other);
                *of_tile = samples;
            }
        }
    }

    /// Reconstruction of the picture, if it is wanted.
    #[doc(hidden)]
    pub fn reconstruction(&self) -> Option<&FilmReconstruction<'a>> {
        self.reconstruction.as_ref()
    }

    /// Samples of the least sampled pixel.
    pub fn samples(&self) -> u32 {
        self.state.spp()
    }

    /// The method at work.
    pub fn method(&self) -> MethodKind {
        self.method.kind
    }

    /// Decisions and numbers of the parts of the method.
    pub fn findings(&self) -> Findings {
        let lacking = self.hidden.as_ref().map(|hidden| hidden.lacking_in(&self.state.film).finding());
        let made = self.reconstruction.as_ref().map(FilmReconstruction::finding);
        self.method.findings().and(lacking).and(made)
    }
}

/// Lights of `context` with the visibility of the environment, where that pays or is wanted.
fn learn_visibility<'a, F: Features>(
    context: &RenderContext<'a>,
    settings: &Settings,
    memory: &mut Buffer<'a>,
    executor: &mut impl Executor,
) -> Result<LightSampler<'a>, OutOfMemory> {
    match settings.environment_visibility {
        Some(false) => Ok(context.lights),
        wanted => Ok(learn::<F>(context, wanted, memory, executor)?.0),
    }
}
