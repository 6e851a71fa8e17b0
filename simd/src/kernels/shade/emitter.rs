//! Samples of flat area lights: a triangle, a parallelogram or a rectangle for each vertex of a block. Near
//! lights are sampled by solid angle, far ones by area.

use super::rectangle::SphericalRectangle;
use super::triangle::SphericalTriangle;
use super::vector::{self, add, scale, sub};
use super::{Row, Row3, load2, load3, warp};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};

/// Solid angle in steradians below which single precision cannot invert it. A light may be near and still a
/// sliver.
pub const SLIVER: f32 = 1e-3;

/// Lights of a block: `origin + a edges[0] + b edges[1]`.
#[derive(Clone, Debug)]
pub struct EmitterBlock {
    /// Corners.
    pub origin: Row3,
    /// Edges from the corners.
    pub edges: [Row3; 2],
    /// Unit normals of the emitting sides.
    pub normal: Row3,
    /// Areas.
    pub area: Row,
    /// Squared distances below which the lights are near.
    pub near: Row,
    /// Bit `i`: the light of vertex `i` is a triangle.
    pub triangles: u32,
    /// Bit `i`: it is a rectangle. Others are parallelograms.
    pub rectangles: u32,
    /// Bit `i`: its back emits too.
    pub two_sided: u32,
}

impl EmitterBlock {
    /// Zeros.
    pub const EMPTY: Self = Self {
        origin: [[0.0; 16]; 3],
        edges: [[[0.0; 16]; 3]; 2],
        normal: [[0.0; 16]; 3],
        area: [0.0; 16],
        near: [0.0; 16],
        triangles: 0,
        rectangles: 0,
        two_sided: 0,
    };
}

/// Samples of the lights of a block.
#[derive(Debug)]
pub struct EmitterSamples<'b> {
    /// Lights.
    pub lights: &'b EmitterBlock,
    /// Points that are lit.
    pub from: &'b Row3,
    /// Sides of these points that are lit; zero vectors for both.
    pub normal: &'b Row3,
    /// Positions in the unit square.
    pub u: &'b [Row; 2],
    /// Probabilities of the choice of the lights.
    pub probability: &'b Row,
    /// Bit `i`: vertex `i` takes a sample.
    pub active: u32,
}

/// Sampled points of the lights of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct EmitterSampleBlock {
    /// Positions on the lights, offset from their surfaces by their error bounds: ends of shadow rays.
    pub end: Row3,
    /// Unit directions to the positions.
    pub direction: Row3,
    /// Distances to the positions.
    pub distance: Row,
    /// Densities in solid angle, including the choice of the light.
    pub pdf: Row,
    /// Bit `i`: there is a sample.
    pub exists: u32,
    /// Bit `i`: the front of the light is seen.
    pub front: u32,
    /// Bit `i`: the point is on the second triangle of a parallelogram.
    pub second: u32,
}

/// Area lights over lanes.
pub struct EmitterLanes<L: Lanes> {
    origin: [L; 3],
    edges: [[L; 3]; 2],
    normal: [L; 3],
    area: L,
    near: L,
    triangles: L::Mask,
    rectangles: L::Mask,
    two_sided: L::Mask,
}

/// Samples over lanes.
pub struct EmitterSampleLanes<L: Lanes> {
    end: [L; 3],
    direction: [L; 3],
    distance: L,
    pdf: L,
    exists: L::Mask,
    front: L::Mask,
    second: L::Mask,
}

