//! Packets of rays that go about the same way: camera rays of a tile, as [`REGISTERS`] registers of sixteen.
//!
//! Plainly: all rays of the packet walk the tree together, so a node is fetched and tested once for all.
//! 1. A node's eight boxes are tested at once against the interval of all rays, and visited in the order that
//!    the build has prepared for the octant of the directions.
//! 2. At a leaf the rays are tested against its box, sixteen at a time. The interval of all rays leaves out the
//!    triangles that none can meet, and the rest is tested against sixteen rays at a time.
//! 3. The rays of a packet agree in the signs of their directions and in their dominant axis: the caller sorts
//!    them so ([`class`]).
//! 4. Where all start at the same point, as those of a pinhole do, that is subtracted once for all.
//!
//! The price: a packet whose rays diverge visits nodes that few rays of it meet.

use super::Bvh;
use super::batch::{Nearest, Sink};
use super::layout::Child;
use super::leaf::corners_of;
use crate::geometry::{Hit, MISS, Ray};
use halflight_simd::kernels::RECIPROCAL_MAX;
use halflight_simd::kernels::boxes::{ROBUST, SlabInterval, SlabInterval8, SlabRays16};
use halflight_simd::kernels::triangles::{Found, Shear, ShearRays16, dominant_axis, intersect};
use halflight_simd::{Lanes, Mask, Simd, Stack};

/// Registers of sixteen rays.
const REGISTERS: usize = 4;

/// Most rays of a packet.
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
    /// Lanes that hold a ray.
    active: u32,
}

/// The rays of a packet, and where they are in the batch.
struct Packet<'a, S: Simd> {
    lanes: [Lane16<S>; REGISTERS],
    rays: &'a [Ray],
    order: &'a [u8],
}

/// Signs of the direction (three bits) and dominant axis: what rays of one packet share. Below [`CLASSES`].
#[inline(always)]
pub(super) fn class(direction: [f32; 3]) -> usize {
    let [x, y, z] = direction.map(|d| (d.to_bits() >> 31) as usize);
    x | y << 1 | z << 2 | dominant_axis(direction) << 3
}

/// How many classes of rays there are.
pub(super) const CLASSES: usize = 24;

/// Traces the rays `order` of `rays` (1 … [`RAYS_MAX`], all of one class and traceable) and puts their hits.
#[inline(always)]
pub(super) fn trace<S: Simd>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u8],
    base: u32,
    stack: &mut Stack,
    sink: &mut Nearest,
) {
    let Some(first) = order.first().and_then(|&i| rays.get(usize::from(i))) else { return };
    let axes = Shear::new(first.direction).axes;
    let class = class(first.direction);
    let near = [class & 1, 2 | (class >> 1 & 1), 4 | (class >> 2 & 1)];

    let records = records_of(rays, order, first, 0);
    let mut lanes = [Lane16::new(simd, &records, near, axes); REGISTERS];
    for (k, lane) in lanes.iter_mut().enumerate() {
        if k > 0 {
            *lane = Lane16::new(simd, &records_of(rays, order, first, 16 * k), near, axes);
        }
        let count = order.len().saturating_sub(16 * k).min(16) as u32;
        lane.active = (1u32 << count) - 1;
    }
    let mut packet = Packet { lanes, rays, order };
    let (interval, pinhole) = packet.interval(near);
    let interval = SlabInterval8::new(simd, &interval);
    if pinhole {
        packet.walk::<true>(simd, bvh, class & 7, &interval, stack);
    } else {
        packet.walk::<false>(simd, bvh, class & 7, &interval, stack);
    }

    for (lane, order) in packet.lanes.iter().zip(order.chunks(16)) {
        let records = simd.records16([lane.t, lane.u, lane.v, lane.triangle]);
        for (&[t, u, v, triangle], &i) in records.iter().zip(order) {
            let hit = Hit { t, u, v, triangle: triangle.to_bits() };
            sink.put(base + u32::from(i), if hit.triangle == MISS { Hit::NONE } else { hit });
        }
    }
}

