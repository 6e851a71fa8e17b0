//! Connections between vertices of neighbouring paths for path reuse: geometry and form factor.

use crate::geometry::Ray;
use crate::scene::SurfacePoint;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Minimum cosine of the viewer. Below it the shading normal may have been turned to the viewer, so that two
/// viewers do not see the same surface.
const HORIZON: f32 = 2e-3;

/// End of a connection. Both normals point to the side of the other end.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ConnectionVertex {
    pub(super) position: [f32; 3],
    /// Error bound of `position`.
    error: f32,
    /// Shading normal.
    pub(super) normal: [f32; 3],
    geometric_normal: [f32; 3],
}

impl ConnectionVertex {
    pub(super) fn of(point: &SurfacePoint) -> Self {
        Self {
            position: point.position.to_array(),
            error: point.error,
            normal: point.frame.normal.to_array(),
            geometric_normal: point.geometric_normal.to_array(),
        }
    }

    /// Position, offset from the surface.
    #[inline]
    fn outside(&self) -> Vec3 {
        Vec3::from(self.position) + self.error * Vec3::from(self.geometric_normal)
    }

    /// Ray to `other` that hits neither surface.
    #[inline]
    pub(super) fn ray_to(&self, other: &ConnectionVertex) -> Ray {
        let origin = self.outside();
        Ray::segment(origin, other.outside() - origin, 1.0 - f32::EPSILON)
    }
}

/// g = cos θ_x cos θ_y / |x - y|²: density per area, up to a factor π, with which a path from the diffuse
/// point `x` hits `y`. Zero if x and y do not face each other.
#[inline]
pub(super) fn density(x: &ConnectionVertex, y: &ConnectionVertex) -> f32 {
    let between = Vec3::from(y.position) - Vec3::from(x.position);
    let square = between.length_squared();
    let leaving = between.dot(x.normal.into());
    let arriving = -between.dot(y.geometric_normal.into());
    let shading = -between.dot(y.normal.into());
    let faces = leaving > 0.0
        && arriving > 0.0
        && shading > 0.0
        && between.dot(x.geometric_normal.into()) > 0.0
        && shading * shading > HORIZON * HORIZON * square;
    if faces { leaving * arriving / square / square } else { 0.0 }
}
