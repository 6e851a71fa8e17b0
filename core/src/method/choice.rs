//! Choice of a method by predicted error.
//!
//! A trial renders 16 tiles with four samples per pixel: by path tracing, by path tracing in which an
//! irradiance cache supplies the indirect light of diffuse surfaces, and by one in which records supply the
//! light of rough lobes, too. It measures the variance and the rays of each. The difference of the variances,
//! divided by the gather rays of a record, is the noise of interpolated light; it includes the difference of
//! the estimators of direct light. Work is counted in rays and not in seconds: the choice follows from scene,
//! settings, seed, memory and, where time is limited, the number of threads.

mod goal;

pub use goal::Goal;

use super::cache_resolution::{CacheResolution, CachedPicture};
use super::caustics::{self, CausticPathTracing};
use super::counts::{self, PilotNoise};
use super::executor::{Executor, Passed};
use super::pilot::PILOT_TILES;
use super::{PilotSize, RenderContext, work_of_detail};
use crate::Rgb;
use crate::bsdf::Features;
use crate::cache::radiance::{LobeSettings, ServedLobes};
use crate::estimate::RELMSE_OFFSET;
use crate::film::{PIXELS_PER_TILE, Pixel};
use crate::findings::Decision::Used;
use crate::findings::{Finding, Value};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::transport::cached::view;
use crate::transport::path::{LightEstimator, WAVE};
use crate::transport::{Counters, PathIntegrator, PathSettings, SuppliedLobes};
use goal::SAMPLES;

/// Pixels of a block.
const BLOCK: usize = 64;

/// Rays of the pilot of counts, and its greatest fraction of the work.
const PILOT_RAYS: f64 = 5e5;
const PILOT_SHARE: f64 = 0.08;

/// Work of a ray of cached paths in a scene of few triangles, with its share of look-ups. It is below one
/// because noise of light samples falls faster than with the inverse of their number.
const CACHED_RAY: f64 = 0.8;

/// Work of filling with records of lobes, relative to that without.
const FILLING_OF_LOBES: f64 = 1.5;

/// Least ratio of predicted errors for which records of lobes join an irradiance cache: they take more rays.
const LEAST_GAIN_OF_LOBES: f64 = 1.1;

/// Factor on the predicted error of light paths: their rays take more time.
const LIGHT_PATHS_FACTOR: f64 = 2.0;

/// Factor on the predicted errors of path tracing and of a cache with caustic photons: light paths, density
/// estimates, and noise that sixteen samples of a block do not show.
const PHOTONS_FACTOR: f64 = 4.0;

/// Least ratio of predicted errors for which a method takes the place of path tracing.
const LEAST_GAIN: f64 = 1.15;

/// Method with the least predicted error or work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Best {
    /// Path tracing with all of its means.
    Paths,
    /// An irradiance cache, by which the picture is predicted to have this work and noise.
    Cache(CachedPicture),
    /// An irradiance cache with records of lobes, as above.
    RadianceCache(CachedPicture),
    /// Light paths with the counts of a pilot.
    LightPaths,
}

/// Light that records supply: none, that of diffuse surfaces, and that of lobes, too.
const SUPPLIES: usize = 3;
const IRRADIANCE: usize = 1;
const RADIANCE: usize = 2;

/// Sums over a tile, for each of [`SUPPLIES`]: of the light that no record supplies.
#[derive(Clone, Copy, Default)]
struct TileTrial {
    pixels: f64,
    /// Variance of the mean of the samples, relative to the light of pixel or block.
    variance: [f64; SUPPLIES],
    rays: [f64; SUPPLIES],
}

/// Caches that a trial predicts.
#[derive(Clone, Copy, Debug)]
pub struct TrialCaches {
    /// Gather rays and density of the records, if they are fixed.
    pub resolution: Option<CacheResolution>,
    /// Parts in which the picture is rendered, each with caches of its own.
    pub shards: u32,
    /// Lobes that records may serve.
    pub lobes: LobeSettings,
}

