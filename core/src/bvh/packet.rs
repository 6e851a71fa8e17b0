//! Packet traversal of coherent rays: camera rays of a tile in [`REGISTERS`] registers of sixteen.
//!
//! All rays of a packet traverse the tree together, so that a node is fetched and tested once for all.
//! 1. A node's eight boxes are tested together against the interval of all rays, and visited in the order
//!    that the build has prepared for the octant of the directions.
//! 2. At a leaf the rays are tested against its box, sixteen at a time. The interval of all rays rejects the
//!    triangles that no ray can meet. The others are tested against sixteen rays at a time.
//! 3. The rays of a packet agree in the signs of their directions and in their dominant axis: the caller
//!    sorts them by [`class`].
//! 4. A common origin, as of a pinhole camera, is subtracted once for all rays.
//!
//! The cost: a packet whose rays diverge visits nodes that few of its rays meet.

use super::Bvh;
use super::layout::Child;
use super::leaf::corners_of;
use super::query::{Nearest, Sink};
use crate::geometry::{Hit, MISS, Ray};
use halflight_simd::kernels::RECIPROCAL_MAX;
use halflight_simd::kernels::boxes::{ROBUST, SlabInterval, SlabInterval8, SlabRays16};
use halflight_simd::kernels::triangles::{Found, Shear, ShearRays16, dominant_axis, intersect};
use halflight_simd::{Lanes, Mask, Simd, Stack};

/// Registers of sixteen rays.
const REGISTERS: usize = 4;

/// Largest number of rays of a packet.
pub(super) const RAYS_MAX: usize = 16 * REGISTERS;

/// Sixteen rays and their best hits.
#[derive(Clone, Copy)]
struct Lane16<S: Simd> {
    slab: SlabRays16<S>,
    shear: ShearRays16<S>,
    t: S::F16,
    u: S::F16,
    v: S::F16,
    /// Bits of the triangle's index.
    triangle: S::F16,
    /// Lanes whose ray has a hit.
    found: u32,
    /// Lanes that hold a ray.
    active: u32,
}

/// Rays to be traced together: 1 … [`RAYS_MAX`], all traceable and of one class.
pub(super) struct Packet<'a, S: Simd> {
    pub columns: Columns<S>,
    /// The tile, and the indices of the packet's rays in it.
    pub rays: &'a [Ray],
    pub order: &'a [u8],
    /// Index of the tile's first ray in the batch.
    pub base: u32,
    /// True if the packet holds all rays of the tile in their order.
    pub whole: bool,
}

/// State of a packet's traversal.
struct Walk<'a, S: Simd> {
    lanes: [Lane16<S>; REGISTERS],
    rays: &'a [Ray],
    order: &'a [u8],
}

/// Class that the rays of a packet share: signs of the direction (three bits) and dominant axis. Below
/// [`CLASSES`].
#[inline(always)]
pub(super) fn class(direction: [f32; 3]) -> usize {
    let [x, y, z] = direction.map(|d| (d.to_bits() >> 31) as usize);
    x | y << 1 | z << 2 | dominant_axis(direction) << 3
}

/// Number of classes.
pub(super) const CLASSES: usize = 24;

/// The eight floats of sixteen rays, a register each, for each register of rays.
#[derive(Clone, Copy)]
pub(super) struct Columns<S: Simd>([[S::F16; 8]; REGISTERS]);

impl<S: Simd> Columns<S> {
    /// Columns of a full tile whose rays are all traceable and of one class.
    #[inline(always)]
    pub(super) fn whole(simd: S, rays: &[Ray]) -> Option<Self> {
        let records: &[[f32; 8]] = bytemuck::cast_slice(rays);
        let records: &[[f32; 8]; RAYS_MAX] = records.try_into().ok()?;
        let ([a, b, c, d], _) = records.as_chunks::<16>() else { return None };
        let columns = Self([simd.columns16(a), simd.columns16(b), simd.columns16(c), simd.columns16(d)]);
        columns.agree(simd).then_some(columns)
    }

