//! Uniform sampling of a rectangle's solid angle (Ureña, Fajardo and King 2013, "An Area-Preserving
//! Parametrization for Spherical Rectangles"). The map preserves the stratification of the unit square.
//!
//! Departure: no inverse cosines. The paper's angles occur only as sums under sine and cosine, which are
//! products of complex numbers. The single arc tangent gives the solid angle, in a form that stays precise
//! for small ones (van Oosterom and Strackee 1983, for both triangles).

use crate::sampling::sin_cos_turns;
use core::f32::consts::TAU;
use glam::{Vec2, Vec3};

/// Rectangle projected to the unit sphere around a point. The axes x and y run along its edges; its plane
/// lies at height `z` above the point. Lengths are in units of the largest coordinate.
pub(super) struct SphericalRectangle {
    /// Solid angle in steradians.
    pub(super) solid_angle: f32,
    x: [f32; 2],
    y: [f32; 2],
    z: f32,
    /// Distances of the corners (x0, y0) and (x0, y1).
    lengths: [f32; 2],
}

impl SphericalRectangle {
    /// Rectangle with corner `origin`, two edges and a unit normal, seen from `from`. `None` if that point
    /// lies in its plane within rounding.
    #[inline]
    pub(super) fn new(origin: Vec3, [ex, ey]: [Vec3; 2], normal: Vec3, from: Vec3) -> Option<Self> {
        let (width, depth) = (ex.length(), ey.length());
        let p = origin - from;
        let (x0, y0) = (p.dot(ex) / width, p.dot(ey) / depth);
        let (x1, y1) = (x0 + width, y0 + depth);
        let z = p.dot(normal).abs();
        let scale = 1.0 / x0.abs().max(x1.abs()).max(y0.abs()).max(y1.abs()).max(z);
        let (x, y, z) = ([x0 * scale, x1 * scale], [y0 * scale, y1 * scale], z * scale);
        let corners =
            [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])].map(|(x, y)| Vec3::new(x, y, z));
        let [l0, l1, l2, l3] = corners.map(Vec3::length);
        let [c0, c1, c2, c3] = corners;
        // tan(Ω/2) of a triangle is the ratio of `volume` to its `sum`. The halves add as arguments of
        // complex numbers. Both have the same volume.
        let volume = width * scale * (depth * scale) * z;
        let diagonal = c0.dot(c2) + l0 * l2;
        let sum_1 = diagonal * l1 + c0.dot(c1) * l2 + c1.dot(c2) * l0;
        let sum_2 = diagonal * l3 + c0.dot(c3) * l2 + c3.dot(c2) * l0;
        let solid_angle = 2.0 * libm::atan2f(volume * (sum_1 + sum_2), sum_1 * sum_2 - volume * volume);
        if !(z > 0.0 && solid_angle > 0.0) {
            return None;
        }
        Some(Self { solid_angle, x, y, z, lengths: [l0, l3] })
    }

    /// Edge coordinates of a sampled point of the rectangle.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        let Self { x: [x0, x1], y: [y0, y1], z, .. } = *self;
        // γ2 and γ3, the angles of the spherical rectangle at its corners (x0, y1) and (x0, y0).
        let g2 = Vec2::new(x0 * y1, z * self.lengths[1]);
        let g3 = Vec2::new(-x0 * y0, z * self.lengths[0]);
        let sum = Vec2::new(g2.x * g3.x - g2.y * g3.y, g2.x * g3.y + g2.y * g3.x).normalize_or(Vec2::X);
        // φ_u = u Ω - γ2 - γ3 + 2π.
        let (sin, cos) = sin_cos_turns(u[0] * self.solid_angle / TAU);
        let (sin, cos) = (sin * sum.x - cos * sum.y, cos * sum.x + sin * sum.y);
        // Eq. 20 to 22; b0 and b1 are the z components of the normals of the lower and upper planes.
        let (a0, a2) = (libm::sqrtf(z * z + y0 * y0), libm::sqrtf(z * z + y1 * y1));
        let (b0, b1) = (-y0 / a0, y1 / a2);
        let f = (cos * b0 - b1) / sin;
        let root = libm::sqrtf((f * f + (b0 * b0 - 1.0)).max(f32::MIN_POSITIVE));
        let xu = (z / root).copysign(f).max(x0).min(x1);
        // Eq. 24 to 28.
        let d2 = xu * xu + z * z;
        let h0 = y0 / libm::sqrtf(d2 + y0 * y0);
        let h1 = y1 / libm::sqrtf(d2 + y1 * y1);
        let h = h0 + u[1] * (h1 - h0);
        let yv = h * libm::sqrtf(d2 / (1.0 - h * h).max(f32::MIN_POSITIVE));
        let at = |v: f32, from: f32, to: f32| ((v - from) / (to - from)).clamp(0.0, 1.0);
        [at(xu, x0, x1), at(yv, y0, y1)]
    }
}
