//! Runs the core's passes: memory, threads, rounds, stop rules. [`render`] is all that a program needs.
//!
//! A picture is made in rounds; a round adds the same number of samples to every pixel. How the samples are
//! cut into rounds, and how many threads there are, leaves the bits of the picture as they are; so does an end in the
//! middle, where the film is kept in a file and the render resumed from it.

mod audit;
mod blurred;
mod cache_file;
mod crew;
mod deadline;
mod error;
mod error_report;
mod film_file;
mod fingerprint;
mod gaps;
mod held_out;
mod history;
mod ledger;
mod memory;
mod merge;
mod method;
mod picture;
mod regions;
mod rewritten_file;
mod rounds;
mod run;
mod sealed;
mod study;
mod survey;
mod threads;
mod turns;
mod windows;
mod workers;

pub use audit::{Audited, Region};
pub use blurred::Blurred;
pub use cache_file::inspect as inspect_cache;
pub use error::{FileError, RenderError};
pub use halflight_core::estimate::{BiasEstimate, Deviation, ErrorEstimate};
pub use halflight_core::method::bidirectional::BidirectionalSettings;
pub use halflight_core::method::instant_radiosity::VirtualLightSettings;
pub use halflight_core::method::metropolis::{MetropolisSettings, PrimarySpace};
pub use halflight_core::method::{Shard, path::Reuse};
pub use history::{Against, Round};
pub use ledger::Place;
pub use memory::MemoryUse;
pub use merge::{Merged, merge};
pub use method::{
    CacheSettings, CacheUse, CausticUse, ChainUse, MapUse, MapView, Method, PhotonSettings, PhotonUse,
    PhotonView, VirtualLightUse,
};
pub use rounds::{Stop, StopRule};
pub use study::{IrradianceStudy, MetricError, study_irradiance};
pub use survey::{Check, Look, Mark, Survey};
pub use turns::{Turn, Turns};
pub use windows::WindowUse;

use crate::save::Image;
use core::sync::atomic::AtomicBool;
use halflight_core::Level;
use halflight_core::census::Census;
use halflight_core::film::Tile;
use halflight_core::scene::Scene;
use halflight_core::transport::Counters;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How to render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// How to make the picture; `None`: what fits the scene.
    pub method: Option<Method>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Another seed, another picture of the same thing.
    pub seed: u32,
    /// The largest number of segments of a path; 1 is light that is seen directly. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Whether neighbouring pixels share what their paths find; `None`: where a look at a few tiles says that it
    /// pays.
    pub reuse: Option<bool>,
    /// Whether paths are joined with photons of caustics, where a first look finds any.
    pub caustics: bool,
    /// How an irradiance cache is filled, where the method has one.
    pub cache: CacheSettings,
    /// How photons are used, where the method has any.
    pub photons: PhotonSettings,
    /// Counts of the techniques of bidirectional methods.
    pub bidirectional: BidirectionalSettings,
    /// How virtual lights are used, where the method has any.
    pub virtual_lights: VirtualLightSettings,
    /// Choices of Metropolis light transport.
    pub metropolis: MetropolisSettings,
    /// Whether maps of photons are looked at in the end, for a report. The time that this takes does not count.
    pub photon_view: bool,
    /// Whether the environment is sampled through windows that a first look finds; `None` where it is to tell.
    pub windows: Option<bool>,
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
    /// The share of the work that goes into an audit of the picture, between 0, no audit, and 1. `None`: a twentieth
    /// where the method is biased. Not with shards.
    pub audit: Option<f64>,
    /// Which part of the picture to render.
    pub shard: Shard,
    /// Where to keep the film while it grows.
    pub checkpoint: Option<Checkpoint>,
    /// A film to go on with: a checkpoint of the same picture.
    pub resume: Option<PathBuf>,
    /// A file of irradiance caches to begin with: of the same scene and settings, of any view.
    pub load_cache: Option<PathBuf>,
    /// Where to keep the irradiance caches when they are filled.
    pub save_cache: Option<PathBuf>,
    /// About how many points the irradiance caches are held against exact values at, after the render; `None`: no
    /// survey.
    pub survey: Option<u32>,
}

/// A film file that is written every so often, and at the end. The time that this takes does not count.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// Seconds from one to the next.
    pub every: f64,
}

impl Checkpoint {
    /// Seconds between checkpoints where nothing else is asked for.
    pub const EVERY: f64 = 60.0;
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: None,
            width: 512,
            height: 512,
            seed: 0,
            max_depth: None,
            reuse: None,
            caustics: true,
            cache: CacheSettings::default(),
            photons: PhotonSettings::default(),
            bidirectional: BidirectionalSettings::default(),
            virtual_lights: VirtualLightSettings::default(),
            metropolis: MetropolisSettings::default(),
            photon_view: false,
            windows: None,
            threads: None,
            memory: None,
            level: Level::detect(),
            stop: Stop::default(),
            reference: None,
            audit: None,
            shard: Shard::WHOLE,
            checkpoint: None,
            resume: None,
            load_cache: None,
            save_cache: None,
            survey: None,
        }
    }
}

