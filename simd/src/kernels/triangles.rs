//! Watertight ray/triangle tests (Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection"): the
//! scalar reference, one ray against eight triangles, sixteen rays against one triangle.
//!
//! The origin is moved to zero and space is sheared so that the ray is the +z axis. U, V, W are the signed
//! areas of the three edges with the z axis. The ray hits if no two of them have opposite signs.
//! 1. Two triangles that share an edge compute the same area with opposite sign, so that no ray slips between
//!    them. Nothing is fused, because a fused difference of products is not antisymmetric.
//! 2. An area of exactly zero in f32 is computed again in f64, where products of f32 are exact.
//! 3. All forms do the same operations in the same order: their hits agree to the bit.
//!
//! The cost: no fused multiply-add, and the rays of a packet must agree in their dominant axis.

use crate::lanes::{Lanes, Mask, Simd};

/// Shear that maps a ray to the +z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shear {
    /// Axes that become x, y, z. The direction is largest along z; x and y are swapped if that component is
    /// negative, to keep the winding.
    pub axes: [usize; 3],
    /// Shear in x and in y, scale of z.
    pub factors: [f32; 3],
}

impl Shear {
    /// Shear of a direction that is not zero.
    #[inline(always)]
    pub fn new(d: [f32; 3]) -> Self {
        let z = dominant_axis(d);
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let (x, y) = if d[z] < 0.0 { (y, x) } else { (x, y) };
        let scale = 1.0 / d[z];
        Self { axes: [x, y, z], factors: [d[x] * scale, d[y] * scale, scale] }
    }
}

/// Axis along which `d` is largest in magnitude.
#[inline(always)]
pub fn dominant_axis(d: [f32; 3]) -> usize {
    let [x, y, z] = [d[0].abs(), d[1].abs(), d[2].abs()];
    // Selections, not branches: the directions of bounces are unpredictable.
    let (most, axis) = if x > y { (x, 0) } else { (y, 1) };
    if most > z { axis } else { 2 }
}

/// Scalar reference: `(t, u, v)` of the intersection at `0 <= t <= t_max`, with the barycentric weights of
/// the second and third corner.
#[inline(always)]
pub fn intersect(
    origin: [f32; 3],
    shear: &Shear,
    t_max: f32,
    corners: [[f32; 3]; 3],
) -> Option<(f32, f32, f32)> {
    let [kx, ky, kz] = shear.axes;
    let [sx, sy, sz] = shear.factors;
    let [a, b, c] = corners.map(|p| {
        let z = p[kz] - origin[kz];
        [(p[kx] - origin[kx]) - sx * z, (p[ky] - origin[ky]) - sy * z, z]
    });
    // Twice the signed areas opposite to a, b, c.
    let mut u = c[0] * b[1] - c[1] * b[0];
    let mut v = a[0] * c[1] - a[1] * c[0];
    let mut w = b[0] * a[1] - b[1] * a[0];
    if u == 0.0 || v == 0.0 || w == 0.0 {
        let area = |p: [f32; 3], q: [f32; 3]| (p[0] as f64 * q[1] as f64 - p[1] as f64 * q[0] as f64) as f32;
        (u, v, w) = (area(c, b), area(a, c), area(b, a));
    }
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let det = (u + v) + w;
    if !inside || det == 0.0 {
        return None;
    }
    let t = ((u * (sz * a[2]) + v * (sz * b[2])) + w * (sz * c[2])) / det;
    (t >= 0.0 && t <= t_max).then(|| (t, v / det, w / det))
}

/// Result of a batch test; lanes outside `hits` are unspecified.
#[derive(Clone, Copy)]
pub struct Found<L> {
    /// Distance.
    pub t: L,
    /// Barycentric weight of the second corner.
    pub u: L,
    /// Barycentric weight of the third corner.
    pub v: L,
    /// Mask of the lanes that hit.
    pub hits: u32,
    /// Mask of the lanes on an edge in f32, which the scalar reference decides.
    pub on_edge: u32,
}

impl<L: Lanes> Found<L> {
    /// No hit; the lanes are unspecified.
    #[inline(always)]
    fn nothing(garbage: L, on_edge: u32) -> Self {
        Self { t: garbage, u: garbage, v: garbage, hits: 0, on_edge }
    }
}

