//! Paths that end where photons lie: reflected light by the density of photons, direct light by shadow rays.

use super::shoot::holds_photons;
use crate::bsdf::{Bsdf, Features};
use crate::bvh::{Bvh, Coherence};
use crate::camera::Camera;
use crate::geometry::{Hit, Ray};
use crate::photon::{Disc, Falloff, Fence, PROBES, PhotonMap, Uniform};
use crate::scene::SurfacePoint;
use crate::{Level, Rgb};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Cosine below which that of a photon counts as this: its direction is not known better.
const GRAZING: f32 = 0.01;

/// The least distance from the eye by which radii are reckoned, in diagonals of the scene: what is seen through a
/// mirror may lie near the eye.
const NEAREST: f32 = 0.05;

/// How steeply probes for walls rise from the surface: what is lower than that is a step, not a wall, and what the
/// surface bends less is none either.
const LIFT: f32 = 0.1;

/// A photon map as paths from the eye use it.
#[derive(Clone, Copy)]
pub struct PhotonLight<'a> {
    map: &'a PhotonMap<'a>,
    eye: Vec3,
    /// Of discs, at distance one from the eye.
    radius: f32,
    nearest: f32,
}

impl<'a> PhotonLight<'a> {
    /// For a picture of `height` rows of a scene of that `diagonal`. Discs are `pixels` in radius.
    pub fn new(map: &'a PhotonMap<'a>, camera: &Camera, height: u32, diagonal: f32, pixels: f32) -> Self {
        let radius = pixels * 2.0 * camera.tan_half_fov / height.max(1) as f32;
        Self { map, eye: camera.eye, radius, nearest: NEAREST * diagonal }
    }

    /// The reflected light that `point` sends to `wo`, itself reflected; `None` where no photons are left on such a
    /// surface. `turns`, from 0 to 1, turns the probes for walls. Those are not counted as rays.
    #[inline]
    pub(super) fn reflected<F: Features>(
        &self,
        (bvh, level): (&Bvh, Level),
        point: &SurfacePoint,
        bsdf: &Bsdf,
        wo: Vec3,
        turns: f32,
    ) -> Option<Rgb> {
        if !holds_photons(bsdf) {
            return None;
        }
        let distance = point.position.distance(self.eye).max(self.nearest);
        let disc = Disc {
            place: point.position,
            normal: point.geometric_normal,
            radius: self.radius * distance,
            falloff: Falloff::Epanechnikov,
        };
        let fence = fence(bvh, level, point, disc.radius, turns);
        let is_flat = point.frame.normal == point.geometric_normal;
        if let (Bsdf::Diffuse(diffuse), true) = (bsdf, is_flat) {
            let response = Uniform(diffuse.reflectance * FRAC_1_PI);
            return Some(self.map.gather_within(level, &disc, &fence, &response).radiance);
        }
        // A photon's power has met the triangle: the cosine is in it already, and that of the triangle's normal.
        let response = |from: Vec3| {
            let wi = point.frame.to_local(from);
            if !point.sides_agree(wi, from) {
                return Rgb::ZERO;
            }
            bsdf.evaluate::<F>(wo, wi).0 / from.dot(point.geometric_normal).abs().max(GRAZING)
        };
        Some(self.map.gather_within(level, &disc, &fence, &response).radiance)
    }
}

/// Looks for walls around `point`, up to `radius`.
fn fence(bvh: &Bvh, level: Level, point: &SurfacePoint, radius: f32, turns: f32) -> Fence {
    let (ways, fence) = Fence::probes(point.geometric_normal, turns);
    let probe = |way: Vec3| {
        let way = way + LIFT * point.geometric_normal;
        Ray { t_max: Fence::FARTHEST * radius, ..point.spawn(way) }
    };
    let mut hits = [Hit::NONE; PROBES];
    bvh.nearest_batch(level, &ways.map(probe), Coherence::Incoherent, &mut hits);
    fence(hits.map(|hit| if hit.is_some() { hit.t / radius } else { f32::INFINITY }))
}
