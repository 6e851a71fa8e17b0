//! Coverage of the intervals of irradiance at points: of pooled variances, of Student's t over the samples
//! of a point, and of sixteen replicates.

mod coverage;
mod places;

use super::threads::Threads;
use crate::Result;
use crate::output::Output;
use clap::Args;
use coverage::{Coverage, REPLICATES, Samples};
use halflight::load::{LoadOptions, load};
use halflight::pages::Pages;
use halflight_core::bvh::{Bvh, Serial};
use halflight_core::light::LightSampler;
use halflight_core::memory::Arena;
use halflight_core::renderer::{IrradianceRenderer, PointSettings, Until};
use halflight_core::scene::Scene;
use halflight_core::{Goal, IrradiancePoint, Level, PointMethod};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

/// Coverage of the 95 % intervals of irradiance at points
///
/// Points are the surfaces that camera rays meet and, for every second one, the next surface of a diffuse
/// path. Those with less than a thousandth of the mean are left out.
#[derive(Args)]
pub(super) struct Points {
    /// Scenes: meshes (.obj) or scene files (.toml)
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    /// Points of a scene
    #[arg(long, value_name = "N", default_value = "1000", value_parser = clap::value_parser!(u32).range(64..=1 << 20))]
    points: u32,
    /// Bakes of different seeds
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    seeds: u32,
    /// Samples per point, multiples of sixteen in ascending order
    #[arg(long, value_name = "N,...", default_value = "64,256,1024", value_delimiter = ',', value_parser = multiple)]
    spp: Vec<u32>,
    /// Samples per point of the reference
    #[arg(long, value_name = "N", default_value = "16384")]
    reference_spp: u32,
    /// Paths without caustic photons, also for the reference
    #[arg(long)]
    no_caustics: bool,
    /// An irradiance cache in place of paths, but for the reference
    #[arg(long)]
    cache: bool,
    /// Number of threads [default: all hardware threads]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

fn multiple(text: &str) -> core::result::Result<u32, String> {
    match text.parse::<u32>() {
        Ok(samples) if samples > 0 && samples.is_multiple_of(REPLICATES) => Ok(samples),
        _ => Err(format!("a number of samples is a multiple of {REPLICATES}")),
    }
}

/// Seed of the reference and of the points.
const REFERENCE_SEED: u32 = 0x7e5e_ed00;

/// Structures of a scene.
struct Built<'a> {
    scene: &'a Scene<'a>,
    bvh: Bvh<'a>,
    lights: LightSampler<'a>,
}

const HEAD: &str = "scene             spp   pooled: held  worst tenth  region  width   samples: held  worst   replicates: held  worst";

impl Points {
    pub(super) fn run(&self, output: &mut Output) -> Result<()> {
        output.line(HEAD);
        let mut rows = Vec::new();
        for path in &self.scenes {
            rows.extend(self.of_scene(path, output)?);
        }
        output.object(&json!({ "scenes": rows }));
        Ok(())
    }

    fn of_scene(&self, path: &Path, output: &mut Output) -> Result<Vec<Value>> {
        let loaded = load(path, &LoadOptions::default())?;
        let views = loaded.views();
        let scene = &views.scene(loaded.camera_or_default());
        let level = Level::detect();
        let mut memory = Pages::new(Bvh::footprint_of(&scene.mesh))?;
        let bvh = Bvh::build_with(&scene.mesh, &mut Arena::over(&mut memory), level, &Serial)?;
        let mut memory = Pages::new(LightSampler::footprint(scene).and(LightSampler::scratch(scene)))?;
        let lights = LightSampler::build(scene, &mut Arena::over(&mut memory))?.with_level(level);
        let built = Built { scene, bvh, lights };
        let threads = self.threads.map_or_else(|| available_parallelism().map(usize::from), Ok)?;
        let mut executor = Threads::new(threads, IrradianceRenderer::scratch())?;

        let points = places::lit(&built, self.points as usize, REFERENCE_SEED.into());
        let mut truth = Vec::new();
        self.bake(
            &built,
            &points,
            (REFERENCE_SEED, PointMethod::Path),
            &mut executor,
            &mut |renderer, executor| {
                renderer.step(executor, Until::Samples(self.reference_spp))?;
                truth = renderer.values().map(|value| f64::from(value.value())).collect();
                Ok(())
            },
        )?;
        let mean = truth.iter().sum::<f64>() / truth.len().max(1) as f64;
        let (points, truth): (Vec<_>, Vec<_>) =
            points.into_iter().zip(truth).filter(|(_, truth)| *truth > 1e-3 * mean).unzip();
        if points.len() < 64 {
            return Err(format!("{}: the camera sees too few lit points", path.display()).into());
        }
        let mut coverages: Vec<_> = self.spp.iter().map(|_| Coverage::new(&truth, &points)).collect();
        for seed in 0..self.seeds {
            let mut samples = Samples::new(points.len());
            self.bake(&built, &points, (seed, self.method()), &mut executor, &mut |renderer, executor| {
                let mut taken = 0;
                for (spp, coverage) in self.spp.iter().zip(&mut coverages) {
                    while taken < *spp {
                        taken += 1;
                        renderer.step(executor, Until::Samples(taken))?;
                        samples.add(renderer.values());
                    }
                    coverage.count(renderer.values(), &samples);
                }
                Ok(())
            })?;
        }
        let name = path.file_stem().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(self
            .spp
            .iter()
            .zip(coverages)
            .map(|(spp, coverage)| {
                output.line(coverage.line(&name, *spp));
                coverage.object(&name, *spp)
            })
            .collect())
    }

    fn method(&self) -> PointMethod {
        if self.cache { PointMethod::IrradianceCache } else { PointMethod::Path }
    }

    /// Runs `work` on a bake of `points`.
    fn bake(
        &self,
        Built { scene, bvh, lights }: &Built,
        points: &[IrradiancePoint],
        (seed, method): (u32, PointMethod),
        executor: &mut Threads,
        work: &mut dyn FnMut(&mut IrradianceRenderer, &mut Threads) -> Result<()>,
    ) -> Result<()> {
        let mut memory = Pages::new(IrradianceRenderer::footprint(scene, points.len(), method))?;
        let goal = Goal { samples: self.spp.last().copied(), ..Goal::default() };
        let settings =
            PointSettings { seed, caustics: !self.no_caustics, method, goal, ..PointSettings::default() };
        let mut arena = Arena::over(&mut memory);
        let structures = (*scene, *bvh, *lights);
        let mut renderer = IrradianceRenderer::over(structures, points, &settings, &mut arena, executor)?;
        work(&mut renderer, executor)
    }
}
