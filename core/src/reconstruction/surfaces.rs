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

impl Default for PixelSurfaces {
    /// A whole pixel of one diffuse surface.
    fn default() -> Self {
        Self {
            clusters: [0, NO_CLUSTER, NO_CLUSTER, NO_CLUSTER],
            fractions: [1.0, 0.0, 0.0, 0.0],
            albedo: [1.0; 3],
            normal: [0.0, 0.0, 1.0],
            depth: 1.0,
        }
    }
}

impl PixelSurfaces {
    /// True if all rays of the pixel see one cluster.
    #[inline]
    pub fn is_whole(&self) -> bool {
        self.fractions[0] >= 1.0
    }

    /// True if all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        let Self { fractions, albedo, normal, depth, .. } = self;
        let numbers = fractions.iter().chain(albedo).chain(normal).chain([depth]);
        numbers.into_iter().all(|number| number.is_finite())
    }

    /// The cluster of a whole pixel, else [`NO_CLUSTER`].
    #[inline]
    pub fn whole(&self) -> u32 {
        if self.is_whole() { self.clusters[0] } else { NO_CLUSTER }
    }

    /// Clusters with a fraction, and their fractions.
    #[inline]
    pub fn parts(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let parts = self.clusters.iter().copied().zip(self.fractions);
        parts.filter(|(cluster, fraction)| *cluster != NO_CLUSTER && *fraction > 0.0)
    }
}
