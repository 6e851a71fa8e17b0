//! Packets of rays that go about the same way: up to `K` registers of sixteen.
//!
//! Plainly: all rays of the packet walk the tree together, so a node is fetched and tested once for all.
//! 1. A node's eight boxes are tested at once against the interval of all rays; no ray is looked at.
//! 2. At a leaf each register of rays is tested against the leaf's own box, and those that meet it
//!    against its triangles, one triangle against sixteen rays at a time.
//! 3. The rays of a packet agree in the signs of their directions and in their dominant axis: the caller
//!    sorts them so.
//!
//! The price: a packet whose rays diverge visits nodes that no ray of it meets.

use super::Bvh;
use super::batch::Sink;
use super::layout::{Child, STACK};
use super::walk::leaf_corners;
use crate::geometry::{Hit, MISS, Ray};
use halflight_simd::kernels::boxes::{ROBUST, SlabInterval, SlabInterval8, SlabRays16};
use halflight_simd::kernels::safe_reciprocal;
use halflight_simd::kernels::triangles::{Found, Shear, ShearRays16, intersect};
use halflight_simd::{Lanes, Mask, Simd};

/// Nodes put aside: what is in them, the lane of the parent that holds their box, and where rays may enter.
pub(super) struct PacketStack {
    entries: [(u32, u32, f32); STACK],
}

