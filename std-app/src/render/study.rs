//! Studies of irradiance caching: errors of each metric at the same number of records, at held-out points of
//! the picture.

use super::built::{Built, BuiltMemory};
use super::deadline::End;
use super::held_out::{EXACT, Point, held_out, luminance};
use super::memory::{Bank, Memory};
use super::run::path_settings;
use super::survey::means;
use super::threads::{Pool, Threads, Workers};
use super::{RenderError, Settings};
use halflight_core::bsdf::{All, Features};
use halflight_core::cache::irradiance::{CellFlux, IrradianceCache, Metric, metric};
use halflight_core::memory::Arena;
use halflight_core::method::irradiance_cache::LEAST_PIXELS;
use halflight_core::method::record_placement::{CacheBuilder, RecordPlacement, step_footprint, step_points};
use halflight_core::scene::Scene;
use halflight_core::transport::PathIntegrator;

/// Parameters of a study.
#[derive(Clone, Debug)]
pub struct IrradianceStudy {
    /// Error metrics to compare.
    pub metrics: Vec<Metric>,
    /// Number of records for each metric.
    pub records: u64,
    /// Approximate number of held-out points.
    pub points: u32,
    /// True if caches are filled in passes, each with half the radii of the previous pass (Křivánek et al.
    /// 2006, §5).
    pub progressive: bool,
}

/// Result for one metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetricError {
    /// The metric.
    pub metric: Metric,
    /// Allowed error in the metric's unit that gives this number of records.
    pub error: f32,
    /// Records.
    pub records: u64,
    /// Root mean squared error of indirect luminance over its mean, without the noise of the exact values.
    pub rmse: f64,
    /// Noise of the exact values, over the mean.
    pub noise: f64,
    /// 99th percentile of the error, relative to the irradiance or at least a tenth of its mean.
    pub worst: f64,
    /// Share of points within reach of records; errors refer to these points.
    pub reached: f64,
    /// Mean predicted relative error at the points.
    pub predicted: f64,
    /// Mean error, relative to the irradiance or at least a tenth of its mean.
    pub achieved: f64,
}

/// Relative tolerance of the number of records.
const TOLERANCE: f64 = 0.02;

/// Most attempts. Near the end chance decides about single records, which are some hundredths of a few
/// hundred.
const ATTEMPTS: usize = 20;

/// Longest step of an attempt in the logarithm of the error: a factor of a hundred.
const FARTHEST: f64 = 4.605;

/// Passes of a progressive filling.
const PASSES: i32 = 3;

/// Gatherings at each held-out point.
const REPEATS: u32 = 4;

/// Runs `study` on the picture of `settings` and calls `tell` after each metric.
pub fn study_irradiance(
    scene: &Scene,
    settings: &Settings,
    study: &IrradianceStudy,
    tell: &mut dyn FnMut(&MetricError),
) -> Result<(), RenderError> {
    // One build suffices for a study.
    Study { scene, settings, study, tell }.run::<All>()
}

struct Study<'a> {
    scene: &'a Scene<'a>,
    settings: &'a Settings,
    study: &'a IrradianceStudy,
    tell: &'a mut dyn FnMut(&MetricError),
}

impl Study<'_> {
    fn run<F: Features>(self) -> Result<(), RenderError> {
        let Study { scene, settings, study, tell } = self;
        let (pool, owner) = (Pool::new(settings.threads)?, BuiltMemory::default());
        let workers = Workers::new(&pool);
        let built = Built::new(scene, (settings.level, settings.memory), &pool, &owner)?;
        let bank = Bank::new();
        let mut memory = Memory::new(scene, settings, &bank).beside(&built)?;
        let (bvh, lights) = (built.bvh, built.lights.with_level(settings.level));
        let tracer = PathIntegrator::<F>::new(scene, &bvh, &lights, path_settings(settings), settings.level);
        let strata = settings.cache.strata() as usize;
        let scratch =
            PathIntegrator::<F>::gather_scratch(strata).or(PathIntegrator::<F>::gather_scratch(EXACT));
        let mut scratch = memory.take_each("paths", scratch, workers.count())?;

        let mut executor = Threads::new(&workers, &mut scratch).until(End::Round(None));
        let size = [settings.width, settings.height];
        let extent = 0.5 * bvh.bounds().diagonal();
        let points = held_out(&tracer, size, [study.points, REPEATS], &mut executor)?;
        let points = points.unwrap_or_default();
        let mut tables = memory.take("gathering", CellFlux::footprint(strata).and(step_footprint()))?;
        let mut tables = Arena::over(&mut tables);
        let flux = CellFlux::build(strata, &mut tables)?;
        let step = step_points(&mut tables)?;
        let capacity = (study.records as usize).saturating_mul(4);
        let mut lines = memory.take("cache", CacheBuilder::footprint(capacity, None))?;
        for &metric in &study.metrics {
            let usual = metric::Settings::new(metric, extent);
            let mut search = Search::new(study.records, usual.error);
            loop {
                let mut builder =
                    CacheBuilder::new(&bvh.bounds(), capacity, 0, None, &mut Arena::over(&mut lines))?;
                for pass in (0..if study.progressive { PASSES } else { 1 }).rev() {
                    // Radii are proportional to the error or to its fourth root.
                    let wider = 2f32.powi(pass);
                    let looser = if metric.takes_distances() { wider } else { wider.powi(4) };
                    let mut placement = RecordPlacement {
                        integrator: &tracer,
                        photons: None,
                        flux: [&flux; 2],
                        metric: metric::Settings { error: looser * search.error, ..usual },
                        least_pixels: wider * LEAST_PIXELS,
                        size,
                        step: &mut *step,
                        lobes: None,
                    };
                    // This executor never ends early.
                    let _ = placement.fill(&mut builder, &mut executor)?;
                    if pass > 0 {
                        builder.tighten(0.5);
                    }
                }
                let error = search.error;
                if search.is_done(builder.cache.records().len() as u64) {
                    tell(&judge(metric, error, &builder.cache, &points));
                    break;
                }
            }
        }
        Ok(())
    }
}

