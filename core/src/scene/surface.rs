//! The point where a ray met a triangle: position with a bound of its error, normals, texture coordinates;
//! and rays that leave it without meeting it again.

use super::{Material, NormalMap, Scene};
use crate::features::Features;
use crate::geometry::{Frame, Hit, Ray};
use glam::{Vec2, Vec3};

/// What is needed of a surface to shade it. Both normals are on the side of the viewer.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<'a> {
    /// Interpolated from the corners, which is more precise than a step along the ray.
    pub position: Vec3,
    /// Bound of the distance between `position` and the triangle as the tracer sees it.
    pub error: f32,
    /// Unit normal of the triangle.
    pub geometric_normal: Vec3,
    /// The shading frame: interpolated normal, normal or bump map. z is never turned away from the viewer.
    pub frame: Frame,
    /// Texture coordinates; zero in scenes without textures.
    pub uv: Vec2,
    /// Whether the viewer is on the side from which the triangle winds counter-clockwise.
    pub front: bool,
    /// What the triangle is made of.
    pub material: &'a Material,
    /// Index of the triangle.
    pub triangle: u32,
}

/// The bound of the error counts in this many units in the last place: five roundings of the sum of three
/// products, as many in the tracer's differences and shears, and one of the step itself, rounded up.
const ERROR_UNITS: f32 = 16.0 * 0.5 * f32::EPSILON;

/// The tracer's distances err by the length of a triangle times its slenderness; what is more slender than
/// this counts as this, so that needles do not push rays far off.
const SLENDEREST: f32 = 16.0;

/// Squares outside of this range lose bits to underflow or overflow.
const SAFE_SQUARES: core::ops::Range<f32> = 1e-24..1e24;

/// The shading normal is turned until the viewer stands this high above its horizon (a cosine).
const LOWEST_VIEW: f32 = 1e-3;

impl<'a> SurfacePoint<'a> {
    /// The point of `hit`, seen by `ray`. `None` where the scene has no such triangle or material, or the
    /// triangle has no area: nothing that the tracer returns.
    #[inline]
    pub fn at<F: Features>(scene: &Scene<'a>, ray: &Ray, hit: &Hit) -> Option<Self> {
        let mesh = &scene.mesh;
        let triangle = mesh.triangles.get(hit.triangle as usize)?;
        let material = scene.materials.get(triangle.material as usize)?;
        let [p0, p1, p2] = corners(mesh.positions, triangle.vertices)?;
        let (u, v) = (hit.u, hit.v);
        let w = 1.0 - u - v;
        let position = w * p0 + u * p1 + v * p2;

        let (e1, e2) = (p1 - p0, p2 - p0);
        let (normal, slenderness) = unit_normal(e1, e2)?;
        // Scale-free: proportional to the coordinates and to the edges, nothing absolute.
        let coordinates = (w * p0.abs() + u * p1.abs() + v * p2.abs()).max_element();
        let reach = e1.abs().max(e2.abs()).max_element();
        let error = ERROR_UNITS * (coordinates + reach * slenderness.min(SLENDEREST));

        let to_viewer = -Vec3::from(ray.direction);
        let front = normal.dot(to_viewer) >= 0.0;

        let mut shading = normal;
        if !mesh.normals.is_empty() {
            shading = interpolated_normal(mesh.normals, triangle.vertices, [w, u, v]).unwrap_or(normal);
            // Normals that a file gives the wrong way round still say how the surface bends.
            if shading.dot(normal) < 0.0 {
                shading = -shading;
            }
        }
        let mut uv = Vec2::ZERO;
        let mut bent = false;
        if F::TEXTURES || F::NORMAL_MAPS || F::CUTOUT {
            let t = texture_corners(mesh.texcoords, triangle.vertices);
            uv = w * t[0] + u * t[1] + v * t[2];
            if F::NORMAL_MAPS
                && let Some(map) = material.normal_map
            {
                let sides = [t[1] - t[0], t[2] - t[0]];
                shading = mapped_normal(scene, map, uv, shading, [e1, e2], sides).unwrap_or(shading);
                bent = true;
            }
        }
        let side = if front { 1.0 } else { -1.0 };
        let geometric_normal = side * normal;
        shading *= side;
        // Where the interpolated normal looks away from the viewer, it is turned just enough to look back.
        if bent || !mesh.normals.is_empty() {
            let cos = shading.dot(to_viewer);
            let lowest = LOWEST_VIEW.min(geometric_normal.dot(to_viewer));
            if cos < lowest {
                let turned = shading + (lowest - cos) * to_viewer;
                shading = turned.try_normalize().unwrap_or(geometric_normal);
            }
        }
        let frame = Frame::from_normal(shading);
        Some(Self { position, error, geometric_normal, frame, uv, front, material, triangle: hit.triangle })
    }

