//! Flags of the methods: `--method`, and the settings that may differ between the methods of a race.

use super::values;
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use halflight::render::{
    BidirectionalSettings, CacheSettings, Method, MetropolisSettings, PhotonSettings, PrimarySpace, Settings,
    VirtualLightSettings,
};
use halflight_core::cache::irradiance::Metric;
use halflight_core::photon;
use halflight_simd::{Level, Tier};

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
            .map_or("path, irradiance-cache or vcm: the one with the least predicted error", Method::about);
        Some(PossibleValue::new(self.name()).help(about))
    }
}

/// Settings that may differ between the methods of a race.
#[derive(Args, Clone, Debug)]
pub(super) struct MethodArgs {
    /// Caustic photons with path and irradiance-cache [default: auto]
    #[arg(long, help_heading = "Light transport")]
    caustics: Option<Caustics>,
    /// Path reuse among neighbouring pixels: less noise in indirect light, but correlated [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light transport")]
    reuse: Option<When>,
    /// Sampling of the environment by its visibility: less noise in rooms with windows [default: auto]
    #[arg(long, value_name = "WHEN", help_heading = "Light transport")]
    windows: Option<When>,
    /// Longest path in segments: 1 is emission seen directly, 2 adds direct light [default: no limit]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..),
        help_heading = "Light transport")]
    max_depth: Option<u32>,
    /// Share of the work for path tracing some pixels to measure the bias [default: 5% if the method is
    /// biased]
    #[arg(long, value_name = "SHARE|off", value_parser = values::audit, help_heading = "Light transport")]
    audit: Option<f64>,
    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N", display_order = 7)]
    seed: Option<u32>,
    /// Highest instruction set: baseline, avx2 or avx512 [default: the best of the processor]
    #[arg(long, value_name = "LEVEL", value_parser = values::tier, help_heading = "Instruction set")]
    simd: Option<Tier>,
    /// Same bits on every processor, by the baseline instruction set
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

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Caustics {
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
    /// These settings, completed by `base`.
    pub(super) fn over(&self, base: &MethodArgs) -> MethodArgs {
        MethodArgs {
            caustics: self.caustics.or(base.caustics),
            reuse: self.reuse.or(base.reuse),
            cache_metric: self.cache_metric.or(base.cache_metric),
            cache_error: self.cache_error.or(base.cache_error),
            cache_rays: self.cache_rays.or(base.cache_rays),
            photon_kernel: self.photon_kernel.or(base.photon_kernel),
            global_photons: self.global_photons.or(base.global_photons),
            caustic_photons: self.caustic_photons.or(base.caustic_photons),
            light_paths: self.light_paths.or(base.light_paths),
            connections: self.connections.or(base.connections),
            merging: self.merging.or(base.merging),
            mlt: self.mlt.or(base.mlt),
            mutations: self.mutations.or(base.mutations),
            path_limit: self.path_limit.or(base.path_limit),
            windows: self.windows.or(base.windows),
            max_depth: self.max_depth.or(base.max_depth),
            audit: self.audit.or(base.audit),
            seed: self.seed.or(base.seed),
            simd: self.simd.or(base.simd),
            precise: self.precise || base.precise,
        }
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
            max_depth: self.max_depth.or(settings.max_depth),
            reuse: When::forced(self.reuse),
            caustics: !matches!(self.caustics, Some(Caustics::Off)),
            environment_visibility: When::forced(self.windows),
            cache: CacheSettings {
                metric: self.cache_metric.unwrap_or(settings.cache.metric),
                error: self.cache_error.map(|error| error as f32),
                strata: self.cache_rays.map(u32::isqrt),
            },
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
            level: self.simd.map_or(level, |tier| level.capped(tier)),
            ..settings
        }
    }
}
