//! Rays from a surface point to a light, and what cut-outs on their way let through.

use crate::bsdf::Features;
use crate::bvh::Bvh;
use crate::geometry::{Hit, Ray};
use crate::light::LightSample;
use crate::scene::{Scene, SurfacePoint};
use crate::transport::estimator::MAX_CROSSINGS;
use crate::{Level, Rgb};
use glam::Vec3;

/// The ray that meets what hides the light of `sample` from `point`, and neither end. `None` where the light, moved off
/// its surface, is no longer on the side on which it was seen: rounding may put a point of a light's own back before it.
#[inline]
pub(in crate::transport) fn shadow_ray(point: &SurfacePoint, sample: &LightSample) -> Option<Ray> {
    if let Some(target) = sample.target {
        // Off the light's surface, to the side from which it is seen.
        let end = target.position + target.error * target.normal;
        let heights = [end - point.position, sample.direction].map(|to| to.dot(point.geometric_normal));
        return (heights[0] * heights[1] > 0.0).then(|| point.spawn_to(end));
    }
    if sample.distance < f32::INFINITY {
        return Some(point.spawn_to(point.position + sample.distance * sample.direction));
    }
    Some(point.spawn(sample.direction))
}

/// Fewer rays than this are followed one by one: a batch takes some time to set up.
pub(in crate::transport) const FEW: usize = 32;

/// What of `light` passes along `ray`, cut-outs included. `None` where there are too many of them. Counts the rays
/// that this takes.
pub(in crate::transport) fn passing<F: Features>(
    scene: &Scene,
    bvh: &Bvh,
    level: Level,
    mut ray: Ray,
    mut light: Rgb,
    rays: &mut u64,
) -> Option<Rgb> {
    for _ in 0..=MAX_CROSSINGS {
        *rays += 1;
        let hit = bvh.nearest(level, &ray);
        if !hit.is_some() {
            return Some(light);
        }
        let Some((rest, transmittance)) = pass_cutout::<F>(scene, &ray, &hit) else { return Some(Rgb::ZERO) };
        light *= transmittance;
        ray = rest;
    }
    None
}

/// Behind the surface that a shadow ray met: the rest of the ray, and the factor on its light. `None` where
/// nothing passes.
pub(in crate::transport) fn pass_cutout<F: Features>(
    scene: &Scene,
    ray: &Ray,
    hit: &Hit,
) -> Option<(Ray, f32)> {
    // Most are opaque, which is known before anything is computed.
    let triangle = scene.mesh.triangles.get(hit.triangle as usize)?;
    if !scene.materials.get(triangle.material as usize)?.has_cutout() {
        return None;
    }
    let point = SurfacePoint::at::<F>(scene, ray, hit)?;
    let opacity = point.material.opacity.at::<F>(scene, point.uv);
    let transmittance = 1.0 - opacity.clamp(0.0, 1.0);
    // What is no number lets nothing pass.
    (transmittance > 0.0).then(|| {
        let direction = Vec3::from(ray.direction);
        let rest = if ray.t_max == f32::INFINITY {
            point.spawn(direction)
        } else {
            point.spawn_to(Vec3::from(ray.origin) + direction)
        };
        (Ray { tag: ray.tag, ..rest }, transmittance)
    })
}
