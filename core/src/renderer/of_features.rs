//! Renderer compiled for one set of features.

use super::{RenderError, RequiredMemory, Settings, Until};
use crate::audit::ErrorReport;
use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::estimate::ErrorEstimate;
use crate::film::Film;
use crate::findings::Findings;
use crate::light::LightSampler;
use crate::memory::{Arena, Buffer, OutOfMemory};
use crate::method::cached_paths::KeptCaches;
use crate::method::environment_visibility::learn;
use crate::method::{
    Attempt, ChosenMethod, Executor, Loop, MethodKind, MethodPlan, MethodSetup, PilotSize, RenderContext,
    RenderMethod, RenderState, Round,
};
use crate::scene::Scene;

/// Samples of a tile between two questions whether the executor is over.
const STEP: u32 = 8;

/// Samples at the first estimate of the error, and fewest at which it may end a picture.
const FIRST_ESTIMATE: u32 = 4;
const FEWEST_FOR_ERROR: u32 = 16;

/// A [`Renderer`](super::Renderer) of scenes that have no other features than `F`.
pub struct FeatureRenderer<'a, F> {
    method: ChosenMethod<'a, F>,
    state: RenderState<'a>,
}

impl<'a, F: Features> FeatureRenderer<'a, F> {
    /// See [`Renderer::required_memory`](super::Renderer::required_memory).
    pub fn required_memory(scene: &Scene, settings: &Settings) -> RequiredMemory {
        let [width, height] = settings.size;
        let options = settings.method.options();
        let kind = settings.method.kind();
        let [method, scratch] = MethodPlan::<F>::required_memory(kind, &options, (scene, settings.size));
        let bvh = Bvh::footprint(scene.mesh.triangles.len());
        let lights = LightSampler::footprint(scene).and(LightSampler::scratch(scene));
        let film = RenderState::footprint(width, height);
        let structures = bvh.and(lights).and(film).and(method).bytes();
        RequiredMemory { structures, scratch: scratch.bytes() }
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
        let mut memory = Buffer::new(arena.slice(arena.available())?);
        let lights = learn_visibility::<F>(&context, settings, &mut memory, executor)?;
        let setup = MethodSetup {
            context: RenderContext { lights, ..context },
            options: settings.method.options(),
            goal: settings.goal,
            shards: settings.shard.count,
            reserve: [0; 2],
            is_audited: true,
            kept: KeptCaches::default(),
            widens: true,
            has_fixed_records: false,
        };
        let mut plan = settings.method.kind().map_or_else(MethodPlan::open, MethodPlan::from);
        let method = loop {
            match plan.set_up(&setup, &mut memory, executor)? {
                Attempt::Ready(method) => break method,
                Attempt::Instead(better) => plan = better,
            }
        };
        let is_correlated = method.kind.shares();
        Ok(Self { method, state: RenderState { is_correlated, ..state } })
    }

    /// See [`Renderer::step`](super::Renderer::step).
    ///
    /// # Errors
    /// Those of [`Renderer::step`](super::Renderer::step).
    pub fn step(&mut self, executor: &mut impl Executor, until: Until) -> Result<(), RenderError> {
        match until {
            Until::Samples(target) => self.add_samples(executor, target),
            Until::Error(wanted) => {
                let is_reached = |error: ErrorEstimate| error.upper <= wanted;
                while self.samples() < FEWEST_FOR_ERROR || !self.error().is_some_and(is_reached) {
                    let samples = self.samples();
                    self.add_samples(executor, self.next_estimate(wanted))?;
                    if executor.is_over() || self.samples() == samples {
                        break;
                    }
                }
                Ok(())
            }
        }
    }

    fn add_samples(&mut self, executor: &mut impl Executor, target: u32) -> Result<(), RenderError> {
        let Self { method, state } = self;
        Ok(method.round(&mut Round { executor, state, target, step: STEP })?)
    }

    /// Samples at which the error can be `wanted` at the earliest: it falls at best with the squared number
    /// of samples, while its interval narrows.
    fn next_estimate(&self, wanted: f64) -> u32 {
        let samples = self.samples();
        let growth = self.error().map_or(2.0, |error| libm::cbrt(error.upper / wanted));
        let next = (f64::from(samples) * growth.clamp(1.0 + 1.0 / 32.0, 2.0)) as u32;
        next.max(samples + 1).max(FIRST_ESTIMATE).next_multiple_of(4)
    }

    /// See [`Renderer::error`](super::Renderer::error).
    pub fn error(&self) -> Option<ErrorEstimate> {
        let RenderState { film, is_correlated, .. } = &self.state;
        ErrorReport::of_film(film, *is_correlated, |_, _, _| None, &mut Loop::new(&mut [])).error()
    }

    /// Sums of the samples.
    pub fn film(&self) -> &Film<'a> {
        &self.state.film
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
        self.method.findings()
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
