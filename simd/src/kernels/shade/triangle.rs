//! Uniform sampling of a triangle's solid angle (Arvo 1995), in the form without inverse cosines (Peters
//! 2021, "BRDF Importance Sampling for Polygonal Lights", section 4).

use super::vector::{self, add, cross, divide, scale, sub};
use super::warp::{atan2, sin_cos_turns};
use crate::lanes::{Lanes, dot};
use core::f32::consts::TAU;

/// Triangle projected to the unit sphere around a point.
pub struct SphericalTriangle<L: Lanes> {
    /// Solid angle in steradians.
    pub solid_angle: L,
    /// False in lanes whose point lies in the plane of the triangle within rounding.
    pub exists: L::Mask,
    /// Unit directions of the corners.
    v: [[L; 3]; 3],
    /// Triple product of the corner directions: six times the volume of the simplex.
    g0: L,
    /// v0 · v2 + v1 · v2.
    g1: L,
    /// 1 + v0 · v1.
    g2: L,
    /// First corner and edges of the triangle, relative to the point and scaled.
    p: [L; 3],
    edges: [[L; 3]; 2],
}

impl<L: Lanes> SphericalTriangle<L> {
    /// Triangle `origin`, `origin + edges[0]`, `origin + edges[1]`, seen from `from`.
    #[inline(always)]
    pub fn new(origin: [L; 3], edges: [[L; 3]; 2], from: [L; 3]) -> Self {
        let p = sub(origin, from);
        let (zero, one, two) = (p[0].all(0.0), p[0].all(1.0), p[0].all(2.0));
        // In units of the size: products of three lengths would leave the range of floats.
        let sizes = vector::max(vector::max(vector::abs(p), vector::abs(edges[0])), vector::abs(edges[1]));
        let unit = one / vector::largest(sizes);
        let (p, edges) = (scale(p, unit), [scale(edges[0], unit), scale(edges[1], unit)]);
        let corners = [p, add(p, edges[0]), add(p, edges[1])];
        let (l0, l1, l2) =
            (vector::length(corners[0]), vector::length(corners[1]), vector::length(corners[2]));
        let product = l0 * l1 * l2;
        // Edge vectors keep the precision that the triple product of directions loses.
        let g0 = dot(p, cross(edges[0], edges[1])).abs() / product;
        let exists = zero.lt(product) & zero.lt(g0);
        let v = [divide(corners[0], l0), divide(corners[1], l1), divide(corners[2], l2)];
        let g1 = dot(v[0], v[2]) + dot(v[1], v[2]);
        let g2 = one + dot(v[0], v[1]);
        // Van Oosterom and Strackee 1983, eq. 8.
        let solid_angle = two * atan2(g0, g1 + g2);
        Self { solid_angle, exists, v, g0, g1, g2, p, edges }
    }

    /// Edge coordinates of a sampled point of the triangle.
    #[inline(always)]
    pub fn sample(&self, u: [L; 2]) -> [L; 2] {
        let [v0, v1, v2] = self.v;
        let (zero, one, two) = (self.g0.all(0.0), self.g0.all(1.0), self.g0.all(2.0));
        // Third corner c of the part v0, v1, c that has the fraction u0 of the solid angle, by the half
        // vector of v0 and c.
        let (sin, cos) = sin_cos_turns(zero.all(0.5) * u[0] * self.solid_angle / zero.all(TAU));
        let half = add(scale(v0, self.g0 * cos - self.g1 * sin), scale(v2, self.g2 * sin));
        let c = sub(scale(half, two * dot(v0, half) / vector::square(half)), v0);
        // A point of the arc from v1 to c, uniform in the cosine.
        let d = dot(v1, c);
        let s = one - u[1] * (one - d);
        let t = (u[1] * (one + s) / (one + d)).max(zero).sqrt();
        self.meet(add(scale(v1, s - t * d), scale(c, t)))
    }

    /// Intersection of the ray from the point in `direction` with the triangle, clamped to it.
    #[inline(always)]
    fn meet(&self, direction: [L; 3]) -> [L; 2] {
        let [e1, e2] = self.edges;
        let (zero, one) = (self.g0.all(0.0), self.g0.all(1.0));
        let across = cross(direction, e2);
        let inverse = one / dot(across, e1);
        let a = -dot(self.p, across) * inverse;
        let b = -dot(direction, cross(self.p, e1)) * inverse;
        let limit = zero.all(f32::INFINITY);
        let is_finite = a.abs().lt(limit) & b.abs().lt(limit);
        let (a, b) = (a.max(zero).min(one), b.max(zero).min(one));
        let outside = (a + b).max(one);
        let third = zero.all(1.0 / 3.0);
        [(a / outside).select(is_finite, third), (b / outside).select(is_finite, third)]
    }
}
