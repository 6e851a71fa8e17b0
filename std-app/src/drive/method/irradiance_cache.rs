//! Irradiance caching: the indirect light of diffuse surfaces is gathered at few points and interpolated between them,
//! all other light is path traced. Two caches that know nothing of each other serve the even and the odd samples, so
//! that the halves of the film tell the errors of records too.
//!
//! The first round begins with the overture of both. Then caches are frozen; a point that no record reaches is path
//! traced, as is every surface that is not diffuse.

use super::{Renderer, Stage};
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use crate::drive::run::path_settings;
use crate::drive::{RenderError, Settings};
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{CellFlux, IrradianceCache, Metric, Record, metric};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::gather::{Gathering, Place};
use halflight_core::transport::overture::{Order, PIXELS};
use halflight_core::transport::{Counters, PathTracer, path::WAVE};

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

/// The overture looks at every other pixel of every other row: what lies between is reached from there, or path traced.
const STRIDE: u32 = 2;

/// Pixels that are looked at before it is gathered where records are missing: tasks of [`PIXELS`].
const LOOKED_AT: usize = 16 * PIXELS;

/// Places that are gathered at before their records are committed.
const GATHERED: usize = 32;

/// Pixels for each record that a cache has memory for, where that is not limited.
const PIXELS_PER_RECORD: usize = 8;

/// The fewest, for small pictures.
const FEWEST_RECORDS: usize = 4096;

/// Least radius of a record in pixels.
const LEAST_PIXELS: f32 = 1.0;

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
    let capacity = wanted.min(IrradianceCache::capacity_of(memory.available() / 2));
    let footprint = IrradianceCache::footprint(capacity);
    let mut lines = [memory.take("cache", footprint)?, memory.take("cache", footprint)?];
    let [even, odd] = &mut lines;
    let cache = |lines| {
        IrradianceCache::new(&bvh.bounds(), capacity, &mut Arena::new(bytemuck::cast_slice_mut(lines)))
    };
    let caches = [cache(even)?, cache(odd)?];

    let usual = metric::Settings::new(metric, 0.5 * bvh.bounds().diagonal());
    let metric = metric::Settings { error: error.unwrap_or(usual.error), ..usual };
    let mut method = Cached {
        tracer: PathTracer::<F>::new(scene, bvh, lights, path_settings(settings), settings.level),
        gathering: Gathering { flux: &flux, metric, least_pixels: LEAST_PIXELS },
        order: Order::new(settings.width, settings.height, STRIDE),
        halves: caches.map(|cache| Half { cache, next: 0, gathered: 0 }),
        scratch,
        seconds: 0.0,
    };
    if !has_indirect_light(settings) {
        method.halves.iter_mut().for_each(|half| half.next = u64::MAX);
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
    order: Order,
    halves: [Half<'a>; 2],
    scratch: Vec<Vec<Line>>,
    seconds: f64,
}

/// The cache of the even or the odd samples.
struct Half<'a> {
    cache: IrradianceCache<'a>,
    /// How far the overture is in its order.
    next: u64,
    /// Places at which it has gathered.
    gathered: u32,
}

impl<F: Features> Renderer for Cached<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        for half in 0..2 {
            if !self.overture(half, crew)? {
                return Ok(());
            }
        }
        let Self { tracer, halves: [even, odd], scratch, .. } = self;
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

impl<F: Features> Cached<'_, F> {
    /// Fills the cache of a half, or goes on with it. Whether it is done: not where the round is over.
    fn overture(&mut self, index: usize, crew: &mut Crew) -> Result<bool, RenderError> {
        let start = std::time::Instant::now();
        let Self { tracer, gathering, order, halves, scratch, seconds } = self;
        let Some(half) = halves.get_mut(index) else { return Ok(true) };
        let mut places = vec![Place::NONE; LOOKED_AT];
        while half.next < order.len() && !half.cache.is_full() {
            let (first, cache) = (half.next, &half.cache);
            let look = |task: usize, _: &mut Arena, out: &mut [Place]| {
                let mut counters = Counters::default();
                tracer.places(order, first + (task * PIXELS) as u64, index as u32, out, &mut counters);
                for place in out.iter_mut().filter(|place| is_served(cache, place)) {
                    *place = Place::NONE;
                }
                Ok(counters)
            };
            if !crew.pass(&mut places, PIXELS, scratch, &look)? {
                return Ok(false);
            }
            let mut missing: Vec<Place> = places.iter().copied().filter(Place::is_some).collect();
            while !missing.is_empty() {
                missing.retain(|place| !is_served(&half.cache, place));
                let batch: Vec<Place> = missing.drain(..missing.len().min(GATHERED)).collect();
                let mut records: Vec<Option<Record>> = vec![None; batch.len()];
                let gathered = half.gathered;
                let tracer = if std::env::var_os("IC_REC").is_some() {
                    tracer.with_caches([&half.cache, &half.cache])
                } else {
                    *tracer
                };
                let gather = |task: usize, arena: &mut Arena, out: &mut [Option<Record>]| {
                    let mut counters = Counters::default();
                    let number = 2 * (gathered + task as u32) + index as u32;
                    if let (Some(out), Some(place)) = (out.first_mut(), batch.get(task)) {
                        *out = tracer.gather(place, number, gathering, arena, &mut counters)?;
                    }
                    Ok(counters)
                };
                if !crew.pass(&mut records, 1, scratch, &gather)? {
                    return Ok(false);
                }
                half.gathered += batch.len() as u32;
                records.into_iter().flatten().for_each(|record| _ = half.cache.insert(record));
            }
            half.next += LOOKED_AT as u64;
        }
        *seconds += start.elapsed().as_secs_f64();
        Ok(true)
    }
}

/// Whether nothing is to be gathered at `place`.
fn is_served(cache: &IrradianceCache, place: &Place) -> bool {
    cache.is_full() || cache.reaches(place.position(), place.normal(), 0.0)
}
