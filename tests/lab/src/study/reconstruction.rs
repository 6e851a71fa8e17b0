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
use halflight_core::reconstruction::{
    FRACTIONS, FilmReconstruction, FirstSurfaces, NO_CLUSTER, NotReconstructed, PixelSurfaces,
    SurfaceComponents,
};
use halflight_core::transport::{PathSettings, UNLIMITED};
use halflight_core::{Level, Rgb};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Instant;

/// Raw and reconstructed pictures by path tracing against a long reference
///
/// The errors are relMSE against a reference of another seed, less the noise of the reference.
#[derive(Args)]
pub(super) struct Reconstruction {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
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

    /// Estimated squared error of the reconstructed picture with the denominators of the reference.
    fn estimated(&self, film: &Film, filter: &FilmReconstruction) -> f64 {
        let mean = self.picture.iter().map(|rgb| f64::from(rgb.element_sum())).sum::<f64>();
        let floor = 0.01 * (mean / (3 * self.picture.len()) as f64).powi(2);
        let places = (0..film.height()).flat_map(|y| (0..film.width()).map(move |x| [x, y]));
        let squares = places.zip(&self.picture).map(|([x, y], reference)| {
            let Some([a, b, _]) = filter.pixel([x, y]) else { return 0.0 };
            let raw = film.pixel(x, y);
            let bias = (a - raw.even.mean()) * (b - raw.odd.mean());
            let square = 0.25 * (a - b) * (a - b) + bias;
            let channels = square.to_array().into_iter().zip(reference.to_array());
            channels.map(|(e, r)| f64::from(e) / (f64::from(r).powi(2) + floor)).sum::<f64>()
        });
        squares.sum::<f64>() / (3 * self.picture.len()) as f64
    }

    /// Sum of the squares of relative errors of pixels that are not whole, over all pixels, beyond the noise
    /// of the reference.
    fn error_of_mixed(&self, picture: &[Rgb], surfaces: &[PixelSurfaces]) -> f64 {
        let only_mixed: Vec<Rgb> = (picture.iter().zip(&self.picture).zip(surfaces))
            .map(|((own, reference), surfaces)| if surfaces.fractions[0] < 1.0 { *own } else { *reference })
            .collect();
        let variance = self.variance.iter().zip(surfaces);
        let variance = variance.map(|(v, s)| if s.fractions[0] < 1.0 { *v } else { Rgb::ZERO }).collect();
        let [_, error] = Self { picture: self.picture.clone(), variance }.errors(&only_mixed);
        error
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
        let mut memory = Pages::new(Bvh::footprint_of(&scene.mesh))?;
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
        output.line(HEAD);
        for seed in self.seed..self.seed + self.seeds.max(1) {
            let Some(reference) = &reference else { break };
            let context = RenderContext { settings: PathSettings { seed, ..settings }, ..context };
            let row = film(&context, self.spp, &mut executor, |film, executor| {
                errors(film, seed, (surfaces, reference), executor)
            })??;
            output.line(row.line());
            pictures.push(row.object());
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
        let reference =
            film(&RenderContext { settings, ..*context }, spp, executor, |film, _| Reference::of(film))?;
        if let Some(path) = &self.reference {
            reference.write(path)?;
        }
        Ok(reference)
    }
}

/// Errors of the picture of a film, raw and reconstructed.
fn errors(
    film: &Film,
    seed: u32,
    (surfaces, reference): (&[PixelSurfaces], &Reference),
    executor: &mut Threads,
) -> Result<Row> {
    let size = [film.width(), film.height()];
    let start = Instant::now();
    let mut memory = Pages::new(FilmReconstruction::footprint(size))?;
    let mut filter = FilmReconstruction::new(size, surfaces, &mut Arena::over(&mut memory))?;
    // Also where it makes the error larger.
    filter.update(film, None, executor);
    let found = filter.result().map_err(NotReconstructed::reason)?;
    let seconds = start.elapsed().as_secs_f64();
    let raw: Vec<Rgb> = film.rows().collect();
    let filtered: Vec<Rgb> = filter.picture().into_iter().flatten().collect();
    let [own, raw] = reference.errors(&raw);
    let [_, error] = reference.errors(&filtered);
    let mixed = [film.rows().collect(), filtered].map(|picture| reference.error_of_mixed(&picture, surfaces));
    let estimated = [found.error.raw, found.error.total.relmse];
    let exact = reference.estimated(film, &filter);
    let interval = [found.error.total.lower, found.error.total.upper];
    Ok(Row {
        seed,
        own,
        errors: [raw, error],
        mixed,
        estimated,
        exact,
        interval,
        fractions: found.fractions,
        seconds,
    })
}

/// Calls `work` with a film of `spp` samples per pixel by path tracing.
fn film<T>(
    context: &RenderContext,
    spp: u32,
    executor: &mut Threads,
    work: impl FnOnce(&Film, &mut Threads) -> T,
) -> Result<T> {
    let PathSettings { width, height, .. } = context.settings;
    let mut method = PathTracing::<All>::new(context, None, executor)?;
    let mut memory = Pages::new(RenderState::footprint(width, height))?;
    let mut state = RenderState::new(width, height, Shard::WHOLE, &mut Arena::over(&mut memory))?;
    method.round(&mut Round { executor, state: &mut state, target: spp, step: 64 })?;
    Ok(work(&state.film, executor))
}

const HEAD: &str = "seed        raw  reconstructed  gain  told/true raw  told/true  same, true denominators  interval              \
                    reference  mixed raw, reconstructed  seconds  fractions of 48, 24, 12, 6 pixels, guided means, 1 pixel";

/// Errors of a picture.
struct Row {
    seed: u32,
    /// Error of the reference.
    own: f64,
    /// relMSE of the raw and of the reconstructed picture.
    errors: [f64; 2],
    /// Parts of them that mixed pixels have.
    mixed: [f64; 2],
    estimated: [f64; 2],
    /// Estimate with the denominators of the reference.
    exact: f64,
    interval: [f64; 2],
    fractions: [f64; FRACTIONS],
    seconds: f64,
}

impl Row {
    fn line(&self) -> String {
        let Self { seed, own, errors: [raw, error], mixed, estimated, exact, interval, fractions, seconds } =
            self;
        format!(
            "{seed:4}  {raw:9.2e}  {error:13.2e}  {:4.1}  {:13.2}  {:9.2}  {:23.2}  {:.2e} to {:.2e}  {own:9.1e}  {:9.2} {:12.2}  \
             {seconds:7.3}  {fractions:.2?}",
            raw / error,
            estimated[0] / raw,
            estimated[1] / error,
            exact / error,
            interval[0],
            interval[1],
            mixed[0] / raw,
            mixed[1] / error,
        )
    }

    fn object(&self) -> Value {
        json!({
            "seed": self.seed,
            "raw": self.errors[0],
            "reconstructed": self.errors[1],
            "mixed": self.mixed,
            "estimated_raw": self.estimated[0],
            "estimated": self.estimated[1],
            "exact": self.exact,
            "interval": self.interval,
            "reference": self.own,
            "fractions": self.fractions,
            "seconds": self.seconds,
        })
    }
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
