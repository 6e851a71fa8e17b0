//! Error metrics of the irradiance cache at equal numbers of records, at held-out points of the picture.

mod points;
mod report;
mod search;

use crate::Result;
use crate::flags::{self, CameraArgs};
use crate::output::Output;
use crate::study::threads::Threads;
use clap::Args;
use halflight::load::{LoadOptions, load};
use halflight::pages::Pages;
use halflight_core::Level;
use halflight_core::bsdf::All;
use halflight_core::bvh::{Bvh, Serial};
use halflight_core::cache::irradiance::{CellFlux, Metric, metric};
use halflight_core::light::LightSampler;
use halflight_core::memory::Arena;
use halflight_core::method::irradiance_cache::LEAST_PIXELS;
use halflight_core::method::record_placement::{
    CacheBuilder, PlaceSource, RecordPlacement, step_footprint, step_points,
};
use halflight_core::transport::{PathIntegrator, PathSettings};
use points::{EXACT, held_out};
use report::MetricError;
use search::Search;
use serde_json::json;
use std::path::PathBuf;
use std::thread::available_parallelism;

/// Error metrics of the irradiance cache at equal numbers of records
///
/// For each metric the error is searched that fills the cache of the picture with the number of records, to
/// 2 %. The cached irradiance is then compared with many gather rays at points of the picture.
#[derive(Args)]
pub(super) struct Irradiance {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
    scene: PathBuf,
    /// Records per metric
    #[arg(long, value_name = "N", default_value = "1700",
        value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    records: u64,
    /// Metrics to compare [default: all]
    #[arg(long, value_name = "METRIC,...", value_delimiter = ',', value_parser = metric_named)]
    metrics: Vec<Metric>,
    /// Points of comparison, about
    #[arg(long, value_name = "N", default_value = "2000",
        value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    points: u32,
    /// Fill the cache first with four times the radii, then with twice, then with those of the error
    #[arg(long)]
    progressive: bool,
    /// Gather rays of a record: a square
    #[arg(long, value_name = "N", default_value = "256")]
    cache_rays: u32,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = flags::size, default_value = "512x512")]
    size: [u32; 2],
    /// Longest path in segments [default: that of the scene file, or no limit]
    #[arg(long, value_name = "N")]
    max_depth: Option<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value = "0")]
    seed: u32,
    /// Number of threads [default: all hardware threads]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    #[command(flatten)]
    camera: CameraArgs,
}

/// Error metric of the irradiance cache by name.
fn metric_named(name: &str) -> core::result::Result<Metric, String> {
    let names = Metric::ALL.map(Metric::name).join(", ");
    Metric::named(name).ok_or(format!("the metrics are {names}"))
}

/// Passes of a progressive filling, each with half of the radii of the previous one (Křivánek et al. 2006,
/// §5).
const PASSES: i32 = 3;

/// Path tracing of the study: one build of the code for all scenes.
type Tracer<'a> = PathIntegrator<'a, All>;

impl Irradiance {
    pub(super) fn run(&self, output: &mut Output) -> Result<()> {
        let loaded = load(&self.scene, &LoadOptions::default())?;
        loaded.repairs.iter().for_each(|repair| eprintln!("note: {repair}"));
        let views = loaded.views();
        let scene = views.scene(self.camera.camera(&loaded)?);
        let settings = PathSettings {
            width: self.size[0],
            height: self.size[1],
            seed: self.seed,
            max_depth: self.max_depth.or(loaded.settings.max_depth.map(u32::from)).unwrap_or(u32::MAX),
        };
        let level = Level::detect();
        let mut memory = Pages::new(Bvh::footprint_of(&scene.mesh))?;
        let bvh = Bvh::build_with(&scene.mesh, &mut Arena::over(&mut memory), level, &Serial)?;
        let mut memory = Pages::new(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)))?;
        let lights = LightSampler::build(&scene, &mut Arena::over(&mut memory))?.with_level(level);
        let tracer = Tracer::new(&scene, &bvh, &lights, settings, level);

        let mut rows = Vec::new();
        output.line(report::HEAD);
        self.compare(&bvh, &tracer, &mut |row| {
            output.line(row.line());
            rows.push(row.object());
        })?;
        output.object(&json!({
            "records": self.records,
            "rays_per_record": self.strata().pow(2),
            "metrics": rows,
        }));
        Ok(())
    }

    /// Strata along a side of the hemisphere.
    fn strata(&self) -> usize {
        self.cache_rays.isqrt() as usize
    }

    /// Calls `each` with the errors of each metric at the number of records.
    fn compare(&self, bvh: &Bvh, tracer: &Tracer, each: &mut dyn FnMut(&MetricError)) -> Result<()> {
        let threads = match self.threads {
            Some(threads) => threads,
            None => available_parallelism()?.into(),
        };
        let scratch = Tracer::gather_scratch(self.strata()).or(Tracer::gather_scratch(EXACT));
        let mut executor = Threads::new(threads, scratch)?;
        let points = held_out(tracer, self.size, self.points, &mut executor)?;
        let capacity = (self.records as usize).saturating_mul(4);
        let mut memory = Pages::new(CacheBuilder::footprint(capacity, None))?;
        let metrics = if self.metrics.is_empty() { &Metric::ALL[..] } else { &self.metrics };
        for &metric in metrics {
            let usual = metric::Settings::new(metric, 0.5 * bvh.bounds().diagonal());
            let mut search = Search::new(self.records, usual.error);
            loop {
                let settings = metric::Settings { error: search.error, ..usual };
                let mut builder =
                    CacheBuilder::new(&bvh.bounds(), capacity, 0, None, &mut Arena::over(&mut memory))?;
                self.fill(tracer, settings, &mut builder, &mut executor)?;
                if search.is_done(builder.cache.records().len() as u64) {
                    each(&MetricError::of(&settings, &builder.cache, &points));
                    break;
                }
            }
        }
        Ok(())
    }

    /// Fills a cache by `settings`.
    fn fill(
        &self,
        tracer: &Tracer,
        settings: metric::Settings,
        builder: &mut CacheBuilder,
        executor: &mut Threads,
    ) -> Result<()> {
        let mut tables = Pages::new(CellFlux::footprint(self.strata()).and(step_footprint()))?;
        let mut tables = Arena::over(&mut tables);
        let flux = CellFlux::build(self.strata(), &mut tables)?;
        let step = step_points(&mut tables)?;
        for pass in (0..if self.progressive { PASSES } else { 1 }).rev() {
            // Radii are proportional to the error or to its fourth root.
            let wider = 2f32.powi(pass);
            let looser = if settings.metric.takes_distances() { wider } else { wider.powi(4) };
            let mut placement = RecordPlacement {
                integrator: tracer,
                photons: None,
                flux: [&flux; 2],
                metric: metric::Settings { error: looser * settings.error, ..settings },
                least_pixels: wider * LEAST_PIXELS,
                source: PlaceSource::Picture(self.size),
                step: &mut *step,
                lobes: None,
            };
            // This executor never ends early.
            let _ = placement.fill(builder, executor)?;
            if pass > 0 {
                builder.tighten(0.5);
            }
        }
        Ok(())
    }
}