impl TileTrial {
    /// Adds a block of pixels of a picture with this `mean` radiance, for each of [`SUPPLIES`].
    fn add(&mut self, [all, first, second]: [&[Pixel]; SUPPLIES], mean: f64) {
        let brightness = |light: Rgb| f64::from(light.element_sum()) / 3.0;
        let of_all = all.iter().filter(|all| all.count() > 0);
        let pixels = of_all.clone().count() as f64;
        let level = of_all.map(|all| brightness(all.mean())).sum::<f64>() / pixels.max(1.0);
        for ((all, first), second) in
            all.iter().zip(first).zip(second).filter(|((all, _), _)| all.count() > 0)
        {
            // A lamp is bright in both halves, a firefly in one.
            let least = brightness(all.even.mean()).min(brightness(all.odd.mean()));
            let own = level.max(least);
            let scale = own * own + RELMSE_OFFSET * mean * mean;
            if scale > 0.0 {
                let pixels = [all, first, second];
                for (sum, pixel) in self.variance.iter_mut().zip(pixels) {
                    *sum += brightness(pixel.variance()) / scale;
                }
            }
        }
        self.pixels += pixels;
    }
}

/// Noise and work of samples of a picture: of all light, of that which no irradiance cache supplies, and of
/// that which no record supplies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trial {
    /// Variance of a sample relative to the light of its pixel or block.
    pub noise: [f64; SUPPLIES],
    /// Rays of a sample.
    pub work: [f64; SUPPLIES],
    /// Whether records may serve lobes of the scene.
    pub has_lobes: bool,
    /// Factor on noise × work by path reuse, or 1.
    pub reuse: f64,
    /// Pixels of the picture.
    pub pixels: f64,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Gather rays and density of the records, if they are fixed.
    pub resolution: Option<CacheResolution>,
    /// Parts in which the picture is rendered, each with caches of its own.
    pub shards: f64,
    /// Whether caustic photons belong to the picture.
    pub has_photons: bool,
}

/// Predicted relMSE of methods without a cache; infinite for one that is no choice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Predictions {
    paths: f64,
    /// Noise of a sample of all light, and of that which no record supplies, for each of [`SUPPLIES`].
    noise: [f64; SUPPLIES],
    light_paths: f64,
}

/// Pilot of light paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPaths {
    /// Noise and work that it has found.
    pub noise: PilotNoise,
    /// Whether light paths are a choice.
    pub are_choice: bool,
}

/// Working memory of a worker.
pub fn scratch<F: Features>() -> Footprint {
    caustics::scratch::<F>().slice::<Pixel>(SUPPLIES * PIXELS_PER_TILE)
}

