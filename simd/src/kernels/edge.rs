//! Contribution of one edge of the environment to the derivatives of irradiance: an edge of a polygon of
//! radiance 1, seen from the receiver at the origin with normal +z.
//!
//! If the receiver moves by dx, a boundary at distance r moves by -dx/r on the sphere of directions. The
//! derivatives of ∫ cos dω over the polygon are therefore integrals along its boundary alone, with w the
//! direction and ν the inward normal of the boundary (Reynolds' transport theorem; x and y only):
//!
//!   grad E = ∫ cos ν/r ds,   Hess E = ∫ 4 cos Sym(ν ⊗ w)/r² ds,   n × ∂E/∂n = n × ½ ∫ ν ds.
//!
//! An edge is straight in space, from a/u to b/v: unit directions a, b, inverse distances u, v. With θ the
//! angle between them, s = sin θ, c = cos θ, z = 1 - c, the integrals consist of P = (θ - s c)/s³,
//! Q = (s - θ c)/s³ and U22 = (θ(1 + 2c²) - 3 s c)/8s⁵. Departures from the textbook (Arvo 1994; Holzschuch,
//! Sillion 1998):
//! 1. Nothing is divided by s. With k = (θ/s - 1)/z and k₁ = (k - 1/3)/z: P - Q = k,
//!    P + Q = (2 + z k)/(2 - z), and U22 is a sum of positive terms over (2 - z)².
//! 2. k₁ is a polynomial in z = |b - a|²/2, and a × b is a × (b - a). An acos, a cosine or a plain product of
//!    near directions would lose more digits the smaller the angle.
//! 3. Distances enter as inverses: a miss is u = 0 and no special case.
//!
//! The cost: an edge longer than a right angle is beyond the polynomial and must be halved first. Edges in
//! the horizon contribute nothing, so that a polygon may be left open there.

use core::ops::{Add, Div, Mul, Sub};

/// k₁(z) for 0 <= z <= 1, lowest power first. Relative error 1.2e-7, which its use reduces.
const K1: [f32; 9] = [
    0.133_333_35,
    0.057_140_4,
    0.025_460_95,
    0.010_907_974,
    0.008_435_632,
    -0.005_838_643,
    0.013_765_093,
    -0.009_744_39,
    0.004_002_603,
];

/// Contribution of an edge to the derivatives of irradiance E per radiance on its left; negated per radiance
/// on its right. E is π for a full hemisphere of radiance 1.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Flux<T> {
    /// ∂E/∂x, ∂E/∂y.
    pub gradient: [T; 2],
    /// n × ∂E/∂n: a receiver of normal n' has the irradiance E + rotation · (n × n') to first order.
    pub rotation: [T; 2],
    /// ∂²E/∂x², ∂²E/∂x∂y, ∂²E/∂y².
    pub hessian: [T; 3],
}

/// Number or register of numbers.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
}
impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>> Number for T {}

/// Contribution of the edge from `a` to `b` (unit directions, at most a right angle apart) at inverse
/// distances `u` and `v`, with the polygon on its left as seen by the receiver. `all` converts a constant to
/// a number.
#[inline(always)]
pub fn flux<T: Number>(all: impl Fn(f32) -> T, a: [T; 3], u: T, b: [T; 3], v: T) -> Flux<T> {
    let [half, two] = [all(0.5), all(2.0)];
    let e = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let z = half * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
    let mut k1 = all(K1[8]);
    for coefficient in K1[..8].iter().rev() {
        k1 = k1 * z + all(*coefficient);
    }
    let k = all(1.0 / 3.0) + z * k1;
    let g = all(1.0) + z * k;
    let inverse = all(1.0) / (two - z);
    let sum = (g + all(1.0)) * inverse;
    let (p, q) = (half * (sum + k), half * (sum - k));
    // U22 = (2/3 (1 + z) + k₁ (3 - 4z + 2z²)) / 8 (2 - z)²; the other two by integration by parts.
    let numerator = all(2.0 / 3.0) * (all(1.0) + z) + k1 * (all(3.0) - z * (all(4.0) - two * z));
    let u22 = all(0.125) * numerator * (inverse * inverse);
    let c = all(1.0) - z;
    let u31 = all(0.25) * q - c * u22;
    let u40 = half * p - u22 - two * c * u31;
    // a × b, of length s.
    let (cx, cy) = (a[1] * e[2] - a[2] * e[1], a[2] * e[0] - a[0] * e[2]);

    let slope = half * (a[2] * (p * u + q * v) + b[2] * (p * v + q * u));
    let (uu, uv, vv) = (u * u, u * v, v * v);
    let maa = u40 * uu + two * u31 * uv + u22 * vv;
    let mbb = u22 * uu + two * u31 * uv + u40 * vv;
    let mab = u31 * (uu + vv) + two * u22 * uv;
    let (wa, wb) = (maa * a[2] + mab * b[2], mab * a[2] + mbb * b[2]);
    let (wx, wy) = (wa * a[0] + wb * b[0], wa * a[1] + wb * b[1]);
    let turn = half * g;
    Flux {
        gradient: [cx * slope, cy * slope],
        rotation: [all(-0.5) * g * cy, turn * cx],
        hessian: [all(4.0) * (cx * wx), two * (cx * wy + cy * wx), all(4.0) * (cy * wy)],
    }
}

/// Scalar reference, for an edge of any length; zero if its ends are opposite, which defines no edge.
pub fn flux_of(a: [f32; 3], u: f32, b: [f32; 3], v: f32) -> Flux<f32> {
    let cos = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if cos >= 0.0 {
        return flux(|x| x, a, u, b, v);
    }
    let m = [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    let length = libm::sqrtf(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    if length < f32::EPSILON {
        return Flux::default();
    }
    // The inverse distance of a line in space is linear in the direction.
    let (m, w) = (m.map(|x| x / length), (u + v) / length);
    flux(|x| x, a, u, m, w) + flux(|x| x, m, w, b, v)
}

impl<T: Number> Add for Flux<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (Flux { gradient: g, rotation: r, hessian: h }, o) = (self, other);
        Self {
            gradient: [g[0] + o.gradient[0], g[1] + o.gradient[1]],
            rotation: [r[0] + o.rotation[0], r[1] + o.rotation[1]],
            hessian: [h[0] + o.hessian[0], h[1] + o.hessian[1], h[2] + o.hessian[2]],
        }
    }
}

#[cfg(test)]
mod tests;
