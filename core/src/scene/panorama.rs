//! Panorama: columns are longitudes and rows are polar angles, as in an environment map. From the inside the
//! longitude rises to the right.

use super::{Camera, Projection};
use crate::geometry::Ray;
use crate::sampling::sin_cos_turns;
use core::f32::consts::{PI, TAU};
use glam::{Vec2, Vec3};

impl Camera {
    /// Ray of a panorama through a point of the picture.
    #[inline]
    pub(super) fn ray_of_panorama(&self, [width, height]: [u32; 2], [x, y]: [f32; 2]) -> Ray {
        // Half a turn from the left border to `forward`.
        let (sin_phi, cos_phi) = sin_cos_turns(x / width as f32);
        let (sin, cos) = sin_cos_turns(0.5 * y / height as f32);
        let level = -cos_phi * self.forward - sin_phi * self.right;
        Ray::new(self.eye, (sin * level + cos * self.up).normalize())
    }

    /// Projection of `point` to a panorama; `None` for the eye itself.
    #[inline]
    pub(super) fn project_to_panorama(&self, [width, height]: [u32; 2], point: Vec3) -> Option<Projection> {
        let to_point = point - self.eye;
        let distance = to_point.length();
        if !(distance > 0.0 && distance < f32::INFINITY) {
            return None;
        }
        let direction = to_point / distance;
        let [x, y, z] = [self.right, self.up, self.forward].map(|axis| direction.dot(axis));
        let sin = libm::sqrtf(x * x + z * z);
        let raster = Vec2::new(
            (0.5 + libm::atan2f(x, z) * (1.0 / TAU)) * width as f32,
            libm::atan2f(sin, y) * (1.0 / PI) * height as f32,
        );
        // dω = 2π² sin θ du dv.
        (sin > 0.0).then(|| Projection { raster, direction, distance, pdf: 1.0 / (TAU * PI * sin) })
    }
}
