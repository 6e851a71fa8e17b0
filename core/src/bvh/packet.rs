//! Packets of rays that go about the same way: up to `K` registers of sixteen.
//!
//! Plainly: all rays of the packet walk the tree together, so a node is fetched and tested once for all.
//! 1. A node's eight boxes are tested at once against the interval of all rays. A packet of one register
//!    then tests its rays against each box that is left; a larger one goes down without.
//! 2. Boxes are visited in the order that the build has prepared for the octant of the directions.
//! 3. At a leaf one triangle is tested against sixteen rays at a time.
//! 4. The rays of a packet agree in the signs of their directions and in their dominant axis: the caller
//!    sorts them so.
//!
//! The price: a packet whose rays diverge visits nodes that few rays of it meet.

use super::Bvh;
use super::batch::Sink;
use super::layout::{Child, STACK};
use super::walk::corners_of;
use crate::geometry::{Hit, MISS, Ray};
use halflight_simd::kernels::RECIPROCAL_MAX;
use halflight_simd::kernels::boxes::{ROBUST, SlabInterval, SlabInterval8, SlabRays16};
use halflight_simd::kernels::triangles::{Found, Shear, ShearRays16, dominant_axis, intersect};
use halflight_simd::{Lanes, Mask, Simd, Stacks};

/// Boxes put aside, and for each the rays that meet it (one register) or where the box is (more).
pub(super) struct PacketStack {
    boxes: Stacks,
    rays: [u32; STACK],
}

impl PacketStack {
    pub(super) const fn new() -> Self {
        Self { boxes: Stacks::new(), rays: [0; STACK] }
    }
}

/// So few rays of a packet go on alone.
const ALONE: u32 = 4;

/// Most subtrees that wait for a ray to go on alone.
const JOBS: usize = 1024;

/// Subtrees with the ray (of the window) that is yet to walk them, and where it enters.
pub(super) struct Jobs {
    waiting: [(u32, u32, f32); JOBS],
    count: usize,
}

impl Jobs {
    pub(super) const fn new() -> Self {
        Self { waiting: [(0, 0, 0.0); JOBS], count: 0 }
    }

    #[inline(always)]
    fn room(&self) -> usize {
        JOBS - self.count
    }

    #[inline(always)]
    fn push(&mut self, ray: u32, child: u32, entry: f32) {
        if let Some(slot) = self.waiting.get_mut(self.count) {
            *slot = (ray, child, entry);
            self.count += 1;
        }
    }

    /// The whole tree, for a ray that found no company.
    #[inline(always)]
    pub(super) fn push_root(&mut self, ray: u32) {
        self.push(ray, Child::node(0).0, 0.0);
    }

    /// All that wait, and none after that.
    #[inline(always)]
    pub(super) fn take(&mut self) -> &[(u32, u32, f32)] {
        let count = core::mem::take(&mut self.count);
        self.waiting.get(..count).unwrap_or(&[])
    }

    /// Whether the next packet may run out of room.
    pub(super) fn is_crowded(&self) -> bool {
        self.count > JOBS / 2
    }
}

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
    /// Rays that still look for a hit.
    active: u32,
}

/// Signs of the direction (three bits) and dominant axis: what rays of one packet share. Below [`CLASSES`].
#[inline(always)]
pub(super) fn class(direction: [f32; 3]) -> usize {
    let [x, y, z] = direction.map(|d| (d.to_bits() >> 31) as usize);
    x | y << 1 | z << 2 | dominant_axis(direction) << 3
}

/// How many classes of rays there are.
pub(super) const CLASSES: usize = 24;

/// Origins, directions and ends of the rays of a packet, one row of sixteen each.
type Rows = [[f32; 16]; 7];

/// Traces the rays `order` of `rays` (1 … `16 K`, all of one class and traceable) and puts their hits.
#[inline(always)]
#[allow(clippy::too_many_arguments, clippy::needless_range_loop)]
pub(super) fn trace<S: Simd, T: Sink, const K: usize, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    base: u32,
    stack: &mut PacketStack,
    jobs: &mut Jobs,
    sink: &mut T,
) {
    let mut rows: [Rows; K] = [[[0.0; 16]; 7]; K];
    let Some(first) = order.first().and_then(|&i| rays.get(i as usize)) else { return };
    let axes = Shear::new(first.direction).axes;
    for (k, rows) in rows.iter_mut().enumerate() {
        for l in 0..16 {
            // Lanes without a ray repeat the first one: they change no interval.
            let ray = order.get(16 * k + l).and_then(|&i| rays.get(i as usize)).unwrap_or(first);
            for axis in 0..3 {
                rows[axis][l] = ray.origin[axis];
                rows[3 + axis][l] = ray.direction[axis];
            }
            rows[6][l] = ray.t_max;
        }
    }
    let class = class(first.direction);
    let near = [class & 1, 2 | (class >> 1 & 1), 4 | (class >> 2 & 1)];

    let mut packet = [Lane16::new(simd, &rows[0], near, axes); K];
    for (k, (lane, rows)) in packet.iter_mut().zip(&rows).enumerate() {
        if k > 0 {
            *lane = Lane16::new(simd, rows, near, axes);
        }
        let count = order.len().saturating_sub(16 * k).min(16) as u32;
        lane.active = (1u32 << count) - 1;
    }
    let interval = SlabInterval8::new(simd, &interval(&packet, near));
    let t_max = farthest::<S, K, ANY>(simd, &packet);

    walk::<S, K, ANY>(simd, bvh, rays, order, class & 7, &interval, &mut packet, t_max, stack, jobs);

    for (lane, order) in packet.iter().zip(order.chunks(16)) {
        let (t, u, v, triangle) =
            (lane.t.to_array(), lane.u.to_array(), lane.v.to_array(), lane.triangle.to_array());
        for (l, &index) in order.iter().enumerate() {
            let hit = Hit { t: t[l & 15], u: u[l & 15], v: v[l & 15], triangle: triangle[l & 15].to_bits() };
            sink.put(base + index, if hit.triangle == MISS { Hit::NONE } else { hit });
        }
    }
}