impl Trial {
    /// Trial of `paths`, joined with photons if they pay, and of `caches`. `None` where the executor is over.
    ///
    /// # Errors
    /// [`OutOfMemory`] where the scratch of the executor is smaller than [`scratch`].
    pub fn run<'m, F: Features>(
        context: &RenderContext,
        paths: &mut CausticPathTracing<F>,
        caches: &TrialCaches,
        memory: &mut impl MemorySource<'m>,
        executor: &mut impl Executor,
    ) -> Result<Option<Self>, OutOfMemory> {
        let tables = ServedLobes::footprint(context.scene, caches.lobes.basis);
        // Lobes of a scene with little memory are left to paths.
        let tables = if F::GLOSSY && memory.has(tables) { tables } else { Footprint::default() };
        let (has_photons, reuse) = (paths.finding().used, paths.reuse());
        let picture = (f64::from(paths.mean_radiance(executor)?), context.pilots);
        let (tiles, has_lobes) = memory.lend("lobes", tables, |_, arena| {
            let wide = match tables.bytes() {
                0 => None,
                _ => ServedLobes::build(context.scene, &caches.lobes, arena)?,
            };
            let narrow = F::GLOSSY && view::may_serve(context.scene);
            let supplied = SuppliedLobes { wide: wide.as_ref(), narrow };
            let has_lobes = wide.is_some() || narrow;
            // Samples that the picture does not have.
            let settings = PathSettings { seed: !context.settings.seed, ..context.settings };
            let all = RenderContext { settings, ..*context }.integrator::<F>();
            let [first, second] =
                [SuppliedLobes::default(), supplied].map(|lobes| all.without_cached_light(lobes));
            let second = has_lobes.then_some(second);
            let tiles = match paths.photons() {
                None => trace(&all, (&first, second.as_ref()), picture, executor)?,
                Some(photons) => photons.lend(|photons| match photons {
                    Some(photons) => {
                        let first = first.with_caustics(photons);
                        let second = second.map(|second| second.with_caustics(photons));
                        trace(&all.with_caustics(photons), (&first, second.as_ref()), picture, executor)
                    }
                    None => trace(&all, (&first, second.as_ref()), picture, executor),
                })??,
            };
            Ok((tiles, has_lobes))
        })?;
        let Some(tiles) = tiles else { return Ok(None) };
        let reuse = match reuse.pilot.filter(|_| reuse.used) {
            Some(pilot) => f64::from(pilot.cost()) / f64::from(pilot.gain()).min(counts::REUSE_GAIN),
            None => 1.0,
        };
        let (pixels, shards) = (context.pixels() as f64, caches.shards.into());
        let (triangles, resolution) = (context.scene.mesh.triangles.len(), caches.resolution);
        let trial = Self { reuse, pixels, triangles, resolution, shards, ..Self::of(&tiles) };
        Ok(Some(Self { has_photons, has_lobes, ..trial }))
    }

    /// Noise and work of `tiles`.
    fn of(tiles: &[TileTrial]) -> Self {
        let samples = f64::from(SAMPLES);
        let pixels = tiles.iter().map(|tile| tile.pixels).sum::<f64>().max(1.0);
        let sum = |of: &dyn Fn(&TileTrial) -> f64| tiles.iter().map(of).sum::<f64>();
        Self {
            noise: core::array::from_fn(|i| samples * sum(&|tile| tile.variance[i]) / pixels),
            work: core::array::from_fn(|i| sum(&|tile| tile.rays[i]) / (samples * pixels)),
            ..Self::default()
        }
    }

    /// Work for each pixel that reaches `goal` by path tracing, in rays.
    fn budget(&self, goal: &Goal) -> f64 {
        let time = goal.rays.map(|rays| rays / self.pixels);
        let samples = goal.samples.map(|samples| f64::from(samples) * self.work[0]);
        let error = goal.error.map(|error| self.error_of_paths(1.0) / error);
        [time, samples, error].into_iter().flatten().fold(f64::INFINITY, f64::min)
    }

    /// relMSE of path tracing after so much work for each pixel.
    pub fn error_of_paths(&self, work: f64) -> f64 {
        self.reuse * self.noise[0] * self.work[0] / work
    }

    /// Picture with a cache after so much work for each pixel, by the light that records supply
    /// ([`SUPPLIES`]), and its relMSE. `noise` is that of samples of each.
    fn cached(&self, supply: usize, work: f64, noise: &[f64; SUPPLIES]) -> (CachedPicture, f64) {
        let cached_ray = CACHED_RAY * work_of_detail(self.triangles);
        let product = noise[supply] * cached_ray * self.work[supply];
        let pixels = self.pixels / self.shards;
        let picture = CachedPicture {
            rays: work * pixels,
            samples: product * pixels,
            gathered: (noise[0] - noise[supply]).max(0.0),
        };
        let of_lobes = if supply > IRRADIANCE { FILLING_OF_LOBES } else { 1.0 };
        let filling = |resolution: CacheResolution| {
            of_lobes * resolution.predicted_filling(self.pixels, self.triangles)
        };
        let chosen = || picture.resolution(filling(CacheResolution::COARSEST));
        let resolution = self.resolution.unwrap_or_else(chosen);
        (picture, picture.error_after(&resolution, filling(resolution)))
    }

    /// Errors after so much work for each pixel.
    fn predict(&self, work: f64, found: Option<LightPaths>) -> Predictions {
        let of_trial = self.error_of_paths(work);
        let factor = if self.has_photons { PHOTONS_FACTOR } else { 1.0 };
        // The pilot of light paths finds light that the few paths of the trial miss.
        let samples_of = |rays: f32| work / f64::from(rays);
        let of_pilot = found.map(|LightPaths { noise, .. }| {
            let samples = samples_of(noise.work_of_paths) / self.reuse;
            noise.rests[0].error(samples, self.pixels)
        });
        let paths = (factor * of_trial).max(of_pilot.unwrap_or(0.0));
        // Rare light is that of records or of the rest.
        let noise = core::array::from_fn(|i| match (i, found) {
            (0, _) => self.noise[0] * paths / of_trial,
            (_, None) => factor * self.noise[i],
            (_, Some(LightPaths { noise, .. })) => {
                let samples = work / self.work[i];
                (factor * self.noise[i]).max(samples * noise.rests[i].error(samples, self.pixels))
            }
        });
        let light_paths =
            found.filter(|found| found.are_choice).map_or(f64::INFINITY, |LightPaths { noise, .. }| {
                noise.light_paths.error(samples_of(noise.work) / LIGHT_PATHS_FACTOR, self.pixels)
            });
        Predictions { paths, noise, light_paths }
    }

    /// Whether the pilot of light paths costs little beside the picture.
    pub fn affords_light_paths(&self, goal: &Goal) -> bool {
        self.budget(goal) * self.pixels > PILOT_RAYS / PILOT_SHARE
    }

    /// The method with the least error for `goal`, and the reason; light paths if their pilot prefers them to
    /// path tracing.
    pub fn best(
        &self,
        goal: &Goal,
        may_have_cache: bool,
        light_paths: Option<LightPaths>,
    ) -> (Best, Finding) {
        if self.noise[0] <= 0.0 {
            return (Best::Paths, Finding::new("method", Used, "paths show no noise"));
        }
        let work = self.budget(goal);
        let Predictions { paths, noise, light_paths } = self.predict(work, light_paths);
        let [(first, cache), (second, radiance_cache)] =
            [(IRRADIANCE, may_have_cache), (RADIANCE, may_have_cache && self.has_lobes)].map(
                |(supply, is_choice)| {
                    let (picture, error) = self.cached(supply, work, &noise);
                    (picture, if is_choice { error } else { f64::INFINITY })
                },
            );
        let cached = cache.min(radiance_cache);
        let (best, reason) = match () {
            () if paths <= LEAST_GAIN * cached.min(light_paths) => {
                (Best::Paths, "path tracing has the least error")
            }
            () if cached <= light_paths && cache <= LEAST_GAIN_OF_LOBES * radiance_cache => {
                (Best::Cache(first), "an irradiance cache has less error than path tracing")
            }
            () if cached <= light_paths => {
                (Best::RadianceCache(second), "records of rough reflections have less error than paths")
            }
            () => (Best::LightPaths, "light paths have less error than paths alone"),
        };
        let number = |error: f64| error.is_finite().then_some(Value::Number(error));
        let finding = Finding::new("method", Used, reason)
            .with("path", Value::Number(paths))
            .with_some("irradiance_cache", number(cache))
            .with_some("radiance_cache", number(radiance_cache))
            .with_some("light_paths", number(light_paths));
        (best, finding)
    }
}

