//! Irradiance at many points by path tracing (Kajiya 1986): a film whose pixels are points, with caustic
//! photons or an irradiance cache where a pilot finds that they pay.

use super::cached_points::{CacheLimits, CachedPoints, PointPrediction};
use super::caustics::{self, CausticPhotons, CausticSettings, CausticUse, PointReceivers, photons_that_pay};
use super::choice::Goal;
use super::executor::Executor;
use super::{RenderContext, Round};
use crate::bsdf::Features;
use crate::film::PIXELS_PER_TILE;
use crate::findings::Decision::LeftOut;
use crate::findings::{Finding, Findings};
use crate::light::LightSampler;
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::scene::Scene;
use crate::transport::path::WAVE;
use crate::transport::{IrradiancePoint, LightEstimator, LightPart, PathIntegrator};

/// Receivers whose photon maps have room for the fewest light paths of a map.
const FEWEST_RECEIVERS: usize = 36 << 10;

/// Source of the indirect light of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointMethod {
    /// Path tracing at every point, which has no bias.
    #[default]
    Path,
    /// An irradiance cache, whose bias an audit measures.
    IrradianceCache,
    /// The one of less predicted error.
    Auto,
}

/// Irradiance to estimate.
#[derive(Clone, Copy)]
pub struct WantedIrradiance<'a> {
    /// Points in the order of the film.
    pub points: &'a [IrradiancePoint],
    /// Light to estimate.
    pub part: LightPart,
    /// Caustic photons where they pay.
    pub caustics: bool,
    /// Source of the indirect light.
    pub method: PointMethod,
    /// End of the bake, whose error is the relative half-width of intervals.
    pub goal: Goal,
}

/// Irradiance at the points of one scene. Pixel `i` of the film is point `i`.
pub struct IrradiancePoints<'a, F> {
    integrator: PathIntegrator<'a, F>,
    points: &'a [IrradiancePoint],
    part: LightPart,
    photons: Option<CausticPhotons<'a>>,
    caustics: CausticUse,
    cache: Option<CachedPoints<'a, F>>,
    /// Predicted errors, and the reason against a cache.
    prediction: Option<PointPrediction>,
    without_cache: Option<&'static str>,
}

