//! Flags of a picture and of its method that `render` and `race` share, and the settings that follow
//! from them.

use super::camera_args::CameraArgs;
use super::failure::Failure;
use super::{print_note, read_picture, values};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use halflight::load::{LoadOptions, LoadedScene};
use halflight::memory::Budget;
use halflight::render::{
    BidirectionalSettings, CacheSettings, LobeSettings, Method, MetropolisSettings, PhotonSettings,
    PrimarySpace, Reconstruct, RenderError, Settings, Stop, VirtualLightSettings,
};
use halflight::save::Image;
use halflight::values::Depth;
use halflight_core::cache::irradiance::Metric;
use halflight_core::cache::radiance::Basis;
use halflight_core::photon;
use halflight_core::scene::Scene;
use halflight_simd::{Level, Tier};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Flags of a picture by any method.
#[derive(Args)]
pub(super) struct PictureArgs {
    /// Width and height in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size, display_order = 3)]
    size: Option<[u32; 2]>,
    /// Reference picture of the same size, with which each round is compared; not counted as rendering time
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    pub(super) camera: CameraArgs,
    /// Number of threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096), display_order = 8)]
    threads: Option<u32>,
    /// Memory limit for files, scene and all structures, as in 512M or 2G [default: four fifths of the
    /// machine's]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, display_order = 9)]
    memory: Option<usize>,
}

impl PictureArgs {
    /// Number of threads; `None`: all of the machine.
    pub(super) fn threads(&self) -> Option<usize> {
        self.threads.map(|threads| threads as usize)
    }

    /// File of the reference picture.
    pub(super) fn reference_file(&self) -> Option<&Path> {
        self.reference.as_deref()
    }

    /// Reference picture. To be read before the scene, so that a wrong name fails at once.
    pub(super) fn reference(&self) -> Result<Option<Arc<Image>>, Failure> {
        let mut budget = Budget::new(self.memory);
        let read = |path: &PathBuf| read_picture(path, &mut budget);
        Ok(self.reference.as_ref().map(read).transpose()?.map(Arc::new))
    }

    /// Options for a scene that shares the memory with `reference`.
    pub(super) fn load_options(&self, reference: Option<&Image>) -> LoadOptions {
        let taken = reference.map_or(0, |image| size_of_val(&image.pixels[..]));
        let memory = Budget::new(self.memory).limit().saturating_sub(taken);
        LoadOptions { memory: Some(memory), ..LoadOptions::default() }
    }

    /// Settings of a method, completed by those of the scene file.
    pub(super) fn settings(
        &self,
        loaded: &LoadedScene,
        method: MethodArg,
        args: &MethodArgs,
        stop: Stop,
        reference: Option<Arc<Image>>,
    ) -> Result<Settings, Failure> {
        let (file, defaults) = (&loaded.settings, Settings::default());
        let [width, height] =
            self.size.or(file.size.map(<[u32; 2]>::from)).unwrap_or([defaults.width, defaults.height]);
        self.check_reference(reference.as_deref(), [width, height])?;
        args.check_degree()?;
        Ok(args.apply(Settings {
            method: method.0.or(file.method.and_then(|method| method.0)),
            width,
            height,
            seed: file.seed.unwrap_or(defaults.seed),
            max_depth: file.max_depth.map(u32::from),
            threads: self.threads(),
            memory: self.memory,
            stop,
            reference,
            ..defaults
        }))
    }

    fn check_reference(&self, reference: Option<&Image>, size: [u32; 2]) -> Result<(), Failure> {
        let (Some(file), Some(reference)) = (&self.reference, reference) else { return Ok(()) };
        let Image { width, height, .. } = *reference;
        if [width, height] == size {
            return Ok(());
        }
        let render = format!("{}x{}", size[0], size[1]);
        Err(Failure::new(format!("{} has {width}x{height} pixels, the render {render}", file.display()))
            .advice(format!("render with --size {width}x{height}; nothing is resampled")))
    }
}

/// Value of `--method`: a method, or `None` for `auto`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MethodArg(pub(super) Option<Method>);

const METHODS: [MethodArg; 1 + Method::ALL.len()] = {
    let mut methods = [MethodArg(None); 1 + Method::ALL.len()];
    let mut i = 0;
    while i < Method::ALL.len() {
        methods[i + 1] = MethodArg(Some(Method::ALL[i]));
        i += 1;
    }
    methods
};

impl MethodArg {
    fn name(self) -> &'static str {
        self.0.map_or("auto", Method::name)
    }

    /// Names of all methods, separated by commas.
    pub(super) fn names() -> String {
        METHODS.map(MethodArg::name).join(", ")
    }
}

