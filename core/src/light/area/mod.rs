//! Area lights: an emissive triangle, or two that make a parallelogram and are sampled as one. Near lights
//! are sampled by solid angle, far ones by area. The choice depends on the shaded point only, so that
//! [`Emitter::pdf`] is the density of [`Emitter::sample`] for a point found in any other way.

use crate::geometry::Cone;
use crate::sampling::warp::uniform_triangle;
use crate::scene::Mesh;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_simd::kernels::shade;
use halflight_simd::kernels::shade::emitter::{EmitterBlock, SLIVER};
use halflight_simd::kernels::shade::rectangle::SphericalRectangle;
use halflight_simd::kernels::shade::triangle::SphericalTriangle;

/// A light whose radius is below this fraction of its distance is sampled by area. On the Cornell box the
/// squared error of a sample grows by 5 %, and its time shrinks by a quarter.
const FAR: f32 = 0.35;

/// Largest deviation from a parallelogram and from a right angle, as a fraction of the edges: far below a
/// visible error of the density, far above the rounding of coordinates.
const SHAPE_TOLERANCE: f32 = 1e-5;

/// Map of the unit square to the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Triangle,
    Parallelogram,
    Rectangle,
}

/// Flat light of one or two triangles: `origin + a * edges[0] + b * edges[1]`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Emitter {
    pub(super) origin: [f32; 3],
    pub(super) edges: [[f32; 3]; 2],
    /// Unit normal of the emitting side.
    pub(super) normal: [f32; 3],
    pub(super) area: f32,
    /// Index in the mesh. The other half of a parallelogram is the next triangle.
    pub(super) triangle: u32,
    /// Squared distance below which the light is near.
    near: f32,
    /// Bits 0-1 shape, 2-3 and 4-5 the corners at `origin` and opposite to it, 6 two-sided, 7 textured.
    flags: u32,
}

/// Point on a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) position: Vec3,
    pub(super) triangle: u32,
    /// Barycentric weights of the second and third vertex.
    pub(super) barycentric: [f32; 2],
}

impl Emitter {
    /// Light of triangle `index`, joined with the next triangle if `pairs` says that both emit alike and if
    /// they make a parallelogram. `None` without area.
    pub(super) fn new(mesh: &Mesh, index: u32, pairs: bool, two_sided: bool, textured: bool) -> Option<Self> {
        let flags = u32::from(two_sided) << 6 | u32::from(textured) << 7;
        let pair = if pairs { Self::parallelogram(mesh, index) } else { None };
        let (corners, shape, turns) = match pair {
            Some((first, second, shape)) => {
                (rotate_corners(mesh.corners(index), first), shape, first << 2 | second << 4)
            }
            None => (mesh.corners(index), Shape::Triangle, 0),
        };
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        let size = edges[0].abs().max(edges[1].abs()).max_element();
        if !(size > 0.0 && size < f32::INFINITY && corners[0].is_finite()) {
            return None;
        }
        // In units of the size: products of tiny edges would underflow.
        let cross = (edges[0] / size).cross(edges[1] / size);
        let normal = cross.try_normalize()?;
        let halves = if shape == Shape::Triangle { 0.5 } else { 1.0 };
        let area = cross.length() * size * size * halves;
        let radius = 0.5 * (edges[0].distance(edges[1])).max(edges[0].length()).max(edges[1].length());
        if !(area > 0.0 && area < f32::INFINITY) {
            return None;
        }
        Some(Self {
            origin: corners[0].to_array(),
            edges: edges.map(Into::into),
            normal: normal.to_array(),
            area,
            triangle: index,
            near: (radius / FAR) * (radius / FAR),
            flags: flags | shape as u32 | turns,
        })
    }

    /// If triangles `index` and `index + 1` make a parallelogram: the unshared corner of each, and the shape.
    fn parallelogram(mesh: &Mesh, index: u32) -> Option<(u32, u32, Shape)> {
        let (first, second) = (mesh.corners(index), mesh.corners(index.checked_add(1)?));
        for turn in 0..3 {
            let [o, a, b] = rotate_corners(first, turn);
            for other in 0..3 {
                let [c, d, e] = rotate_corners(second, other);
                let (u, v) = (a - o, b - o);
                let tolerance = SHAPE_TOLERANCE * u.length().min(v.length());
                // The shared edge runs a → b in one triangle and b → a in the other.
                if d == b && e == a && (c - (o + u + v)).length() <= tolerance {
                    let right = u.dot(v).abs() <= SHAPE_TOLERANCE * u.length() * v.length();
                    let shape = if right { Shape::Rectangle } else { Shape::Parallelogram };
                    return Some((turn, other, shape));
                }
            }
        }
        None
    }

