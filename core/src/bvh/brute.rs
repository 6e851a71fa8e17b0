//! Scalar reference of ray tracing: one ray against every triangle of a mesh. Tests hold all tracing to it.

use super::references::hittable;
use super::traversal_ray::traceable;
use crate::geometry::{Hit, MISS, Ray};
use crate::scene::Mesh;
use halflight_simd::kernels::triangles::{self, Shear};

/// `(t, u, v)` of the intersection of the ray with a triangle at `0 <= t <= ray.t_max` (see
/// [`halflight_simd::kernels::triangles`]).
pub fn intersect(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<(f32, f32, f32)> {
    triangles::intersect(ray.origin, &Shear::new(ray.direction), ray.t_max, corners)
}

/// Nearest hit among all triangles and those of instances; among hits at equal distance the lowest index.
pub fn nearest(mesh: &Mesh, ray: &Ray) -> Hit {
    let mut best = Hit { t: ray.t_max, u: 0.0, v: 0.0, triangle: MISS };
    if !traceable(ray) {
        return Hit::NONE;
    }
    for triangle in 0..mesh.triangles.len() as u32 {
        if let Some(corners) = hittable(mesh, triangle)
            && let Some((t, u, v)) = intersect(ray, corners.map(|p| p.to_array()))
        {
            best.take(Hit { t, u, v, triangle });
        }
    }
    for instance in mesh.instances.placed {
        let local = nearest(&mesh.instances.prototype(instance.prototype()), &instance.local_ray(ray));
        if local.is_some() {
            let (u, v) = if instance.is_mirrored() { (local.v, local.u) } else { (local.u, local.v) };
            best.take(Hit { u, v, triangle: instance.first_triangle() + local.triangle, ..local });
        }
    }
    if best.is_some() { best } else { Hit::NONE }
}
