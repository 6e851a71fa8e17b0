//! Settings of path tracing, and counters for reports.

use crate::film::Dropped;
use bytemuck::{Pod, Zeroable};

/// `max_depth` without a limit.
pub const UNLIMITED: u32 = u32::MAX;

/// Settings of a path-traced picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Maximum number of segments between camera and light: 1 shows emission, 2 adds direct light, 3 one
    /// bounce, [`UNLIMITED`] all light.
    pub max_depth: u32,
}

impl PathSettings {
    /// True if the depth of paths is limited.
    pub fn is_limited(&self) -> bool {
        self.max_depth != UNLIMITED
    }

    /// Segments that the path of a photon has to have left, besides one, behind a camera path of so many
    /// `segments`: none if paths have any length.
    pub(crate) fn extra_segments(&self, segments: u32) -> u32 {
        if self.is_limited() { segments - 1 } else { 0 }
    }
}

/// Counters of work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Counters {
    /// Number of paths started, one per sample of a pixel.
    pub paths: u64,
    /// Number of rays traced for the nearest hit: camera rays and bounces.
    pub rays: u64,
    /// Number of shadow rays to lights.
    pub shadow_rays: u64,
    /// Rejected samples.
    pub dropped: Dropped,
}

impl Counters {
    /// Number of rays of all kinds.
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
