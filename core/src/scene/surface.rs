//! Surface interaction at a hit: position with an error bound, normals, texture coordinates, and rays that
//! leave the surface without hitting it again. Blocks of them are computed in lanes, with the same bits
//! (`halflight_simd::kernels::shade::surface`).

use super::placed::PlacedTriangle;
use super::{Attributes, Material, NormalMap, Scene, Triangle};
use crate::features::Features;
use crate::geometry::{Frame, Hit, Ray};
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::surface::{ERROR_UNITS, MAX_SLENDERNESS, MIN_VIEW_COSINE, SAFE_SQUARES};

/// Surface data for shading. Both normals are on the side of the viewer.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<'a> {
    /// Interpolated from the corners, which is more precise than `ray.at(t)`.
    pub position: Vec3,
    /// Bound of the distance between `position` and the triangle as the tracer computes it.
    pub error: f32,
    /// Unit normal of the triangle.
    pub geometric_normal: Vec3,
    /// Shading frame: interpolated normal, normal or bump map. Its z axis is never turned away from the
    /// viewer.
    pub frame: Frame,
    /// Attributes of the vertices; none in scenes without textures and vertex colours.
    pub attributes: Attributes,
    /// True if the viewer is on the side from which the triangle is counter-clockwise.
    pub front: bool,
    /// Material of the triangle.
    pub material: &'a Material,
    /// Index of the triangle.
    pub triangle: u32,
}

impl<'a> SurfacePoint<'a> {
    /// Point of `hit`, seen along `ray`. `None` if the scene has no such triangle or material, or the
    /// triangle has no area: the tracer returns no such hit.
    #[inline]
    pub fn at<F: Features>(scene: &Scene<'a>, ray: &Ray, hit: &Hit) -> Option<Self> {
        let mesh = &scene.mesh;
        let of_instance;
        let (triangle, positions, normals, texcoords, more_error) =
            match mesh.triangles.get(hit.triangle as usize) {
                Some(triangle) => (*triangle, mesh.positions, mesh.normals, mesh.texcoords, 0.0),
                None => {
                    of_instance = mesh.placed_triangle(hit.triangle)?;
                    let PlacedTriangle { positions, normals, texcoords, material, error } = &of_instance;
                    let triangle = Triangle { vertices: [0, 1, 2], material: *material };
                    (triangle, &positions[..], &normals[..], &texcoords[..], *error)
                }
            };
        let material = scene.materials.get(triangle.material as usize)?;
        let [p0, p1, p2] = corners(positions, triangle.vertices)?;
        let (u, v) = (hit.u, hit.v);
        let w = 1.0 - u - v;
        let position = w * p0 + u * p1 + v * p2;

        let (e1, e2) = (p1 - p0, p2 - p0);
        let (normal, slenderness) = unit_normal(e1, e2)?;
        // Scale-free: proportional to the coordinates and edges, without absolute terms.
        let coordinates = (w * p0.abs() + u * p1.abs() + v * p2.abs()).max_element();
        let reach = e1.abs().max(e2.abs()).max_element();
        let error = ERROR_UNITS * (coordinates + reach * slenderness.min(MAX_SLENDERNESS)) + more_error;

        let to_viewer = -Vec3::from(ray.direction);
        let front = normal.dot(to_viewer) >= 0.0;

        let mut shading = normal;
        if !normals.is_empty() {
            shading = interpolated_normal(normals, triangle.vertices, [w, u, v]).unwrap_or(normal);
            // Flipped normals of a file still describe the curvature of the surface.
            if shading.dot(normal) < 0.0 {
                shading = -shading;
            }
        }
        let mut attributes = Attributes::NONE;
        let mut bent = false;
        if (F::TEXTURES || F::NORMAL_MAPS || F::CUTOUT) && scene.has_attributes() {
            let t = texture_corners(texcoords, triangle.vertices);
            attributes.uv[0] = w * t[0] + u * t[1] + v * t[2];
            if mesh.has_more_attributes() {
                mesh.add_attributes(hit.triangle, [u, v], &mut attributes);
            }
            if F::NORMAL_MAPS
                && let Some(map) = material.normal_map
            {
                let sides = [t[1] - t[0], t[2] - t[0]];
                let of_texture = (&attributes, sides, hit.triangle);
                shading = mapped_normal(scene, map, of_texture, shading, [e1, e2]).unwrap_or(shading);
                bent = true;
            }
        }
        let side = if front { 1.0 } else { -1.0 };
        let geometric_normal = side * normal;
        shading *= side;
        // An interpolated normal that faces away from the viewer is turned just far enough to face it.
        if bent || !normals.is_empty() {
            let cos = shading.dot(to_viewer);
            let lowest = MIN_VIEW_COSINE.min(geometric_normal.dot(to_viewer));
            if cos < lowest {
                let turned = shading + (lowest - cos) * to_viewer;
                shading = turned.try_normalize().unwrap_or(geometric_normal);
            }
        }
        let frame = Frame::from_normal(shading);
        Some(Self {
            position,
            error,
            geometric_normal,
            frame,
            attributes,
            front,
            material,
            triangle: hit.triangle,
        })
    }

    /// True if a direction, in the shading frame and in the world, is on the same side of the geometric and
    /// of the shading normal. Otherwise no light passes.
    #[inline]
    pub fn sides_agree(&self, local: Vec3, world: Vec3) -> bool {
        local.z * world.dot(self.geometric_normal) > 0.0
    }

