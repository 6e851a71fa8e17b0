//! What is asked of irradiance caches, and what became of them.

use halflight_core::cache::irradiance::{Metric, metric};

/// How an irradiance cache is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheSettings {
    /// The rule by which records know how far they reach.
    pub metric: Metric,
    /// Error allowed, in the unit of the metric; `None`: its usual one.
    pub error: Option<f32>,
    /// Strata along a side of the hemisphere that is gathered: its square is the number of rays of a record. `None`:
    /// [`CacheSettings::STRATA`].
    pub strata: Option<u32>,
}

impl CacheSettings {
    /// Strata along a side where nothing else is asked for.
    pub const STRATA: u32 = 16;

    /// Strata along a side that are wanted.
    pub fn strata(&self) -> u32 {
        self.strata.unwrap_or(Self::STRATA)
    }

    /// The error allowed.
    pub fn allowed(&self) -> f32 {
        self.error.unwrap_or(metric::Settings::new(self.metric, 1.0).error)
    }
}

impl Default for CacheSettings {
    fn default() -> Self {
        Self { metric: Metric::Halflight, error: None, strata: None }
    }
}

/// What became of the caches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CacheUse {
    /// Records of both.
    pub records: u64,
    /// Most records that there was memory for.
    pub capacity: u64,
    /// Records that found no memory: their surroundings are path traced.
    pub refused: u64,
    /// Records of both that a file had.
    pub loaded: u64,
    /// Places at which light was gathered: as many times the rays of a record.
    pub gathered: u64,
    /// Rays of each of them.
    pub rays: u32,
    /// They were left as they were when their part of the time was over, or the render was interrupted.
    pub is_cut: bool,
    /// Seconds of filling both.
    pub seconds: f64,
}