impl<S: Simd> Lane16<S> {
    #[inline(always)]
    fn new(simd: S, rows: &Rows, near: [usize; 3], axes: [usize; 3]) -> Self {
        let origin = [simd.load16(&rows[0]), simd.load16(&rows[1]), simd.load16(&rows[2])];
        let direction = [simd.load16(&rows[3]), simd.load16(&rows[4]), simd.load16(&rows[5])];
        let [kx, ky, kz] = axes;
        let scale = simd.splat16(1.0) / direction[kz % 3];
        let zero = simd.splat16(0.0);
        Self {
            slab: SlabRays16 {
                origin,
                reciprocal: [
                    reciprocal(simd, direction[0]),
                    reciprocal(simd, direction[1]),
                    reciprocal(simd, direction[2]),
                ],
                near,
            },
            shear: ShearRays16 {
                axes,
                origin: [origin[kx % 3], origin[ky % 3], origin[kz % 3]],
                factors: [direction[kx % 3] * scale, direction[ky % 3] * scale, scale],
            },
            t: simd.load16(&rows[6]),
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

/// What the rays of a packet have in common.
#[inline(always)]
fn interval<S: Simd, const K: usize>(packet: &[Lane16<S>; K], near: [usize; 3]) -> SlabInterval {
    let (mut origin, mut reciprocal) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
    for axis in 0..3 {
        let (o, r) = (packet[0].slab.origin[axis], packet[0].slab.reciprocal[axis]);
        let (mut least, mut most) = ((o, r), (o, r));
        for lane in &packet[1..] {
            if lane.active != 0 {
                let (o, r) = (lane.slab.origin[axis], lane.slab.reciprocal[axis]);
                least = (least.0.min(o), least.1.min(r));
                most = (most.0.max(o), most.1.max(r));
            }
        }
        (origin[0][axis], origin[1][axis]) = (least.0.smallest(), most.0.largest());
        (reciprocal[0][axis], reciprocal[1][axis]) = (least.1.smallest(), most.1.largest());
    }
    SlabInterval::new(near, origin, reciprocal)
}

/// The farthest that any ray still looks; negative when none does.
#[inline(always)]
fn farthest<S: Simd, const K: usize, const ANY: bool>(simd: S, packet: &[Lane16<S>; K]) -> f32 {
    let mut t_max = simd.splat16(-1.0);
    for lane in packet {
        if lane.active != 0 {
            let t = if ANY { lane.t.select(simd.mask16(lane.active), simd.splat16(-1.0)) } else { lane.t };
            t_max = t_max.max(t);
        }
    }
    t_max.largest()
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn walk<S: Simd, const K: usize, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    octant: usize,
    interval: &SlabInterval8<S>,
    packet: &mut [Lane16<S>; K],
    mut t_max: f32,
    stack: &mut PacketStack,
    jobs: &mut Jobs,
) {
    stack.boxes.items[0] = Child::node(0).0;
    stack.boxes.entries[0] = 0.0;
    stack.rays[0] = u32::MAX;
    let mut height = 1;
    while height > 0 {
        height -= 1;
        let (bits, entry) = stack.boxes.get(height);
        if entry > t_max * ROBUST {
            continue;
        }
        let child = Child(bits);
        let mut wanted = stack.rays[height.min(STACK - 1)];
        if K == 1 {
            wanted &= packet[0].active;
            if wanted.count_ones() <= ALONE {
                if jobs.room() >= ALONE as usize {
                    while wanted != 0 {
                        let l = wanted.trailing_zeros() as usize;
                        wanted &= wanted - 1;
                        jobs.push(order.get(l).copied().unwrap_or(0), bits, entry);
                    }
                    continue;
                }
                if wanted == 0 {
                    continue;
                }
            }
        }
        if !child.is_leaf() {
            let Some(node) = bvh.nodes.get(child.0 as usize) else { return };
            let (entry, exit) = interval.interval(simd, &node.rows, t_max);
            let met = simd.push8(node.order_of(octant), entry, exit, &SLOTS, &mut stack.boxes, height);
            let mut kept = height;
            for at in height..met {
                let (slot, entry) = stack.boxes.get(at);
                let slot = slot as usize & 7;
                let meeting = if K == 1 {
                    let lane = &packet[0];
                    lane.slab.enters(simd, &node.rows, slot, lane.t).1 & lane.active & wanted
                } else {
                    // The box of a leaf is tested when its turn comes.
                    child.0 << 3 | slot as u32
                };
                let to = kept.min(STACK - 1);
                stack.boxes.items[to] = node.child(slot).0;
                stack.boxes.entries[to] = entry;
                stack.rays[to] = meeting;
                kept += (K > 1 || meeting != 0) as usize;
            }
            height = kept;
        } else if leaf::<S, K, ANY>(simd, bvh, rays, order, child, wanted, interval, t_max, packet) {
            t_max = farthest::<S, K, ANY>(simd, packet);
        }
    }
}

/// The lanes of a node by their own numbers.
const SLOTS: [f32; 8] = {
    let mut slots = [0.0; 8];
    let mut i = 0;
    while i < 8 {
        slots[i] = f32::from_bits(i as u32);
        i += 1;
    }
    slots
};

/// Tests the rays that meet the leaf's box against its triangles; whether a hit was taken. `wanted` are the
/// rays of a packet of one register, and for larger ones the node and slot of the leaf's box.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn leaf<S: Simd, const K: usize, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    child: Child,
    wanted: u32,
    interval: &SlabInterval8<S>,
    t_max: f32,
    packet: &mut [Lane16<S>; K],
) -> bool {
    let (first, count) = child.triangles();
    let Some(ids) = bvh.triangles.get(first..first + count) else { return false };
    let Some(runs) = bvh.coordinates.get(9 * first..9 * (first + count)) else { return false };
    let mut met = [0u32; K];
    if K == 1 {
        met[0] = wanted & packet[0].active;
    } else {
        let Some(node) = bvh.nodes.get((wanted >> 3) as usize) else { return false };
        for (lane, met) in packet.iter().zip(&mut met) {
            if lane.active != 0 {
                *met = lane.slab.enters(simd, &node.rows, wanted as usize & 7, lane.t).1 & lane.active;
            }
        }
    }
    if met == [0; K] {
        return false;
    }
    let mut taken = false;
    let mut candidates = if K == 1 {
        (1u32 << count) - 1
    } else {
        interval.may_meet(simd, bvh.coordinates, 9 * first, count, bvh.slack, t_max) & ((1 << count) - 1)
    };
    while candidates != 0 {
        let i = candidates.trailing_zeros() as usize;
        candidates &= candidates - 1;
        let id = ids.get(i).copied().unwrap_or(MISS);
        for (k, (lane, met)) in packet.iter_mut().zip(&mut met).enumerate() {
            if *met == 0 {
                continue;
            }
            let Some(found) = lane.shear.meets(simd, runs, i, count, lane.t, *met) else { continue };
            if found.hits | found.doubtful != 0 {
                let order = order.get(16 * k..).unwrap_or(&[]);
                let hits = take(simd, lane, &found, id, (runs, count, i), rays, order);
                taken |= hits != 0;
                if ANY {
                    lane.active &= !hits;
                    *met &= !hits;
                }
            }
        }
    }
    taken
}

/// Takes over what a triangle test found; the bits of the rays that have a better hit now.
#[inline(always)]
fn take<S: Simd>(
    simd: S,
    lane: &mut Lane16<S>,
    found: &Found<S::F16>,
    id: u32,
    triangle: (&[f32], usize, usize),
    rays: &[Ray],
    order: &[u32],
) -> u32 {
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
    if found.doubtful != 0 {
        hits | take_doubtful(simd, lane, found.doubtful, id, triangle, rays, order)
    } else {
        hits
    }
}

/// The rays on an edge in f32, by the scalar reference.
#[cold]
fn take_doubtful<S: Simd>(
    simd: S,
    lane: &mut Lane16<S>,
    mut doubtful: u32,
    id: u32,
    triangle: (&[f32], usize, usize),
    rays: &[Ray],
    order: &[u32],
) -> u32 {
    let (mut t, mut u, mut v, mut ids) =
        (lane.t.to_array(), lane.u.to_array(), lane.v.to_array(), lane.triangle.to_array());
    let (runs, count, i) = triangle;
    let corners = corners_of(runs, count, i);
    let mut hits = 0;
    while doubtful != 0 {
        let l = doubtful.trailing_zeros() as usize & 15;
        doubtful &= doubtful - 1;
        let Some(ray) = order.get(l).and_then(|&i| rays.get(i as usize)) else { continue };
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
