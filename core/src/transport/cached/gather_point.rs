//! Point at which records are gathered, as its viewer sees it.

use crate::cache::irradiance::{OVERHANG_RADIUS_FACTOR, QueryPoint};
use crate::geometry::{Hit, MISS, Ray};
use crate::scene::SurfacePoint;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::PathState;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Diffuse point at which irradiance is gathered. Both normals are on the side of the viewer.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct GatherPoint {
    pub(in crate::transport) position: [f32; 3],
    /// Error bound of `position`.
    pub(in crate::transport) error: f32,
    /// Shading normal, the axis of the hemisphere.
    pub(in crate::transport) normal: [f32; 3],
    pub(in crate::transport) geometric_normal: [f32; 3],
    pub(in crate::transport) triangle: u32,
    /// Width of a pixel at this point.
    pub(in crate::transport) pixel: f32,
    /// Maximum distance of records that are valid here, and of points at which the record of this point is
    /// valid: [`QueryPoint::within`].
    pub(in crate::transport) within: f32,
    /// Direction to the viewer of a lobe that records serve; zero without one.
    pub(super) viewer: [f32; 3],
    /// Position on the triangle, with a lobe.
    pub(super) barycentrics: [f32; 2],
}

impl GatherPoint {
    /// No point.
    pub const NONE: GatherPoint = GatherPoint {
        position: [0.0; 3],
        error: 0.0,
        normal: [0.0; 3],
        geometric_normal: [0.0; 3],
        triangle: MISS,
        pixel: 0.0,
        within: f32::INFINITY,
        viewer: [0.0; 3],
        barycentrics: [0.0; 2],
    };

    /// True if this is a point.
    pub fn is_some(&self) -> bool {
        self.triangle != MISS
    }

    /// Gather point at `point`, where a pixel has the width `pixel`.
    pub(in crate::transport) fn of(point: &SurfacePoint, pixel: f32) -> Self {
        Self {
            position: point.position.to_array(),
            error: point.error,
            normal: point.frame.normal.to_array(),
            geometric_normal: point.geometric_normal.to_array(),
            triangle: point.triangle,
            pixel,
            ..Self::NONE
        }
    }

    /// This point, with a lobe that records serve: `hit` of a ray along `direction`.
    pub(in crate::transport) fn with_lobe(self, direction: Vec3, hit: &Hit) -> Self {
        Self { viewer: (-direction).to_array(), barycentrics: [hit.u, hit.v], ..self }
    }

    /// True if the record of this point is to have coefficients.
    pub fn has_lobe(&self) -> bool {
        self.viewer != [0.0; 3]
    }

    /// Position of the point.
    pub fn position(&self) -> Vec3 {
        self.position.into()
    }

    /// Query of this point to a cache.
    pub fn query(&self) -> QueryPoint {
        QueryPoint { position: self.position(), normal: self.normal(), within: self.within }
    }

    /// True if an overhang is so close that records with radii of `pixels` pixels are too coarse.
    pub fn is_confined(&self, pixels: f32) -> bool {
        self.within < OVERHANG_RADIUS_FACTOR * pixels * self.pixel
    }

    /// Shading normal.
    pub fn normal(&self) -> Vec3 {
        self.normal.into()
    }

    /// Width of a pixel at this point.
    pub fn pixel(&self) -> f32 {
        self.pixel
    }

    /// Gather ray along the unit vector `direction`, in world space.
    pub(in crate::transport) fn ray(&self, direction: Vec3) -> Ray {
        let geometric = Vec3::from(self.geometric_normal);
        let ray = Ray::new(self.position() + self.error * geometric, direction);
        // No light arrives from below the surface.
        if direction.dot(geometric) > 0.0 { ray } else { Ray { t_max: -1.0, ..ray } }
    }

    /// Path of a gather ray; its light belongs to stratum `index`.
    pub(in crate::transport) fn path(&self, pixel: u32, sample: u32, index: usize) -> PathState {
        PathState {
            position: self.position,
            segments: 2,
            triangle: self.triangle,
            ..PathState::new(pixel, index as u32, sample, PathClasses::REFLECTED)
        }
    }
}
