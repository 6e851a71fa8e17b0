//! Settings of path tracing, and counters for reports.

use crate::film::Dropped;

/// No limit on the length of paths.
pub const UNLIMITED: u32 = u32::MAX;

/// Settings of a picture by path tracing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// The largest number of segments between camera and light: 1 shows emission, 2 adds direct light, 3 one
    /// bounce, [`UNLIMITED`] all.
    pub max_depth: u32,
}

impl PathSettings {
    /// Whether paths have a limit of depth.
    pub fn is_limited(&self) -> bool {
        self.max_depth != UNLIMITED
    }
}

/// Counts of work done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Paths started: samples of pixels.
    pub paths: u64,
    /// Rays traced for the nearest hit: camera rays and bounces.
    pub rays: u64,
    /// Shadow rays, to lights.
    pub shadow_rays: u64,
    /// Samples that did not reach the picture.
    pub dropped: Dropped,
}

impl Counters {
    /// Rays of every kind.
    pub fn all_rays(&self) -> u64 {
        self.rays + self.shadow_rays
    }
}

impl core::ops::AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.paths += other.paths;
        self.rays += other.rays;
        self.shadow_rays += other.shadow_rays;
        self.dropped += other.dropped;
    }
}