impl<'a, F: Features> IrradiancePoints<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        let structures =
            PointReceivers::<F>::scratch().or(caustics::scratch::<F>()).or(CachedPoints::<F>::scratch());
        structures.and(PathIntegrator::<F>::scratch_of_points(PIXELS_PER_TILE))
    }

    /// Memory of photons in `scene` for so many points.
    pub fn footprint(scene: &Scene, points: usize) -> Footprint {
        match caustics::are_possible(scene) {
            true => {
                let (lights, receivers) = (LightSampler::count_in(scene), points.max(FEWEST_RECEIVERS));
                PointReceivers::<F>::footprint(points).and(caustics::footprint(lights, receivers))
            }
            false => Footprint::default(),
        }
    }

    /// Path tracing of the `wanted` irradiance, with caustic photons or a cache where they pay.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn new(
        context: &RenderContext<'a>,
        wanted: &WantedIrradiance<'a>,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let WantedIrradiance { points, part, caustics, method, .. } = *wanted;
        // Photons carry light that surfaces have scattered.
        let is_possible = caustics && part != LightPart::Direct && caustics::are_possible(context.scene);
        let footprint = PointReceivers::<F>::footprint(points.len());
        let (photons, caustics) = match is_possible && memory.has(footprint) {
            true => memory.lend("points", footprint, |memory, arena| {
                match PointReceivers::<F>::new(context, (points, part), arena, executor)? {
                    Some(mut receivers) => {
                        let settings = CausticSettings::default();
                        photons_that_pay(context, &mut receivers, settings, memory, executor)
                    }
                    None => Ok(Default::default()),
                }
            })?,
            false => (None, CausticUse { lacks_memory: is_possible, ..CausticUse::default() }),
        };
        let integrator = context.integrator();
        let (cache, prediction, without_cache) = (None, None, None);
        let paths = Self { integrator, points, part, photons, caustics, cache, prediction, without_cache };
        match method {
            PointMethod::Path => Ok(paths),
            _ => paths.with_cache(context, wanted, memory, executor),
        }
    }

    /// The same with a cache, if it can serve.
    fn with_cache(
        mut self,
        context: &RenderContext<'a>,
        wanted: &WantedIrradiance<'a>,
        memory: &mut impl MemorySource<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, OutOfMemory> {
        let WantedIrradiance { points, part, method, ref goal, .. } = *wanted;
        self.without_cache = match () {
            () if part == LightPart::Direct => Some("direct light alone is wanted"),
            () if context.settings.max_depth <= 2 => Some("paths have two segments at most"),
            () if self.photons.is_some() => Some("the points have caustic photons"),
            () if !memory.has(CachedPoints::<F>::footprint(points.len())) => Some("not enough memory"),
            () => None,
        };
        if self.without_cache.is_some() {
            return Ok(self);
        }
        self.prediction = PointPrediction::new::<F>(context, (points, part), goal, executor)?;
        let prefers = |prediction: &PointPrediction| {
            method == PointMethod::IrradianceCache || prediction.prefers_cache()
        };
        match self.prediction.filter(prefers) {
            Some(ref prediction) => {
                let is_limited = method == PointMethod::Auto;
                self.cache = CachedPoints::new(context, points, (prediction, is_limited), memory)?;
            }
            None => self.without_cache = Some("paths have less predicted error"),
        }
        Ok(self)
    }

    /// Limits beyond which the cache is of no use; `None` without a cache.
    pub fn limits_of_cache(&self) -> Option<CacheLimits> {
        self.cache.as_ref()?;
        self.prediction.map(|prediction| prediction.limits)
    }

    /// True if a cache serves the indirect light, and true if there was no time for all of its records.
    pub fn source(&self) -> (bool, bool) {
        (self.cache.is_some(), self.cache.as_ref().is_some_and(CachedPoints::is_cut))
    }

    /// Path traces all points from now on, since records have too much error.
    pub fn leave_cache(&mut self) {
        (self.cache, self.without_cache) = (None, Some("records have more error than paths"));
    }

    /// Decisions and numbers of its photons and of its cache.
    pub fn findings(&self) -> Findings {
        let caustics = self.caustics.findings(self.photons.as_ref().map(CausticPhotons::statistics));
        let left_out = |reason| Finding::new("irradiance_cache", LeftOut, reason);
        let cache = self.cache.as_ref().map(CachedPoints::finding).or(self.without_cache.map(left_out));
        let with_errors = |finding| self.prediction.map_or(finding, |errors| errors.add_to(finding));
        caustics.and(cache.map(with_errors))
    }

    /// Samples of the tiles that are open.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn sample<E: Executor>(
        &mut self,
        round: &mut Round<E>,
        is_open: impl Fn(usize) -> bool + Copy + Send,
    ) -> Result<(), OutOfMemory> {
        if let Some(cache) = &mut self.cache {
            if cache.fill(round)? {
                return sample(&cache.paths(), (self.points, self.part), round, (u32::MAX, is_open));
            }
            if !cache.is_too_small() {
                return Ok(());
            }
            (self.cache, self.without_cache) = (None, Some("records would take too much of the work"));
        }
        let Self { integrator, points, part, photons, .. } = self;
        let Some(photons) = photons else {
            return sample(integrator, (points, *part), round, (u32::MAX, is_open));
        };
        let next = |round: &Round<E>| round.next_open_sample(is_open);
        photons.blocks::<F, E>(round, next, |round, merging, end| {
            sample(&integrator.with_caustics(merging), (points, *part), round, (end, is_open))
        })
    }

    /// Path-traced samples of other `points`.
    ///
    /// # Errors
    /// Those of [`IrradiancePoints::sample`].
    pub fn sample_by_paths(
        &self,
        points: &[IrradiancePoint],
        round: &mut Round<impl Executor>,
    ) -> Result<(), OutOfMemory> {
        sample(&self.integrator, (points, self.part), round, (u32::MAX, |_| true))
    }
}

/// Brings the open tiles of `round` to `end` samples by `integrator`.
fn sample<F: Features, L: LightEstimator<F>>(
    integrator: &PathIntegrator<F, L>,
    (points, part): (&[IrradiancePoint], LightPart),
    round: &mut Round<impl Executor>,
    (end, is_open): (u32, impl Fn(usize) -> bool + Send),
) -> Result<(), OutOfMemory> {
    round.open_tiles(end, is_open, |tile, samples, scratch, pixels| {
        let of_tile = points.chunks(PIXELS_PER_TILE).nth(tile).unwrap_or(&[]);
        integrator.sample_irradiance((of_tile, part), samples, WAVE, scratch, pixels)
    })
}
