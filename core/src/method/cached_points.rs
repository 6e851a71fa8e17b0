//! Irradiance cache of a film of points: records at points serve the indirect light of their neighbours, and
//! light samples find the direct light. A pilot predicts the error by it and by path tracing.

use super::cache_resolution::{CacheResolution, CachedPicture};
use super::caustics::{for_pilot_tiles, median_step};
use super::choice::Goal;
use super::executor::Executor;
use super::irradiance_cache::{CacheSettings, FILLED, IrradianceCaching};
use super::record_placement::CacheBuilder;
use super::tuned::{CACHED_RAY, LEAST_GAIN};
use super::{RenderContext, Round, work_of_detail};
use crate::bsdf::Features;
use crate::cache::irradiance::Metric;
use crate::estimate::NORMAL_95;
use crate::film::Pixel;
use crate::findings::Decision::{Limited, Used};
use crate::findings::{Finding, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::cached::point_places::PointPlaces;
use crate::transport::path::reuse_pilot::SAMPLES;
use crate::transport::{
    CacheView, Counters, IrradiancePoint, LightEstimator, LightPart, PathIntegrator, Pilot, SuppliedLobes,
};

/// Work of the audit, relative to that of the samples.
const AUDIT: f64 = 0.2;

/// Work of filling one of both caches, relative to that of the bake, above which paths take its place: a part
/// of the predicted ratio of squared errors, so that little is lost where little is to be gained, and its
/// most (docs/decisions/bakes.md#work-of-filling).
const FILLING_OF_GAIN: f64 = 0.05;
const MOST_FILLING: f64 = 0.5;

/// Part of the tiles whose records are placed first, and their fewest and most, by which those of all are
/// predicted. And the part of them that is certain: tiles of their own need records around them that they
/// could share.
const PILOT_PART: usize = 16;
const PILOT: [usize; 2] = [2, 8];
const CERTAIN: f64 = 0.5;

const SETTINGS: CacheSettings = CacheSettings {
    metric: Metric::Halflight,
    error: CacheResolution::COARSEST.error,
    strata: CacheResolution::COARSEST.strata as usize,
    records: None,
    fewest: 0,
    reserve: 0,
    widens: false,
    lobes: None,
    picture: Some(CachedPicture { rays: 0.0, samples: 0.0, gathered: 1.0 }),
};

/// Prediction of a bake by path tracing and by a cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointPrediction {
    /// Film of the cache.
    picture: CachedPicture,
    /// Records of a cache from which on its filling takes too much of the work.
    records: f64,
    /// Squared relative error by path tracing, and by the cache.
    errors: [f64; 2],
    /// Limits beyond which path tracing is better.
    pub limits: CacheLimits,
}

/// Limits of a cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheLimits {
    /// Squared relative bias that exceeds the goal, or the error of path tracing.
    pub bias: f64,
    /// Samples of a point after which tiles that are not within the error will not be: the noise of records
    /// does not fall with them. Half of those of path tracing.
    pub samples: f64,
}