/// Corner relative to the origin of the ray, with coordinates in the order of the axes.
#[inline(always)]
fn moved<L: Lanes>([x, y, z]: [L; 3], [ox, oy, oz]: [L; 3]) -> [L; 3] {
    [x - ox, y - oy, z - oz]
}

/// Corner after [`moved`], sheared so that the ray is the +z axis.
#[inline(always)]
fn turned<L: Lanes>([x, y, z]: [L; 3], [sx, sy, _]: [L; 3]) -> [L; 3] {
    [x - sx * z, y - sy * z, z]
}

/// [`moved`], then [`turned`].
#[inline(always)]
fn sheared<L: Lanes>(corner: [L; 3], origin: [L; 3], factors: [L; 3]) -> [L; 3] {
    turned(moved(corner, origin), factors)
}

/// The test over lanes of triangles or lanes of rays: sheared corners `[x, y, z]` of a, b, c.
#[inline(always)]
fn areas<L: Lanes>(zero: L, sz: L, [a, b, c]: [[L; 3]; 3], t_max: L, wanted: u32) -> Found<L> {
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    let low = u.min(v).min(w);
    let high = u.max(v).max(w);
    let det = (u + v) + w;
    let inside = (zero.le(low) | high.le(zero)).bits() & wanted;
    if inside == 0 {
        return Found::nothing(det, 0);
    }
    // A zero area among areas of one sign: one of the extremes is zero.
    let on_edge = (low.eq(zero) | high.eq(zero)).bits() & inside;
    let t = ((u * (sz * a[2]) + v * (sz * b[2])) + w * (sz * c[2])) / det;
    let hits = (zero.le(t) & t.le(t_max)).bits() & inside & !on_edge;
    if hits == 0 {
        return Found::nothing(det, on_edge);
    }
    Found { t, u: v / det, v: w / det, hits, on_edge }
}

/// Result of [`ShearRay8::areas`]. The divisions are left for the hit that counts.
#[derive(Clone, Copy, Debug)]
pub struct Areas {
    /// Distance; infinite in lanes that do not hit.
    pub t: [f32; 8],
    /// Twice the area opposite to the second corner.
    pub v: [f32; 8],
    /// Twice the area opposite to the third corner.
    pub w: [f32; 8],
    /// Twice the area of the whole triangle, as seen along the ray.
    pub det: [f32; 8],
    /// Mask of the lanes that hit.
    pub hits: u32,
    /// Mask of the lanes on an edge in f32, which the scalar reference decides.
    pub on_edge: u32,
}

impl Areas {
    /// No hit.
    pub const NONE: Areas =
        Areas { t: [f32::INFINITY; 8], v: [0.0; 8], w: [0.0; 8], det: [0.0; 8], hits: 0, on_edge: 0 };

    /// Mask of the nearest hit: one lane, or several at equal distance.
    #[inline(always)]
    pub fn nearest<S: Simd>(&self, simd: S) -> u32 {
        let t = simd.load8(&self.t);
        t.eq(simd.splat8(t.smallest())).bits() & self.hits
    }
}

/// Ray in all lanes, for tests against eight triangles at once.
#[derive(Clone, Copy)]
pub struct ShearRay8<S: Simd> {
    axes: [usize; 3],
    origin: [S::F8; 3],
    factors: [S::F8; 3],
}

impl<S: Simd> ShearRay8<S> {
    /// Broadcasts the ray.
    #[inline(always)]
    pub fn new(simd: S, origin: [f32; 3], shear: &Shear) -> Self {
        let [kx, ky, kz] = shear.axes;
        let [sx, sy, sz] = shear.factors;
        Self {
            axes: shear.axes,
            origin: [simd.splat8(origin[kx % 3]), simd.splat8(origin[ky % 3]), simd.splat8(origin[kz % 3])],
            factors: [simd.splat8(sx), simd.splat8(sy), simd.splat8(sz)],
        }
    }

    /// Ray from its origin along the axes of the shear, and its factors.
    #[inline(always)]
    pub fn along(simd: S, axes: [usize; 3], [ox, oy, oz]: [f32; 3], [sx, sy, sz]: [f32; 3]) -> Self {
        Self {
            axes,
            origin: [simd.splat8(ox), simd.splat8(oy), simd.splat8(oz)],
            factors: [simd.splat8(sx), simd.splat8(sy), simd.splat8(sz)],
        }
    }