    /// Whether a direction, given in the shading frame and in the world, is on the same side of the triangle
    /// as of its shading normal: no light passes where the two disagree.
    #[inline]
    pub fn sides_agree(&self, local: Vec3, world: Vec3) -> bool {
        local.z * world.dot(self.geometric_normal) > 0.0
    }

    /// The ray that leaves the surface into `direction`, on the side to which that points.
    #[inline]
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray::new(self.origin(direction), direction)
    }

    /// Whether `ray`, which met this point, started on the surface as far as rounding can tell, and leaves
    /// its front. A camera on a wall stands before it.
    #[inline]
    pub fn is_left_by(&self, ray: &Ray) -> bool {
        !self.front && Vec3::from(ray.origin).distance(self.position) <= STARTS_HERE * self.error
    }

    /// The ray from here to `target`, a point without extent or one already moved off its surface: `t_max`
    /// is just below 1 at the target.
    #[inline]
    pub fn spawn_to(&self, target: Vec3) -> Ray {
        let origin = self.origin(target - self.position);
        Ray::segment(origin, target - origin, 1.0 - f32::EPSILON)
    }

    /// `position`, moved off the surface to the side of `direction` by the bound of its error.
    #[inline]
    fn origin(&self, direction: Vec3) -> Vec3 {
        let step = self.error.copysign(direction.dot(self.geometric_normal));
        self.position + step * self.geometric_normal
    }
}

/// Bounds of the error of a point, within which a ray starts at it: its own, that of the origin, and as much
/// for a corner, where the ray has left another surface just before.
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

/// The unit normal of a triangle with edges `e1` and `e2`, and how slender it is: the square of its length
/// over twice its area.
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

/// The same for a very small, very large, very slender or no triangle: in units of its size, twice.
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

/// A power of two whose product with `x` is about 1; exact, so that scaled scenes give the same bits.
#[inline]
fn power_of_two_near(x: f32) -> Option<f32> {
    if !(x > 0.0 && x < f32::INFINITY) {
        return None;
    }
    let exponent = ((x.to_bits() >> 23) as i32).clamp(1, 253);
    Some(f32::from_bits(((254 - exponent) as u32) << 23))
}

/// The interpolated normal, unit; `None` where a corner has none or they cancel.
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

/// The normal that a map makes of `normal`; `edges` and `sides` are two edges of the triangle in space and in
/// texture coordinates. `None` where the texture coordinates span nothing.
fn mapped_normal(
    scene: &Scene,
    map: NormalMap,
    uv: Vec2,
    normal: Vec3,
    edges: [Vec3; 2],
    sides: [Vec2; 2],
) -> Option<Vec3> {
    let (texture, local) = match map {
        NormalMap::Tangent(id, factor) => {
            let texture = scene.textures.get(id.0 as usize)?;
            let [x, y, z, _] = texture.lookup(uv);
            let local = 2.0 * Vec3::new(x, y, z) - Vec3::ONE;
            (texture, Vec3::new(factor * local.x, factor * local.y, local.z))
        }
        NormalMap::Height(id, factor) => {
            let texture = scene.textures.get(id.0 as usize)?;
            let slope = texture.gradient(uv) * factor;
            (texture, Vec3::new(-slope.x, -slope.y, 1.0))
        }
    };
    // Where the texture is mirrored, so are its directions.
    let mirrored = Vec2::ONE.copysign(texture.transform.scale);
    let local = Vec3::new(mirrored.x * local.x, mirrored.y * local.y, local.z);
    // dp/du from the two edges, made orthogonal to the normal; mirrored charts turn the bitangent.
    let determinant = sides[0].perp_dot(sides[1]);
    let along_u = (edges[0] * sides[1].y - edges[1] * sides[0].y) * 1f32.copysign(determinant);
    let tangent = (along_u - normal.dot(along_u) * normal).try_normalize()?;
    let bitangent = normal.cross(tangent) * 1f32.copysign(determinant);
    (local.x * tangent + local.y * bitangent + local.z * normal).try_normalize()
}