impl PointPrediction {
    /// Prediction for `goal`, whose error is the relative half-width of an interval; by two samples of the
    /// points of some tiles. `None` where they show no noise.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn new<F: Features>(
        context: &RenderContext,
        (points, part): (&[IrradiancePoint], LightPart),
        goal: &Goal,
        executor: &mut impl Executor,
    ) -> Result<Option<Self>, OutOfMemory> {
        let paths = context.integrator::<F>();
        let rest = paths.without_cached_light(SuppliedLobes::default());
        let of = (points, part);
        let mean = mean_of(&paths, of, executor)?;
        let [all, rest] = [pilot_of(&paths, of, mean, executor)?, pilot_of(&rest, of, mean, executor)?];
        let (noise, work) = (all.noise(false), all.work(false));
        let count = points.len() as f64;
        let of_sample = noise * work * count;
        if of_sample <= 0.0 {
            return Ok(None);
        }
        let largest = goal.error.map(|error| error / NORMAL_95 * (error / NORMAL_95));
        let samples = goal.samples.map(|samples| f64::from(samples) * count * work);
        let within = largest.map(|error| of_sample / error);
        let rays = [goal.rays, samples, within].into_iter().flatten().fold(f64::INFINITY, f64::min);
        let triangles = context.scene.mesh.unique_triangles();
        let of_cached = CACHED_RAY * work_of_detail(triangles) * rest.work(false) * (1.0 + AUDIT);
        let picture = CachedPicture {
            rays,
            samples: rest.noise(false) * of_cached * count,
            gathered: (noise - rest.noise(false)).max(0.0),
        };
        let filling = |resolution: &CacheResolution| resolution.predicted_filling(count, triangles);
        let resolution = picture.resolution(filling(&CacheResolution::COARSEST));
        let errors = [of_sample / rays, picture.error_after(&resolution, filling(&resolution))];
        let limits = CacheLimits {
            bias: if rays.is_finite() { largest.unwrap_or(0.0).max(errors[0]) } else { f64::INFINITY },
            samples: within.map_or(f64::INFINITY, |within| 0.5 * within / (count * work)),
        };
        let of_record = work * f64::from(CacheResolution::COARSEST.strata.pow(2));
        let filling = (FILLING_OF_GAIN * errors[0] / errors[1]).min(MOST_FILLING);
        Ok(Some(Self { picture, records: filling * rays / of_record, errors, limits }))
    }

    /// True if the cache is predicted to have less error.
    pub fn prefers_cache(&self) -> bool {
        self.errors[1] * LEAST_GAIN < self.errors[0]
    }

    /// `finding` with the predicted errors.
    pub fn add_to(&self, finding: Finding) -> Finding {
        let [paths, cache] = self.errors.map(libm::sqrt);
        finding
            .with("predicted_by_paths", Value::Fraction(paths))
            .with("predicted_by_cache", Value::Fraction(cache))
    }
}

/// Mean irradiance by one sample of some tiles.
fn mean_of<F: Features>(
    integrator: &PathIntegrator<F>,
    of: (&[IrradiancePoint], LightPart),
    executor: &mut impl Executor,
) -> Result<f32, OutOfMemory> {
    let mean = |pixels: &[Pixel], _: &Counters| {
        pixels.iter().map(|pixel| pixel.mean().element_sum() / 3.0).sum::<f32>() / pixels.len().max(1) as f32
    };
    let means = for_pilot_tiles((integrator, 1), of, executor, mean)?;
    Ok(means.iter().flatten().sum::<f32>() / means.iter().flatten().count().max(1) as f32)
}

fn pilot_of<F: Features, E: LightEstimator<F>>(
    integrator: &PathIntegrator<F, E>,
    of: (&[IrradiancePoint], LightPart),
    mean: f32,
    executor: &mut impl Executor,
) -> Result<Pilot, OutOfMemory> {
    let of_tile = |pixels: &[Pixel], counters: &Counters| Pilot::of_points(pixels, (1.0, mean), counters);
    let mut pilot = Pilot::default();
    let tiles = for_pilot_tiles((integrator, SAMPLES), of, executor, of_tile)?;
    tiles.into_iter().flatten().for_each(|tile| pilot += tile);
    Ok(pilot)
}

/// Irradiance cache of points.
pub struct CachedPoints<'a, F> {
    caching: IrradianceCaching<'a, F>,
    /// True if its size follows from the work.
    is_limited: bool,
    /// Tiles of the pilot and of the film, until the records of the pilot are placed.
    pilot: Option<(PointPlaces<'a>, [usize; 2])>,
    /// Records that pay.
    most: f64,
    /// Predicted records of one cache.
    predicted: Option<f64>,
}

impl<'a, F: Features> CachedPoints<'a, F> {
    /// Working memory of a worker.
    pub fn scratch() -> Footprint {
        let strata = CacheResolution::FINEST.strata as usize;
        PathIntegrator::<F>::gather_scratch(strata)
    }

