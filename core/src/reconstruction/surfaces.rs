//! Surfaces that a pixel sees, through mirrors and smooth glass.

use bytemuck::{Pod, Zeroable};

/// Number of an empty slot of [`PixelSurfaces`].
pub const NO_CLUSTER: u32 = u32::MAX;

/// Clusters of a pixel that are kept.
pub(super) const SLOTS: usize = 4;

/// The clusters of surfaces that a pixel sees, most frequent first, and their shares.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PixelSurfaces {
    /// Number of the cluster by descending share; [`NO_CLUSTER`] where a slot is empty.
    pub clusters: [u32; SLOTS],
    /// Fraction of the pixel that each cluster covers, 0 to 1. A pixel is *whole* if the first is 1.
    pub fractions: [f32; SLOTS],
    /// Mean albedo of the surfaces where the rays end, 0 to 1 (1 for emitters and the environment).
    pub albedo: [f32; 3],
    /// Mean shading normal where the rays end.
    pub normal: [f32; 3],
    /// Distance along the ray to the first surface; 0 where the ray escapes.
    pub depth: f32,
}
