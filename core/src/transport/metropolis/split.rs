//! The division of light between path tracing and Markov chains (selective Metropolis light transport,
//! Bitterli and Jarosz 2019).
//!
//! A path of contribution F, which path tracing finds with density p by all of its techniques, would add F /
//! p to a pixel. Path tracing adds λ F / p with λ = max(w, min(1, T m / (F / p))), for a pixel of radiance
//! about m and w the weight of path tracing by the balance heuristic of all techniques. Light that no other
//! technique finds stays with path tracing: independent points, which choose a length and a technique first,
//! find it more seldom than paths do. PSSMLT, whose points are whole paths, has w = 0. Chains have the rest,
//! (1 − λ) F. λ depends on the path alone, so that both parts add up to F whatever m and T are.

use crate::light::luminance;
use crate::transport::walk::sums::Counts;
use crate::transport::walk::techniques::Weighted;

/// Pixels of a cell of the rough picture: 8 × 8, a run of the film.
pub const CELL: usize = 64;

/// Fewest segments of paths whose light may be left to chains. Path tracing samples the light that is seen,
/// and direct light, by stratified numbers.
pub const MIN_SEGMENTS: u32 = 3;

/// Most segments of such paths.
pub const MAX_SEGMENTS: u32 = 20;

/// Kinds of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PrimarySpace {
    /// One technique of a path of one length.
    #[default]
    Multiplexed,
    /// All light of a path from the camera.
    PathTracing,
}

/// The division of light for one picture.
#[derive(Clone, Copy, Debug)]
pub struct Split<'a> {
    /// Radiance of each cell of the film, about; 1 beyond the end.
    pub levels: &'a [f32],
    /// T: the largest contribution of path tracing beyond w, relative to the level of the pixel. 0 leaves
    /// all else to chains.
    pub threshold: f32,
    /// Most segments of paths of chains.
    pub max_segments: u32,
    /// Space of the chains.
    pub space: PrimarySpace,
}

impl Split<'_> {
    /// Counts of all techniques that share the light of a picture of so many `pixels`.
    pub(super) fn counts(&self, pixels: f32) -> Counts {
        match self.space {
            PrimarySpace::Multiplexed => Counts { light_paths: pixels, connections: 1.0, light_samples: 1.0 },
            PrimarySpace::PathTracing => Counts::PATH_TRACING,
        }
    }

    /// The level of the pixel at that position of the film.
    pub fn level(&self, position: u32) -> f32 {
        self.levels.get(position as usize / CELL).copied().unwrap_or(1.0)
    }

    /// λ: the fraction of a path of `segments` segments that belongs to path tracing.
    pub(super) fn of_paths(&self, position: u32, segments: u32, light: &Weighted) -> f32 {
        if !(MIN_SEGMENTS..=self.max_segments).contains(&segments) {
            return 1.0;
        }
        if light.by_paths <= 0.0 {
            return 0.0;
        }
        let by_paths_alone = luminance(light.radiance) / light.by_paths;
        // Points of PSSMLT find the light of paths as often as path tracing does.
        let least = if self.space == PrimarySpace::Multiplexed { light.by_paths } else { 0.0 };
        (self.threshold * self.level(position) / by_paths_alone).max(least).min(1.0)
    }
}