/// What is known while a picture is made, after each round, and while its audit goes on alone.
#[derive(Clone, Debug)]
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
    /// A failed write of a film or a cache, once for each file: the render goes on, and tries again.
    pub unsaved: Option<FileError>,
}

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// A stop rule held.
    Done,
    /// The interrupt flag was raised: the picture is valid, with fewer samples.
    Interrupted,
    /// The error that was asked for is out of reach: the bias alone is larger, and more samples leave it as it is.
    Biased,
    /// The error that was asked for is out of reach: noise that all samples share, as that of records, stays above it.
    NoiseFloor,
}

/// Seconds of wall-clock time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Building the hierarchy and the light structures.
    pub build: f64,
    /// Tracing paths, before a resumption too; without comparisons with a reference, checkpoints and calls of
    /// `progress`.
    pub render: f64,
    /// Tracing photons and building their maps, a part of that; not before a resumption.
    pub photons: f64,
    /// Estimating the noise, a part of that; not before a resumption.
    pub estimate: f64,
}

/// A picture and all that is known of it.
#[derive(Clone, Debug)]
pub struct RenderResult {
    /// How it was made.
    pub method: Method,
    /// The picture.
    pub image: Image,
    /// Samples of each pixel; of the least sampled one where the last round was cut.
    pub spp: u32,
    /// Rounds begun, those before a resumption included.
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
    /// Whether pixels shared what their paths found, and why.
    pub reuse: Reuse,
    /// Whether paths were joined with photons of caustics, and why.
    pub caustics: CausticUse,
    /// What became of the irradiance cache, where the method has one.
    pub cache: Option<CacheUse>,
    /// What the irradiance cache looks like and how wrong it is, where that was asked for, the method has one and there
    /// is memory for it.
    pub survey: Option<Survey>,
    /// Use of Markov chains, where the method has any.
    pub chains: Option<ChainUse>,
    /// What became of photons, where the method has any.
    pub photons: Option<PhotonUse>,
    /// The use of virtual lights, where the method has any.
    pub virtual_lights: Option<VirtualLightUse>,
    /// The last maps of photons as the camera sees them, where that was asked for.
    pub photon_view: Option<PhotonView>,
    /// Whether the sky was sampled through windows.
    pub windows: WindowUse,
    /// Where samples were dropped, the worst first.
    pub places: Vec<Place>,
    /// Pixels that are black because all of their samples were dropped.
    pub empty_pixels: u64,
    /// Pixels that had no sample yet when the render was ended, and show what is around them.
    pub filled_pixels: u64,
    /// The error, estimated from the two half-films, and from the audit where there is one or from what photons blur; `None` for
    /// fewer than four samples, and for a black picture.
    pub error: Option<ErrorEstimate>,
    /// Noise and what photons blur, where there are photons and no audit.
    pub blurred: Option<Blurred>,
    /// What the audit has found.
    pub audit: Option<Audited>,
    /// Bytes of each structure, while paths are traced.
    pub memory: Vec<MemoryUse>,
    /// The most bytes at any time: building the hierarchy takes more than keeping it.
    pub memory_peak: usize,
    /// Films and caches whose last write failed. The files hold the last whole version.
    pub unsaved: Vec<FileError>,
    /// Why rendering ended.
    pub ending: Ending,
    /// The stop rule that held, if one did.
    pub stop_rule: Option<StopRule>,
}

/// Whether a film or a cache will find its way to `path`: the folder is there and takes files.
///
/// # Errors
/// Names the file and why not.
pub fn check_writable(path: &Path) -> Result<(), FileError> {
    sealed::check_writable(path)
}

/// Pixels that a picture may have.
const MOST_PIXELS: u64 = 1 << 28;

/// Renders `scene` until a rule of `settings.stop` holds or `interrupt` is raised. `progress` is called
/// after each round, on the calling thread; the time that it takes does not count.
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
    let Shard { index, count } = settings.shard;
    let many = count as usize > Tile::count(settings.width, settings.height);
    if index >= count || many {
        return Err(RenderError::Shard);
    }
    let plan = Census::of(scene).plan();
    let keeps_cache = settings.load_cache.is_some() || settings.save_cache.is_some();
    let method = settings.method.or(Method::named(plan.method)).unwrap_or(Method::Path);
    if keeps_cache && method != Method::IrradianceCache {
        return Err(RenderError::NoCache);
    }
    plan.features.dispatch(run::Render { scene, settings, method, progress, interrupt })
}
