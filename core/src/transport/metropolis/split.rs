//! The division of light between path tracing and Markov chains (selective Metropolis light transport,
//! Bitterli and Jarosz 2019).
//!
//! A path of contribution F, which path tracing finds with density p by all of its techniques, would add F /
//! p to a pixel. Path tracing adds λ F / p with λ = min(1, T m / (F / p)), for a pixel of radiance about m:
//! no contribution exceeds T m. Chains have the rest, (1 − λ) F. λ depends on the path alone, so that both
//! parts add up to F whatever m and T are.

use crate::light::luminance;
use crate::transport::walk::techniques::Weighted;

/// Pixels of a cell of the rough picture: 8 × 8, a run of the film.
pub const CELL: usize = 64;

/// Fewest segments of paths whose light may be left to chains. Path tracing samples the light that is seen,
/// and direct light, by stratified numbers.
pub const MIN_SEGMENTS: u32 = 3;

/// Most segments of such paths.
pub const MAX_SEGMENTS: u32 = 20;

/// The division of light for one picture.
#[derive(Clone, Copy, Debug)]
pub struct Split<'a> {
    /// Radiance of each cell of the film, about; 1 beyond the end.
    pub levels: &'a [f32],
    /// T: the largest contribution of path tracing, relative to the level of the pixel. 0 leaves all to
    /// chains.
    pub threshold: f32,
    /// Most segments of paths of chains.
    pub max_segments: u32,
}

impl Split<'_> {
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
        (self.threshold * self.level(position) / by_paths_alone).min(1.0)
    }
}
