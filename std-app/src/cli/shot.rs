//! The flags of a picture that `render` and `race` share, and the settings that follow from them.

use super::failure::Failure;
use super::method::{self, Choice};
use super::read_picture;
use super::values;
use super::view::ViewFlags;
use clap::{Args, ValueEnum};
use halflight::drive::{CacheSettings, PhotonSettings, RenderError, Settings, Stop};
use halflight::load::{LoadOptions, LoadedScene};
use halflight::memory::Budget;
use halflight::report::words::readable_bytes;
use halflight::save::Image;
use halflight_core::cache::irradiance::Metric;
use halflight_core::photon;
use halflight_simd::{Level, Tier};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The picture, whatever the method.
#[derive(Args)]
pub(super) struct Shot {
    /// Width and height in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size, display_order = 3)]
    size: Option<[u32; 2]>,
    /// Reference picture of the same size: errors are measured against it, with --json those of each round. The
    /// comparison does not count as time of rendering
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    pub(super) view: ViewFlags,
    /// Threads [default: one for each processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096), display_order = 8)]
    threads: Option<u32>,
    /// Memory limit for files, scene and all structures, as in 512M or 2G [default: four fifths of the machine's]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, display_order = 9)]
    memory: Option<usize>,
}

/// How a method does its work: what may differ between the methods of a race.
#[derive(Args, Clone, Debug)]
pub(super) struct Options {
    /// Photons for caustics with path and irradiance-cache; auto: if a pilot pass finds caustics [default: auto]
    #[arg(long, help_heading = "Light transport")]
    caustics: Option<Caustics>,
    /// Path reuse among neighbouring pixels: less noise in indirect light, but the noise that remains is correlated
    /// [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light transport")]
    reuse: Option<When>,
    /// Sample the part of the environment that is visible from each region: less noise in rooms with windows; auto:
    /// if a pilot pass finds most of it occluded [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light transport")]
    windows: Option<When>,
    /// Longest path in segments: 1 is emission seen directly, 2 adds direct light [default: no limit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..),
        help_heading = "Light transport")]
    max_depth: Option<u32>,
    /// Share of the work for an audit of the bias, which path traces some pixels as well [default: 5% if the method
    /// is biased, else off]
    #[arg(long, value_name = "SHARE|off", value_parser = values::audit, help_heading = "Light transport")]
    audit: Option<f64>,
    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N", display_order = 7)]
    seed: Option<u32>,
    /// Highest instruction set to use: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "Instruction set")]
    simd: Option<Tier>,
    /// The same bits on every processor, by the instruction set that all have
    #[arg(long, help_heading = "Instruction set")]
    precise: bool,
    /// Error metric that sets the radii of records [default: halflight]
    #[arg(long, value_name = "METRIC", value_parser = values::metric, help_heading = "Irradiance cache")]
    cache_metric: Option<Metric>,
    /// Interpolation error; smaller means more records [default: 1e-4; min-distance and split spheres: 0.3]
    #[arg(long, value_name = "ERROR", value_parser = values::positive, help_heading = "Irradiance cache")]
    cache_error: Option<f64>,
    /// Gather rays per record: 64, 256, 576, 1024, 2304 or 4096 [default: 256]
    #[arg(long, value_name = "N", value_parser = values::gather_rays, help_heading = "Irradiance cache")]
    cache_rays: Option<u32>,
    /// Weight of a photon by its distance [default: epanechnikov]
    #[arg(long, value_name = "KERNEL", help_heading = "Photons")]
    photon_kernel: Option<Kernel>,
    /// Light paths per global map, or per sample with sppm [default: pixels / 2; sppm: pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28),
        help_heading = "Photons")]
    global_photons: Option<u32>,
    /// Light paths per caustic map [default: pixels / 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28),
        help_heading = "Photons")]
    caustic_photons: Option<u32>,
}