impl ValueEnum for MethodArg {
    fn value_variants<'a>() -> &'a [Self] {
        &METHODS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let about = self
            .0
            .map_or("path, a cache, bdpt or sppm: the one with the least predicted error", Method::about);
        Some(PossibleValue::new(self.name()).help(about))
    }
}

/// Settings that may differ between the methods of a race.
#[derive(Args, Clone, Debug)]
pub(super) struct MethodArgs {
    /// Caustic photons with path and both caches [default: auto]
    #[arg(long, help_heading = "Light transport")]
    caustics: Option<Caustics>,
    /// Path reuse among neighbouring pixels: less noise in indirect light, but correlated [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light transport")]
    reuse: Option<When>,
    /// Sampling of the environment by its visibility: less noise in rooms with windows [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light transport")]
    windows: Option<When>,
    /// Longest path in segments: 1 is emission seen directly, 2 adds direct light [default: no limit]
    #[arg(long, value_name = "N", value_parser = values::checked::<u32, Depth>,
        help_heading = "Light transport")]
    max_depth: Option<Depth>,
    /// Share of the work for path tracing some pixels to measure the bias [default: 5% if the method is
    /// biased]
    #[arg(long, value_name = "SHARE|off", value_parser = values::audit, help_heading = "Light transport")]
    audit: Option<f64>,
    /// Reconstruction of the picture from the halves of its film; film files keep the samples [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Results")]
    reconstruct: Option<Reconstruction>,
    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N", display_order = 7)]
    seed: Option<u32>,
    /// Highest instruction set: baseline, avx2 or avx512 [default: the best of the processor]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "Instruction set")]
    simd: Option<Tier>,
    /// Same bits on every processor, by the baseline instruction set
    #[arg(long, help_heading = "Instruction set")]
    pub(super) precise: bool,
    /// Error metric that sets the radii of records [default: halflight]
    #[arg(long, value_name = "METRIC", value_parser = values::metric, help_heading = "Irradiance cache")]
    cache_metric: Option<Metric>,
    /// Interpolation error; smaller means more records [default: 1e-4; min-distance and split spheres: 0.3]
    #[arg(long, value_name = "ERROR", value_parser = values::positive, help_heading = "Irradiance cache")]
    cache_error: Option<f64>,
    /// Gather rays per record: 64, 256, 576, 1024, 2304 or 4096 [default: 256]
    #[arg(long, value_name = "N", value_parser = values::gather_rays, help_heading = "Irradiance cache")]
    cache_rays: Option<u32>,
    /// Basis of the coefficients of a record: zernike, or sh for spherical harmonics as in Křivánek et al.
    /// 2005 [default: zernike]
    #[arg(long, value_name = "BASIS", value_parser = values::basis, help_heading = "Radiance cache")]
    basis: Option<Basis>,
    /// Expected error of light from lobes that records serve, relative to all that leaves [default: 0.02]
    #[arg(long, value_name = "ERROR", value_parser = values::positive, help_heading = "Radiance cache")]
    lobe_error: Option<f64>,
    /// Largest degree of the coefficients of a record; lobes that need more are path traced [default: 6, with
    /// sh 9]
    #[arg(long, value_name = "DEGREE", value_parser = clap::value_parser!(u32).range(1..=9),
        help_heading = "Radiance cache")]
    lobe_degree: Option<u32>,
    /// Kernel of density estimates [default: epanechnikov]
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
    /// Light paths per sample of the picture [default: bdpt and vcm: by a pilot; light: pixels / 2; instant
    /// radiosity: pixels / 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20),
        help_heading = "Light paths")]
    light_paths: Option<u32>,
    /// Light vertices that a camera vertex is connected to [default: by a pilot; instant radiosity: 4, or 2
    /// with reuse]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64),
        help_heading = "Light paths")]
    connections: Option<u32>,
    /// Merging with vcm [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light paths")]
    merging: Option<When>,
    /// Kind of the points of Markov chains with mlt [default: multiplexed]
    #[arg(long, value_name = "SPACE", help_heading = "Markov chains")]
    mlt: Option<Space>,
    /// Mutations per pixel and sample with mlt, a quarter of them independent [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64),
        help_heading = "Markov chains")]
    mutations: Option<u32>,
    /// Largest contribution of a traced path beside the chains of mlt, relative to the pixel; chains find
    /// the rest; 0: all of it [default: 2]
    #[arg(long, value_name = "RATIO", value_parser = values::not_negative, help_heading = "Markov chains")]
    path_limit: Option<f64>,
}

/// Primary sample space of Markov chains.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Space {
    /// One bidirectional technique of a path of one length
    Multiplexed,
    /// A whole path from the camera
    Pssmlt,
}

