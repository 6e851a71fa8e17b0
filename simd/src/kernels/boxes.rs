//! One ray against eight boxes, sixteen rays against one box: the slab test (Kay, Kajiya 1986).
//!
//! Plainly: per axis the ray is inside the slab from `(lo - o) / d` to `(hi - o) / d`; it meets the box
//! where the latest entry is not after the earliest exit. Departures from that:
//! 1. The division is a product with the reciprocal, clamped to finite values; so no `0 * inf`.
//! 2. Which plane is the near one is known from the direction's sign, once per ray.
//! 3. The exit is lengthened by [`ROBUST`], the rounding of both products: no box is missed whose
//!    triangle is hit (Ize 2013, "Robust BVH Ray Traversal"). The price: a few boxes too many.
//!
//! An empty box has `lo = +inf`, `hi = -inf` and is never met.

use super::safe_reciprocal;
use crate::lanes::{Lanes, Mask, Simd};

/// 1 + 2 gamma(3), what the roundings of subtraction, reciprocal and product can amount to, and as much again
/// for the roundings of the distance of a hit, with which entries are compared.
pub const ROBUST: f32 = 1.000_001;

/// Planes of eight boxes: rows `[lo x, hi x, lo y, hi y, lo z, hi z]`, each for the eight boxes.
/// Two more rows are the caller's: eight rows make any row index safe by a mask.
pub type Boxes8 = [[f32; 8]; 8];

/// A ray as the slab test wants it.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// Clamped reciprocals of its direction.
    pub reciprocal: [f32; 3],
    /// Row of the near plane in [`Boxes8`], per axis; the far plane is `row ^ 1`.
    pub near: [usize; 3],
}

impl SlabRay {
    /// From a ray of finite origin and direction.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let reciprocal = direction.map(safe_reciprocal);
        let near = core::array::from_fn(|axis| 2 * axis + reciprocal[axis].is_sign_negative() as usize);
        Self { origin, reciprocal, near }
    }

    /// Scalar reference: entry distance into box `i`, where the ray meets it before `t_max`.
    pub fn enters(&self, boxes: &Boxes8, i: usize, t_max: f32) -> Option<f32> {
        let (mut entry, mut exit) = (0.0f32, t_max);
        for axis in 0..3 {
            let at = |row: usize| (boxes[row][i] - self.origin[axis]) * self.reciprocal[axis];
            entry = entry.max(at(self.near[axis]));
            exit = exit.min(at(self.near[axis] ^ 1));
        }
        (entry <= exit * ROBUST).then_some(entry)
    }
}

/// A [`SlabRay`] in all lanes.
#[derive(Clone, Copy)]
pub struct SlabRay8<S: Simd> {
    origin: [S::F8; 3],
    reciprocal: [S::F8; 3],
    near: [usize; 3],
}

impl<S: Simd> SlabRay8<S> {
    /// Broadcasts the ray.
    #[inline(always)]
    pub fn new(simd: S, ray: &SlabRay) -> Self {
        let [ox, oy, oz] = ray.origin;
        let [rx, ry, rz] = ray.reciprocal;
        Self {
            origin: [simd.splat8(ox), simd.splat8(oy), simd.splat8(oz)],
            reciprocal: [simd.splat8(rx), simd.splat8(ry), simd.splat8(rz)],
            near: ray.near,
        }
    }

    /// Entry distances into eight boxes, and the bits of those that are met before `t_max`.
    #[inline(always)]
    pub fn enters(&self, simd: S, boxes: &Boxes8, t_max: f32) -> (S::F8, u32) {
        let (entry, exit) = self.interval(simd, boxes, t_max);
        (entry, entry.le(exit).bits())
    }

    /// Entry and (lengthened) exit distances of eight boxes; a box is met where `entry <= exit`.
    #[inline(always)]
    pub fn interval(&self, simd: S, boxes: &Boxes8, t_max: f32) -> (S::F8, S::F8) {
        let [x, y, z] = self.near;
        let entry = self.at(simd, boxes, x, 0).max(self.at(simd, boxes, y, 1));
        let entry = entry.max(self.at(simd, boxes, z, 2).max(simd.splat8(0.0)));
        let exit = self.at(simd, boxes, x ^ 1, 0).min(self.at(simd, boxes, y ^ 1, 1));
        let exit = exit.min(self.at(simd, boxes, z ^ 1, 2).min(simd.splat8(t_max)));
        (entry, exit * simd.splat8(ROBUST))
    }

    /// Where the ray crosses the planes of a row.
    #[inline(always)]
    fn at(&self, simd: S, boxes: &Boxes8, row: usize, axis: usize) -> S::F8 {
        (simd.load8(&boxes[row & 7]) - self.origin[axis]) * self.reciprocal[axis]
    }
}

/// Sixteen rays as the slab test wants them, of which all directions have the same signs.
#[derive(Clone, Copy)]
pub struct SlabRays16<S: Simd> {
    /// Where they start, per axis.
    pub origin: [S::F16; 3],
    /// Clamped reciprocals of their directions, per axis.
    pub reciprocal: [S::F16; 3],
    /// Row of the near plane in [`Boxes8`], per axis.
    pub near: [usize; 3],
}

impl<S: Simd> SlabRays16<S> {
    /// Entry distances of the rays into box `i`, and the bits of those that meet it before `t_max`.
    #[inline(always)]
    pub fn enters(&self, simd: S, boxes: &Boxes8, i: usize, t_max: S::F16) -> (S::F16, u32) {
        let [x, y, z] = self.near;
        let entry = self.at(simd, boxes, x, i, 0).max(self.at(simd, boxes, y, i, 1));
        let entry = entry.max(self.at(simd, boxes, z, i, 2).max(simd.splat16(0.0)));
        let exit = self.at(simd, boxes, x ^ 1, i, 0).min(self.at(simd, boxes, y ^ 1, i, 1));
        let exit = exit.min(self.at(simd, boxes, z ^ 1, i, 2).min(t_max));
        (entry, entry.le(exit * simd.splat16(ROBUST)).bits())
    }