/// Traces the tiles of a trial in a picture with this `mean` radiance: by paths for all light, for that which
/// no irradiance cache supplies, and for that which no record supplies; where no lobe is served, these are
/// the same.
fn trace<F: Features, A: LightEstimator<F>, B: LightEstimator<F>>(
    all: &PathIntegrator<F, A>,
    (first, second): (&PathIntegrator<F, B>, Option<&PathIntegrator<F, B>>),
    (mean, pilots): (f64, PilotSize),
    executor: &mut impl Executor,
) -> Result<Option<[TileTrial; PILOT_TILES]>, OutOfMemory> {
    let mut tiles = [TileTrial::default(); PILOT_TILES];
    let Passed { is_complete, .. } =
        executor.pass(all.pilot_tasks(pilots.tiles()).zip(tiles.iter_mut()), |_, (tile, out), worker| {
            let mut arena = worker.scratch.scratch();
            let pixels = arena.slice::<Pixel>(SUPPLIES * PIXELS_PER_TILE)?;
            pixels.fill(Pixel::default());
            let (of_all, rest) = pixels.split_at_mut(PIXELS_PER_TILE);
            let (of_first, of_second) = rest.split_at_mut(PIXELS_PER_TILE);
            let samples = 0..SAMPLES;
            out.rays[0] = all.run(tile, samples.clone(), WAVE, &mut arena, of_all)?.all_rays() as f64;
            let rays = first.run(tile, samples.clone(), WAVE, &mut arena, of_first)?.all_rays() as f64;
            out.rays[IRRADIANCE] = rays;
            out.rays[RADIANCE] = match second {
                Some(second) => second.run(tile, samples, WAVE, &mut arena, of_second)?.all_rays() as f64,
                None => rays,
            };
            let of_second: &[Pixel] = if second.is_some() { of_second } else { of_first };
            let blocks = of_all.chunks(BLOCK).zip(of_first.chunks(BLOCK)).zip(of_second.chunks(BLOCK));
            blocks.for_each(|((all, first), second)| out.add([all, first, second], mean));
            Ok(Counters::default())
        })?;
    Ok(is_complete.then_some(tiles))
}

#[cfg(test)]
mod tests;