impl PacketStack {
    pub(super) const fn new() -> Self {
        Self { entries: [(0, 0, 0.0); STACK] }
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

/// Signs of the direction (three bits) and dominant axis: what rays of one packet share.
#[inline(always)]
pub(super) fn class(direction: [f32; 3]) -> u32 {
    let sign = |i: usize| safe_reciprocal(direction[i]).is_sign_negative() as u32;
    let axis = halflight_simd::kernels::triangles::dominant_axis(direction) as u32;
    sign(0) | sign(1) << 1 | sign(2) << 2 | axis << 3
}

/// Traces the rays `order` of `rays` (at most `16 K`, all of one class and traceable) and writes their hits.
#[inline(always)]
pub(super) fn trace<S: Simd, T: Sink, const K: usize, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    base: u32,
    stack: &mut PacketStack,
    sink: &mut T,
) {
    let mut lanes = [[[0.0f32; 16]; 10]; K];
    let mut interval =
        [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3], [f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
    let Some(first) = order.first().and_then(|&i| rays.get(i as usize)) else { return };
    let shear0 = Shear::new(first.direction);
    let [kx, ky, kz] = shear0.axes;
    for (i, &index) in order.iter().enumerate().take(16 * K) {
        let Some(ray) = rays.get(index as usize) else { return };
        let rows = &mut lanes[i / 16];
        let l = i % 16;
        let d = ray.direction;
        for axis in 0..3 {
            let (o, r) = (ray.origin[axis], safe_reciprocal(d[axis]));
            rows[axis][l] = o;
            rows[3 + axis][l] = r;
            interval[0][axis] = interval[0][axis].min(o);
            interval[1][axis] = interval[1][axis].max(o);
            interval[2][axis] = interval[2][axis].min(r);
            interval[3][axis] = interval[3][axis].max(r);
        }
        rows[6][l] = d[kx % 3] / d[kz % 3];
        rows[7][l] = d[ky % 3] / d[kz % 3];
        rows[8][l] = 1.0 / d[kz % 3];
        rows[9][l] = ray.t_max;
    }
    let near: [usize; 3] =
        core::array::from_fn(|axis| 2 * axis + interval[2][axis].is_sign_negative() as usize);
    let interval = SlabInterval::new(near, [interval[0], interval[1]], [interval[2], interval[3]]);
    let interval = SlabInterval8::new(simd, &interval);

    let none = simd.splat16(f32::from_bits(MISS));
    let zero = simd.splat16(0.0);
    let mut packet: [Lane16<S>; K] = [Lane16 {
        slab: SlabRays16 { origin: [zero; 3], reciprocal: [zero; 3], near },
        shear: ShearRays16 { axes: shear0.axes, origin: [zero; 3], factors: [zero; 3] },
        t: zero,
        u: zero,
        v: zero,
        triangle: none,
        active: 0,
    }; K];
    let mut t_max = f32::NEG_INFINITY;
    for (k, (lane, rows)) in packet.iter_mut().zip(&lanes).enumerate() {
        let count = order.len().saturating_sub(16 * k).min(16) as u32;
        if count == 0 {
            break;
        }
        let origin = [simd.load16(&rows[0]), simd.load16(&rows[1]), simd.load16(&rows[2])];
        lane.slab.origin = origin;
        lane.slab.reciprocal = [simd.load16(&rows[3]), simd.load16(&rows[4]), simd.load16(&rows[5])];
        lane.shear.origin = [origin[kx % 3], origin[ky % 3], origin[kz % 3]];
        lane.shear.factors = [simd.load16(&rows[6]), simd.load16(&rows[7]), simd.load16(&rows[8])];
        lane.t = simd.load16(&rows[9]);
        lane.active = (1u32 << count) - 1;
        t_max = t_max.max(lane.t.largest());
    }

    walk::<S, K, ANY>(simd, bvh, rays, order, &interval, &mut packet, t_max, &mut stack.entries);

    for (k, lane) in packet.iter().enumerate() {
        if 16 * k >= order.len() {
            break;
        }
        let (t, u, v, triangle) =
            (lane.t.to_array(), lane.u.to_array(), lane.v.to_array(), lane.triangle.to_array());
        for (l, &index) in order.iter().skip(16 * k).take(16).enumerate() {
            let triangle = triangle[l].to_bits();
            let hit = Hit { t: t[l], u: u[l], v: v[l], triangle };
            sink.put(base + index, if triangle == MISS { Hit::NONE } else { hit });
        }
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn walk<S: Simd, const K: usize, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    interval: &SlabInterval8<S>,
    packet: &mut [Lane16<S>; K],
    mut t_max: f32,
    stack: &mut [(u32, u32, f32); STACK],
) {
    let mut height = 0;
    // The node whose boxes hold what is visited; the root has none.
    let (mut child, mut holder) = (Child::node(0), 0u32);
    'walk: loop {
        if !child.is_leaf() {
            let Some(node) = bvh.nodes.get(child.0 as usize) else { break };
            let (entry, mut met) = interval.may_enter(simd, &node.rows, t_max);
            if met != 0 {
                let entries = entry.to_array();
                let first = met.trailing_zeros() as usize & 7;
                met &= met - 1;
                let parent = child.0 << 3;
                let mut near = (node.child(first).0, parent | first as u32, entries[first]);
                let base = height;
                while met != 0 {
                    let i = met.trailing_zeros() as usize & 7;
                    met &= met - 1;
                    let mut next = (node.child(i).0, parent | i as u32, entries[i]);
                    if next.2 < near.2 {
                        core::mem::swap(&mut near, &mut next);
                    }
                    insert(stack, base, &mut height, next);
                }
                child = Child(near.0);
                holder = near.1;
                continue;
            }
        } else if leaf::<S, K, ANY>(simd, bvh, rays, order, child, holder, packet) {
            t_max = f32::NEG_INFINITY;
            for lane in packet.iter() {
                if lane.active != 0 {
                    let t = if ANY {
                        lane.t.select(simd.mask16(lane.active), simd.splat16(-1.0))
                    } else {
                        lane.t
                    };
                    t_max = t_max.max(t.largest());
                }
            }
            if ANY && t_max < 0.0 {
                break;
            }
        }
        loop {
            if height == 0 {
                break 'walk;
            }
            height -= 1;
            let (bits, from, entry) = stack[height.min(STACK - 1)];
            if entry <= t_max * ROBUST {
                (child, holder) = (Child(bits), from);
                break;
            }
        }
    }
}

/// Puts an entry aside so that those from `base` on stay sorted, farthest first.
#[inline(always)]
fn insert(stack: &mut [(u32, u32, f32); STACK], base: usize, height: &mut usize, next: (u32, u32, f32)) {
    if *height >= STACK {
        return;
    }
    let mut at = *height;
    *height += 1;
    while at > base && stack[at - 1].2 < next.2 {
        stack[at] = stack[at - 1];
        at -= 1;
    }
    stack[at] = next;
}

/// Tests the rays that meet the leaf's box against its triangles; whether a hit was taken.
#[inline(always)]
fn leaf<S: Simd, const K: usize, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    child: Child,
    holder: u32,
    packet: &mut [Lane16<S>; K],
) -> bool {
    let (first, count) = child.triangles();
    let Some(ids) = bvh.triangles.get(first..first + count) else { return false };
    let Some(node) = bvh.nodes.get((holder >> 3) as usize) else { return false };
    let slot = holder as usize & 7;
    let mut met = [0u32; K];
    let mut any = 0;
    for (lane, met) in packet.iter().zip(&mut met) {
        if lane.active != 0 {
            *met = lane.slab.enters(simd, &node.rows, slot, lane.t).1 & lane.active;
            any |= *met;
        }
    }
    if any == 0 {
        return false;
    }
    let mut taken = false;
    for (i, &id) in ids.iter().enumerate() {
        let Some(corners) = leaf_corners(bvh.coordinates, first, count, i) else { return taken };
        for (k, (lane, met)) in packet.iter_mut().zip(&mut met).enumerate() {
            if *met == 0 {
                continue;
            }
            let found = lane.shear.meets(simd, corners, lane.t, *met);
            if found.hits | found.doubtful != 0 {
                let order = order.get(16 * k..).unwrap_or(&[]);
                let hits = take(simd, lane, &found, id, corners, rays, order);
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
    corners: [[f32; 3]; 3],
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
        hits | take_doubtful(simd, lane, found.doubtful, id, corners, rays, order)
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
    corners: [[f32; 3]; 3],
    rays: &[Ray],
    order: &[u32],
) -> u32 {
    let (mut t, mut u, mut v, mut ids) =
        (lane.t.to_array(), lane.u.to_array(), lane.v.to_array(), lane.triangle.to_array());
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
