//! One ray on its way through the tree, a step at a time: nearest hit or any hit.
//!
//! Plainly: visit the boxes that the ray meets, near ones first, and skip those beyond the best hit so far.
//! 1. Eight boxes are tested at once. Those that are met go on the stack without a branch, in an order that
//!    the build has prepared for the octant of the direction: nearly that of distance, and not sorted.
//! 2. Up to eight triangles are tested at once.
//! 3. Of hits at the same distance the lowest triangle index wins, and a box at exactly the best distance
//!    is still entered: so the hit does not depend on the order of the walk.
//! 4. A step handles the top of the stack, which was settled the step before: its branches are known at
//!    once, and its node has been asked for. That is what [`super::stream`] lives on.

use super::Bvh;
use super::layout::Child;
use crate::geometry::{Hit, MISS, Ray};
use halflight_simd::kernels::boxes::{ROBUST, SlabRay, SlabRay8};
use halflight_simd::kernels::triangles::{Found, Shear, ShearRay8, intersect};
use halflight_simd::{Lanes, Simd, Stacks};

/// One ray on its way.
pub(super) struct Walk {
    slab: SlabRay,
    shear: Shear,
    octant: usize,
    best: Hit,
    /// Whether it has nowhere to go.
    pub(super) idle: bool,
    /// Of the ray in its batch.
    pub(super) index: u32,
    height: usize,
    stacks: Stacks,
}

impl Walk {
    /// Not on its way. All zeros: cheap to make.
    pub(super) const IDLE: Walk = Walk {
        slab: SlabRay { origin: [0.0; 3], reciprocal: [0.0; 3], near: [0; 3] },
        shear: Shear { axes: [0; 3], factors: [0.0; 3] },
        octant: 0,
        best: Hit { t: 0.0, u: 0.0, v: 0.0, triangle: 0 },
        idle: false,
        index: 0,
        height: 0,
        stacks: Stacks::new(),
    };

    /// The whole way of one ray.
    #[inline(always)]
    pub(super) fn trace<S: Simd, const ANY: bool>(&mut self, simd: S, bvh: &Bvh, ray: &Ray) -> Hit {
        if !traceable(ray) {
            return Hit::NONE;
        }
        self.start(ray, 0, Child::node(0).0, 0.0, Hit { t: ray.t_max, u: 0.0, v: 0.0, triangle: MISS });
        while self.step::<S, ANY>(simd, bvh) {}
        self.hit()
    }

    /// The best hit so far.
    #[inline(always)]
    pub(super) fn hit(&self) -> Hit {
        if self.best.triangle == MISS { Hit::NONE } else { self.best }
    }

    /// Sets out into the subtree `child`, which the ray enters at `entry`, with what it has found so far.
    #[inline(always)]
    pub(super) fn start(&mut self, ray: &Ray, index: u32, child: u32, entry: f32, best: Hit) {
        self.slab = SlabRay::new(ray.origin, ray.direction);
        self.shear = Shear::new(ray.direction);
        let [x, y, z] = self.slab.near;
        self.octant = (x & 1) | (y & 1) << 1 | (z & 1) << 2;
        self.best = best;
        self.index = index;
        self.stacks.items[0] = child;
        self.stacks.entries[0] = entry;
        self.height = 1;
    }

    /// Handles the top of the stack; whether the walk goes on.
    #[inline(always)]
    pub(super) fn step<S: Simd, const ANY: bool>(&mut self, simd: S, bvh: &Bvh) -> bool {
        if self.height == 0 {
            return false;
        }
        self.height -= 1;
        let (bits, entry) = self.stacks.get(self.height);
        let child = Child(bits);
        if entry > self.best.t * ROBUST {
            return true;
        }
        if !child.is_leaf() {
            let Some(node) = bvh.nodes.get(child.0 as usize) else { return false };
            let (entry, exit) = SlabRay8::new(simd, &self.slab).interval(simd, &node.rows, self.best.t);
            let order = node.order_of(self.octant);
            self.height = simd.push8(order, entry, exit, &node.rows[6], &mut self.stacks, self.height);
        } else {
            let (first, count) = child.triangles();
            let shear_ray = ShearRay8::new(simd, self.slab.origin, &self.shear);
            if let Some(found) = shear_ray.meets(simd, bvh.coordinates, 9 * first, count, self.best.t)
                && found.hits | found.doubtful != 0
            {
                take(bvh, self.slab.origin, &self.shear, first, count, &found, &mut self.best);
                if ANY && self.best.triangle != MISS {
                    return false;
                }
            }
        }
        let next = Child(self.stacks.get(self.height.wrapping_sub(1)).0);
        let index = if next.is_leaf() { 9 * next.triangles().0 } else { next.0 as usize };
        simd.prefetch(bvh.nodes, bvh.coordinates, next.is_leaf(), index);
        true
    }
}

/// Whether the ray can be traced at all: finite, and going somewhere. Without branches.
#[inline(always)]
pub(super) fn traceable(ray: &Ray) -> bool {
    let magnitude = |x: f32| x.to_bits() & 0x7fff_ffff;
    let [ox, oy, oz] = ray.origin;
    let [dx, dy, dz] = ray.direction;
    let direction = magnitude(dx).max(magnitude(dy)).max(magnitude(dz));
    let largest = direction.max(magnitude(ox)).max(magnitude(oy)).max(magnitude(oz));
    (largest < f32::INFINITY.to_bits()) & (direction > 0) & (ray.t_max >= 0.0)
}

/// The corners of triangle `i` of a leaf of `count`, from its runs of coordinates.
#[inline(always)]
pub(super) fn corners_of(runs: &[f32], count: usize, i: usize) -> [[f32; 3]; 3] {
    let mut corners = [[f32::NAN; 3]; 3];
    let mut at = i;
    for corner in &mut corners {
        for x in corner {
            *x = runs.get(at).copied().unwrap_or(f32::NAN);
            at += count;
        }
    }
    corners
}

/// Takes over what a leaf test found, nearest first and of equals the lowest index.
#[inline(always)]
fn take<L: Lanes<Array = [f32; 8]>>(
    bvh: &Bvh,
    origin: [f32; 3],
    shear: &Shear,
    first: usize,
    count: usize,
    found: &Found<L>,
    best: &mut Hit,
) {
    let Some(ids) = bvh.triangles.get(first..first + count) else { return };
    if found.hits != 0 {
        let (t, u, v) = (found.t.to_array(), found.u.to_array(), found.v.to_array());
        let mut hits = found.hits;
        while hits != 0 {
            let i = hits.trailing_zeros() as usize & 7;
            hits &= hits - 1;
            if let Some(&triangle) = ids.get(i) {
                best.take(Hit { t: t[i], u: u[i], v: v[i], triangle });
            }
        }
    }
    let mut doubtful = found.doubtful;
    while doubtful != 0 {
        let i = doubtful.trailing_zeros() as usize & 7;
        doubtful &= doubtful - 1;
        let runs = bvh.coordinates.get(9 * first..9 * (first + count)).unwrap_or(&[]);
        if let Some(&triangle) = ids.get(i)
            && let Some((t, u, v)) = intersect(origin, shear, best.t, corners_of(runs, count, i))
        {
            best.take(Hit { t, u, v, triangle });
        }
    }
}