    /// Ray that leaves the surface along `direction`, offset to that side.
    #[inline]
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray::new(self.origin(direction), direction)
    }

    /// True if `ray`, which hit this point, started at the surface within rounding and leaves its front. A
    /// camera on a wall is in front of it.
    #[inline]
    pub fn is_left_by(&self, ray: &Ray) -> bool {
        !self.front && Vec3::from(ray.origin).distance(self.position) <= STARTS_HERE * self.error
    }

    /// Ray to `target`, a point without extent or one already offset from its surface. Its `t_max` is just
    /// below 1, the `t` of the target.
    #[inline]
    pub fn spawn_to(&self, target: Vec3) -> Ray {
        let origin = self.origin(target - self.position);
        Ray::segment(origin, target - origin, 1.0 - f32::EPSILON)
    }

    /// `position`, offset from the surface by its error bound to the side of `direction`.
    #[inline]
    fn origin(&self, direction: Vec3) -> Vec3 {
        let step = self.error.copysign(direction.dot(self.geometric_normal));
        self.position + step * self.geometric_normal
    }
}

/// Distance within which a ray starts at a point, in error bounds: the bound of the point, that of the
/// origin, and twice as much for a corner, where the ray has just left another surface.
const STARTS_HERE: f32 = 4.0;

#[inline]
fn corners(positions: &[[f32; 3]], [a, b, c]: [u32; 3]) -> Option<[Vec3; 3]> {
    let at = |i: u32| positions.get(i as usize).map(|&p| Vec3::from(p));
    Some([at(a)?, at(b)?, at(c)?])
}

#[inline]
fn texture_corners(texcoords: &[[f32; 2]], vertices: [u32; 3]) -> [Vec2; 3] {
    vertices.map(|i| texcoords.get(i as usize).copied().unwrap_or_default().into())
}

/// Unit normal of a triangle with edges `e1` and `e2`, and its slenderness: the square of its length over
/// twice its area.
#[inline(always)]
fn unit_normal(e1: Vec3, e2: Vec3) -> Option<(Vec3, f32)> {
    let cross = e1.cross(e2);
    let square = cross.length_squared();
    if SAFE_SQUARES.contains(&square) {
        let inverse = 1.0 / libm::sqrtf(square);
        return Some((cross * inverse, e1.length_squared().max(e2.length_squared()) * inverse));
    }
    rescaled_unit_normal(e1, e2)
}

/// [`unit_normal`] of a very small, very large, very slender or degenerate triangle: rescaled by its size,
/// twice.
#[cold]
fn rescaled_unit_normal(e1: Vec3, e2: Vec3) -> Option<(Vec3, f32)> {
    let size = power_of_two_near(e1.abs().max(e2.abs()).max_element())?;
    let (e1, e2) = (e1 * size, e2 * size);
    let cross = e1.cross(e2);
    let width = power_of_two_near(cross.abs().max_element())?;
    let inverse = 1.0 / (cross * width).length();
    let longest = e1.length_squared().max(e2.length_squared());
    Some((cross * width * inverse, longest * width * inverse))
}

/// Power of two whose product with `x` is about 1. It is exact, so that scaled scenes give the same bits.
#[inline]
fn power_of_two_near(x: f32) -> Option<f32> {
    if !(x > 0.0 && x < f32::INFINITY) {
        return None;
    }
    let exponent = ((x.to_bits() >> 23) as i32).clamp(1, 253);
    Some(f32::from_bits(((254 - exponent) as u32) << 23))
}

/// Interpolated unit normal; `None` if a corner has none or if they cancel.
#[inline]
fn interpolated_normal(normals: &[[f32; 3]], vertices: [u32; 3], weights: [f32; 3]) -> Option<Vec3> {
    let mut sum = Vec3::ZERO;
    for (&vertex, weight) in vertices.iter().zip(weights) {
        let normal = Vec3::from(*normals.get(vertex as usize)?);
        if normal == Vec3::ZERO {
            return None;
        }
        sum += weight * normal;
    }
    let square = sum.length_squared();
    SAFE_SQUARES.contains(&square).then(|| sum * (1.0 / libm::sqrtf(square)))
}

/// Perturbation of `normal` by a map. `edges` and `sides` are two edges of the triangle in space and in
/// texture coordinates of the first set. `None` if the texture coordinates are degenerate.
fn mapped_normal(
    scene: &Scene,
    map: NormalMap,
    (attributes, sides, triangle): (&Attributes, [Vec2; 2], u32),
    normal: Vec3,
    edges: [Vec3; 2],
) -> Option<Vec3> {
    let (texture, local) = match map {
        NormalMap::Tangent(id, factor) => {
            let texture = scene.textures.get(id.0 as usize)?;
            let [x, y, z, _] = texture.lookup(texture.uv(attributes));
            let local = 2.0 * Vec3::new(x, y, z) - Vec3::ONE;
            (texture, Vec3::new(factor * local.x, factor * local.y, local.z))
        }
        NormalMap::Height(id, factor) => {
            let texture = scene.textures.get(id.0 as usize)?;
            let slope = texture.gradient(texture.uv(attributes)) * factor;
            (texture, Vec3::new(-slope.x, -slope.y, 1.0))
        }
    };
    let sides = if texture.second_set { scene.mesh.second_sides(triangle) } else { sides };
    // A mirrored texture mirrors the directions of its normals.
    let mirrored = Vec2::ONE.copysign(texture.transform.scale);
    let local = Vec3::new(mirrored.x * local.x, mirrored.y * local.y, local.z);
    // dp/du from the two edges, made orthogonal to the normal. A mirrored chart flips the bitangent.
    let determinant = sides[0].perp_dot(sides[1]);
    let along_u = (edges[0] * sides[1].y - edges[1] * sides[0].y) * 1f32.copysign(determinant);
    let tangent = (along_u - normal.dot(along_u) * normal).try_normalize()?;
    let bitangent = normal.cross(tangent) * 1f32.copysign(determinant);
    (local.x * tangent + local.y * bitangent + local.z * normal).try_normalize()
}