    /// [`Self::meets`] without a branch on the result.
    #[inline(always)]
    pub fn areas(&self, simd: S, values: &[f32], start: usize, count: usize, t_max: f32) -> Option<Areas> {
        let corners = simd.load8x9(values, start, count, self.axes)?;
        let [_, _, sz] = self.factors;
        let [a, b, c] = [
            sheared(corners[0], self.origin, self.factors),
            sheared(corners[1], self.origin, self.factors),
            sheared(corners[2], self.origin, self.factors),
        ];
        let zero = simd.splat8(0.0);
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let low = u.min(v).min(w);
        let high = u.max(v).max(w);
        let det = (u + v) + w;
        let inside = zero.le(low) | high.le(zero);
        let edge = low.eq(zero) | high.eq(zero);
        let t = ((u * (sz * a[2]) + v * (sz * b[2])) + w * (sz * c[2])) / det;
        let inside = inside & simd.first8(count as u32);
        let on_edge = (inside & edge).bits();
        let met = inside & !edge & zero.le(t) & t.le(simd.splat8(t_max));
        let hits = met.bits();
        // A lane on an edge may be no hit and must not be the nearest.
        let t = t.select(met, simd.splat8(f32::INFINITY));
        Some(Areas { t: t.to_array(), v: v.to_array(), w: w.to_array(), det: det.to_array(), hits, on_edge })
    }

    /// Tests `count` (1 … 8) triangles. Their coordinates lie in `values` from `start` on, in nine runs of
    /// `count` floats: x of all first corners, y, z, then the second corners, then the third. Eight floats
    /// must be readable from the start of every run, otherwise the result is `None`.
    #[inline(always)]
    pub fn meets(
        &self,
        simd: S,
        values: &[f32],
        start: usize,
        count: usize,
        t_max: f32,
    ) -> Option<Found<S::F8>> {
        let [a, b, c] = simd.load8x9(values, start, count, self.axes)?;
        let [_, _, sz] = self.factors;
        let sheared = [
            sheared(a, self.origin, self.factors),
            sheared(b, self.origin, self.factors),
            sheared(c, self.origin, self.factors),
        ];
        let wanted = (1u32 << count) - 1;
        Some(areas(simd.splat8(0.0), sz, sheared, simd.splat8(t_max), wanted))
    }
}

/// Sixteen rays of the same [`Shear::axes`], for tests against one triangle at a time.
#[derive(Clone, Copy)]
pub struct ShearRays16<S: Simd> {
    /// Axes that become x, y, z, for all rays.
    pub axes: [usize; 3],
    /// Origins along those axes.
    pub origin: [S::F16; 3],
    /// Shear in x and y, scale of z.
    pub factors: [S::F16; 3],
}

impl<S: Simd> ShearRays16<S> {
    /// Tests the rays `wanted` against the triangle whose first coordinate is `values[start]`, in runs of
    /// `stride` as in [`ShearRay8::meets`]. `None` if a run is not in the slice.
    #[inline(always)]
    pub fn meets(
        &self,
        simd: S,
        values: &[f32],
        start: usize,
        stride: usize,
        t_max: S::F16,
        wanted: u32,
    ) -> Option<Found<S::F16>> {
        let corners = self.moved(simd, values, start, stride)?;
        Some(self.meets_moved(simd, &corners, t_max, wanted))
    }

    /// Corners of that triangle relative to the origins, equal for all rays of the same origin and axes.
    #[inline(always)]
    pub fn moved(&self, simd: S, values: &[f32], start: usize, stride: usize) -> Option<[[S::F16; 3]; 3]> {
        let [a, b, c] = simd.splat16x9(values, start, stride, self.axes)?;
        Some([moved(a, self.origin), moved(b, self.origin), moved(c, self.origin)])
    }

    /// [`Self::meets`] for corners of [`Self::moved`].
    #[inline(always)]
    pub fn meets_moved(
        &self,
        simd: S,
        corners: &[[S::F16; 3]; 3],
        t_max: S::F16,
        wanted: u32,
    ) -> Found<S::F16> {
        let [a, b, c] = *corners;
        let [_, _, sz] = self.factors;
        let sheared = [turned(a, self.factors), turned(b, self.factors), turned(c, self.factors)];
        areas(simd.splat16(0.0), sz, sheared, t_max, wanted)
    }
}
