//! Rays and hits in the layout that the SIMD kernels load: 32 and 16 bytes, no padding.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The half-line `origin + t * direction` for `0 <= t <= t_max`. The direction need not be normalised:
/// `t` counts in lengths of it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Ray {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// The farthest `t` that counts; infinite for a ray without end, negative for a ray that is off.
    pub t_max: f32,
    /// Where it goes.
    pub direction: [f32; 3],
    /// Carried along and never read by the tracer.
    pub tag: u32,
}

impl Ray {
    /// A ray without end.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self::segment(origin, direction, f32::INFINITY)
    }

    /// A ray that ends at `t_max`.
    pub fn segment(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin: origin.to_array(), t_max, direction: direction.to_array(), tag: 0 }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        Vec3::from(self.origin) + t * Vec3::from(self.direction)
    }
}

/// The `triangle` of a ray that hit nothing.
pub const MISS: u32 = u32::MAX;

/// Where a ray met a triangle: the point `(1 - u - v) p0 + u p1 + v p2`.
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

    /// Becomes `other` where that is nearer, or as near and of a lower index: the order in which hits
    /// are offered does not matter.
    #[inline(always)]
    pub fn take(&mut self, other: Hit) {
        if other.t < self.t || (other.t == self.t && other.triangle < self.triangle) {
            *self = other;
        }
    }

    /// Whether a triangle was hit.
    pub fn is_some(&self) -> bool {
        self.triangle != MISS
    }
}
