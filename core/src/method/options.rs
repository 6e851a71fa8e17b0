//! Methods with their options.

use super::MethodKind;
use super::bidirectional::BidirectionalSettings;
use super::cache_resolution::CacheResolution;
use super::instant_radiosity::VirtualLightSettings;
use super::metropolis::MetropolisSettings;
use super::photons::PhotonSettings;
use crate::cache::irradiance::{Metric, metric};
use crate::cache::radiance::LobeSettings;

/// A method of rendering, with its options.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// The method with the least predicted error, by pilots, with the options of all.
    #[default]
    Auto,
    /// Path tracing with next-event estimation and multiple importance sampling (Kajiya 1986; Veach 1997).
    Path(PathOptions),
    /// Irradiance caching with occlusion-aware Hessians (Ward et al. 1988; Schwarzhaupt et al. 2012).
    IrradianceCache(CacheOptions),
    /// Irradiance caching, and records of radiance for rough reflections (Křivánek et al. 2005).
    RadianceCache(CacheOptions, LobeSettings),
    /// Photon mapping with final gathering and a caustic map (Jensen 1996).
    PhotonMap(PhotonSettings),
    /// Stochastic progressive photon mapping (Hachisuka and Jensen 2009).
    ProgressivePhotons(PhotonSettings),
    /// Path tracing, and light paths whose vertices the camera sees.
    LightTracing(BidirectionalSettings),
    /// Bidirectional path tracing (Veach 1997).
    Bidirectional(BidirectionalSettings),
    /// Vertex connection and merging (Georgiev et al. 2012).
    VertexMerging(BidirectionalSettings),
    /// Instant radiosity (Keller 1997); paths find the light that its bound cuts.
    InstantRadiosity(VirtualLightSettings),
    /// Instant radiosity without the light that its bound cuts: dark corners.
    ClampedInstantRadiosity(VirtualLightSettings),
    /// Metropolis light transport in primary sample space (Kelemen et al. 2002; Hachisuka et al. 2014).
    Metropolis(MetropolisSettings),
}

impl Method {
    /// All methods with their usual options, [`Method::Auto`] first.
    pub fn all() -> [Method; 12] {
        let MethodOptions { paths, cache, lobes, photons, bidirectional, virtual_lights, metropolis } =
            MethodOptions::default();
        [
            Method::Auto,
            Method::Path(paths),
            Method::IrradianceCache(cache),
            Method::RadianceCache(cache, lobes),
            Method::PhotonMap(photons),
            Method::ProgressivePhotons(photons),
            Method::LightTracing(bidirectional),
            Method::Bidirectional(bidirectional),
            Method::VertexMerging(bidirectional),
            Method::InstantRadiosity(virtual_lights),
            Method::ClampedInstantRadiosity(virtual_lights),
            Method::Metropolis(metropolis),
        ]
    }

    /// Kind of the method; `None` for [`Method::Auto`].
    pub const fn kind(&self) -> Option<MethodKind> {
        Some(match self {
            Method::Auto => return None,
            Method::Path(_) => MethodKind::Path,
            Method::IrradianceCache(_) => MethodKind::IrradianceCache,
            Method::RadianceCache(..) => MethodKind::RadianceCache,
            Method::PhotonMap(_) => MethodKind::PhotonMap,
            Method::ProgressivePhotons(_) => MethodKind::ProgressivePhotons,
            Method::LightTracing(_) => MethodKind::LightTracing,
            Method::Bidirectional(_) => MethodKind::Bidirectional,
            Method::VertexMerging(_) => MethodKind::VertexMerging,
            Method::InstantRadiosity(_) => MethodKind::InstantRadiosity,
            Method::ClampedInstantRadiosity(_) => MethodKind::ClampedInstantRadiosity,
            Method::Metropolis(_) => MethodKind::Metropolis,
        })
    }