    /// Columns of the rays `order`. Lanes without a ray repeat the first ray, which changes no interval.
    #[inline(always)]
    pub(super) fn gathered(simd: S, rays: &[Ray], order: &[u8]) -> Self {
        let mut records = [[[0.0; 8]; 16]; REGISTERS];
        let first = order.first().copied().unwrap_or(0);
        for (l, record) in records.as_flattened_mut().iter_mut().enumerate() {
            let i = order.get(l).copied().unwrap_or(first);
            if let Some(ray) = rays.get(usize::from(i)) {
                *record = bytemuck::cast(*ray);
            }
        }
        let [a, b, c, d] = &records;
        Self([simd.columns16(a), simd.columns16(b), simd.columns16(c), simd.columns16(d)])
    }

    /// True if all rays are traceable (by [`super::traversal_ray::traceable`]) and of one [`class`].
    #[inline(always)]
    fn agree(&self, simd: S) -> bool {
        const ALL: u32 = 0xffff;
        let (zero, limit) = (simd.splat16(0.0), simd.splat16(f32::INFINITY));
        let (mut minus, mut plus) = ([ALL; 3], [ALL; 3]);
        let (mut along, mut traceable) = ([ALL; 3], ALL);
        for [ox, oy, oz, t, dx, dy, dz, _] in self.0 {
            let signs = [dx.signs(), dy.signs(), dz.signs()];
            let (x, y, z) = (dx.abs(), dy.abs(), dz.abs());
            let (y_x, z_x, z_y) = (y.lt(x).bits(), z.lt(x).bits(), z.lt(y).bits());
            let (is_x, is_y) = (y_x & z_x, !y_x & z_y & ALL);
            let dominant = [is_x, is_y, !(is_x | is_y)];
            for axis in 0..3 {
                minus[axis] &= signs[axis];
                plus[axis] &= !signs[axis] & ALL;
                along[axis] &= dominant[axis];
            }
            // Every comparison with NaN is false, whereas a maximum may lose it.
            traceable &= (x.lt(limit) & y.lt(limit) & z.lt(limit) & zero.lt(x.max(y).max(z))).bits();
            traceable &= (ox.abs().lt(limit) & oy.abs().lt(limit) & oz.abs().lt(limit) & zero.le(t)).bits();
        }
        let [x, y, z] = [minus[0].max(plus[0]), minus[1].max(plus[1]), minus[2].max(plus[2])];
        let dominant = along[0].max(along[1]).max(along[2]);
        (x & y & z & dominant & traceable) == ALL
    }
}

impl<'a, S: Simd> Packet<'a, S> {
    /// Traces the rays and passes their hits to `sink`.
    #[inline(always)]
    pub(super) fn trace(self, simd: S, bvh: &Bvh, stack: &mut Stack, sink: &mut Nearest) {
        let Self { columns, rays, order, base, whole } = self;
        let Some(first) = order.first().and_then(|&i| rays.get(usize::from(i))) else { return };
        let axes = Shear::new(first.direction).axes;
        let class = class(first.direction);
        let near = [class & 1, 2 | (class >> 1 & 1), 4 | (class >> 2 & 1)];

        let [a, b, c, d] = &columns.0;
        let lanes = [
            Lane16::new(simd, a, near, axes, order.len()),
            Lane16::new(simd, b, near, axes, order.len().saturating_sub(16)),
            Lane16::new(simd, c, near, axes, order.len().saturating_sub(32)),
            Lane16::new(simd, d, near, axes, order.len().saturating_sub(48)),
        ];
        let mut walk = Walk { lanes, rays, order };
        let (interval, pinhole) = walk.interval(near);
        let interval = SlabInterval8::new(simd, &interval);
        if pinhole {
            walk.run::<true>(simd, bvh, class & 7, &interval, stack);
        } else {
            walk.run::<false>(simd, bvh, class & 7, &interval, stack);
        }

        let mut base_of_lane = base;
        for (lane, order) in walk.lanes.iter().zip(order.chunks(16)) {
            let t = lane.t.select(simd.mask16(lane.found), simd.splat16(f32::INFINITY));
            let hits: [Hit; 16] = bytemuck::cast(simd.records16([t, lane.u, lane.v, lane.triangle]));
            if !(whole && sink.put_all(base_of_lane, &hits)) {
                for (hit, &i) in hits.iter().zip(order) {
                    sink.put(base + u32::from(i), *hit);
                }
            }
            base_of_lane += 16;
        }
    }
}

