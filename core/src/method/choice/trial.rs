//! Trial of paths and records: 16 tiles with four samples per pixel by path tracing, by path tracing in which
//! an irradiance cache supplies the indirect light of diffuse surfaces, and by one in which records supply
//! the light of rough lobes, too. It measures the variance and the rays of each.

use super::NoiseGains;
use super::goal::SAMPLES;
use crate::Rgb;
use crate::bsdf::Features;
use crate::cache::radiance::{LobeSettings, ServedLobes};
use crate::estimate::RELMSE_OFFSET;
use crate::film::{PIXELS_PER_TILE, Pixel};
use crate::memory::{Footprint, MemorySource, OutOfMemory};
use crate::method::cache_resolution::CacheResolution;
use crate::method::caustics::{self, CausticPathTracing};
use crate::method::executor::{Executor, Passed};
use crate::method::pilot::PILOT_TILES;
use crate::method::tuned::REUSE_GAIN;
use crate::method::{PilotSize, RenderContext};
use crate::transport::cached::view;
use crate::transport::path::{LightEstimator, WAVE};
use crate::transport::{Counters, PathIntegrator, PathSettings, SuppliedLobes};

/// Pixels of a block.
const BLOCK: usize = 64;

/// Light that records supply: none, that of diffuse surfaces, and that of lobes, too.
pub(super) const SUPPLIES: usize = 3;
pub(super) const IRRADIANCE: usize = 1;
pub(super) const RADIANCE: usize = 2;

/// Sums over a tile, for each of [`SUPPLIES`]: of the light that no record supplies.
#[derive(Clone, Copy, Default)]
struct TileTrial {
    pixels: f64,
    /// Variance of the mean of the samples, relative to the light of pixel or block.
    variance: [f64; SUPPLIES],
    rays: [f64; SUPPLIES],
}

/// Caches that a trial predicts.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrialCaches {
    /// Gather rays and density of the records, if they are fixed.
    pub resolution: Option<CacheResolution>,
    /// Parts in which the picture is rendered, each with caches of its own.
    pub shards: u32,
    /// Lobes that records may serve.
    pub lobes: LobeSettings,
}

/// Variance of the pixels of each of the `pictures` of a tile, relative to the light of pixels and blocks of
/// the first one, and the number of pixels. Their `mean` radiance is that of the whole picture.
pub(super) fn variances<const N: usize>(pictures: [&[Pixel]; N], mean: f64) -> ([f64; N], f64) {
    let brightness = |light: Rgb| f64::from(light.element_sum()) / 3.0;
    let (mut sums, mut count) = ([0.0; N], 0.0);
    for (number, block) in pictures[0].chunks(BLOCK).enumerate() {
        let seen = || block.iter().enumerate().filter(|(_, pixel)| pixel.count() > 0);
        let pixels = seen().count() as f64;
        let level = seen().map(|(_, pixel)| brightness(pixel.mean())).sum::<f64>() / pixels.max(1.0);
        for (place, pixel) in seen() {
            // A lamp is bright in both halves, a firefly in one.
            let least = brightness(pixel.even.mean()).min(brightness(pixel.odd.mean()));
            let own = level.max(least);
            let scale = own * own + RELMSE_OFFSET * mean * mean;
            for (sum, picture) in sums.iter_mut().zip(pictures).filter(|_| scale > 0.0) {
                *sum += brightness(picture[number * BLOCK + place].variance()) / scale;
            }
        }
        count += pixels;
    }
    (sums, count)
}

/// Noise and work of samples of a picture: of all light, of that which no irradiance cache supplies, and of
/// that which no record supplies.
#[derive(Clone, Copy, Debug, Default)]
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
    /// Caches that it predicts.
    pub caches: TrialCaches,
    /// Whether caustic photons belong to the picture.
    pub has_photons: bool,
    /// Gains by a reconstruction of the picture.
    pub gains: NoiseGains,
}

/// Working memory of a worker.
pub(super) fn scratch<F: Features>() -> Footprint {
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
            Some(pilot) => f64::from(pilot.cost()) / f64::from(pilot.gain()).min(REUSE_GAIN),
            None => 1.0,
        };
        let (pixels, triangles) = (context.pixels() as f64, context.scene.mesh.triangles.len());
        let trial = Self { reuse, pixels, triangles, caches: *caches, ..Self::of(&tiles) };
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
            (out.variance, out.pixels) = variances([&*of_all, &*of_first, of_second], mean);
            Ok(Counters::default())
        })?;
    Ok(is_complete.then_some(tiles))
}