/// Weight of a photon by its distance.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Kernel {
    /// Constant
    Constant,
    /// Linear
    Cone,
    /// Quadratic
    Epanechnikov,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Caustics {
    /// If a pilot pass finds caustics
    Auto,
    /// Never
    Off,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum When {
    /// If it pays
    Auto,
    /// Always
    On,
    /// Never
    Off,
}

impl When {
    /// `None` where the renderer is to tell.
    pub(super) fn choice(asked: Option<Self>) -> Option<bool> {
        match asked? {
            When::Auto => None,
            When::On => Some(true),
            When::Off => Some(false),
        }
    }
}

impl Options {
    /// These, and those of `base` where these say nothing.
    pub(super) fn over(&self, base: &Options) -> Options {
        Options {
            caustics: self.caustics.or(base.caustics),
            reuse: self.reuse.or(base.reuse),
            cache_metric: self.cache_metric.or(base.cache_metric),
            cache_error: self.cache_error.or(base.cache_error),
            cache_rays: self.cache_rays.or(base.cache_rays),
            photon_kernel: self.photon_kernel.or(base.photon_kernel),
            global_photons: self.global_photons.or(base.global_photons),
            caustic_photons: self.caustic_photons.or(base.caustic_photons),
            windows: self.windows.or(base.windows),
            max_depth: self.max_depth.or(base.max_depth),
            audit: self.audit.or(base.audit),
            seed: self.seed.or(base.seed),
            simd: self.simd.or(base.simd),
            precise: self.precise || base.precise,
        }
    }

    fn cache(&self) -> CacheSettings {
        let defaults = CacheSettings::default();
        CacheSettings {
            metric: self.cache_metric.unwrap_or(defaults.metric),
            error: self.cache_error.map(|error| error as f32),
            strata: self.cache_rays.map(u32::isqrt),
        }
    }

    fn photons(&self) -> PhotonSettings {
        let kernel = match self.photon_kernel {
            None => photon::Kernel::default(),
            Some(Kernel::Constant) => photon::Kernel::Constant,
            Some(Kernel::Cone) => photon::Kernel::Cone,
            Some(Kernel::Epanechnikov) => photon::Kernel::Epanechnikov,
        };
        PhotonSettings { kernel, global: self.global_photons, caustic: self.caustic_photons }
    }

    fn level(&self) -> Level {
        let level = if self.precise { Level::BASELINE } else { Level::detect() };
        self.simd.map_or(level, |tier| level.capped(tier))
    }
}

impl Shot {
    /// The file of the reference picture.
    pub(super) fn reference_file(&self) -> Option<&Path> {
        self.reference.as_deref()
    }

    /// The reference picture. To be read before the scene: a wrong name should not cost a minute.
    pub(super) fn reference(&self) -> Result<Option<Arc<Image>>, Failure> {
        let mut budget = Budget::new(self.memory);
        let read = |path: &PathBuf| read_picture(path, &mut budget);
        Ok(self.reference.as_ref().map(read).transpose()?.map(Arc::new))
    }

    /// How to load a scene beside `reference`.
    pub(super) fn load_options(&self, reference: Option<&Image>) -> LoadOptions {
        let taken = reference.map_or(0, |image| size_of_val(&image.pixels[..]));
        let memory = Budget::new(self.memory).limit().saturating_sub(taken);
        LoadOptions { memory: Some(memory), ..LoadOptions::default() }
    }

    /// The settings of `method` with `options`, completed by those of the scene file.
    pub(super) fn settings(
        &self,
        loaded: &LoadedScene,
        method: Choice,
        options: &Options,
        stop: Stop,
        reference: Option<Arc<Image>>,
    ) -> Result<Settings, Failure> {
        let file = &loaded.settings;
        let defaults = Settings::default();
        let [width, height] = self.size.or(file.size).unwrap_or([defaults.width, defaults.height]);
        self.check_reference(reference.as_deref(), [width, height])?;
        Ok(Settings {
            method: method.0.or(method::of_file(file)),
            width,
            height,
            seed: options.seed.or(file.seed).unwrap_or(defaults.seed),
            max_depth: options.max_depth.or(file.max_depth),
            reuse: When::choice(options.reuse),
            caustics: !matches!(options.caustics, Some(Caustics::Off)),
            windows: When::choice(options.windows),
            cache: options.cache(),
            photons: options.photons(),
            audit: options.audit,
            threads: self.threads.map(|threads| threads as usize),
            memory: self.memory,
            level: options.level(),
            stop,
            reference,
            ..defaults
        })
    }

    /// Before the render, not after it.
    fn check_reference(&self, reference: Option<&Image>, size: [u32; 2]) -> Result<(), Failure> {
        let (Some(file), Some(reference)) = (&self.reference, reference) else { return Ok(()) };
        let Image { width, height, .. } = *reference;
        if [width, height] == size {
            return Ok(());
        }
        let asked = format!("{}x{}", size[0], size[1]);
        Err(Failure::new(format!("{} has {width}x{height} pixels, the render {asked}", file.display()))
            .advice(format!("render with --size {width}x{height}; nothing is resampled")))
    }
}

/// The name of the file of a scene, without its folder.
pub(super) fn name(scene: &Path) -> String {
    scene.file_name().unwrap_or(scene.as_os_str()).to_string_lossy().into_owned()
}

/// Why there is no picture of `scene`, and what to do about it.
pub(super) fn explain(scene: &Path, error: &RenderError) -> Failure {
    let failure = Failure::new(format!("{}: {error}", scene.display()));
    match error {
        RenderError::Memory { needed, .. } => failure.advice(format!(
            "{} are needed: raise --memory, or lower --size or --threads",
            readable_bytes(*needed)
        )),
        _ => failure,
    }
}
