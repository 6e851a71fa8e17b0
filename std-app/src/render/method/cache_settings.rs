//! Settings of irradiance caches.

use halflight_core::cache::irradiance::{Metric, metric};
use halflight_core::method::cache_resolution::CacheResolution;

/// Settings for filling an irradiance cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSettings {
    /// Rule for the radii of records.
    pub metric: Metric,
    /// Allowed error, in the unit of the metric; `None` means the metric's default.
    pub error: Option<f32>,
    /// Strata along a side of the hemisphere; a record has as many gather rays as the square. `None` means
    /// [`CacheSettings::STRATA`].
    pub strata: Option<u32>,
}

impl CacheSettings {
    /// Default number of strata along a side.
    pub const STRATA: u32 = CacheResolution::COARSEST.strata;

    /// Strata along a side, by request or default.
    pub fn strata(&self) -> u32 {
        self.strata.unwrap_or(Self::STRATA)
    }

    /// Whether the rays and the density of records may be chosen for the picture.
    pub(in crate::render) fn is_open(&self) -> bool {
        self.metric == Metric::Halflight && self.error.is_none() && self.strata.is_none()
    }

    /// Gather rays and density of the records. Coarser ones, and those of other metrics, are taken for as
    /// dense as the default.
    pub(in crate::render) fn resolution(&self) -> CacheResolution {
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

impl Default for CacheSettings {
    fn default() -> Self {
        Self { metric: Metric::Halflight, error: None, strata: None }
    }
}
