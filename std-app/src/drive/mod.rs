//! Runs the core's passes: memory, threads, rounds, stop rules. [`render`] is all that a program needs.
//!
//! A picture is made in rounds; a round adds the same number of samples to every pixel. How the samples are
//! cut into rounds, and how many threads there are, leaves the bits of the picture as they are.

mod history;
mod memory;
mod rounds;
mod workers;

pub use halflight_core::estimate::ErrorEstimate;
pub use history::{Against, Round};
pub use memory::MemoryUse;
pub use rounds::Stop;

use crate::save::Image;
use core::sync::atomic::{AtomicBool, Ordering};
use halflight_core::Level;
use halflight_core::bsdf::Features;
use halflight_core::bvh::Bvh;
use halflight_core::census::{Census, WithFeatures};
use halflight_core::film::{Film, Pixel};
use halflight_core::light::Lights;
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::Scene;
use halflight_core::transport::{Counters, PathSettings, PathTracer, UNLIMITED, path::WAVE};
use history::{Clock, Reference};
use memory::Memory;
use rounds::Rounds;
use std::sync::Arc;
use std::time::Instant;
use workers::Workers;

/// How to render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Another seed, another picture of the same thing.
    pub seed: u32,
    /// The largest number of segments of a path; 1 is light that is seen directly. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Number of threads; `None`: as many as the machine runs at once.
    pub threads: Option<usize>,
    /// Most bytes that the scene and all structures may take together; `None`: no limit.
    pub memory: Option<usize>,
    /// The instruction set of the kernels.
    pub level: Level,
    /// When to stop.
    pub stop: Stop,
    /// What the picture should be, of the same size: each round is compared with it, and the time that this
    /// takes does not count.
    pub reference: Option<Arc<Image>>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 512,
            height: 512,
            seed: 0,
            max_depth: None,
            threads: None,
            memory: None,
            level: Level::detect(),
            stop: Stop::default(),
            reference: None,
        }
    }
}

/// What is known while a picture is made, after each round.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Seconds of rendering so far.
    pub seconds: f64,
    /// Seconds that are left, if all goes on as before. `None` where nothing is known yet.
    pub seconds_left: Option<f64>,
    /// Samples of each pixel so far.
    pub spp: u32,
    /// Rounds so far.
    pub rounds: u32,
    /// The error so far.
    pub error: Option<ErrorEstimate>,
}

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// A stop rule held.
    Done,
    /// The interrupt flag was raised: the picture is valid, with fewer samples.
    Interrupted,
}

/// Seconds of wall-clock time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Building the hierarchy and the light structures.
    pub build: f64,
    /// Tracing paths, without the comparisons with a reference.
    pub render: f64,
}

/// A picture and all that is known of it.
#[derive(Clone, Debug)]
pub struct RenderResult {
    /// The picture.
    pub image: Image,
    /// Samples of each pixel (of the least sampled one after an interrupt).
    pub spp: u32,
    /// Rounds completed.
    pub rounds: u32,
    /// What was known after each of them.
    pub history: Vec<Round>,
    /// Estimated variance of the mean of each pixel and channel, from the two half-films.
    pub variance: Image,
    /// Samples of each pixel, row by row.
    pub samples: Vec<u32>,
    /// Threads used.
    pub threads: usize,
    /// Where the time went.
    pub seconds: Seconds,
    /// Paths, rays and dropped samples.
    pub counters: Counters,
    /// The error, estimated from the two half-films; `None` for fewer than four samples, and for a black picture.
    pub error: Option<ErrorEstimate>,
    /// Bytes of each structure, while paths are traced.
    pub memory: Vec<MemoryUse>,
    /// The most bytes at any time: building the hierarchy takes more than keeping it.
    pub memory_peak: usize,
    /// Why rendering ended.
    pub ending: Ending,
}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RenderError {
    /// The picture has no pixels, or more than can be counted.
    Size,
    /// The reference has another size.
    Reference,
    /// The memory allowed does not suffice.
    Memory {
        /// Bytes that are needed.
        needed: usize,
        /// Bytes that were allowed, or that the system gave.
        available: usize,
    },
    /// The threads could not be started.
    Threads(String),
}

impl core::fmt::Display for RenderError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Size => write!(f, "the picture must have between 1 and 2^28 pixels"),
            Self::Reference => write!(f, "the reference has not the size of the picture"),
            Self::Memory { needed, available } => {
                write!(f, "not enough memory: {needed} bytes needed, {available} available")
            }
            Self::Threads(why) => write!(f, "the threads could not be started: {why}"),
        }
    }
}

impl core::error::Error for RenderError {}

impl From<OutOfMemory> for RenderError {
    fn from(error: OutOfMemory) -> Self {
        Self::Memory { needed: error.needed, available: error.available }
    }
}

/// Pixels that a picture may have.
const MOST_PIXELS: u64 = 1 << 28;

/// Renders `scene` until a rule of `settings.stop` holds or `interrupt` is raised. `progress` is called
/// after each round, on the calling thread.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    progress: &mut dyn FnMut(&Progress),
    interrupt: &AtomicBool,
) -> Result<RenderResult, RenderError> {
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    if !(1..=MOST_PIXELS).contains(&pixels) {
        return Err(RenderError::Size);
    }
    let size = [settings.width, settings.height];
    if settings.reference.as_ref().is_some_and(|reference| [reference.width, reference.height] != size) {
        return Err(RenderError::Reference);
    }
    let plan = Census::of(scene).plan();
    plan.features.dispatch(Render { scene, settings, progress, interrupt })
}