    /// Where the rays cross a plane.
    #[inline(always)]
    fn at(&self, simd: S, boxes: &Boxes8, row: usize, i: usize, axis: usize) -> S::F16 {
        (simd.splat16(boxes[row & 7][i & 7]) - self.origin[axis]) * self.reciprocal[axis]
    }
}

/// What all rays of a packet have in common: intervals of their origins and reciprocals. A box that the
/// interval misses is missed by every ray (Wald et al. 2007, "Ray Tracing Deformable Scenes using Dynamic
/// Bounding Volume Hierarchies", section 4).
#[derive(Clone, Copy, Debug)]
pub struct SlabInterval {
    /// Row of the near plane in [`Boxes8`], per axis.
    pub near: [usize; 3],
    /// The origin from which the near plane is nearest.
    pub entry_origin: [f32; 3],
    /// The origin from which the far plane is farthest.
    pub exit_origin: [f32; 3],
    /// Smallest and largest reciprocal.
    pub reciprocal: [[f32; 3]; 2],
}

impl SlabInterval {
    /// Of rays whose directions have the signs that `near` says; `[smallest, largest]` of each.
    #[inline(always)]
    pub fn new(near: [usize; 3], origin: [[f32; 3]; 2], reciprocal: [[f32; 3]; 2]) -> Self {
        let [least, most] = origin;
        let mut interval = Self { near, entry_origin: most, exit_origin: least, reciprocal };
        for axis in 0..3 {
            if near[axis] & 1 == 1 {
                interval.entry_origin[axis] = least[axis];
                interval.exit_origin[axis] = most[axis];
            }
        }
        interval
    }
}

/// A [`SlabInterval`] in all lanes.
#[derive(Clone, Copy)]
pub struct SlabInterval8<S: Simd> {
    near: [usize; 3],
    entry_origin: [S::F8; 3],
    exit_origin: [S::F8; 3],
    least: [S::F8; 3],
    most: [S::F8; 3],
}

impl<S: Simd> SlabInterval8<S> {
    /// Broadcasts the interval.
    #[inline(always)]
    pub fn new(simd: S, i: &SlabInterval) -> Self {
        Self {
            near: i.near,
            entry_origin: splat3(simd, i.entry_origin),
            exit_origin: splat3(simd, i.exit_origin),
            least: splat3(simd, i.reciprocal[0]),
            most: splat3(simd, i.reciprocal[1]),
        }
    }

    /// Bounds of the entry and (lengthened) exit distances of eight boxes; a box that some ray meets before
    /// `t_max` has `entry <= exit`.
    #[inline(always)]
    pub fn interval(&self, simd: S, boxes: &Boxes8, t_max: f32) -> (S::F8, S::F8) {
        let [x, y, z] = self.near;
        let entry = self.entry(simd, boxes, x, 0).max(self.entry(simd, boxes, y, 1));
        let entry = entry.max(self.entry(simd, boxes, z, 2).max(simd.splat8(0.0)));
        let exit = self.exit(simd, boxes, x ^ 1, 0).min(self.exit(simd, boxes, y ^ 1, 1));
        let exit = exit.min(self.exit(simd, boxes, z ^ 1, 2).min(simd.splat8(t_max)));
        (entry, exit * simd.splat8(ROBUST))
    }

    /// Bits of the triangles that some ray may meet before `t_max`, by their boxes widened by `slack`. The
    /// triangles stand in `values` as [`super::triangles::ShearRay8::meets`] wants them.
    #[inline(always)]
    pub fn may_meet(
        &self,
        simd: S,
        values: &[f32],
        start: usize,
        count: usize,
        slack: f32,
        t_max: f32,
    ) -> u32 {
        let Some([a, b, c]) = simd.load8x9(values, start, count, [0, 1, 2]) else { return 0 };
        let slack = simd.splat8(slack);
        let (mut entry, mut exit) = (simd.splat8(0.0), simd.splat8(t_max));
        for axis in 0..3 {
            let lo = a[axis].min(b[axis]).min(c[axis]) - slack;
            let hi = a[axis].max(b[axis]).max(c[axis]) + slack;
            let (near, far) = if self.near[axis] & 1 == 0 { (lo, hi) } else { (hi, lo) };
            entry = entry.max(self.entry_at(near, axis));
            exit = exit.min(self.exit_at(far, axis));
        }
        entry.le(exit * simd.splat8(ROBUST)).bits()
    }

    #[inline(always)]
    fn entry(&self, simd: S, boxes: &Boxes8, row: usize, axis: usize) -> S::F8 {
        self.entry_at(simd.load8(&boxes[row & 7]), axis)
    }

    #[inline(always)]
    fn exit(&self, simd: S, boxes: &Boxes8, row: usize, axis: usize) -> S::F8 {
        self.exit_at(simd.load8(&boxes[row & 7]), axis)
    }

    #[inline(always)]
    fn entry_at(&self, planes: S::F8, axis: usize) -> S::F8 {
        let way = planes - self.entry_origin[axis];
        (way * self.least[axis]).min(way * self.most[axis])
    }

    #[inline(always)]
    fn exit_at(&self, planes: S::F8, axis: usize) -> S::F8 {
        let way = planes - self.exit_origin[axis];
        (way * self.least[axis]).max(way * self.most[axis])
    }
}

#[inline(always)]
fn splat3<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [S::F8; 3] {
    [simd.splat8(x), simd.splat8(y), simd.splat8(z)]
}
