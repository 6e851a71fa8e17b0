//! Rays and hits in the memory layout that the SIMD kernels load: 32 and 16 bytes, no padding.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Half-line `origin + t * direction` for `0 <= t <= t_max`. `t` is in lengths of the direction, which need
/// not be normalised.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Ray {
    /// Origin.
    pub origin: [f32; 3],
    /// Largest `t` of a hit; infinite for an unbounded ray, negative for an inactive ray.
    pub t_max: f32,
    /// Direction.
    pub direction: [f32; 3],
    /// Number for the caller, never read by the tracer.
    pub tag: u32,
}

impl Ray {
    /// Unbounded ray.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self::segment(origin, direction, f32::INFINITY)
    }

    /// Ray that ends at `t_max`.
    #[inline]
    pub fn segment(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin: origin.to_array(), t_max, direction: direction.to_array(), tag: 0 }
    }

    /// Point at `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        Vec3::from(self.origin) + t * Vec3::from(self.direction)
    }
}

/// `triangle` of a ray without a hit.
pub const MISS: u32 = u32::MAX;

/// Hit of a ray at the point `(1 - u - v) p0 + u p1 + v p2` of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
    /// Index of the triangle in the mesh, or [`MISS`].
    pub triangle: u32,
}

impl Hit {
    /// No hit.
    pub const NONE: Hit = Hit { t: f32::INFINITY, u: 0.0, v: 0.0, triangle: MISS };

    /// Becomes `other` if that is nearer, or equally near with a lower index. The order of the calls does not
    /// matter.
    #[inline(always)]
    pub fn take(&mut self, other: Hit) {
        if other.t < self.t || (other.t == self.t && other.triangle < self.triangle) {
            *self = other;
        }
    }

    /// True if a triangle was hit.
    #[inline]
    pub fn is_some(&self) -> bool {
        self.triangle != MISS
    }
}
