//! Irradiance at points, each with a 95 % interval, in the caller's memory and on the caller's threads.

mod audit;
mod film;
mod layout;
mod memory;
mod stop_rule;
mod structures;
mod value;

pub use film::PointFilm;
pub use value::{PointIrradiance, PointSettings};

use super::build::{All, Build, DiffuseTextured, Opaque, build_for, of_build};
use super::{RenderError, Until};
use crate::bvh::Bvh;
use crate::film::{Dropped, Pixel};
use crate::findings::Findings;
use crate::light::LightSampler;
use crate::memory::{Arena, Buffer, OutOfMemory};
use crate::method::{
    Executor, IrradiancePoints, PilotSize, PointMethod, RenderContext, RenderState, Round, WantedIrradiance,
};
use crate::scene::Scene;
use crate::transport::{Counters, IrradiancePoint, PathSettings, UNLIMITED};
use audit::{Bias, PointAudit};
use layout::{Layout, number_of, order_along_curve};
use stop_rule::FIRST_DECISION;
use structures::{method_of, structures};

/// Samples of a tile between two questions whether the executor is over.
const STEP: u32 = 16;

/// Points of a task that prepares points.
const CHUNK: usize = 1024;

/// Most points: numbers have 31 bits beside the Z-curve.
const MOST_POINTS: usize = 1 << 30;

/// Most samples of a point.
const MOST_SAMPLES: u32 = 1 << 30;

/// Builds of the path tracer of points.
type Builds<'a> =
    Build<IrradiancePoints<'a, DiffuseTextured>, IrradiancePoints<'a, Opaque>, IrradiancePoints<'a, All>>;

/// Irradiance of many points in progress.
///
/// ```
/// use halflight_core::glam::Vec3;
/// use halflight_core::scene::{Material, Mesh, Triangle};
/// use halflight_core::{Arena, Line, Loop, Rgb, Scene, Until};
/// use halflight_core::{IrradiancePoint, IrradianceRenderer, PointSettings};
///
/// // Two sensors that look up at a square lamp.
/// let positions = [[-0.5, 2.0, -0.5], [0.5, 2.0, -0.5], [0.5, 2.0, 0.5], [-0.5, 2.0, 0.5]];
/// let triangles = [[0, 1, 2], [0, 2, 3]].map(|vertices| Triangle { vertices, material: 0 });
/// let scene = Scene {
///     mesh: Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() },
///     materials: &[Material::lamp(Rgb::splat(10.0))],
///     ..Scene::default()
/// };
/// let points = [0.0, 1.0].map(|x| IrradiancePoint::free(Vec3::new(x, 0.0, 0.0), Vec3::Y));
///
/// let memory = IrradianceRenderer::required_memory(&scene, points.len());
/// let mut lines = vec![Line::ZERO; Line::count(memory.with_workers(1))];
/// let mut arena = Arena::over(&mut lines);
/// let mut executor = Loop::new(arena.slice(memory.scratch)?);
/// let settings = PointSettings::default();
/// let mut renderer = IrradianceRenderer::new(&scene, &points, &settings, &mut arena, &mut executor)?;
/// renderer.step(&mut executor, Until::Error(0.01))?;
///
/// let values: Vec<f32> = renderer.values().map(|point| point.value()).collect();
/// // By the form factors of the lamp.
/// assert!((values[0] - 2.308).abs() < 0.05 && (values[1] - 1.556).abs() < 0.05);
/// assert!(renderer.values().all(|point| point.upper - point.lower < 0.05));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub struct IrradianceRenderer<'a> {
    build: Builds<'a>,
    film: PointFilm<'a>,
    /// Path-traced points, with a cache.
    audit: Option<PointAudit<'a>>,
    /// 1 for each tile that has reached the error.
    finished: &'a mut [u8],
    /// Samples at which tiles are judged next.
    decision: u32,
    /// Error by which they were judged.
    error: f64,
}