impl<S: Simd> Lane16<S> {
    /// The first `count` of sixteen rays.
    #[inline(always)]
    fn new(simd: S, columns: &[S::F16; 8], near: [usize; 3], axes: [usize; 3], count: usize) -> Self {
        let [ox, oy, oz, t, dx, dy, dz, _] = *columns;
        let (origin, direction) = ([ox, oy, oz], [dx, dy, dz]);
        let [kx, ky, kz] = axes;
        let scale = simd.splat16(1.0) / direction[kz % 3];
        let zero = simd.splat16(0.0);
        let reciprocal = [reciprocal(simd, dx), reciprocal(simd, dy), reciprocal(simd, dz)];
        Self {
            slab: SlabRays16 { origin, reciprocal, near },
            shear: ShearRays16 {
                axes,
                origin: [origin[kx % 3], origin[ky % 3], origin[kz % 3]],
                factors: [direction[kx % 3] * scale, direction[ky % 3] * scale, scale],
            },
            t,
            u: zero,
            v: zero,
            triangle: simd.splat16(f32::from_bits(MISS)),
            found: 0,
            active: (1u32 << count.min(16)) - 1,
        }
    }
}

/// [`halflight_simd::kernels::safe_reciprocal`] in all lanes.
#[inline(always)]
fn reciprocal<S: Simd>(simd: S, d: S::F16) -> S::F16 {
    let limit = simd.splat16(RECIPROCAL_MAX);
    (simd.splat16(1.0) / d).min(limit).max(-limit)
}

impl<S: Simd> Walk<'_, S> {
    /// Interval of all rays, and whether they share their origin.
    #[inline(always)]
    fn interval(&self, near: [usize; 3]) -> (SlabInterval, bool) {
        let (mut origin, mut reciprocal) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
        for axis in 0..3 {
            let SlabRays16 { origin: o, reciprocal: r, .. } = self.lanes[0].slab;
            let (mut least, mut most) = ((o[axis], r[axis]), (o[axis], r[axis]));
            for lane in &self.lanes[1..] {
                let (o, r) = (lane.slab.origin[axis], lane.slab.reciprocal[axis]);
                least = (least.0.min(o), least.1.min(r));
                most = (most.0.max(o), most.1.max(r));
            }
            (origin[0][axis], origin[1][axis]) = (least.0.smallest(), most.0.largest());
            (reciprocal[0][axis], reciprocal[1][axis]) = (least.1.smallest(), most.1.largest());
        }
        (SlabInterval::new(near, origin, reciprocal), origin[0] == origin[1])
    }

    /// Largest `t` that any ray still searches.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        let [a, b, c, d] = &self.lanes;
        a.t.max(b.t).max(c.t.max(d.t)).largest()
    }

    #[inline(always)]
    fn run<const PINHOLE: bool>(
        &mut self,
        simd: S,
        bvh: &Bvh,
        octant: usize,
        interval: &SlabInterval8<S>,
        stack: &mut Stack,
    ) {
        let mut t_max = self.farthest();
        stack.truncate(0);
        let (mut child, mut place) = (bvh.root, 0);
        loop {
            if !child.is_leaf() {
                let Some(node) = bvh.nodes.get(child.0 as usize) else { return };
                let (entry, exit) = interval.interval(simd, &node.rows, t_max);
                // The stack holds the places of boxes: node and slot.
                let mut places = [0.0; 8];
                for (slot, place) in places.iter_mut().enumerate() {
                    *place = f32::from_bits(child.0 << 3 | slot as u32);
                }
                simd.push8(node.order_of(octant), entry, exit, &places, stack);
            } else if self.leaf::<PINHOLE>(simd, bvh, child, place, interval, t_max) {
                t_max = self.farthest();
                simd.keep(t_max * ROBUST, stack);
            }
            let Some(top) = stack.pop() else { return };
            place = top;
            let Some(node) = bvh.nodes.get((place >> 3) as usize) else { return };
            child = node.child(place as usize & 7);
        }
    }

    /// Tests the rays that meet the box of the leaf, at `place`, against its triangles. Returns true if a hit
    /// was taken.
    #[inline(always)]
    fn leaf<const PINHOLE: bool>(
        &mut self,
        simd: S,
        bvh: &Bvh,
        leaf: Child,
        place: u32,
        interval: &SlabInterval8<S>,
        t_max: f32,
    ) -> bool {
        let (first, count) = leaf.triangles();
        let Some(ids) = bvh.triangles.get(first..first + count) else { return false };
        let Some(runs) = bvh.coordinates.get(9 * first..9 * (first + count)) else { return false };
        let Some(node) = bvh.nodes.get((place >> 3) as usize) else { return false };
        let mut met = [0u32; REGISTERS];
        let mut planes = self.lanes[0].slab.moved(simd, &node.rows, place as usize & 7);
        for (lane, met) in self.lanes.iter().zip(&mut met) {
            if !PINHOLE {
                planes = lane.slab.moved(simd, &node.rows, place as usize & 7);
            }
            *met = lane.slab.enters_moved(simd, &planes, lane.t).1 & lane.active;
        }
        if met == [0; REGISTERS] {
            return false;
        }
        let mut taken = false;
        let mut candidates =
            interval.may_meet(simd, bvh.coordinates, 9 * first, count, bvh.slack, t_max) & ((1 << count) - 1);
        while candidates != 0 {
            let i = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let id = ids.get(i).copied().unwrap_or(MISS);
            let Some(mut corners) = self.lanes[0].shear.moved(simd, runs, i, count) else { continue };
            for (k, (lane, &met)) in self.lanes.iter_mut().zip(&met).enumerate() {
                if met == 0 {
                    continue;
                }
                if !PINHOLE && let Some(moved) = lane.shear.moved(simd, runs, i, count) {
                    corners = moved;
                }
                let found = lane.shear.meets_moved(simd, &corners, lane.t, met);
                if found.hits | found.on_edge != 0 {
                    let mut hits = take(simd, lane, &found, id);
                    if found.on_edge != 0 {
                        let order = self.order.get(16 * k..).unwrap_or(&[]);
                        let corners = corners_of(runs, count, i);
                        hits |= take_on_edge(simd, lane, found.on_edge, id, corners, self.rays, order);
                    }
                    lane.found |= hits;
                    taken |= hits != 0;
                }
            }
        }
        taken
    }
}

