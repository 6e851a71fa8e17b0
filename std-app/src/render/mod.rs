//! Program side of a render: memory, threads, rounds and stop rules around the passes of the core. [`render`]
//! is the entry point.
//!
//! A picture is made in rounds; each round adds the same number of samples to every pixel. The bits of the
//! picture depend neither on the division into rounds nor on the number of threads, nor on an interruption
//! after which the render is resumed from its film file.

mod audit;
mod back_faces;
mod built;
mod deadline;
mod environment_visibility;
mod error;
mod fair_schedule;
mod files;
mod gaps;
mod held_out;
mod hidden_light;
mod history;
mod image;
mod layers;
mod memory;
mod merge;
mod merge_points;
mod method;
mod picture;
mod points;
mod reconstruction;
mod rejected_tiles;
mod run;
mod setup;
mod survey;
mod threads;
mod window;

pub(crate) use built::{Built, BuiltMemory};
pub use error::{FileError, RenderError};
pub use fair_schedule::{FairSchedule, Turn};
pub use files::inspect_cache;
pub use files::is_bake;
pub use halflight_core::audit::{AuditWork, Audited, NoiseAndBlur, Region};
pub use halflight_core::cache::radiance::{Basis, LobeSettings};
pub use halflight_core::estimate::{BiasEstimate, Deviation, ErrorEstimate};
pub use halflight_core::method::Shard;
pub use halflight_core::method::bidirectional::BidirectionalSettings;
pub use halflight_core::method::counts::Choice;
pub use halflight_core::method::instant_radiosity::VirtualLightSettings;
pub use halflight_core::method::metropolis::{MetropolisSettings, PrimarySpace};
pub use halflight_core::method::{CacheOptions as CacheSettings, MethodKind as Method, PhotonSettings};
pub use halflight_core::renderer::{Reconstruct, Stop, StopRule};
pub use history::{Against, Round};
pub use layers::{Layer, LayerSettings, Layers};
pub use memory::MemoryUse;
pub(crate) use memory::scene_bytes;
pub use merge::{Merged, merge, merge_with};
pub(crate) use merge_points::merge_points;
pub use method::{MapView, PhotonView};
pub(crate) use points::with_points;
pub use points::{BakeProgress, BakeSettings, Baked};
pub use rejected_tiles::RejectedTile;
pub(crate) use run::Request;
pub use run::render;
pub use survey::{Check, Mark, Survey, SurveyPixel};
pub(crate) use threads::Pool;

use crate::save::Image;
use halflight_core::Level;
use halflight_core::film::Film;
use halflight_core::findings::Findings;
use halflight_core::reconstruction::FilmReconstruction;
use halflight_core::transport::Counters;
use std::path::PathBuf;
use std::sync::Arc;

/// Settings of a render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Method; `None` chooses one that fits the scene.
    pub method: Option<Method>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 1 is directly visible light. `None`: no limit.
    pub max_depth: Option<u32>,
    /// True if neighbouring pixels share paths; `None`: as the pilot on a few tiles decides.
    pub reuse: Option<bool>,
    /// True if paths are merged with caustic photons if a prepass finds that they pay.
    pub caustics: bool,
    /// Settings of irradiance caches.
    pub cache: CacheSettings,
    /// Lobes that the records of a radiance cache serve.
    pub lobes: LobeSettings,
    /// Settings of photons.
    pub photons: PhotonSettings,
    /// Sample counts of the techniques of bidirectional methods.
    pub bidirectional: BidirectionalSettings,
    /// Settings of virtual lights.
    pub virtual_lights: VirtualLightSettings,
    /// Settings of Metropolis light transport.
    pub metropolis: MetropolisSettings,
    /// True if photon maps are rendered at the end for a report, outside the measured time.
    pub photon_view: bool,
    /// True if the environment is sampled by visibility tables, which a prepass learns; `None`: as the
    /// prepass decides.
    pub environment_visibility: Option<bool>,
    /// Number of threads; `None`: all of the machine. A render on a thread of a pool with at most so many
    /// threads runs on that pool.
    pub threads: Option<usize>,
    /// Memory limit in bytes for the scene and all structures; `None`: no limit.
    pub memory: Option<usize>,
    /// Bytes that `progress` takes for pictures which it shows. They count in `memory`.
    pub shown_bytes: usize,
    /// Instruction set of the kernels.
    pub level: Level,
    /// Stop rules.
    pub stop: Stop,
    /// Reference of the same size, with which each round is compared, outside the measured time.
    pub reference: Option<Arc<Image>>,
    /// Share of the work that goes into the audit, from 0 (no audit) to 1. `None`: 0.05 if the method is
    /// biased.
    pub audit: Option<f64>,
    /// Reconstruction of the picture from the halves of its film. The film file keeps the samples.
    pub reconstruct: Reconstruct,
    /// Layers beside the picture; `None`: none.
    pub layers: Option<Arc<LayerSettings>>,
    /// Part of the picture to render.
    pub shard: Shard,
    /// Film file to write during the render.
    pub checkpoint: Option<Checkpoint>,
    /// Film file to resume: a checkpoint of the same picture.
    pub resume: Option<PathBuf>,
    /// Irradiance cache file to begin with: of the same scene and settings, for any view.
    pub load_cache: Option<PathBuf>,
    /// Irradiance cache file to write after filling.
    pub save_cache: Option<PathBuf>,
    /// Approximate number of held-out points at which irradiance caches are compared with exact values after
    /// the render; `None`: no survey.
    pub survey: Option<u32>,
    /// True for a deliberately biased method.
    #[cfg(test)]
    pub(crate) is_wrong: bool,
}

