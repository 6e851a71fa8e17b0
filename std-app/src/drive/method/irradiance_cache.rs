//! Irradiance caching: the indirect light of diffuse surfaces is gathered at few points and interpolated between them,
//! all other light is path traced. Two caches that know nothing of each other serve the even and the odd samples, so
//! that the halves of the film tell the errors of records too.
//!
//! The first round begins with the overture of both. Then caches are frozen; a point that no record reaches is path
//! traced, as is every surface that is not diffuse.

use super::overture::{Growing, Overture};
use super::{Method, Renderer, Stage};
use crate::drive::audit::Audit;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use crate::drive::{RenderError, Settings};
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{CellFlux, IrradianceCache, Metric, metric};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::gather::Gathering;
use halflight_core::transport::{PathTracer, path::WAVE};
use std::time::Instant;

/// How an irradiance cache is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSettings {
    /// The rule by which records know how far they reach.
    pub metric: Metric,
    /// Error allowed, in the unit of the metric; `None`: its usual one.
    pub error: Option<f32>,
    /// Strata along a side of the hemisphere that is gathered: its square is the number of rays of a record.
    pub strata: u32,
}

impl Default for CacheSettings {
    fn default() -> Self {
        Self { metric: Metric::Halflight, error: None, strata: 32 }
    }
}

/// What became of the caches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CacheUse {
    /// Records of both.
    pub records: u64,
    /// Most records that there was memory for.
    pub capacity: u64,
    /// Records that found no memory: their surroundings are path traced.
    pub refused: u64,
    /// Seconds of the overture.
    pub seconds: f64,
}

/// Pixels for each record that a cache has memory for, where that is not limited.
const PIXELS_PER_RECORD: usize = 8;

/// The fewest, for small pictures.
const FEWEST_RECORDS: usize = 4096;

/// Least radius of a record in pixels: neighbouring pixels of the overture reach each other.
pub(in crate::drive) const LEAST_PIXELS: f32 = 2.0;

/// Takes the memory, sets the method up, and hands it to `then`.
pub(super) fn with<F: Features, T>(
    stage: &Stage,
    memory: &mut Memory,
    then: impl FnOnce(&mut dyn Renderer, &mut Memory) -> Result<T, RenderError>,
) -> Result<T, RenderError> {
    let Stage { scene, bvh, lights, settings, workers } = *stage;
    let CacheSettings { metric, error, strata } = settings.cache;
    let strata = strata as usize;
    let scratch = PathTracer::<F>::scratch(WAVE).or(PathTracer::<F>::gather_scratch(strata));
    let scratch = memory.take_each("paths", scratch, workers.count())?;
    let mut tables = memory.take("gathering", CellFlux::footprint(strata))?;
    let flux = CellFlux::build(strata, &mut Arena::new(bytemuck::cast_slice_mut(&mut tables)))?;
    let pixels = settings.width as usize * settings.height as usize;
    let wanted = (pixels / PIXELS_PER_RECORD).max(FEWEST_RECORDS);
    let others = Audit::bytes::<F>(stage, Method::IrradianceCache.is_biased());
    let available = memory.available().saturating_sub(others);
    let capacity = wanted.min(IrradianceCache::capacity_of(available / 2));
    let footprint = IrradianceCache::footprint(capacity);
    let mut lines = [memory.take("cache", footprint)?, memory.take("cache", footprint)?];
    let [even, odd] = &mut lines;
    let cache = |lines| {
        IrradianceCache::new(&bvh.bounds(), capacity, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
    };
    let (even, odd) = (cache(even)?, cache(odd)?);

    let usual = metric::Settings::new(metric, 0.5 * bvh.bounds().diagonal());
    let metric = metric::Settings { error: error.unwrap_or(usual.error), ..usual };
    let mut method = Cached {
        tracer: PathTracer::<F>::new(scene, bvh, lights, path_settings(settings), settings.level),
        gathering: Gathering { flux: &flux, metric, least_pixels: LEAST_PIXELS },
        size: [settings.width, settings.height],
        halves: [Growing::new(even, 0), Growing::new(odd, 1)],
        scratch,
        seconds: 0.0,
    };
    if !has_indirect_light(settings) {
        method.halves.iter_mut().for_each(Growing::finish);
    }
    then(&mut method, memory)
}

/// Whether paths are long enough for light to be reflected by one surface before the one that is seen.
fn has_indirect_light(settings: &Settings) -> bool {
    settings.max_depth.is_none_or(|depth| depth > 2)
}

/// See the file.
struct Cached<'a, F> {
    tracer: PathTracer<'a, F>,
    gathering: Gathering<'a>,
    size: [u32; 2],
    halves: [Growing<'a>; 2],
    scratch: Vec<Vec<Line>>,
    seconds: f64,
}

impl<F: Features> Renderer for Cached<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { tracer, gathering, size, halves, scratch, seconds } = self;
        let start = Instant::now();
        let overture = Overture { tracer, gathering, size: *size };
        for half in halves.iter_mut() {
            if !overture.fill(half, crew, scratch)? {
                return Ok(());
            }
        }
        *seconds += start.elapsed().as_secs_f64();
        let [even, odd] = halves;
        let tracer = tracer.with_caches([&even.cache, &odd.cache]);
        crew.tiles(u32::MAX, scratch, &|task, samples, arena, pixels| {
            tracer.run(task, samples, WAVE, arena, pixels)
        })?;
        Ok(())
    }

    fn cache(&self) -> Option<CacheUse> {
        let sum = |of: fn(&IrradianceCache) -> u64| self.halves.iter().map(|half| of(&half.cache)).sum();
        Some(CacheUse {
            records: sum(|cache| cache.records().len() as u64),
            capacity: sum(|cache| cache.capacity() as u64),
            refused: sum(|cache| cache.refused()),
            seconds: self.seconds,
        })
    }
}