impl<'a> IrradianceRenderer<'a> {
    /// Builds the hierarchy and the lights of `scene`, whose camera is of no matter. Points that lie on a
    /// surface within rounding are put on it, on the side of their normals.
    ///
    /// # Errors
    /// [`RenderError::Memory`] where `arena` or the scratch of `executor` has less than
    /// [`IrradianceRenderer::required_memory`]; others where there is no point or the mesh is damaged.
    pub fn new(
        scene: &'a Scene<'a>,
        points: &[IrradiancePoint],
        settings: &PointSettings,
        arena: &mut Arena<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, RenderError> {
        check_number(points)?;
        scene.mesh.validate(scene.materials.len()).map_err(RenderError::Triangle)?;
        let needed = Self::required_memory(scene, points.len()).structures;
        if arena.available() < needed {
            return Err(OutOfMemory { needed, available: arena.available() }.into());
        }
        let bvh = Bvh::build_with(&scene.mesh, arena, settings.level, executor.fork())?;
        let lights = LightSampler::build(scene, arena)?.with_level(settings.level);
        Self::over((scene, bvh, lights), points, settings, arena, executor)
    }

    /// As [`IrradianceRenderer::new`], over structures of the scene that exist.
    ///
    /// # Errors
    /// [`RenderError::Shard`], and [`RenderError::Memory`] where `arena` has less than
    /// [`IrradianceRenderer::footprint`].
    #[doc(hidden)]
    pub fn over(
        (scene, bvh, lights): (&'a Scene<'a>, Bvh<'a>, LightSampler<'a>),
        points: &[IrradiancePoint],
        settings: &PointSettings,
        arena: &mut Arena<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, RenderError> {
        check_number(points)?;
        let PointSettings { seed, level, shard, .. } = *settings;
        let layout = Layout::of(points.len());
        let is_window = shard.window.is_some();
        if is_window || shard.index >= shard.count || shard.count as usize > layout.tiles() {
            return Err(RenderError::Shard);
        }
        let [width, height] = layout.size();
        let max_depth = settings.max_depth.unwrap_or(UNLIMITED);
        let paths = PathSettings { width, height, seed, max_depth };
        let context = RenderContext { scene, bvh, lights, settings: paths, level, pilots: PilotSize::USUAL };
        let pixels = layout.pixels();
        let (ordered, keys) = (arena.slice::<IrradiancePoint>(pixels)?, arena.slice::<u64>(pixels)?);
        let (places, finished) = (arena.slice::<u32>(pixels)?, arena.slice::<u8>(layout.tiles())?);
        finished.fill(0);
        order_along_curve(points, layout.replicates, keys);
        for (place, key) in keys.iter().enumerate() {
            if let Some(slot) = places.get_mut(number_of(*key)) {
                *slot = place as u32;
            }
        }
        let (of_scene, keys) = (context.scene_context::<All>(), &*keys);
        let passed = executor.pass(ordered.chunks_mut(CHUNK), |chunk, pieces, _| {
            for (point, key) in pieces.iter_mut().zip(&keys[chunk * CHUNK..]) {
                let number = number_of(*key);
                let Some(given) = points.get(number / layout.replicates) else { continue };
                *point = given.numbered(number as u32).settled(&of_scene);
            }
            Ok(Counters::default())
        })?;
        // Without positions nothing can be sampled: the film stays empty.
        let ordered = if passed.is_complete { &*ordered } else { &[] };
        let film = PointFilm::new(points.len(), (ordered, places), shard, arena)?;
        let method = method_of(settings, &layout);
        let mut audit = match method {
            PointMethod::Path => None,
            _ => Some(PointAudit::new(&film, arena)?),
        };
        let bytes = structures(scene, &layout, method).bytes();
        let memory = &mut Buffer::new(arena.slice(bytes.min(arena.available()))?);
        let PointSettings { light: part, caustics, goal, .. } = *settings;
        let wanted = &WantedIrradiance { points: ordered, part, caustics, method, goal };
        let build = build_for!(scene, IrradiancePoints::new(&context, wanted, memory, executor)?);
        audit = audit.filter(|_| of_build!(&build, method => method.limits_of_cache().is_some()));
        Ok(Self { build, film, audit, finished, decision: FIRST_DECISION, error: 0.0 })
    }

    /// Adds samples to each point `until` the given end, or until the executor is over. By an error, tiles of
    /// near points end one by one: when the half-widths of 95 % of the points of a tile are at most the
    /// error times (E + 0.1 of the mean of all points).
    ///
    /// # Errors
    /// [`RenderError::Memory`] where the scratch of `executor` is too small.
    pub fn step(&mut self, executor: &mut impl Executor, until: Until) -> Result<(), RenderError> {
        match until {
            Until::Samples(target) => self.advance((None, target), executor)?,
            Until::Error(error) => self.advance((Some(error), MOST_SAMPLES), executor)?,
        }
        Ok(())
    }

    /// As [`Until::Error`], with at most so many samples of each point.
    ///
    /// # Errors
    /// Those of [`IrradianceRenderer::step`].
    pub fn step_within(
        &mut self,
        executor: &mut impl Executor,
        error: f64,
        most: u32,
    ) -> Result<(), RenderError> {
        Ok(self.advance((Some(error), most), executor)?)
    }

    /// Irradiance of each point, in the order of the points.
    pub fn values(&self) -> impl Iterator<Item = PointIrradiance> + '_ {
        self.film.values()
    }

    /// Samples of the least sampled point.
    pub fn samples(&self) -> u32 {
        self.film.state.spp()
    }

    /// Number of tiles of near points, and of those that have reached the error of the last step.
    pub fn tiles(&self) -> [usize; 2] {
        [self.film.state.tiles(), self.finished.iter().filter(|finished| **finished != 0).count()]
    }

    /// Sums of the samples. Pixels are points along a Z-curve.
    #[doc(hidden)]
    pub fn state(&self) -> &RenderState<'a> {
        &self.film.state
    }