    /// Name in reports.
    pub const fn name(&self) -> &'static str {
        match self.kind() {
            Some(kind) => kind.name(),
            None => "auto",
        }
    }

    /// Its options, among the usual ones of all other methods.
    #[doc(hidden)]
    pub fn options(&self) -> MethodOptions {
        let usual = MethodOptions::default();
        match *self {
            Method::Auto => usual,
            Method::Path(paths) => MethodOptions { paths, ..usual },
            Method::IrradianceCache(cache) => MethodOptions { cache, ..usual },
            Method::RadianceCache(cache, lobes) => MethodOptions { cache, lobes, ..usual },
            Method::PhotonMap(photons) | Method::ProgressivePhotons(photons) => {
                MethodOptions { photons, ..usual }
            }
            Method::LightTracing(counts) | Method::Bidirectional(counts) | Method::VertexMerging(counts) => {
                MethodOptions { bidirectional: counts, ..usual }
            }
            Method::InstantRadiosity(virtual_lights) | Method::ClampedInstantRadiosity(virtual_lights) => {
                MethodOptions { virtual_lights, ..usual }
            }
            Method::Metropolis(metropolis) => MethodOptions { metropolis, ..usual },
        }
    }
}

/// Options of all methods, among which prepasses choose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MethodOptions {
    /// Options of path tracing, alone and beside other methods.
    pub paths: PathOptions,
    /// Options of caches.
    pub cache: CacheOptions,
    /// Lobes that the records of a radiance cache serve.
    pub lobes: LobeSettings,
    /// Options of photon maps.
    pub photons: PhotonSettings,
    /// Sample counts of the techniques of bidirectional methods.
    pub bidirectional: BidirectionalSettings,
    /// Options of virtual lights.
    pub virtual_lights: VirtualLightSettings,
    /// Options of Metropolis light transport.
    pub metropolis: MetropolisSettings,
}

/// Options of path tracing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathOptions {
    /// True if neighbouring pixels share paths; `None`: as a pilot on a few tiles decides.
    pub reuse: Option<bool>,
    /// True if paths are merged with caustic photons where a prepass finds that they pay.
    pub caustics: bool,
}

impl PathOptions {
    /// Paths without pilots: neither reuse nor photons.
    pub const PLAIN: Self = Self { reuse: Some(false), caustics: false };
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { reuse: None, caustics: true }
    }
}

/// Options of caches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheOptions {
    /// Rule for the radii of records.
    pub metric: Metric,
    /// Allowed error, in the unit of the metric; `None`: the metric's default.
    pub error: Option<f32>,
    /// Strata along a side of the hemisphere; a record has as many gather rays as the square. `None`:
    /// [`CacheOptions::STRATA`].
    pub strata: Option<u32>,
    /// Records of each of the two caches; `None`: an eighth of the pixels, and 4096 at least.
    pub records: Option<u32>,
}

impl CacheOptions {
    /// Usual options.
    pub const DEFAULT: Self = Self { metric: Metric::Halflight, error: None, strata: None, records: None };

    /// Default number of strata along a side.
    pub const STRATA: u32 = CacheResolution::COARSEST.strata;

    /// Strata along a side, by request or default.
    pub fn strata(&self) -> u32 {
        self.strata.unwrap_or(Self::STRATA)
    }

    /// True if the rays and the density of records may be chosen for the picture.
    pub fn is_open(&self) -> bool {
        self.metric == Metric::Halflight && self.error.is_none() && self.strata.is_none()
    }

    /// Gather rays and density of the records. Coarser ones, and those of other metrics, are taken for as
    /// dense as the default.
    #[doc(hidden)]
    pub fn resolution(&self) -> CacheResolution {
        let error = match self.metric {
            Metric::Halflight => self.allowed().min(CacheResolution::COARSEST.error),
            _ => CacheResolution::COARSEST.error,
        };
        CacheResolution { strata: self.strata(), error }
    }

    /// Allowed error, by request or default.
    pub fn allowed(&self) -> f32 {
        self.error.unwrap_or(metric::Settings::new(self.metric, 1.0).error)
    }
}

impl Default for CacheOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}