/// Samples points of lights at `u` as seen from `from`. `active` are the lanes that need a result.
#[inline(always)]
pub fn sample<L: Lanes>(
    light: &EmitterLanes<L>,
    from: [L; 3],
    normal: [L; 3],
    u: [L; 2],
    probability: L,
    active: L::Mask,
) -> EmitterSampleLanes<L> {
    let (zero, one) = (probability.all(0.0), probability.all(1.0));
    let [o, e0, e1] = [light.origin, light.edges[0], light.edges[1]];
    let height = dot(sub(from, o), light.normal);
    let shines = zero.lt(height) | light.two_sided & height.lt(zero);
    let share = zero.all(1.0 / 3.0).select(light.triangles, zero.all(0.5));
    let center = add(o, scale(add(e0, e1), share));
    let is_near = active & shines & vector::square(sub(from, center)).lt(light.near);

    // By area: in edge coordinates, with a density that follows from the distance.
    let flat = warp::uniform_triangle(u);
    let mut at = [flat[0].select(light.triangles, u[0]), flat[1].select(light.triangles, u[1])];
    let (mut by_angle, mut angular) = (zero.lt(zero), zero);
    let is_rectangle = is_near & light.rectangles;
    if is_rectangle.any() {
        let seen = SphericalRectangle::new(o, light.edges, light.normal, from);
        let is_seen = is_rectangle & seen.exists & zero.all(SLIVER).lt(seen.solid_angle);
        let [a, b] = seen.sample(u);
        at = [a.select(is_seen, at[0]), b.select(is_seen, at[1])];
        angular = (one / seen.solid_angle).select(is_seen, angular);
        by_angle = by_angle | is_seen;
    }
    let is_triangle = is_near & light.triangles;
    if is_triangle.any() {
        let seen = SphericalTriangle::new(o, light.edges, from);
        let is_seen = is_triangle & seen.exists & zero.all(SLIVER).lt(seen.solid_angle);
        let [a, b] = seen.sample(u);
        at = [a.select(is_seen, at[0]), b.select(is_seen, at[1])];
        angular = (one / seen.solid_angle).select(is_seen, angular);
        by_angle = by_angle | is_seen;
    }
    let position = add(add(o, scale(e0, at[0])), scale(e1, at[1]));
    let second = !light.triangles & one.lt(at[0] + at[1]);

    let way = sub(position, from);
    let distance = vector::length(way);
    let direction = vector::divide(way, distance);
    let faces = dot(normal, direction);
    let is_free = normal[0].eq(zero) & normal[1].eq(zero) & normal[2].eq(zero);
    let slope = dot(light.normal, direction);
    let front = slope.lt(zero);
    let cos = slope.abs();
    // This order avoids overflow of a tiny area and of a large distance.
    let areal = (distance / (light.area * cos) * distance).select(zero.lt(cos), zero);
    let pdf = probability * angular.select(by_angle, areal);
    let has_pdf = zero.lt(pdf) & pdf.lt(zero.all(f32::INFINITY));
    let exists = active & shines & zero.lt(distance) & (is_free | zero.lt(faces)) & has_pdf;
    // Three products and two sums of numbers no larger than the corners; the tracer subtracts the other point
    // from the corners.
    let largest = vector::max(vector::max(vector::abs(o), vector::abs(position)), vector::abs(from));
    let error = zero.all(16.0 * f32::EPSILON) * vector::largest(largest);
    let side = vector::select(front, light.normal, vector::negate(light.normal));
    let end = add(position, scale(side, error));
    EmitterSampleLanes { end, direction, distance, pdf, exists, front, second }
}

impl EmitterSamples<'_> {
    /// Samples by the instructions of `level`.
    pub fn compute(&self, level: Level) -> EmitterSampleBlock {
        level.dispatch(self)
    }
}

impl EmitterSampleBlock {
    /// No sample.
    pub const EMPTY: Self = Self {
        end: [[0.0; 16]; 3],
        direction: [[0.0; 16]; 3],
        distance: [0.0; 16],
        pdf: [0.0; 16],
        exists: 0,
        front: 0,
        second: 0,
    };
}

impl Kernel for &EmitterSamples<'_> {
    type Out = EmitterSampleBlock;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> EmitterSampleBlock {
        let EmitterSamples { lights, from, normal, u, probability, active } = self;
        let light = EmitterLanes {
            origin: load3(simd, &lights.origin),
            edges: [load3(simd, &lights.edges[0]), load3(simd, &lights.edges[1])],
            normal: load3(simd, &lights.normal),
            area: simd.load16(&lights.area),
            near: simd.load16(&lights.near),
            triangles: simd.mask16(lights.triangles),
            rectangles: simd.mask16(lights.rectangles),
            two_sided: simd.mask16(lights.two_sided),
        };
        let (from, normal, u) = (load3(simd, from), load3(simd, normal), load2(simd, u));
        let (probability, active) = (simd.load16(probability), simd.mask16(*active));
        let sample = sample(&light, from, normal, u, probability, active);
        EmitterSampleBlock {
            end: vector::to_arrays(sample.end),
            direction: vector::to_arrays(sample.direction),
            distance: sample.distance.to_array(),
            pdf: sample.pdf.to_array(),
            exists: sample.exists.bits(),
            front: sample.front.bits(),
            second: sample.second.bits(),
        }
    }
}