/// Sixteen rays from place `from` of the order on. Lanes without a ray repeat the first one: they change no
/// interval.
#[inline(always)]
fn records_of(rays: &[Ray], order: &[u8], first: &Ray, from: usize) -> [[f32; 8]; 16] {
    let mut records = [[0.0; 8]; 16];
    for (l, record) in records.iter_mut().enumerate() {
        let ray = order.get(from + l).and_then(|&i| rays.get(usize::from(i))).unwrap_or(first);
        *record = bytemuck::cast(*ray);
    }
    records
}

impl<S: Simd> Lane16<S> {
    #[inline(always)]
    fn new(simd: S, records: &[[f32; 8]; 16], near: [usize; 3], axes: [usize; 3]) -> Self {
        let [ox, oy, oz, t, dx, dy, dz, _] = simd.columns16(records);
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
            active: 0,
        }
    }
}

/// [`halflight_simd::kernels::safe_reciprocal`] of all lanes.
#[inline(always)]
fn reciprocal<S: Simd>(simd: S, d: S::F16) -> S::F16 {
    let limit = simd.splat16(RECIPROCAL_MAX);
    (simd.splat16(1.0) / d).min(limit).max(-limit)
}

impl<S: Simd> Packet<'_, S> {
    /// What the rays have in common, and whether that is their origin.
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

    /// The farthest that any ray still looks.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        let [a, b, c, d] = &self.lanes;
        a.t.max(b.t).max(c.t.max(d.t)).largest()
    }

    #[inline(always)]
    fn walk<const PINHOLE: bool>(
        &mut self,
        simd: S,
        bvh: &Bvh,
        octant: usize,
        interval: &SlabInterval8<S>,
        stack: &mut Stack,
    ) {
        let mut t_max = self.farthest();
        stack.truncate(0);
        let (mut child, mut place) = (Child::node(0), 0);
        loop {
            if !child.is_leaf() {
                let Some(node) = bvh.nodes.get(child.0 as usize) else { return };
                let (entry, exit) = interval.interval(simd, &node.rows, t_max);
                // On the stack are places of boxes: node and slot.
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

    /// Tests the rays that meet the leaf's box, which is at `place`, against its triangles; whether a hit was
    /// taken.
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
                if found.hits | found.doubtful != 0 {
                    taken |= take(simd, lane, &found, id);
                    if found.doubtful != 0 {
                        let order = self.order.get(16 * k..).unwrap_or(&[]);
                        let corners = corners_of(runs, count, i);
                        taken |= take_doubtful(simd, lane, found.doubtful, id, corners, self.rays, order);
                    }
                }
            }
        }
        taken
    }
}

/// Takes over what a triangle test found; whether a ray has a better hit now.
#[inline(always)]
fn take<S: Simd>(simd: S, lane: &mut Lane16<S>, found: &Found<S::F16>, id: u32) -> bool {
    let nearer = found.t.lt(lane.t).bits() & found.hits;
    let same = found.hits & !nearer;
    let mut hits = nearer;
    if same != 0 {
        // As near as the best: the lower index wins, and no hit at all is the highest.
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
    hits != 0
}

/// The rays on an edge in f32, by the scalar reference.
#[cold]
fn take_doubtful<S: Simd>(
    simd: S,
    lane: &mut Lane16<S>,
    mut doubtful: u32,
    id: u32,
    corners: [[f32; 3]; 3],
    rays: &[Ray],
    order: &[u8],
) -> bool {
    let (mut t, mut u, mut v, mut ids) =
        (lane.t.to_array(), lane.u.to_array(), lane.v.to_array(), lane.triangle.to_array());
    let mut taken = false;
    while doubtful != 0 {
        let l = doubtful.trailing_zeros() as usize & 15;
        doubtful &= doubtful - 1;
        let Some(ray) = order.get(l).and_then(|&i| rays.get(usize::from(i))) else { continue };
        let mut best = Hit { t: t[l], u: u[l], v: v[l], triangle: ids[l].to_bits() };
        let before = best;
        if let Some((t, u, v)) = intersect(ray.origin, &Shear::new(ray.direction), best.t, corners) {
            best.take(Hit { t, u, v, triangle: id });
        }
        if best != before {
            (t[l], u[l], v[l], ids[l]) = (best.t, best.u, best.v, f32::from_bits(best.triangle));
            taken = true;
        }
    }
    lane.t = simd.load16(&t);
    lane.u = simd.load16(&u);
    lane.v = simd.load16(&v);
    lane.triangle = simd.load16(&ids);
    taken
}
