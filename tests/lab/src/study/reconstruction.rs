//! Reconstruction of path-traced pictures against a long reference.

use super::threads::Threads;
use crate::Result;
use crate::flags::{self, CameraArgs};
use crate::output::Output;
use clap::Args;
use halflight::load::{LoadOptions, load};
use halflight::pages::Pages;
use halflight_core::bsdf::All;
use halflight_core::bvh::{Bvh, Serial};
use halflight_core::estimate::Difference;
use halflight_core::film::{Film, Pixel};
use halflight_core::light::LightSampler;
use halflight_core::memory::Arena;
use halflight_core::method::path::PathTracing;
use halflight_core::method::{PilotSize, RenderContext, RenderMethod, RenderState, Round, Shard};
use halflight_core::reconstruction::{FirstSurfaces, NO_CLUSTER, PixelSurfaces, SurfaceComponents};
use halflight_core::transport::{PathSettings, UNLIMITED};
use halflight_core::{Level, Rgb};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Instant;

/// Raw and reconstructed pictures by path tracing against a long reference
///
/// The errors are relMSE against a reference of another seed, less the noise of the reference.
#[derive(Args)]
pub(super) struct Reconstruction {
    /// Scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value = "64", value_parser = clap::value_parser!(u32).range(4..=1 << 20))]
    spp: u32,
    /// Samples per pixel of the reference; 0 for none
    #[arg(long, value_name = "N", default_value = "4096")]
    reference_spp: u32,
    /// File of the reference: read if it exists, else written
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", value_parser = flags::size, default_value = "128x128")]
    size: [u32; 2],
    /// Seed of the first picture
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u32,
    /// Pictures of different seeds
    #[arg(long, value_name = "N", default_value = "1")]
    seeds: u32,
    /// Number of threads [default: all hardware threads]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    #[command(flatten)]
    camera: CameraArgs,
}

/// Seed of the reference.
const REFERENCE_SEED: u32 = 0x7e5e_ed00;

/// Reference picture and the variance of its pixels, row by row.
struct Reference {
    picture: Vec<Rgb>,
    variance: Vec<Rgb>,
}

impl Reference {
    fn of(film: &Film) -> Self {
        let pixels = || rows(film).into_iter();
        Self {
            picture: pixels().map(|p| p.mean()).collect(),
            variance: pixels().map(|p| p.variance()).collect(),
        }
    }

    /// relMSE of the reference itself, and of `picture` beyond it.
    fn errors(&self, picture: &[Rgb]) -> [f64; 2] {
        let difference = Difference::between(picture.iter().copied(), self.picture.iter().copied());
        let floor = 0.01 * difference.reference_mean.powi(2);
        let channels = |rgb: &Rgb| rgb.to_array().map(f64::from);
        let pairs = self.picture.iter().zip(&self.variance);
        let terms = pairs.flat_map(|(r, v)| {
            let (r, v) = (channels(r), channels(v));
            [0, 1, 2].map(|i| if v[i] > 0.0 { v[i] / (r[i] * r[i] + floor) } else { 0.0 })
        });
        let own = terms.sum::<f64>() / (3 * self.picture.len()) as f64;
        [own, difference.relmse - own]
    }

    fn write(&self, path: &PathBuf) -> Result<()> {
        let numbers = self.picture.iter().chain(&self.variance).flat_map(|rgb| rgb.to_array());
        let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
        Ok(std::fs::write(path, bytes)?)
    }

    /// `None` unless the file has `pixels` pixels.
    fn read(path: &PathBuf, pixels: usize) -> Option<Self> {
        let bytes = std::fs::read(path).ok()?;
        let (words, _) = bytes.as_chunks::<4>();
        let numbers: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
        let (colours, _) = numbers.as_chunks::<3>();
        let colours: Vec<Rgb> = colours.iter().map(|rgb| Rgb::from(*rgb)).collect();
        (colours.len() == 2 * pixels).then(|| {
            let (picture, variance) = colours.split_at(pixels);
            Self { picture: picture.to_vec(), variance: variance.to_vec() }
        })
    }
}

/// Pixels row by row.
fn rows(film: &Film) -> Vec<Pixel> {
    (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| film.pixel(x, y))).collect()
}

