//! Radii of density estimates: a kernel covers a fixed number of pixels in the view of the camera. Density
//! estimation, vertex merging and the map of visible points share one schedule; passes scale it.

use crate::Level;
use crate::bvh::Bvh;
use crate::geometry::Bounds;
use crate::scene::{PixelWidth, Scene};
use core::f32::consts::PI;
use glam::Vec3;

/// Minimum camera distance of radii, since a surface in a mirror may lie near the camera: the lesser of
/// [`MIN_DISTANCE_IN_DIAGONALS`] diagonals of the scene and [`MIN_DISTANCE_OF_VISIBLE`] times the distance of
/// the nearest visible surface.
const MIN_DISTANCE_IN_DIAGONALS: f32 = 0.05;
const MIN_DISTANCE_OF_VISIBLE: f32 = 0.5;

/// Fraction of the scene's diagonal below which a surface is the one that the camera lies on.
const CONTACT: f32 = 1e-6;

/// Number of rays across and down that search for the nearest visible surface.
const RAYS_PER_SIDE: u32 = 32;

/// Shrinkage exponent a: with 2/3 both variance and squared bias fall as n^(-2/3).
const ALPHA: f64 = 2.0 / 3.0;

/// Kernel radius by distance: the width of a number of pixels at that distance from the camera.
#[derive(Clone, Copy, Debug)]
pub struct RadiusSchedule {
    eye: Vec3,
    /// Increase of the radius for a distance of 1.
    radius: f32,
    /// Radius at the camera: of parallel rays, above zero.
    at_eye: f32,
    nearest: f32,
}

impl RadiusSchedule {
    /// Schedule of one pixel in radius, for a picture of `scene` of `frame` pixels across and down.
    pub fn new((scene, bvh): (&Scene, &Bvh), frame: [u32; 2], level: Level) -> Self {
        let camera = &scene.camera;
        let mut seen = f32::INFINITY;
        for i in 0..RAYS_PER_SIDE * RAYS_PER_SIDE {
            let at = |i: u32, pixels: u32| (i as f32 + 0.5) * pixels as f32 / RAYS_PER_SIDE as f32;
            let (x, y) = (at(i % RAYS_PER_SIDE, frame[0]), at(i / RAYS_PER_SIDE, frame[1]));
            let ray = camera.ray(frame[0], frame[1], x, y, [0.5; 2]);
            let hit = bvh.nearest(level, &ray);
            let distance = hit.t * Vec3::from(ray.direction).length();
            let stands_on = distance < CONTACT * bvh.bounds().diagonal();
            seen = if hit.is_some() && !stands_on { seen.min(distance) } else { seen };
        }
        let nearest =
            (MIN_DISTANCE_IN_DIAGONALS * bvh.bounds().diagonal()).min(MIN_DISTANCE_OF_VISIBLE * seen);
        let PixelWidth { at_eye, per_length } = camera.pixel_width(frame[1].max(1));
        Self { eye: camera.eye, radius: per_length, at_eye, nearest }
    }

    /// Schedule of the same `radius` everywhere within `bounds`.
    pub fn constant(radius: f32, bounds: &Bounds) -> Self {
        // No place is farther from the centre.
        let nearest = bounds.diagonal().max(f32::MIN_POSITIVE);
        Self { eye: bounds.center(), radius: radius / nearest, at_eye: 0.0, nearest }
    }

    /// This schedule with a radius of `pixels` pixels.
    pub fn of_pixels(self, pixels: f32) -> Self {
        Self { radius: pixels * self.radius, at_eye: pixels * self.at_eye, ..self }
    }

    /// Schedule of a progressive method after `samples` samples; the first sample has a radius of `pixels`
    /// pixels.
    pub fn after(self, pixels: f64, samples: u32) -> Self {
        self.of_pixels((pixels * libm::sqrt(Self::shrinkage(samples))) as f32)
    }

    /// Squared radius after `samples` over the initial squared radius (Knaus and Zwicker 2011): r² (i + 1) =
    /// r² (i) (i + a) / (i + 1).
    pub fn shrinkage(samples: u32) -> f64 {
        (1..=samples).map(f64::from).fold(1.0, |squared, i| squared * (i + ALPHA) / (i + 1.0))
    }

    /// Kernel radius at `place`.
    #[inline]
    pub fn radius(&self, place: Vec3) -> f32 {
        self.at_eye + self.radius * place.distance(self.eye).max(self.nearest)
    }

    /// Kernel radius at `place` for a path of length `travelled` from the camera: a surface in a mirror
    /// appears as small as the whole path is long. MIS weights use the place alone.
    #[inline]
    pub(in crate::transport) fn radius_after(&self, travelled: f32, place: Vec3) -> f32 {
        self.radius(place).max(self.at_eye + self.radius * travelled)
    }

    /// π² r² N: R of a path without vertices in between, for emission with a density of one.
    #[inline]
    pub(in crate::transport) fn merge_factor(&self, place: Vec3, paths: f32) -> f32 {
        let radius = PI * self.radius(place);
        radius * radius * paths
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_shrink_as_a_power_of_the_samples() {
        let shrinkage = RadiusSchedule::shrinkage;
        assert_eq!(shrinkage(0), 1.0);
        assert!((shrinkage(1) - (1.0 + ALPHA) / 2.0).abs() < 1e-12);
        // Γ(n + a) / (Γ(1 + a) Γ(n + 1)), which goes like n^(a - 1) / Γ(5/3).
        let expected = 64f64.powf(ALPHA - 1.0) / 0.902_745_293;
        assert!((shrinkage(63) / expected - 1.0).abs() < 0.005, "{}", shrinkage(63));
    }
}