/// Kernel of a density estimate.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Kernel {
    /// Constant
    Constant,
    /// Linear
    Cone,
    /// Quadratic
    Epanechnikov,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(super) enum Caustics {
    /// If a pilot finds that they reduce variance
    Auto,
    /// Never
    Off,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum When {
    /// If a pilot finds that it pays
    Auto,
    /// Always
    On,
    /// Never
    Off,
}

/// Use of the reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Reconstruction {
    /// If its estimated error is smaller than that of the samples
    Auto,
    /// Never
    Off,
}

impl When {
    /// `None` for `auto`.
    fn forced(when: Option<Self>) -> Option<bool> {
        match when? {
            When::Auto => None,
            When::On => Some(true),
            When::Off => Some(false),
        }
    }
}

impl MethodArgs {
    fn lobes(&self) -> LobeSettings {
        let usual = LobeSettings::of(self.basis.unwrap_or_default());
        LobeSettings {
            tolerance: self.lobe_error.map_or(usual.tolerance, |error| error as f32),
            degree: self.lobe_degree.map_or(usual.degree, |degree| degree as usize),
            ..usual
        }
    }

    /// Refuses a degree that the basis does not have.
    fn check_degree(&self) -> Result<(), Failure> {
        let LobeSettings { basis, degree, .. } = self.lobes();
        let (name, most) = (basis.name(), basis.degree_max());
        if degree <= most {
            return Ok(());
        }
        let message = format!("--lobe-degree {degree}: the basis {name} has degrees up to {most}");
        Err(Failure::new(message).advice("take a lower degree, or --basis sh".to_owned()))
    }

    /// `settings` with these.
    pub(super) fn apply(&self, settings: Settings) -> Settings {
        let kernel = match self.photon_kernel {
            None => photon::Kernel::default(),
            Some(Kernel::Constant) => photon::Kernel::Constant,
            Some(Kernel::Cone) => photon::Kernel::Cone,
            Some(Kernel::Epanechnikov) => photon::Kernel::Epanechnikov,
        };
        let level = if self.precise { Level::BASELINE } else { Level::detect() };
        Settings {
            seed: self.seed.unwrap_or(settings.seed),
            max_depth: self.max_depth.map(u32::from).or(settings.max_depth),
            reuse: When::forced(self.reuse),
            caustics: !matches!(self.caustics, Some(Caustics::Off)),
            environment_visibility: When::forced(self.windows),
            cache: CacheSettings {
                metric: self.cache_metric.unwrap_or(settings.cache.metric),
                error: self.cache_error.map(|error| error as f32),
                strata: self.cache_rays.map(u32::isqrt),
                records: None,
            },
            lobes: self.lobes(),
            photons: PhotonSettings { kernel, global: self.global_photons, caustic: self.caustic_photons },
            bidirectional: BidirectionalSettings {
                light_paths: self.light_paths,
                connections: self.connections,
                merging: When::forced(self.merging),
            },
            virtual_lights: VirtualLightSettings {
                light_paths: self.light_paths,
                connections: self.connections,
            },
            metropolis: MetropolisSettings {
                space: match self.mlt {
                    Some(Space::Pssmlt) => PrimarySpace::PathTracing,
                    _ => PrimarySpace::Multiplexed,
                },
                mutations: self.mutations.unwrap_or(settings.metropolis.mutations),
                threshold: self.path_limit.map_or(settings.metropolis.threshold, |limit| limit as f32),
            },
            audit: self.audit,
            reconstruct: match self.reconstruct {
                Some(Reconstruction::Auto) | None => Reconstruct::Auto,
                Some(Reconstruction::Off) => Reconstruct::Off,
            },
            level: self.simd.map_or(level, |tier| level.capped(tier)),
            ..settings
        }
    }
}

/// File name of a scene.
pub(super) fn file_name(scene: &Path) -> String {
    scene.file_name().unwrap_or(scene.as_os_str()).to_string_lossy().into_owned()
}

/// Notes that a scene is dark; returns whether it is. More samples of its black picture show nothing.
pub(super) fn note_darkness(scene: &Scene) -> bool {
    let is_dark = scene.is_dark();
    if is_dark {
        print_note(
            "nothing in this scene emits light: the picture is black. Add a light or an environment: the lines \
             `[[mesh]]`, `file = \"MODEL\"`, `[sky]`, `sun = [1, 2, 1]` are a scene file in daylight",
        );
    }
    is_dark
}

/// Failure of a render of `scene`, with advice.
pub(super) fn render_failure(scene: &Path, error: &RenderError) -> Failure {
    let failure = Failure::new(format!("{}: {error}", scene.display()));
    match error {
        // The file has its own name.
        RenderError::File(error) => {
            Failure::new(error).advice("give another file, or leave out its flag to render anew")
        }
        RenderError::Memory { needed, .. } => {
            failure.advice(format!("raise --memory to {needed}, or lower --size or --threads"))
        }
        _ => failure,
    }
}
