//! Surface points of a block: interpolated position with its error bound, geometric normal, shading frame.

use super::vector::{self, add, cross, negate, scale, sub};
use super::{Row, Row3, load2, load33, warp};
use crate::lanes::{Lanes, Mask, Simd, dot};
use crate::level::{Kernel, Level};

/// Relative error bound, 16 half units in the last place: five roundings of the sum of three products, as
/// many of the tracer's differences and shears, and one of the offset itself, rounded up.
pub const ERROR_UNITS: f32 = 16.0 * 0.5 * f32::EPSILON;

/// Upper limit of slenderness, so that needles do not move rays too far. The error of the tracer's distances
/// grows with the length of a triangle times its slenderness.
pub const MAX_SLENDERNESS: f32 = 16.0;

/// Squares outside this range lose bits to underflow or overflow.
pub const SAFE_SQUARES: core::ops::Range<f32> = 1e-24..1e24;

/// Least cosine of the viewer over the horizon of the shading normal, which is turned to reach it.
pub const MIN_VIEW_COSINE: f32 = 1e-3;

/// Hits of a block.
#[derive(Debug)]
pub struct Surfaces<'b> {
    /// Corners of the triangles.
    pub corners: &'b [Row3; 3],
    /// Normals at the corners; `None` in a mesh without normals.
    pub normals: Option<&'b [Row3; 3]>,
    /// Barycentric weights of the second and third corner.
    pub weights: &'b [Row; 2],
    /// Rays: origin, end, unit direction, tag.
    pub rays: &'b [[f32; 8]; 16],
}

/// Surface points of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceBlock {
    /// Interpolated positions.
    pub position: Row3,
    /// Error bounds of the positions.
    pub error: Row,
    /// Unit normals of the triangles, on the side of the viewer.
    pub geometric_normal: Row3,
    /// Tangent, bitangent and normal of the shading frame.
    pub frame: [Row3; 3],
    /// Local directions to the viewer.
    pub wo: Row3,
    /// Bit `i`: the viewer of vertex `i` is on the front.
    pub front: u32,
    /// Bit `i`: the size of the triangle of vertex `i` is within the range of these operations.
    pub regular: u32,
}

/// Surface points over lanes.
pub struct SurfaceLanes<L: Lanes> {
    position: [L; 3],
    error: L,
    geometric_normal: [L; 3],
    frame: [[L; 3]; 3],
    wo: [L; 3],
    front: L::Mask,
    regular: L::Mask,
}

/// True where a square keeps its bits.
#[inline(always)]
fn is_safe<L: Lanes>(square: L) -> L::Mask {
    square.all(SAFE_SQUARES.start).le(square) & square.lt(square.all(SAFE_SQUARES.end))
}

/// Surface points of hits: see [`Surfaces`].
#[inline(always)]
pub fn surface<L: Lanes>(
    [p0, p1, p2]: [[L; 3]; 3],
    normals: Option<[[L; 3]; 3]>,
    [u, v]: [L; 2],
    direction: [L; 3],
) -> SurfaceLanes<L> {
    let (zero, one) = (u.all(0.0), u.all(1.0));
    let w = one - u - v;
    let position = add(add(scale(p0, w), scale(p1, u)), scale(p2, v));
    let (e1, e2) = (sub(p1, p0), sub(p2, p0));
    let across = cross(e1, e2);
    let area_square = vector::square(across);
    let inverse = one / area_square.sqrt();
    let normal = scale(across, inverse);
    let slenderness = vector::square(e1).max(vector::square(e2)) * inverse;
    // Scale-free: proportional to the coordinates and edges, without absolute terms.
    let sizes = [vector::abs(p0), vector::abs(p1), vector::abs(p2)];
    let coordinates = vector::largest(add(add(scale(sizes[0], w), scale(sizes[1], u)), scale(sizes[2], v)));
    let reach = vector::largest(vector::max(vector::abs(e1), vector::abs(e2)));
    let error = u.all(ERROR_UNITS) * (coordinates + reach * slenderness.min(u.all(MAX_SLENDERNESS)));

    let viewer = negate(direction);
    let front = zero.le(dot(normal, viewer));
    let side = one.select(front, -one);
    let geometric_normal = scale(normal, side);
    let mut shading = geometric_normal;
    if let Some(normals) = normals {
        let [n0, n1, n2] = normals;
        // From zero on, which removes the sign of zeros.
        let sum = add(add(add([zero; 3], scale(n0, w)), scale(n1, u)), scale(n2, v));
        let square = vector::square(sum);
        let exists = |n: [L; 3]| zero.lt(vector::largest(vector::abs(n)));
        let is_smooth = is_safe(square) & exists(n0) & exists(n1) & exists(n2);
        let smooth = scale(sum, one / square.sqrt());
        let smooth = vector::select(is_smooth, smooth, normal);
        // Flipped normals of a file still describe the curvature of the surface.
        let flipped = dot(smooth, normal).lt(zero);
        let smooth = scale(vector::select(flipped, negate(smooth), smooth), side);
        // An interpolated normal that faces away from the viewer is turned just far enough to face it.
        let cos = dot(smooth, viewer);
        let lowest = u.all(MIN_VIEW_COSINE).min(dot(geometric_normal, viewer));
        let turned = add(smooth, scale(viewer, lowest - cos));
        let shrink = one / vector::length(turned);
        let has_length = zero.lt(shrink) & shrink.lt(u.all(f32::INFINITY));
        let turned = vector::select(has_length, scale(turned, shrink), geometric_normal);
        shading = vector::select(cos.lt(lowest), turned, smooth);
    }
    let [tangent, bitangent] = warp::frame(shading);
    let wo = [dot(viewer, tangent), dot(viewer, bitangent), dot(viewer, shading)];
    let frame = [tangent, bitangent, shading];
    let regular = is_safe(area_square);
    SurfaceLanes { position, error, geometric_normal, frame, wo, front, regular }
}

impl Surfaces<'_> {
    /// Surface points by the instructions of `level`, into `block`.
    pub fn compute(&self, level: Level, block: &mut SurfaceBlock) {
        level.dispatch((self, block));
    }
}

impl SurfaceBlock {
    /// Zeros.
    pub const EMPTY: Self = Self {
        position: [[0.0; 16]; 3],
        error: [0.0; 16],
        geometric_normal: [[0.0; 16]; 3],
        frame: [[[0.0; 16]; 3]; 3],
        wo: [[0.0; 16]; 3],
        front: 0,
        regular: 0,
    };
}

impl Kernel for (&Surfaces<'_>, &mut SurfaceBlock) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Surfaces { corners, normals, weights, rays } = self.0;
        let [.., x, y, z, _] = simd.columns16(rays);
        let normals = normals.map(|normals| load33(simd, normals));
        let point = surface(load33(simd, corners), normals, load2(simd, weights), [x, y, z]);
        let [tangent, bitangent, normal] = point.frame;
        let block = self.1;
        block.position = vector::to_arrays(point.position);
        block.error = point.error.to_array();
        block.geometric_normal = vector::to_arrays(point.geometric_normal);
        block.frame[0] = vector::to_arrays(tangent);
        block.frame[1] = vector::to_arrays(bitangent);
        block.frame[2] = vector::to_arrays(normal);
        block.wo = vector::to_arrays(point.wo);
        (block.front, block.regular) = (point.front.bits(), point.regular.bits());
    }
}