    pub(super) fn corners(&self) -> impl Iterator<Item = Vec3> {
        let [o, u, v] = [self.origin, self.edges[0], self.edges[1]].map(Vec3::from);
        let count = if self.shape() == Shape::Triangle { 3 } else { 4 };
        [o, o + u, o + v, o + u + v].into_iter().take(count)
    }

    /// Edges between corners of the mesh, equal to the bit to those of neighbouring lights.
    pub(super) fn border(&self, mesh: &Mesh) -> impl Iterator<Item = [Vec3; 2]> + use<> {
        let [o, a, b] = rotate_corners(mesh.corners(self.triangle), self.flags >> 2 & 3);
        let (last, count) = match self.is_pair() {
            true => (rotate_corners(mesh.corners(self.triangle + 1), self.flags >> 4 & 3)[0], 4),
            false => (b, 3),
        };
        [[o, a], [a, last], [last, if count == 4 { b } else { o }], [b, o]].into_iter().take(count)
    }

    /// Some(true) if the front faces `eye`, Some(false) if the emitting back does; `None` if no light goes
    /// there.
    pub(super) fn faces(&self, eye: Vec3) -> Option<bool> {
        let front = self.height(eye) > 0.0;
        (front || self.is_two_sided()).then_some(front)
    }

    pub(super) fn cone(&self) -> Cone {
        if self.is_two_sided() { Cone::ALL } else { Cone { axis: self.normal, cos: 1.0 } }
    }

    #[inline]
    pub(super) fn is_pair(&self) -> bool {
        self.shape() != Shape::Triangle
    }

    #[inline]
    pub(super) fn is_two_sided(&self) -> bool {
        self.flags & 1 << 6 != 0
    }

    #[inline]
    pub(super) fn is_textured(&self) -> bool {
        self.flags & 1 << 7 != 0
    }

    #[inline]
    fn shape(&self) -> Shape {
        match self.flags & 3 {
            0 => Shape::Triangle,
            1 => Shape::Parallelogram,
            _ => Shape::Rectangle,
        }
    }

    /// Height of `point` above the plane, positive in front.
    #[inline]
    fn height(&self, point: Vec3) -> f32 {
        (point - Vec3::from(self.origin)).dot(self.normal.into())
    }

    #[inline]
    fn is_near(&self, point: Vec3) -> bool {
        let [o, u, v] = [self.origin, self.edges[0], self.edges[1]].map(Vec3::from);
        let share = if self.shape() == Shape::Triangle { 1.0 / 3.0 } else { 0.5 };
        (point - (o + share * (u + v))).length_squared() < self.near
    }

    #[inline]
    fn seen_rectangle(&self, from: Vec3) -> Option<SphericalRectangle<f32>> {
        let seen = SphericalRectangle::new(self.origin, self.edges, self.normal, from.to_array());
        seen.exists.then_some(seen)
    }

    #[inline]
    fn seen_triangle(&self, from: Vec3) -> Option<SphericalTriangle<f32>> {
        let seen = SphericalTriangle::new(self.origin, self.edges, from.to_array());
        seen.exists.then_some(seen)
    }

    /// Makes this the light of vertex `i` (below 16) of a block.
    #[inline]
    pub(super) fn put(&self, block: &mut EmitterBlock, i: usize) {
        let i = i & 15;
        shade::put(&mut block.origin, i, self.origin);
        shade::put(&mut block.edges[0], i, self.edges[0]);
        shade::put(&mut block.edges[1], i, self.edges[1]);
        shade::put(&mut block.normal, i, self.normal);
        (block.area[i], block.near[i]) = (self.area, self.near);
        let shape = self.shape();
        block.triangles |= u32::from(shape == Shape::Triangle) << i;
        block.rectangles |= u32::from(shape == Shape::Rectangle) << i;
        block.two_sided |= u32::from(self.is_two_sided()) << i;
    }

