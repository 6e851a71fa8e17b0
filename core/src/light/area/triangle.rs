//! Uniform sampling of a triangle's solid angle (Arvo 1995), in the form without inverse cosines (Peters
//! 2021, "BRDF Importance Sampling for Polygonal Lights", section 4).

use crate::sampling::sin_cos_turns;
use core::f32::consts::TAU;
use glam::Vec3;

/// Triangle projected to the unit sphere around a point.
pub(super) struct SphericalTriangle {
    /// Solid angle in steradians.
    pub(super) solid_angle: f32,
    /// Unit directions of the corners.
    v: [Vec3; 3],
    /// Triple product of the corner directions: six times the volume of the simplex.
    g0: f32,
    /// v0 · v2 + v1 · v2.
    g1: f32,
    /// 1 + v0 · v1.
    g2: f32,
    /// First corner and edges of the triangle, relative to the point and scaled.
    p: Vec3,
    edges: [Vec3; 2],
}

impl SphericalTriangle {
    /// Triangle `origin`, `origin + edges[0]`, `origin + edges[1]`, seen from `from`. `None` if that point
    /// lies in its plane within rounding.
    #[inline]
    pub(super) fn new(origin: Vec3, edges: [Vec3; 2], from: Vec3) -> Option<Self> {
        let p = origin - from;
        // In units of the size: products of three lengths would leave the range of floats.
        let scale = 1.0 / p.abs().max(edges[0].abs()).max(edges[1].abs()).max_element();
        let (p, edges) = (p * scale, edges.map(|e| e * scale));
        let corners = [p, p + edges[0], p + edges[1]];
        let lengths = corners.map(Vec3::length);
        let product = lengths[0] * lengths[1] * lengths[2];
        // Edge vectors keep the precision that the triple product of directions loses.
        let g0 = p.dot(edges[0].cross(edges[1])).abs() / product;
        if !(product > 0.0 && g0 > 0.0) {
            return None;
        }
        let v = [0, 1, 2].map(|i| corners[i] / lengths[i]);
        let g1 = v[0].dot(v[2]) + v[1].dot(v[2]);
        let g2 = 1.0 + v[0].dot(v[1]);
        // Van Oosterom and Strackee 1983, eq. 8.
        let solid_angle = 2.0 * libm::atan2f(g0, g1 + g2);
        Some(Self { solid_angle, v, g0, g1, g2, p, edges })
    }

    /// Edge coordinates of a sampled point of the triangle.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        let [v0, v1, v2] = self.v;
        // Third corner c of the part v0, v1, c that has the fraction u0 of the solid angle, by the half
        // vector of v0 and c.
        let (sin, cos) = sin_cos_turns(0.5 * u[0] * self.solid_angle / TAU);
        let half = (self.g0 * cos - self.g1 * sin) * v0 + self.g2 * sin * v2;
        let c = (2.0 * v0.dot(half) / half.length_squared()) * half - v0;
        // A point of the arc from v1 to c, uniform in the cosine.
        let d = v1.dot(c);
        let s = 1.0 - u[1] * (1.0 - d);
        let t = libm::sqrtf((u[1] * (1.0 + s) / (1.0 + d)).max(0.0));
        let direction = (s - t * d) * v1 + t * c;
        self.meet(direction)
    }

    /// Intersection of the ray from the point in `direction` with the triangle, clamped to it.
    #[inline]
    fn meet(&self, direction: Vec3) -> [f32; 2] {
        let [e1, e2] = self.edges;
        let across = direction.cross(e2);
        let inverse = 1.0 / across.dot(e1);
        let a = -self.p.dot(across) * inverse;
        let b = -direction.dot(self.p.cross(e1)) * inverse;
        if !(a.is_finite() && b.is_finite()) {
            return [1.0 / 3.0; 2];
        }
        let (a, b) = (a.clamp(0.0, 1.0), b.clamp(0.0, 1.0));
        let outside = (a + b).max(1.0);
        [a / outside, b / outside]
    }
}