impl Reconstruction {
    pub(super) fn run(&self, output: &mut Output) -> Result<()> {
        let loaded = load(&self.scene, &LoadOptions::default())?;
        let views = loaded.views();
        let scene = views.scene(self.camera.camera(&loaded)?);
        let [width, height] = self.size;
        let settings = PathSettings { width, height, seed: self.seed, max_depth: UNLIMITED };
        let level = Level::detect();
        let mut memory = Pages::new(Bvh::footprint(scene.mesh.triangles.len()))?;
        let bvh = Bvh::build_with(&scene.mesh, &mut Arena::over(&mut memory), level, &Serial)?;
        let mut memory = Pages::new(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)))?;
        let lights = LightSampler::build(&scene, &mut Arena::over(&mut memory))?.with_level(level);
        let context = RenderContext { scene: &scene, bvh, lights, settings, level, pilots: PilotSize::USUAL };
        let threads = match self.threads {
            Some(threads) => threads,
            None => available_parallelism()?.into(),
        };
        let scratch = PathTracing::<All>::scratch().or(FirstSurfaces::<All>::scratch());
        let mut executor = Threads::new(threads, scratch)?;

        let start = Instant::now();
        let mut memory = Pages::new(SurfaceComponents::footprint(&scene.mesh))?;
        let components = SurfaceComponents::build(&scene.mesh, &mut Arena::over(&mut memory))?;
        let component_seconds = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let mut memory = Pages::new(FirstSurfaces::<All>::footprint(width, height))?;
        let search = FirstSurfaces::<All>::new(&context, components);
        let surfaces = search.find(&mut Arena::over(&mut memory), &mut executor)?;
        let surfaces = surfaces.ok_or("the search for surfaces ended early")?;
        let surface_seconds = start.elapsed().as_secs_f64();
        output.line(format!(
            "{} triangles, components in {component_seconds:.3} s; surfaces in {surface_seconds:.3} s by \
             {threads} threads: {}",
            scene.mesh.triangles.len(),
            summary(surfaces)
        ));

        let reference = match self.reference_spp {
            0 => None,
            spp => Some(self.reference(&context, spp, &mut executor)?),
        };
        let mut pictures = Vec::new();
        for seed in self.seed..self.seed + self.seeds.max(1) {
            let context = RenderContext { settings: PathSettings { seed, ..settings }, ..context };
            let Some(reference) = &reference else { break };
            let raw = film(&context, self.spp, &mut executor, |film| film.rows().collect::<Vec<_>>())?;
            let [own, error] = reference.errors(&raw);
            output.line(format!("seed {seed}: raw {error:.3e}, reference {own:.1e}"));
            pictures.push(json!({ "seed": seed, "raw": error, "reference": own }));
        }
        output.object(&json!({
            "component_seconds": component_seconds,
            "surface_seconds": surface_seconds,
            "pictures": pictures,
        }));
        Ok(())
    }

    fn reference(&self, context: &RenderContext, spp: u32, executor: &mut Threads) -> Result<Reference> {
        let pixels = self.size[0] as usize * self.size[1] as usize;
        if let Some(known) = self.reference.as_ref().and_then(|path| Reference::read(path, pixels)) {
            return Ok(known);
        }
        let settings = PathSettings { seed: REFERENCE_SEED, ..context.settings };
        let reference = film(&RenderContext { settings, ..*context }, spp, executor, Reference::of)?;
        if let Some(path) = &self.reference {
            reference.write(path)?;
        }
        Ok(reference)
    }
}

/// Calls `work` with a film of `spp` samples per pixel by path tracing.
fn film<T>(
    context: &RenderContext,
    spp: u32,
    executor: &mut Threads,
    work: impl FnOnce(&Film) -> T,
) -> Result<T> {
    let PathSettings { width, height, .. } = context.settings;
    let mut method = PathTracing::<All>::new(context, None, executor)?;
    let mut memory = Pages::new(RenderState::footprint(width, height))?;
    let mut state = RenderState::new(width, height, Shard::WHOLE, &mut Arena::over(&mut memory))?;
    method.round(&mut Round { executor, state: &mut state, target: spp, step: 64 })?;
    Ok(work(&state.film))
}

/// Numbers of pixels and clusters.
fn summary(surfaces: &[PixelSurfaces]) -> String {
    let percent = |is: &dyn Fn(&PixelSurfaces) -> bool| {
        100.0 * surfaces.iter().filter(|pixel| is(pixel)).count() as f64 / surfaces.len().max(1) as f64
    };
    let clusters: BTreeSet<u32> =
        surfaces.iter().flat_map(|pixel| pixel.clusters).filter(|number| *number != NO_CLUSTER).collect();
    let whole = percent(&|pixel| pixel.fractions[0] >= 1.0);
    let known = percent(&|pixel| pixel.fractions.iter().sum::<f32>() > 0.99);
    format!("{whole:.1} % whole, {known:.1} % in four clusters, {} clusters", clusters.len())
}