    /// Samples a point of the light as seen from `from`, with its density in solid angle; `None` in place of
    /// the density means uniform in area. `None` if the light faces away.
    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<(Place, Option<f32>)> {
        let height = self.height(from);
        if !(height > 0.0 || self.is_two_sided() && height < 0.0) {
            return None;
        }
        if self.is_near(from) {
            let sampled = match self.shape() {
                Shape::Rectangle => self.seen_rectangle(from).map(|r| (r.sample(u), r.solid_angle)),
                Shape::Triangle => self.seen_triangle(from).map(|t| (t.sample(u), t.solid_angle)),
                Shape::Parallelogram => None,
            };
            if let Some((at, solid_angle)) = sampled.filter(|s| s.1 > SLIVER) {
                return Some((self.place(at), Some(1.0 / solid_angle)));
            }
        }
        let at = if self.shape() == Shape::Triangle { uniform_triangle(u).into() } else { u };
        Some((self.place(at), None))
    }

    /// Density of [`Emitter::sample`] in solid angle, for a point of the light in unit `direction` at
    /// `distance` from `from`.
    #[inline]
    pub(super) fn pdf(&self, from: Vec3, direction: Vec3, distance: f32) -> f32 {
        let height = self.height(from);
        if !(height > 0.0 || self.is_two_sided() && height < 0.0) {
            return 0.0;
        }
        if self.is_near(from) {
            let solid_angle = match self.shape() {
                Shape::Rectangle => self.seen_rectangle(from).map(|r| r.solid_angle),
                Shape::Triangle => self.seen_triangle(from).map(|t| t.solid_angle),
                Shape::Parallelogram => None,
            };
            if let Some(solid_angle) = solid_angle.filter(|&s| s > SLIVER) {
                return 1.0 / solid_angle;
            }
        }
        self.area_pdf(direction, distance)
    }

    /// Uniform density in area, converted to solid angle.
    #[inline]
    pub(super) fn area_pdf(&self, direction: Vec3, distance: f32) -> f32 {
        let cos = direction.dot(self.normal.into()).abs();
        // This order avoids overflow of a tiny area and of a large distance.
        if cos > 0.0 { distance / (self.area * cos) * distance } else { 0.0 }
    }

    /// Bound of the rounding error in each coordinate of a point of the light, and of the distance at which a
    /// ray between it and the point `other` hits the light.
    #[inline]
    pub(super) fn error(&self, position: Vec3, other: Vec3) -> f32 {
        // Three products and two sums of numbers no larger than the corners; the tracer subtracts the other
        // point from the corners.
        let largest = Vec3::from(self.origin).abs().max(position.abs()).max(other.abs());
        16.0 * f32::EPSILON * largest.max_element()
    }

    /// Point at edge coordinates `[a, b]`, and its triangle.
    #[inline]
    pub(super) fn place(&self, [a, b]: [f32; 2]) -> Place {
        let [o, u, v] = [self.origin, self.edges[0], self.edges[1]].map(Vec3::from);
        let position = o + a * u + b * v;
        if self.shape() == Shape::Triangle || a + b <= 1.0 {
            let weights = unrotate_corners([1.0 - a - b, a, b], self.flags >> 2 & 3);
            return Place { position, triangle: self.triangle, barycentric: [weights[1], weights[2]] };
        }
        // The second half is relative to its unshared corner, with the edges reversed.
        let weights = unrotate_corners([a + b - 1.0, 1.0 - a, 1.0 - b], self.flags >> 4 & 3);
        Place { position, triangle: self.triangle + 1, barycentric: [weights[1], weights[2]] }
    }
}

/// Rotates corner `turn` to the front.
fn rotate_corners<T: Copy>(c: [T; 3], turn: u32) -> [T; 3] {
    match turn {
        0 => c,
        1 => [c[1], c[2], c[0]],
        _ => [c[2], c[0], c[1]],
    }
}

/// Inverse of [`rotate_corners`].
#[inline]
fn unrotate_corners<T: Copy>(c: [T; 3], turn: u32) -> [T; 3] {
    match turn {
        0 => c,
        1 => [c[2], c[0], c[1]],
        _ => [c[1], c[2], c[0]],
    }
}
