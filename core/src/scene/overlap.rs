//! Triangles that overlap in one plane: sheets with a material on each side, and surfaces that lie on others.
//! Rounding decides which of them a ray meets first, so the visible one is chosen after the hit.

use super::Scene;
use crate::geometry::{Hit, Ray};
use glam::Vec3;
use halflight_simd::kernels::triangles::{Shear, intersect};

/// A triangle, and another that overlaps it in its plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Overlap {
    /// Index of the triangle.
    pub triangle: u32,
    /// Index of the other.
    pub other: u32,
    /// True if their fronts are on the same side.
    pub same_front: bool,
}

impl Scene<'_> {
    /// The visible hit where triangles overlap: one whose front faces the ray before the others, then a lamp,
    /// then one without cut-outs, then the first of the mesh.
    pub fn visible_hit(&self, ray: &Ray, hit: Hit) -> Hit {
        // Triangles of an instance overlap others of the same instance.
        let (all, local) = match self.mesh.instance_of(hit.triangle) {
            None => (self.mesh.overlaps, hit.triangle),
            Some((_, prototype, local)) => (prototype.overlaps, local),
        };
        let base = hit.triangle - local;
        let first = all.partition_point(|overlap| overlap.triangle < local);
        let mut overlaps = all.iter().skip(first).take_while(|overlap| overlap.triangle == local).peekable();
        if overlaps.peek().is_none() {
            return hit;
        }
        let (mut best, mut best_rank) = (hit, self.rank(ray, hit.triangle));
        let is_front = !best_rank.0;
        for &Overlap { other, same_front, .. } in overlaps {
            if is_front && !same_front {
                continue;
            }
            let other = base + other;
            let rank = self.rank(ray, other);
            if rank < best_rank {
                let corners = self.mesh.corners(other).map(|p| p.to_array());
                let shear = Shear::new(ray.direction);
                if let Some((_, u, v)) = intersect(ray.origin, &shear, f32::INFINITY, corners) {
                    (best, best_rank) = (Hit { t: hit.t, u, v, triangle: other }, rank);
                }
            }
        }
        best
    }

    /// The triangle of lowest rank is visible.
    fn rank(&self, ray: &Ray, index: u32) -> (bool, bool, bool, u32) {
        let [a, b, c] = self.mesh.corners(index);
        let is_back = (b - a).cross(c - a).dot(Vec3::from(ray.direction)) > 0.0;
        let material = self.mesh.material(index).and_then(|material| self.materials.get(material as usize));
        let is_lamp = material.is_some_and(|material| material.emits());
        (is_back, !is_lamp, material.is_some_and(|material| material.has_cutout()), index)
    }
}

#[cfg(test)]
mod tests {
    use crate::Rgb;
    use crate::geometry::{Hit, Ray};
    use crate::scene::{Camera, Material, Mesh, Overlap, Scene, Triangle};
    use glam::Vec3;

    /// Front 0 and back 1 of a triangle, and a smaller triangle 2 that lies on the front.
    const POSITIONS: [[f32; 3]; 6] =
        [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 0.], [0.5, 0., 0.], [0., 0.5, 0.]];
    const OVERLAPS: [Overlap; 6] = {
        const fn overlap(triangle: u32, other: u32, same_front: bool) -> Overlap {
            Overlap { triangle, other, same_front }
        }
        [
            overlap(0, 1, false),
            overlap(0, 2, true),
            overlap(1, 0, false),
            overlap(1, 2, false),
            overlap(2, 0, true),
            overlap(2, 1, false),
        ]
    };

    fn visible(materials: [Material; 3], ray: &Ray, from: u32) -> u32 {
        let vertices = [[0, 1, 2], [2, 1, 0], [3, 4, 5]];
        let triangles = [0, 1, 2].map(|i| Triangle { vertices: vertices[i], material: i as u32 });
        let mesh =
            Mesh { positions: &POSITIONS, triangles: &triangles, overlaps: &OVERLAPS, ..Mesh::default() };
        let camera = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0);
        let scene =
            Scene { mesh, materials: &materials, textures: &[], lights: &[], environment: None, camera };
        let hit = scene.visible_hit(ray, Hit { t: 1.0, u: 0.25, v: 0.25, triangle: from });
        // The point of the hit is the same in all of them.
        let [a, b, c] = scene.mesh.corners(hit.triangle);
        let point = (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c;
        if hit.triangle != from {
            assert!(point.distance(ray.at(1.0)) < 1e-6 && hit.t == 1.0, "{hit:?} {point}");
        }
        hit.triangle
    }

    fn ray(x: f32, from: f32) -> Ray {
        Ray::new(Vec3::new(x, 0.1, from), Vec3::new(0.0, 0.0, -from))
    }

    #[test]
    fn front_that_faces_the_ray_is_visible_then_lamps_then_the_first() {
        let plain = Material::diffuse(Rgb::ONE);
        let lamp = Material { emission: Rgb::ONE.into(), ..plain };
        let cut_out = Material { opacity: 0.5.into(), ..plain };
        for from in 0..3 {
            assert_eq!(visible([plain; 3], &ray(0.1, 1.0), from), 0);
            assert_eq!(visible([plain; 3], &ray(0.1, -1.0), from), 1);
            assert_eq!(visible([plain, lamp, lamp], &ray(0.1, 1.0), from), 2);
            assert_eq!(visible([cut_out, plain, plain], &ray(0.1, 1.0), from), 2);
            assert_eq!(visible([lamp, cut_out, plain], &ray(0.1, -1.0), from), 1);
        }
        // Outside of the smaller triangle.
        for from in 0..2 {
            assert_eq!(visible([plain, plain, lamp], &ray(0.7, 1.0), from), 0);
        }
        assert_eq!(visible([plain; 3], &ray(0.1, 1.0), crate::geometry::MISS), crate::geometry::MISS);
    }
}
