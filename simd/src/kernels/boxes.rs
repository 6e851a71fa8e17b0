//! Slab test (Kay, Kajiya 1986): one ray against eight boxes, sixteen rays against one box.
//!
//! On each axis the ray is inside the slab from `(lo - o) / d` to `(hi - o) / d`. The ray meets the box if
//! the latest entry is not after the earliest exit. Departures:
//! 1. The division is a product with the reciprocal, clamped to finite values, so that `0 * inf` never
//!    occurs.
//! 2. The sign of the direction determines the near plane, once per ray.
//! 3. The exit is lengthened by [`ROBUST`], the rounding of both products: no box is missed whose triangle is
//!    hit (Ize 2013, "Robust BVH Ray Traversal"). The cost: a few boxes too many.
//!
//! An empty box has `lo = +inf`, `hi = -inf` and is never met.

use super::safe_reciprocal;
use crate::lanes::{Lanes, Mask, Simd};

/// 1 + 2 gamma(3): the roundings of subtraction, reciprocal and product, and as much again for the roundings
/// of the distance of a hit, which is compared with entries.
pub const ROBUST: f32 = 1.000_001;

/// Planes of eight boxes: rows `[lo x, hi x, lo y, hi y, lo z, hi z]`, each for the eight boxes. The other
/// two rows belong to the caller: with eight rows a mask makes any row index safe.
pub type Boxes8 = [[f32; 8]; 8];

/// Ray prepared for the slab test.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    /// Origin.
    pub origin: [f32; 3],
    /// Clamped reciprocals of the direction.
    pub reciprocal: [f32; 3],
    /// Row of the near plane in [`Boxes8`], per axis; the far plane is `row ^ 1`.
    pub near: [usize; 3],
}

impl SlabRay {
    /// Prepares a ray of finite origin and direction.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let reciprocal = direction.map(safe_reciprocal);
        let near = core::array::from_fn(|axis| 2 * axis + reciprocal[axis].is_sign_negative() as usize);
        Self { origin, reciprocal, near }
    }

    /// Scalar reference: entry distance into box `i`, if the ray meets it before `t_max`.
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
    octant: usize,
}

impl<S: Simd> SlabRay8<S> {
    /// Broadcasts the ray.
    #[inline(always)]
    pub fn new(simd: S, ray: &SlabRay) -> Self {
        let [x, y, z] = ray.near;
        Self::towards(simd, ray.origin, ray.reciprocal, (x & 1) | (y & 1) << 1 | (z & 1) << 2)
    }

    /// Prepares a ray from its origin, clamped reciprocals, and the signs of the direction as bits of
    /// `octant`.
    #[inline(always)]
    pub fn towards(simd: S, origin: [f32; 3], reciprocal: [f32; 3], octant: usize) -> Self {
        Self { origin: splat3(simd, origin), reciprocal: splat3(simd, reciprocal), octant }
    }

    /// Entry distances into eight boxes, and the mask of those met before `t_max`.
    #[inline(always)]
    pub fn enters(&self, simd: S, boxes: &Boxes8, t_max: f32) -> (S::F8, u32) {
        let (entry, exit) = self.interval(simd, boxes, t_max);
        (entry, entry.le(exit).bits())
    }

    /// Entry and lengthened exit distances of eight boxes. The ray meets a box if `entry <= exit`.
    #[inline(always)]
    pub fn interval(&self, simd: S, boxes: &Boxes8, t_max: f32) -> (S::F8, S::F8) {
        let planes: &[f32; 64] = boxes.as_flattened().first_chunk().unwrap_or(&[0.0; 64]);
        // The near plane of an axis is one row further if the direction is negative.
        let [x, y, z] = [(self.octant << 3) & 8, (self.octant << 2) & 8, (self.octant << 1) & 8];
        let entry = self.at(simd, planes, x, 0).max(self.at(simd, planes, 16 + y, 1));
        let entry = entry.max(self.at(simd, planes, 32 + z, 2).max(simd.splat8(0.0)));
        let exit = self.at(simd, planes, x ^ 8, 0).min(self.at(simd, planes, 16 + (y ^ 8), 1));
        let exit = exit.min(self.at(simd, planes, 32 + (z ^ 8), 2).min(simd.splat8(t_max)));
        (entry, exit * simd.splat8(ROBUST))
    }

