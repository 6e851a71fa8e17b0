//! The flags of a picture that `render` and `race` share, and the settings that follow from them.

use super::failure::Failure;
use super::method::{self, Choice};
use super::read_picture;
use super::values;
use super::view::ViewFlags;
use clap::{Args, ValueEnum};
use halflight::drive::{CacheSettings, Gather, PhotonSettings, RenderError, Settings, Stop};
use halflight::load::{LoadOptions, LoadedScene};
use halflight::memory::Budget;
use halflight::report::words::readable_bytes;
use halflight::save::Image;
use halflight_core::cache::irradiance::Metric;
use halflight_core::photon::Falloff;
use halflight_simd::{Level, Tier};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The picture, whatever the method.
#[derive(Args)]
pub(super) struct Shot {
    /// Width and height in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<[u32; 2]>,
    /// A reference picture of the same size; the error against it is reported, that of each round with
    /// --json. Comparing does not count as time of rendering
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    pub(super) view: ViewFlags,
    /// Threads [default: all that the machine runs at once]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096),
        help_heading = "How to run")]
    threads: Option<u32>,
    /// Most memory for all that is read, the scene and all structures, as in 512M or 2G [default: four fifths of the
    /// machine's]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, help_heading = "How to run")]
    memory: Option<usize>,
}

/// How a method does its work: what may differ between the methods of a race.
#[derive(Args, Clone, Debug)]
pub(super) struct Options {
    /// Whether `path` and `irradiance-cache` are joined with photons of caustics where a first look finds any [default: auto]
    #[arg(long)]
    caustics: Option<Caustics>,
    /// Whether neighbouring pixels share what their paths find: less noise for the same time where much of the
    /// light is indirect; the noise that is left is alike in pixels near each other [default: auto]
    #[arg(long, value_name = "WHEN")]
    reuse: Option<When>,
    /// Whether a first look finds which part of the environment each place sees, and light is then asked for there:
    /// less noise in rooms lit through windows [default: auto]
    #[arg(long, value_name = "WHEN")]
    windows: Option<When>,
    /// Longest path in segments: 1 is light seen directly, 2 adds direct light [default: no limit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_depth: Option<u32>,
    /// Share of the work for an audit of the bias: a few pixels are path traced as well [default: 5% where the method
    /// is biased, otherwise off]
    #[arg(long, value_name = "SHARE|off", value_parser = values::audit)]
    audit: Option<f64>,
    /// Another seed, another noise [default: 0]
    #[arg(long, value_name = "N", help_heading = "How to run")]
    seed: Option<u32>,
    /// Highest instruction set to use: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "How to run")]
    simd: Option<Tier>,
    /// The same bits on every processor: the instruction set that all have
    #[arg(long, help_heading = "How to run")]
    precise: bool,
    /// By which rule the records of an irradiance cache know how far they reach [default: halflight]
    #[arg(long, value_name = "METRIC", value_parser = values::metric, help_heading = "Irradiance cache")]
    cache_metric: Option<Metric>,
    /// Error allowed between records. Metrics with a Hessian: the error within the reach of a record over its
    /// irradiance, times the area in squares of the scene's radius, or of the picture's side there if that is
    /// smaller [default: 1e-4]; the others: the radius over the distance that they take [default: 0.3]
    #[arg(long, value_name = "ERROR", value_parser = values::positive, help_heading = "Irradiance cache")]
    cache_error: Option<f64>,
    /// Rays that are gathered for a record: 64, 256, 576, 1024, 2304 or 4096 [default: as many as the
    /// picture is better for; 1024 where caches are kept in a file]
    #[arg(long, value_name = "N", value_parser = values::gather_rays, help_heading = "Irradiance cache")]
    cache_rays: Option<u32>,
    /// Where the rays of a record find light: on paths, or in a map of photons [default: paths]
    #[arg(long, help_heading = "Irradiance cache")]
    gather: Option<GatherBy>,
    /// How the weight of a photon falls with its distance from where light is asked for [default: epanechnikov]
    #[arg(long, value_name = "KERNEL", help_heading = "Photons")]
    photon_kernel: Option<Kernel>,
    /// Light paths of a global map of photons; those of a sample where the method is sppm [default: half as many as
    /// pixels, 262144 at least for records; as many]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28),
        help_heading = "Photons")]
    global_photons: Option<u32>,
    /// Light paths of a map of caustics [default: half as many as pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 28),
        help_heading = "Photons")]
    caustic_photons: Option<u32>,
}

/// Where the rays of a record find light.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum GatherBy {
    /// On paths that go on from their ends
    Paths,
    /// In a map of photons
    Photons,
}

/// How the weight of a photon falls.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Kernel {
    /// The same everywhere
    Constant,
    /// Linearly
    Cone,
    /// With the square of the distance
    Epanechnikov,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Caustics {
    /// Where they are found
    Auto,
    /// Never
    Off,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum When {
    /// Where it pays
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
            gather: self.gather.or(base.gather),
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
            gather: match self.gather {
                None => defaults.gather,
                Some(GatherBy::Paths) => Gather::Paths,
                Some(GatherBy::Photons) => Gather::Photons,
            },
        }
    }

    fn photons(&self) -> PhotonSettings {
        let falloff = match self.photon_kernel {
            None => Falloff::default(),
            Some(Kernel::Constant) => Falloff::Constant,
            Some(Kernel::Cone) => Falloff::Cone,
            Some(Kernel::Epanechnikov) => Falloff::Epanechnikov,
        };
        PhotonSettings { falloff, global: self.global_photons, caustic: self.caustic_photons }
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
