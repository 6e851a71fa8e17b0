//! The scalar truth: one ray against every triangle of a mesh. All tracing is tested against it.

use super::references::hittable;
use super::traversal_ray::traceable;
use crate::geometry::{Hit, MISS, Ray};
use crate::scene::Mesh;
use halflight_simd::kernels::triangles::{self, Shear};

/// `(t, u, v)` where the ray meets the triangle with these corners at `0 <= t <= ray.t_max`
/// (see [`halflight_simd::kernels::triangles`]).
pub fn intersect(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<(f32, f32, f32)> {
    triangles::intersect(ray.origin, &Shear::new(ray.direction), ray.t_max, corners)
}

/// The nearest hit among all triangles; of hits at the same distance, that of the lowest index.
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
    if best.is_some() { best } else { Hit::NONE }
}