    /// Distances to the planes from index `first` on.
    #[inline(always)]
    fn at(&self, simd: S, planes: &[f32; 64], first: usize, axis: usize) -> S::F8 {
        let row = planes.get(first..).and_then(|rest| rest.first_chunk()).unwrap_or(&[0.0; 8]);
        (simd.load8(row) - self.origin[axis]) * self.reciprocal[axis]
    }
}

/// Sixteen rays prepared for the slab test, with the same signs of direction.
#[derive(Clone, Copy)]
pub struct SlabRays16<S: Simd> {
    /// Origins, per axis.
    pub origin: [S::F16; 3],
    /// Clamped reciprocals of the directions, per axis.
    pub reciprocal: [S::F16; 3],
    /// Row of the near plane in [`Boxes8`], per axis.
    pub near: [usize; 3],
}

impl<S: Simd> SlabRays16<S> {
    /// Entry distances of the rays into box `i`, and the mask of those that meet it before `t_max`.
    #[inline(always)]
    pub fn enters(&self, simd: S, boxes: &Boxes8, i: usize, t_max: S::F16) -> (S::F16, u32) {
        self.enters_moved(simd, &self.moved(simd, boxes, i), t_max)
    }

    /// Near and far planes of box `i` relative to the origins, equal for all rays of the same origin.
    #[inline(always)]
    pub fn moved(&self, simd: S, boxes: &Boxes8, i: usize) -> [[S::F16; 3]; 2] {
        let [x, y, z] = self.near;
        let [ox, oy, oz] = self.origin;
        let plane = |row: usize| simd.splat16(boxes[row & 7][i & 7]);
        [
            [plane(x) - ox, plane(y) - oy, plane(z) - oz],
            [plane(x ^ 1) - ox, plane(y ^ 1) - oy, plane(z ^ 1) - oz],
        ]
    }

    /// [`Self::enters`] for planes of [`Self::moved`].
    #[inline(always)]
    pub fn enters_moved(&self, simd: S, planes: &[[S::F16; 3]; 2], t_max: S::F16) -> (S::F16, u32) {
        let [near, far] = planes;
        let [rx, ry, rz] = self.reciprocal;
        let entry = (near[0] * rx).max(near[1] * ry).max((near[2] * rz).max(simd.splat16(0.0)));
        let exit = (far[0] * rx).min(far[1] * ry).min((far[2] * rz).min(t_max));
        (entry, entry.le(exit * simd.splat16(ROBUST)).bits())
    }
}

/// Interval of a packet: ranges of the origins and reciprocals of its rays. A box that the interval misses is
/// missed by every ray (Wald et al. 2007, "Ray Tracing Deformable Scenes using Dynamic Bounding Volume
/// Hierarchies", section 4).
#[derive(Clone, Copy, Debug)]
pub struct SlabInterval {
    /// Row of the near plane in [`Boxes8`], per axis.
    pub near: [usize; 3],
    /// Origin from which the near plane is nearest.
    pub entry_origin: [f32; 3],
    /// Origin from which the far plane is farthest.
    pub exit_origin: [f32; 3],
    /// Smallest and largest reciprocal.
    pub reciprocal: [[f32; 3]; 2],
}

impl SlabInterval {
    /// Interval of rays whose directions have the signs of `near`; `[smallest, largest]` of origins and
    /// reciprocals.
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

    /// Bounds of the entry and lengthened exit distances of eight boxes. If some ray meets a box before
    /// `t_max`, the box has `entry <= exit`.
    #[inline(always)]
    pub fn interval(&self, simd: S, boxes: &Boxes8, t_max: f32) -> (S::F8, S::F8) {
        let [x, y, z] = self.near;
        let entry = self.entry(simd, boxes, x, 0).max(self.entry(simd, boxes, y, 1));
        let entry = entry.max(self.entry(simd, boxes, z, 2).max(simd.splat8(0.0)));
        let exit = self.exit(simd, boxes, x ^ 1, 0).min(self.exit(simd, boxes, y ^ 1, 1));
        let exit = exit.min(self.exit(simd, boxes, z ^ 1, 2).min(simd.splat8(t_max)));
        (entry, exit * simd.splat8(ROBUST))
    }

    /// Mask of the triangles that some ray may meet before `t_max`, by their boxes widened by `slack`. The
    /// layout of the triangles in `values` is that of [`super::triangles::ShearRay8::meets`].
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
