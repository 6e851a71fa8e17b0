//! The scalar truth: one ray against one triangle, and against every triangle of a mesh.
//! All tracing is tested against it.

use crate::geometry::{Hit, MISS, Ray};
use crate::scene::Mesh;

/// Watertight ray/triangle test (Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection").
///
/// Returns `(t, u, v)` with the barycentric weights of the second and third corner, for `0 <= t <= ray.t_max`.
/// Without fused operations: the edge functions of two triangles that share an edge cancel exactly.
pub fn intersect(ray: &Ray, corners: [[f32; 3]; 3]) -> Option<(f32, f32, f32)> {
    let d = ray.direction;
    // Dimension in which the direction is largest becomes z; the winding is kept by swapping x and y.
    let kz = if d[0].abs() > d[1].abs() {
        if d[0].abs() > d[2].abs() { 0 } else { 2 }
    } else if d[1].abs() > d[2].abs() {
        1
    } else {
        2
    };
    let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
    let (kx, ky) = if d[kz] < 0.0 { (ky, kx) } else { (kx, ky) };
    let (sx, sy, sz) = (d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]);

    // Corners relative to the origin, sheared so that the ray runs along +z.
    let relative = corners.map(|p| {
        let z = p[kz] - ray.origin[kz];
        [(p[kx] - ray.origin[kx]) - sx * z, (p[ky] - ray.origin[ky]) - sy * z, z]
    });
    let [a, b, c] = relative;

    // Scaled barycentric coordinates: signed areas opposite to a, b, c.
    let mut u = c[0] * b[1] - c[1] * b[0];
    let mut v = a[0] * c[1] - a[1] * c[0];
    let mut w = b[0] * a[1] - b[1] * a[0];
    if u == 0.0 || v == 0.0 || w == 0.0 {
        // On an edge in single precision: f64 products are exact.
        let area = |p: [f32; 3], q: [f32; 3]| (p[0] as f64 * q[1] as f64 - p[1] as f64 * q[0] as f64) as f32;
        (u, v, w) = (area(c, b), area(a, c), area(b, a));
    }
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = u + v + w;
    if !inside || det == 0.0 {
        return None;
    }
    let t = (u * (sz * a[2]) + v * (sz * b[2]) + w * (sz * c[2])) / det;
    let hit = t >= 0.0 && t <= ray.t_max;
    hit.then(|| (t, v / det, w / det))
}

/// The nearest hit among all triangles; of hits at the same distance, that of the lowest index.
pub fn nearest(mesh: &Mesh, ray: &Ray) -> Hit {
    let mut best = Hit { t: ray.t_max, u: 0.0, v: 0.0, triangle: MISS };
    for index in 0..mesh.triangles.len() as u32 {
        let corners = mesh.corners(index).map(|p| p.to_array());
        if let Some((t, u, v)) = intersect(ray, corners)
            && (t < best.t || best.triangle == MISS)
        {
            best = Hit { t, u, v, triangle: index };
        }
    }
    if best.is_some() { best } else { Hit::NONE }
}
