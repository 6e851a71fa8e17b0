//! Parallel projection: rays along `forward` from the plane through the eye. With a lens they start at a disc
//! around their place on the plane, and meet on the plane of focus.

use super::{Camera, CameraKind, PixelWidth, Projection};
use crate::geometry::Ray;
use crate::sampling::warp::concentric_disk;
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

impl Camera {
    /// This camera with parallel rays, and a picture of so many lengths in height.
    pub fn orthographic(self, height: f32) -> Self {
        Self { kind: CameraKind::Orthographic { half_height: 0.5 * height }, start: None, ..self }
    }

    /// This camera with rays in all directions and without a lens.
    pub fn panorama(self) -> Self {
        Self { kind: CameraKind::Panorama, lens_radius: 0.0, start: None, ..self }
    }

    /// The point from which the camera sees `point` through the middle of its lens.
    #[inline]
    pub fn origin_towards(&self, point: Vec3) -> Vec3 {
        match self.kind {
            CameraKind::Orthographic { .. } => point - (point - self.eye).dot(self.forward) * self.forward,
            CameraKind::Perspective | CameraKind::Panorama => self.eye,
        }
    }

    /// Width of a pixel of a picture of `height` pixels: in the middle of a perspective, along a meridian of
    /// a panorama.
    pub fn pixel_width(&self, height: u32) -> PixelWidth {
        let (height, none) = (height as f32, PixelWidth { at_eye: 0.0, per_length: 0.0 });
        match self.kind {
            CameraKind::Perspective => PixelWidth { per_length: 2.0 * self.tan_half_fov / height, ..none },
            CameraKind::Orthographic { half_height } => {
                PixelWidth { at_eye: 2.0 * half_height / height, ..none }
            }
            CameraKind::Panorama => PixelWidth { per_length: PI / height, ..none },
        }
    }

    /// Offset on the lens, and the unit direction of rays through it.
    #[inline]
    fn through_lens(&self, lens: [f32; 2]) -> (Vec2, Vec3) {
        if self.lens_radius > 0.0 {
            let offset = self.lens_radius * concentric_disk(lens);
            let towards = self.focus_distance * self.forward - offset.x * self.right - offset.y * self.up;
            return (offset, towards.normalize());
        }
        (Vec2::ZERO, self.forward)
    }

    #[inline]
    pub(super) fn parallel_ray(
        &self,
        half_height: f32,
        [width, height]: [u32; 2],
        [x, y]: [f32; 2],
        lens: [f32; 2],
    ) -> Ray {
        let pixel = 2.0 * half_height / height as f32;
        let film = Vec2::new(x - 0.5 * width as f32, 0.5 * height as f32 - y) * pixel;
        let (offset, direction) = self.through_lens(lens);
        let at = film + offset;
        Ray::new(self.eye + at.x * self.right + at.y * self.up, direction)
    }

    #[inline]
    pub(super) fn project_parallel(
        &self,
        half_height: f32,
        [width, height]: [u32; 2],
        point: Vec3,
        lens: [f32; 2],
    ) -> Option<Projection> {
        let pixel = 2.0 * half_height / height as f32;
        let (offset, direction) = self.through_lens(lens);
        let (beside, cos) = (point - self.eye, direction.dot(self.forward));
        let depth = beside.dot(self.forward);
        let distance = depth / cos;
        if !(depth > 0.0 && distance < f32::INFINITY) {
            return None;
        }
        let start = beside - distance * direction;
        let film = Vec2::new(start.dot(self.right), start.dot(self.up)) - offset;
        let raster = Vec2::new(0.5 * width as f32 + film.x / pixel, 0.5 * height as f32 - film.y / pixel);
        // The plane has the density 1 / area, a plane across the rays that over their cosine.
        let area = pixel * pixel * (width as f32 * height as f32);
        let pdf = distance * (distance / (area * cos));
        Some(Projection { raster, direction, distance, pdf })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> [Camera; 3] {
        let eye = Vec3::new(1.0, 2.0, 3.0);
        let mut camera = Camera::look_at(eye, Vec3::ZERO, Vec3::Z, 50.0);
        camera.focus_distance = 4.0;
        let parallel = camera.orthographic(2.5);
        [parallel, Camera { lens_radius: 0.3, ..parallel }, camera.panorama()]
    }

    #[test]
    fn projection_inverts_the_ray() {
        for camera in cameras() {
            for raster in [[12.5, 40.25], [99.0, 1.0], [50.0, 25.0], [0.25, 49.5]] {
                let lens = [0.8, 0.3];
                let ray = camera.ray(100, 50, raster[0], raster[1], lens);
                assert!((Vec3::from(ray.direction).length() - 1.0).abs() < 1e-6);
                let seen = camera.project(100, 50, ray.at(7.0), lens).unwrap();
                assert!(seen.raster.distance(raster.into()) < 1e-3, "{camera:?} {raster:?} {seen:?}");
                assert!((seen.distance - 7.0).abs() < 1e-4);
                assert!(seen.direction.distance(ray.direction.into()) < 1e-6);
            }
        }
        for camera in &cameras()[..2] {
            assert_eq!(camera.project(100, 50, Vec3::new(2.0, 4.0, 6.0), [0.5; 2]), None, "behind it");
        }
    }

    /// The density is that of the points which the rays of a small square of the picture pierce.
    #[test]
    fn density_is_that_of_rays() {
        const STEP: f32 = 0.25;
        for camera in cameras() {
            let at = |x, y| camera.ray(100, 50, x, y, [0.8, 0.3]).at(7.0);
            let (x, y) = (31.0, 14.0);
            let [across, down] = [at(x + STEP, y) - at(x - STEP, y), at(x, y + STEP) - at(x, y - STEP)];
            let seen = camera.project(100, 50, at(x, y), [0.8, 0.3]).unwrap();
            // Area across the ray of the square, of 2 STEP pixels a side.
            let area = across.cross(down).dot(seen.direction).abs();
            let expected = (2.0 * STEP) * (2.0 * STEP) / (100.0 * 50.0) / area;
            let density = seen.pdf / seen.distance / seen.distance;
            assert!((density / expected - 1.0).abs() < 2e-3, "{camera:?}: {density} {expected}");
        }
    }

    #[test]
    fn widths_of_pixels_are_distances_of_rays() {
        for camera in cameras() {
            let at = |y| camera.ray(100, 50, 50.0, y, [0.5; 2]).at(7.0);
            let width = camera.pixel_width(50);
            let expected = at(24.5).distance(at(25.5));
            assert!((width.at_eye + 7.0 * width.per_length - expected).abs() < 1e-3 * expected);
        }
    }
}