/// Takes the hits of a triangle test. Returns the mask of the rays whose hit improved.
#[inline(always)]
fn take<S: Simd>(simd: S, lane: &mut Lane16<S>, found: &Found<S::F16>, id: u32) -> u32 {
    let nearer = found.t.lt(lane.t).bits() & found.hits;
    let same = found.hits & !nearer;
    let mut hits = nearer;
    if same != 0 {
        // At equal distance the lower index wins. No hit has the highest index.
        let ids = lane.triangle.to_array();
        for (l, other) in ids.iter().enumerate() {
            hits |= ((same >> l & 1 == 1 && id < other.to_bits()) as u32) << l;
        }
    }
    let mask = simd.mask16(hits);
    lane.t = found.t.select(mask, lane.t);
    lane.u = found.u.select(mask, lane.u);
    lane.v = found.v.select(mask, lane.v);
    lane.triangle = simd.splat16(f32::from_bits(id)).select(mask, lane.triangle);
    hits
}

/// Tests the `on_edge` rays, which lie on an edge in f32, by the scalar reference.
#[cold]
fn take_on_edge<S: Simd>(
    simd: S,
    lane: &mut Lane16<S>,
    mut on_edge: u32,
    id: u32,
    corners: [[f32; 3]; 3],
    rays: &[Ray],
    order: &[u8],
) -> u32 {
    let (mut t, mut u, mut v, mut ids) =
        (lane.t.to_array(), lane.u.to_array(), lane.v.to_array(), lane.triangle.to_array());
    let mut hits = 0;
    while on_edge != 0 {
        let l = on_edge.trailing_zeros() as usize & 15;
        on_edge &= on_edge - 1;
        let Some(ray) = order.get(l).and_then(|&i| rays.get(usize::from(i))) else { continue };
        let mut best = Hit { t: t[l], u: u[l], v: v[l], triangle: ids[l].to_bits() };
        let before = best;
        if let Some((t, u, v)) = intersect(ray.origin, &Shear::new(ray.direction), best.t, corners) {
            best.take(Hit { t, u, v, triangle: id });
        }
        if best != before {
            (t[l], u[l], v[l], ids[l]) = (best.t, best.u, best.v, f32::from_bits(best.triangle));
            hits |= 1 << l;
        }
    }
    lane.t = simd.load16(&t);
    lane.u = simd.load16(&u);
    lane.v = simd.load16(&v);
    lane.triangle = simd.load16(&ids);
    hits
}