/// A render to be compiled for the features of its scene.
struct Render<'a> {
    scene: &'a Scene<'a>,
    settings: &'a Settings,
    progress: &'a mut dyn FnMut(&Progress),
    interrupt: &'a AtomicBool,
}

impl WithFeatures for Render<'_> {
    type Out = Result<RenderResult, RenderError>;

    fn run<F: Features>(self) -> Self::Out {
        let Render { scene, settings, progress, interrupt } = self;
        let (width, height) = (settings.width, settings.height);
        let workers = Workers::new(settings.threads)?;
        let mut memory = Memory::new(scene, settings.memory);

        let build_start = Instant::now();
        // First, for the working memory of its build is free again for the others.
        let mut bvh_lines = Vec::new();
        let bvh = build_bvh(scene, &workers, &mut memory, &mut bvh_lines)?;
        let mut film_lines = memory.take("film", Film::footprint(width, height))?;
        let scratch = PathTracer::<F>::scratch(WAVE);
        let mut scratch_lines =
            (0..workers.count()).map(|_| memory.take("paths", scratch)).collect::<Result<Vec<_>, _>>()?;
        let mut lights_lines = memory.take("lights", Lights::footprint(scene).and(Lights::scratch(scene)))?;
        let lights = Lights::build(scene, &mut Arena::new(bytemuck::cast_slice_mut(&mut lights_lines)))?;
        let build = build_start.elapsed().as_secs_f64();

        let mut film = Film::new(width, height, &mut Arena::new(bytemuck::cast_slice_mut(&mut film_lines)))?;
        let max_depth = settings.max_depth.unwrap_or(UNLIMITED);
        let path_settings = PathSettings { width, height, seed: settings.seed, max_depth };
        let tracer = PathTracer::<F>::new(scene, &bvh, &lights, path_settings, settings.level);

        let mut clock = Clock::start();
        let mut rounds = Rounds::new(settings.stop);
        let mut counters = Counters::default();
        let mut history = Vec::<Round>::new();
        let mut reference = settings.reference.as_deref().map(Reference::new);
        let mut error = None;
        while let Some(samples) = rounds.next(clock.seconds(), error) {
            // The first round is finished whatever happens, so that every pixel has something to show.
            let first = samples.start == 0;
            let heeded = if first { &AtomicBool::new(false) } else { interrupt };
            counters += workers.run(&tracer, samples.clone(), &mut film, &mut scratch_lines, heeded)?;
            if interrupt.load(Ordering::Relaxed) && !first {
                break;
            }
            rounds.completed(samples, clock.seconds());
            error = workers.estimate(&film);
            let seconds = clock.seconds();
            let against = reference.as_mut().map(|r| clock.pause(|| r.compare(&image(&film), seconds)));
            let (spp, rays) = (rounds.spp(), counters.rays + counters.shadow_rays);
            history.push(Round { seconds, spp, rays, error, reference: against });
            progress(&Progress {
                seconds,
                seconds_left: rounds.seconds_left(seconds, error),
                spp,
                rounds: rounds.count(),
                error,
            });
        }
        let interrupted = interrupt.load(Ordering::Relaxed);
        let render = clock.seconds();
        Ok(RenderResult {
            image: image(&film),
            spp: rounds.spp(),
            rounds: rounds.count(),
            history,
            variance: map(&film, |pixel| pixel.variance().to_array()),
            samples: by_rows(&film).map(|pixel| pixel.count()).collect(),
            threads: workers.count(),
            seconds: Seconds { build, render },
            counters,
            error: workers.estimate(&film),
            memory: memory.uses(),
            memory_peak: memory.peak(),
            ending: if interrupted { Ending::Interrupted } else { Ending::Done },
        })
    }
}

/// The hierarchy, built on all cores, then moved out of the working memory of its build into `lines`.
fn build_bvh<'m>(
    scene: &Scene,
    workers: &Workers,
    memory: &mut Memory,
    lines: &'m mut Vec<Line>,
) -> Result<Bvh<'m>, RenderError> {
    let mut working = memory.take("bvh build", Bvh::footprint(scene.mesh.triangles.len()))?;
    let built = workers.build_bvh(&scene.mesh, &mut Arena::new(bytemuck::cast_slice_mut(&mut working)))?;
    *lines = memory.take("bvh", built.used())?;
    let bvh = built.copied(&mut Arena::new(bytemuck::cast_slice_mut(lines)))?;
    memory.give_back("bvh build");
    Ok(bvh)
}

fn image(film: &Film) -> Image {
    map(film, |pixel| pixel.mean().to_array())
}

fn map(film: &Film, value: impl Fn(Pixel) -> [f32; 3]) -> Image {
    Image { width: film.width(), height: film.height(), pixels: by_rows(film).map(value).collect() }
}

fn by_rows(film: &Film) -> impl Iterator<Item = Pixel> {
    (0..film.height()).flat_map(move |y| (0..film.width()).map(move |x| film.pixel(x, y)))
}