    /// Memory of the tables and of both caches of so many points.
    pub fn footprint(points: usize) -> Footprint {
        let records = CacheBuilder::footprint(SETTINGS.records(points), None);
        SETTINGS.gathering_footprint().and(records).and(records)
    }

    /// An empty cache for `points` along a curve, which `is_limited` in size by its work; `None` where all
    /// are in one position.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `memory` has less than the tables need.
    pub fn new(
        context: &RenderContext<'a>,
        points: &'a [IrradiancePoint],
        (prediction, is_limited): (&PointPrediction, bool),
        memory: &mut impl MemorySource<'a>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let Some(step) = median_step(points) else { return Ok(None) };
        let usual = SETTINGS.records(points.len()) as f64;
        let records = is_limited.then(|| prediction.records.clamp(1.0, usual) as u32);
        let settings = CacheSettings { picture: Some(prediction.picture), records, ..SETTINGS };
        let caching = IrradianceCaching::new(context, &settings, memory)?;
        let places = PointPlaces::new(points, step);
        let tiles = (places.tiles() / PILOT_PART).clamp(PILOT[0], PILOT[1]);
        // Few tiles are their own pilot.
        let has_pilot = is_limited && places.tiles() >= PILOT_PART;
        let pilot = has_pilot.then(|| (places.of_tiles(tiles), [tiles, places.tiles()]));
        let (most, predicted) = (prediction.records, None);
        Ok(Some(Self { caching: caching.for_points(places), is_limited, pilot, most, predicted }))
    }

    /// True if the scene needs more records than pay.
    pub fn is_too_small(&self) -> bool {
        let is_predicted = self.predicted.is_some_and(|records| CERTAIN * records > self.most);
        self.is_limited && (is_predicted || self.caching.caches().iter().any(|cache| cache.is_full()))
    }

    /// True if there was no time for all of its records.
    pub fn is_cut(&self) -> bool {
        self.caching.is_cut()
    }

    /// Fills both caches, or continues to, unless they are too small. Returns whether they are complete.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is too small.
    pub fn fill<E: Executor>(&mut self, round: &mut Round<E>) -> Result<bool, OutOfMemory> {
        if !self.caching.is_frozen() {
            if let Some((places, [tiles, all])) = self.pilot {
                let of_all = all as f64 / tiles as f64;
                let most = (self.most / (CERTAIN * of_all)) as usize + 1;
                if !self.caching.fill_part((places, most), round)? {
                    return Ok(false);
                }
                let records = self.caching.caches()[0].records().len();
                (self.pilot, self.predicted) = (None, Some(of_all * records as f64));
                if self.is_too_small() {
                    return Ok(false);
                }
            }
            for number in 0..FILLED {
                if !self.caching.fill(number, None, round)? || self.is_too_small() {
                    return Ok(false);
                }
            }
            self.caching.freeze();
        }
        Ok(true)
    }

    /// Paths that look up the records.
    pub fn paths(&self) -> PathIntegrator<'_, F, CacheView<'_>> {
        self.caching.cached_paths()
    }

    /// Numbers of its records.
    pub fn finding(&self) -> Finding {
        let caches = self.caching.caches();
        let refused: u64 = caches.iter().map(|cache| cache.refused()).sum();
        let (decision, reason) = match (self.caching.is_cut(), refused) {
            (true, _) => (Limited, "filling was cut short: other points are path traced"),
            (false, 1..) => (Limited, "not enough memory: other points are path traced"),
            (false, 0) => (Used, "indirect light is interpolated"),
        };
        let resolution = self.caching.resolution();
        let records: u64 = caches.iter().map(|cache| cache.records().len() as u64).sum();
        Finding::new("irradiance_cache", decision, reason)
            .timed("cache")
            .with("error", Value::Number(resolution.error.into()))
            .with("rays_per_record", Value::Count(resolution.strata.pow(2).into()))
            .with("records", Value::Count(records))
            .with_some("predicted_records", self.predicted.map(|records| Value::Count(2 * records as u64)))
            .with_count("refused", refused)
    }
}