/// A film file written at intervals and at the end, outside the measured time.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// The file.
    pub path: PathBuf,
    /// Seconds between writes.
    pub every: f64,
}

impl Checkpoint {
    /// Default of [`Checkpoint::every`], seconds.
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
            lobes: LobeSettings::default(),
            photons: PhotonSettings::default(),
            bidirectional: BidirectionalSettings::default(),
            virtual_lights: VirtualLightSettings::default(),
            metropolis: MetropolisSettings::default(),
            photon_view: false,
            environment_visibility: None,
            threads: None,
            memory: None,
            shown_bytes: 0,
            level: Level::detect(),
            stop: Stop::default(),
            reference: None,
            audit: None,
            reconstruct: Reconstruct::Auto,
            layers: None,
            shard: Shard::WHOLE,
            checkpoint: None,
            resume: None,
            load_cache: None,
            save_cache: None,
            survey: None,
            #[cfg(test)]
            is_wrong: false,
        }
    }
}

/// State of a render, after each round and while its audit continues alone.
#[derive(Clone, Debug)]
pub struct Progress<'a> {
    /// Seconds of rendering so far.
    pub seconds: f64,
    /// Estimated seconds left; `None` if unknown.
    pub seconds_left: Option<f64>,
    /// Samples per pixel so far.
    pub spp: u32,
    /// Rounds so far.
    pub rounds: u32,
    /// The error so far.
    pub error: Option<ErrorEstimate>,
    /// A failed write of a film or a cache, reported once per file: the render continues and retries.
    pub unsaved: Option<FileError>,
    /// The film so far, and its last reconstruction.
    pub(crate) film: Option<(&'a Film<'a>, Option<&'a FilmReconstruction<'a>>)>,
}

impl Progress<'_> {
    /// The picture so far, reconstructed at the last estimate of its error if it is reconstructed. It is made
    /// by this call: pixels without samples are black.
    pub fn picture(&self) -> Option<Image> {
        self.film.map(|(film, reconstruction)| image::image(film, reconstruction))
    }
}

/// Why rendering ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// A stop rule held.
    Done,
    /// The interrupt flag was raised: the picture is valid, with fewer samples.
    Interrupted,
    /// The requested error is out of reach: bias alone, which samples do not reduce, exceeds it.
    Biased,
    /// The requested error is out of reach: noise shared by all samples, such as that of records, exceeds it.
    NoiseFloor,
}

/// Times in seconds of wall-clock time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Building the BVH and the light structures.
    pub build: f64,
    /// Tracing paths, including earlier runs of a resumed film, without comparisons, checkpoints and
    /// `progress`.
    pub render: f64,
    /// Noise estimation, part of `render`; without earlier runs.
    pub estimate: f64,
}

/// A picture with its statistics.
#[derive(Clone, Debug)]
pub struct RenderResult {
    /// The method that made it.
    pub method: Method,
    /// The picture.
    pub image: Image,
    /// Samples per pixel; those of the least sampled pixel if the last round was cut.
    pub spp: u32,
    /// Rounds begun, earlier runs included.
    pub rounds: u32,
    /// State after each round.
    pub history: Vec<Round>,
    /// Estimated variance of each pixel and channel of the picture, from the two half-films.
    pub variance: Image,
    /// Samples of each pixel, row by row.
    pub samples: Vec<u32>,
    /// Layers, if the settings ask for some.
    pub layers: Layers,
    /// Threads used.
    pub threads: usize,
    /// Times of the phases.
    pub seconds: Seconds,
    /// Paths, rays and rejected samples.
    pub counters: Counters,
    /// Decisions and numbers of the parts of the method.
    pub findings: Findings,
    /// Survey of the irradiance cache, if requested, if the method has one and memory suffices.
    pub survey: Option<Survey>,
    /// Views of the last photon maps, if requested.
    pub photon_view: Option<PhotonView>,
    /// Tiles with rejected samples, most first.
    pub rejected_tiles: Vec<RejectedTile>,
    /// Black pixels, whose samples were all rejected.
    pub empty_pixels: u64,
    /// Pixels without samples at an early end, filled from their surroundings.
    pub filled_pixels: u64,
    /// Error from the two half-films, plus bias by the audit or photon blur; `None` with fewer than four
    /// samples, and for a black picture unless a pilot has estimated the light that it lacks: an error of 0
    /// is one of a view without light.
    pub error: Option<ErrorEstimate>,
    /// Noise and photon blur, if there are photons and no audit.
    pub noise_and_blur: Option<NoiseAndBlur>,
    /// Result of the audit.
    pub audit: Option<Audited>,
    /// Bytes of each structure while paths are traced.
    pub memory: Vec<MemoryUse>,
    /// Peak of memory in bytes; building the BVH takes more than keeping it.
    pub memory_peak: usize,
    /// Files whose last write failed; they hold the last complete version.
    pub unsaved: Vec<FileError>,
    /// Why rendering ended.
    pub ending: Ending,
    /// The stop rule that held, if one did.
    pub stop_rule: Option<StopRule>,
}

/// Most pixels of a picture.
const MOST_PIXELS: u64 = 1 << 28;