/// Compares a cache with the exact values.
fn judge(metric: Metric, error: f32, cache: &IrradianceCache, points: &[Point]) -> MetricError {
    let mean = points.iter().map(|point| point.exact).sum::<f64>() / points.len().max(1) as f64;
    let (mut squares, mut variance, mut predicted, mut relative) = (0.0, 0.0, 0.0, Vec::new());
    for Point { place, exact, variance: noise, .. } in points {
        let Some(found) = cache.at(&place.query()) else { continue };
        let difference = luminance(found.irradiance) - exact;
        squares += difference * difference - noise;
        variance += noise;
        let [expected, _] = means(place, [cache; 2], |record| [record.predicted(), 0.0]);
        predicted += f64::from(expected);
        relative.push(difference.abs() / exact.max(0.1 * mean));
    }
    relative.sort_by(f64::total_cmp);
    let reached = relative.len();
    let count = reached.max(1) as f64;
    let over_mean = |squares: f64| (squares.max(0.0) / count).sqrt() / mean.max(f64::MIN_POSITIVE);
    let records = cache.records();
    MetricError {
        metric,
        error,
        records: records.len() as u64,
        rmse: over_mean(squares),
        noise: over_mean(variance),
        worst: relative.get(reached * 99 / 100).copied().unwrap_or(0.0),
        reached: reached as f64 / points.len().max(1) as f64,
        predicted: predicted / count,
        achieved: relative.iter().sum::<f64>() / count,
    }
}

/// Search for the error that gives the wanted number of records: linear interpolation on logarithmic axes
/// between the last errors with too many and with too few records.
struct Search {
    wanted: f64,
    error: f32,
    attempts: usize,
    /// Logarithms of error and number of records for the last attempts with too many and too few records.
    too_many: Option<[f64; 2]>,
    too_few: Option<[f64; 2]>,
}

impl Search {
    fn new(wanted: u64, error: f32) -> Self {
        Self { wanted: wanted.max(1) as f64, error, attempts: 0, too_many: None, too_few: None }
    }

    /// Records that the error gave this number of records; returns whether the search is over.
    fn is_done(&mut self, records: u64) -> bool {
        self.attempts += 1;
        let records = records.max(1) as f64;
        if (records / self.wanted - 1.0).abs() <= TOLERANCE || self.attempts >= ATTEMPTS {
            return true;
        }
        let here = [f64::from(self.error).ln(), records.ln()];
        if records > self.wanted {
            self.too_many = Some(here)
        } else {
            self.too_few = Some(here)
        }
        let wanted = self.wanted.ln();
        let next = match (self.too_many, self.too_few) {
            (Some([a, many]), Some([b, few])) => {
                let share = ((many - wanted) / (many - few)).clamp(0.1, 0.9);
                a + share * (b - a)
            }
            // Areas of records grow with the squared radius, or with the square root of the error; far away
            // this may fail.
            _ => here[0] + (2.0 * (here[1] - wanted)).clamp(-FARTHEST, FARTHEST),
        };
        self.error = next.exp() as f32;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_finds_the_error_for_any_power() {
        for power in [-0.4, -0.5, -1.0, -2.0] {
            for wanted in [100, 1700, 50_000] {
                let mut search = Search::new(wanted, 1e-4);
                let mut records = 0;
                for _ in 0..ATTEMPTS {
                    records = (20.0 * f64::from(search.error).powf(power)) as u64;
                    if search.is_done(records) {
                        break;
                    }
                }
                let off = (records as f64 / wanted as f64 - 1.0).abs();
                assert!(off <= TOLERANCE, "{power} {wanted}: {records}");
            }
        }
    }
}
