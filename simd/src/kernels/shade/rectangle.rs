//! Uniform sampling of a rectangle's solid angle (Ureña, Fajardo and King 2013, "An Area-Preserving
//! Parametrization for Spherical Rectangles"). The map preserves the stratification of the unit square.
//!
//! Departure: no inverse cosines. The paper's angles occur only as sums under sine and cosine, which are
//! products of complex numbers. The single arc tangent gives the solid angle, in a form that stays precise
//! for small ones (van Oosterom and Strackee 1983, for both triangles).

use super::vector::{self, sub};
use super::warp::{atan2, sin_cos_turns};
use crate::lanes::{Lanes, dot};
use core::f32::consts::TAU;

/// Rectangle projected to the unit sphere around a point. The axes x and y run along its edges; its plane
/// lies at height `z` above the point. Lengths are in units of the largest coordinate.
pub struct SphericalRectangle<L: Lanes> {
    /// Solid angle in steradians.
    pub solid_angle: L,
    /// False in lanes whose point lies in the plane of the rectangle within rounding.
    pub exists: L::Mask,
    x: [L; 2],
    y: [L; 2],
    z: L,
    /// Distances of the corners (x0, y0) and (x0, y1).
    lengths: [L; 2],
}

impl<L: Lanes> SphericalRectangle<L> {
    /// Rectangle with corner `origin`, two edges and a unit normal, seen from `from`.
    #[inline(always)]
    pub fn new(origin: [L; 3], [ex, ey]: [[L; 3]; 2], normal: [L; 3], from: [L; 3]) -> Self {
        let (width, depth) = (vector::length(ex), vector::length(ey));
        let (zero, one, two) = (width.all(0.0), width.all(1.0), width.all(2.0));
        let p = sub(origin, from);
        let (x0, y0) = (dot(p, ex) / width, dot(p, ey) / depth);
        let (x1, y1) = (x0 + width, y0 + depth);
        let z = dot(p, normal).abs();
        let scale = one / x0.abs().max(x1.abs()).max(y0.abs()).max(y1.abs()).max(z);
        let (x, y, z) = ([x0 * scale, x1 * scale], [y0 * scale, y1 * scale], z * scale);
        let (c0, c1, c2, c3) = ([x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]);
        let (l0, l1) = (vector::length(c0), vector::length(c1));
        let (l2, l3) = (vector::length(c2), vector::length(c3));
        // tan(Ω/2) of a triangle is the ratio of `volume` to its `sum`. The halves add as arguments of
        // complex numbers. Both have the same volume.
        let volume = width * scale * (depth * scale) * z;
        let diagonal = dot(c0, c2) + l0 * l2;
        let sum_1 = diagonal * l1 + dot(c0, c1) * l2 + dot(c1, c2) * l0;
        let sum_2 = diagonal * l3 + dot(c0, c3) * l2 + dot(c3, c2) * l0;
        let solid_angle = two * atan2(volume * (sum_1 + sum_2), sum_1 * sum_2 - volume * volume);
        let exists = zero.lt(z) & zero.lt(solid_angle);
        Self { solid_angle, exists, x, y, z, lengths: [l0, l3] }
    }

    /// Edge coordinates of a sampled point of the rectangle.
    #[inline(always)]
    pub fn sample(&self, u: [L; 2]) -> [L; 2] {
        let Self { x: [x0, x1], y: [y0, y1], z, .. } = *self;
        let (zero, one, least) = (z.all(0.0), z.all(1.0), z.all(f32::MIN_POSITIVE));
        // γ2 and γ3, the angles of the spherical rectangle at its corners (x0, y1) and (x0, y0).
        let (g2, g3) = ([x0 * y1, z * self.lengths[1]], [-x0 * y0, z * self.lengths[0]]);
        let sum = [g2[0] * g3[0] - g2[1] * g3[1], g2[0] * g3[1] + g2[1] * g3[0]];
        let inverse = one / (sum[0] * sum[0] + sum[1] * sum[1]).sqrt();
        let has_length = zero.lt(inverse) & inverse.lt(z.all(f32::INFINITY));
        let sum = [(sum[0] * inverse).select(has_length, one), (sum[1] * inverse).select(has_length, zero)];
        // φ_u = u Ω - γ2 - γ3 + 2π.
        let (sin, cos) = sin_cos_turns(u[0] * self.solid_angle / z.all(TAU));
        let (sin, cos) = (sin * sum[0] - cos * sum[1], cos * sum[0] + sin * sum[1]);
        // Eq. 20 to 22; b0 and b1 are the z components of the normals of the lower and upper planes.
        let (a0, a2) = ((z * z + y0 * y0).sqrt(), (z * z + y1 * y1).sqrt());
        let (b0, b1) = (-y0 / a0, y1 / a2);
        let f = (cos * b0 - b1) / sin;
        let root = (f * f + (b0 * b0 - one)).max(least).sqrt();
        let xu = (z / root).copysign(f).max(x0).min(x1);
        // Eq. 24 to 28.
        let d2 = xu * xu + z * z;
        let h0 = y0 / (d2 + y0 * y0).sqrt();
        let h1 = y1 / (d2 + y1 * y1).sqrt();
        let h = h0 + u[1] * (h1 - h0);
        let yv = h * (d2 / (one - h * h).max(least)).sqrt();
        let part = |v: L, from: L, to: L| ((v - from) / (to - from)).max(zero).min(one);
        [part(xu, x0, x1), part(yv, y0, y1)]
    }
}