    /// The film.
    #[doc(hidden)]
    pub fn film(&self) -> &PointFilm<'a> {
        &self.film
    }

    /// The samples at which tiles are judged next, the error, and 1 for each tile that has reached it.
    #[doc(hidden)]
    pub fn decisions(&self) -> (u32, f64, &[u8]) {
        (self.decision, self.error, self.finished)
    }

    /// True if a cache serves the indirect light, and true if there was no time for all of its records.
    #[doc(hidden)]
    pub fn source(&self) -> (bool, bool) {
        of_build!(&self.build, method => method.source())
    }

    /// Continues an earlier run: its decisions, and the sums that `fill` puts into the film.
    ///
    /// # Errors
    /// Those of `fill`.
    #[doc(hidden)]
    pub fn resume<E>(
        &mut self,
        (decision, error, finished): (u32, f64, &[u8]),
        fill: impl FnOnce(&mut RenderState<'a>) -> Result<(), E>,
    ) -> Result<(), E> {
        (self.decision, self.error) = (decision.max(FIRST_DECISION), error);
        self.finished.iter_mut().zip(finished).for_each(|(tile, finished)| *tile = *finished);
        fill(&mut self.film.state)
    }

    /// Decisions and numbers of caustic photons and of a cache.
    pub fn findings(&self) -> Findings {
        let findings = of_build!(&self.build, method => method.findings());
        findings.and(self.audit.as_ref().map(|audit| audit.finding(audit.bias(&self.film))))
    }

    /// Rays and rejected samples so far.
    pub fn counters(&self) -> Counters {
        let audit = self.audit.as_ref().map(PointAudit::counters).unwrap_or_default();
        let mut counters = self.film.state.counters;
        counters += audit;
        counters
    }

    /// Bias of the cache; 0 without one.
    fn bias(&self) -> Bias {
        let unknown = Bias { lower: 0.0, upper: f64::INFINITY };
        self.audit.as_ref().map_or(Bias::default(), |audit| audit.bias(&self.film).unwrap_or(unknown))
    }

    /// Estimates the intervals.
    fn estimate(&mut self, executor: &mut impl Executor) {
        self.film.estimate(executor, self.bias().upper as f32);
    }

    /// True if an audit after `samples` of each point has found too much bias for the cache.
    fn is_cache_useless(&self, samples: u32) -> bool {
        let most = of_build!(&self.build, method => method.limits_of_cache());
        most.is_some_and(|most| self.bias().lower > most.bias || f64::from(samples) > most.samples)
    }

    /// Begins again by path tracing.
    fn leave_cache(&mut self) {
        of_build!(&mut self.build, method => method.leave_cache());
        let Self { film, finished, audit, decision, .. } = self;
        film.state.film.pixels_mut().fill(Pixel::default());
        film.state.samples.fill(0);
        film.state.dropped.fill(Dropped::default());
        finished.fill(0);
        if let Some(audit) = audit.take() {
            film.state.counters += audit.counters();
        }
        *decision = FIRST_DECISION;
    }

    /// Brings the tiles that are open to `target` samples.
    fn sample<E: Executor>(
        &mut self,
        executor: &mut E,
        target: u32,
        is_open: impl Fn(&[u8], usize) -> bool + Send + Sync,
    ) -> Result<(), OutOfMemory> {
        let Self { build, film, finished, audit, .. } = self;
        let finished = &**finished;
        let round = &mut Round { executor, state: &mut film.state, target, step: STEP };
        of_build!(build, method => {
            method.sample(round, |tile| is_open(finished, tile))?;
            if method.limits_of_cache().is_none() {
                *audit = None;
            }
            match audit {
                Some(audit) => audit.sample(method, round.executor, (target, STEP)),
                None => Ok(()),
            }
        })
    }
}

/// # Errors
/// [`RenderError::Points`] where there is no point, or there are too many.
fn check_number(points: &[IrradiancePoint]) -> Result<(), RenderError> {
    match (1..=MOST_POINTS).contains(&points.len()) {
        true => Ok(()),
        false => Err(RenderError::Points),
    }
}

#[cfg(test)]
mod tests;
