//! Stream traversal of incoherent rays: independent traversals in step. Of [`SLOTS`] rays in flight, first
//! all rays at a node take a step, then all at a leaf, then all with a hit. Rays that are done make room for
//! new ones.
//!
//! A single traversal is a chain of dependent steps with unpredictable branches. In step, the processor does
//! the same for one independent ray after the other:
//! 1. A mask holds the rays that do the same step next. The branch predictor misses the end of a mask, not
//!    every step.
//! 2. Stack entries need no test when popped: a new best hit has removed all that are farther.
//! 3. Rays are prepared in a loop of their own, [`PREFETCH_DISTANCE`] at a time.
//! 4. Any-hit rays visit children of the least cost per area first ([`super::collapse`] orders the children
//!    so). Near boxes first was slower.

use super::Bvh;
use super::instances::Outside;
use super::layout::{Child, Node};
use super::leaf::{meets_on_edge, take};
use super::query::Sink;
use super::traversal_ray::{TraversalRay, traceable};
use crate::geometry::{Hit, Ray};
use core::hint::select_unpredictable;
use halflight_simd::kernels::boxes::ROBUST;
use halflight_simd::kernels::triangles::Areas;
use halflight_simd::{Simd, Stack, StackMemory};

/// Rays in flight. Few on small machines, because each has a stack.
const SLOTS: usize = if cfg!(target_pointer_width = "64") { 32 } else { 4 };

/// Rays prepared at a time.
const PREFETCH_DISTANCE: usize = 64;

/// A ray in flight.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Slot {
    ray: TraversalRay,
    hit: Hit,
    /// In the padding of the slot.
    outside: Outside,
}

impl Slot {
    /// Takes the ray into an instance, or back out of it: see [`Bvh::cross`].
    fn cross(&mut self, bvh: &Bvh, rays: &[Ray], child: Child, stack: &mut Stack) {
        if let Some(world) = rays.get(self.ray.index as usize) {
            bvh.cross(child, world, (&mut self.ray, &mut self.hit), &mut self.outside, stack);
        }
    }

    const EMPTY: Slot = Slot { ray: TraversalRay::NONE, hit: Hit::NONE, outside: Outside::WORLD };
}

/// Entry at the bottom of every stack.
const DONE: Child = Child::NONE;

/// Queue of rays, prepared ahead of their traversal.
struct Queue<'a, I> {
    rays: &'a [Ray],
    indices: I,
    ahead: [TraversalRay; PREFETCH_DISTANCE],
    count: usize,
    taken: usize,
}

impl<I: Iterator<Item = u32>> Queue<'_, I> {
    #[inline(always)]
    fn next(&mut self) -> Option<&TraversalRay> {
        if self.taken == self.count {
            self.fill();
        }
        if self.taken == self.count {
            return None;
        }
        self.taken += 1;
        self.ahead.get(self.taken - 1)
    }

    /// Prepares the next rays, without those that cannot be traced.
    #[inline(always)]
    fn fill(&mut self) {
        (self.count, self.taken) = (0, 0);
        while self.count < PREFETCH_DISTANCE {
            let Some(index) = self.indices.next() else { return };
            let Some(ray) = self.rays.get(index as usize) else { continue };
            self.ahead[self.count & (PREFETCH_DISTANCE - 1)] = TraversalRay::new(ray, index);
            self.count += traceable(ray) as usize;
        }
    }
}

/// Traces the rays `indices` of `rays` and passes their hits to `sink`.
#[inline(always)]
pub(super) fn trace<S: Simd, T: Sink, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    indices: impl Iterator<Item = u32>,
    sink: &mut T,
) {
    if bvh.nodes.is_empty() {
        return;
    }
    let mut queue =
        Queue { rays, indices, ahead: [TraversalRay::NONE; PREFETCH_DISTANCE], count: 0, taken: 0 };
    let mut slots = [Slot::EMPTY; SLOTS];
    let mut memory = StackMemory::<SLOTS>::new();
    let stacks = memory.stacks();
    let mut next = [DONE.0; SLOTS];
    let mut found = [Areas::NONE; SLOTS];
    let mut empty = 0u32;
    loop {
        let (mut leaves, mut done) = (0u32, 0u32);
        for (i, &child) in next.iter().enumerate() {
            leaves |= (child >> 31) << i;
            done |= ((child == DONE.0) as u32) << i;
        }
        let mut nodes = !leaves & (u32::MAX >> (32 - SLOTS));
        leaves &= !done;

        let mut vacant = done & !empty;
        while let Some(i) = pop(&mut vacant) {
            let (Slot { ray, hit, .. }, stack) = (&mut slots[i], &mut stacks[i]);
            sink.put(ray.index, *hit);
            match queue.next() {
                Some(traversal_ray) => *ray = *traversal_ray,
                None => {
                    empty |= 1 << i;
                    continue;
                }
            }
            *hit = Hit::NONE;
            stack.restart(DONE.0);
            next[i] = bvh.root.0;
            nodes |= 1 << i;
        }
        if nodes | leaves == 0 {
            return;
        }

        while let Some(i) = pop(&mut nodes) {
            let (slot, stack) = (&mut slots[i], &mut stacks[i]);
            match bvh.nodes.get(next[i] as usize) {
                Some(node) => visit::<S, ANY>(simd, node, &slot.ray, stack),
                None => slot.cross(bvh, rays, Child(next[i]), stack),
            }
            next[i] = take_next::<S, ANY>(simd, bvh, stack);
        }

        let (mut at_leaf, mut met) = (leaves, 0u32);
        while let Some(i) = pop(&mut at_leaf) {
            let (Slot { ray, hit, .. }, stack) = (&mut slots[i], &mut stacks[i]);
            let leaf = Child(next[i]);
            let (first, count) = leaf.triangles();
            let Some(areas) = ray.shear8(simd).areas(simd, bvh.coordinates, 9 * first, count, ray.t_max)
            else {
                return;
            };
            if ANY {
                let mut any = areas.hits != 0;
                if areas.on_edge != 0 {
                    any |= meets_on_edge(bvh, ray, leaf, areas.on_edge);
                }
                // Hits are unpredictable: no branch.
                hit.triangle = select_unpredictable(any, 0, hit.triangle);
                stack.truncate(select_unpredictable(any, 1, usize::MAX));
                next[i] = take_next::<S, ANY>(simd, bvh, stack);
            } else {
                found[i] = areas;
                met |= ((areas.hits | areas.on_edge != 0) as u32) << i;
            }
        }
        if ANY {
            continue;
        }
        while let Some(i) = pop(&mut met) {
            let (Slot { ray, hit, .. }, stack) = (&mut slots[i], &mut stacks[i]);
            take(simd, bvh, ray, Child(next[i]), &found[i], hit);
            if hit.is_some() {
                ray.t_max = hit.t;
                simd.keep(hit.t * ROBUST, stack);
            }
        }
        while let Some(i) = pop(&mut leaves) {
            next[i] = take_next::<S, ANY>(simd, bvh, &mut stacks[i]);
        }
    }
}

/// Pushes the children of `node` that the ray meets.
#[inline(always)]
fn visit<S: Simd, const ANY: bool>(simd: S, node: &Node, ray: &TraversalRay, stack: &mut Stack) {
    let (entry, exit) = ray.slab8(simd).interval(simd, &node.rows, ray.t_max);
    if ANY {
        simd.push8_unordered(entry, exit, &node.rows[6], stack);
    } else {
        simd.push8(node.order_of(ray.octant()), entry, exit, &node.rows[6], stack);
    }
}

/// Removes and returns the lowest slot of a mask.
#[inline(always)]
fn pop(slots: &mut u32) -> Option<usize> {
    if *slots == 0 {
        return None;
    }
    let lowest = slots.trailing_zeros() as usize & (SLOTS - 1);
    *slots &= *slots - 1;
    Some(lowest)
}

/// Pops a child from the stack and prefetches its content. Any-hit rays take fewer steps, for which a
/// prefetch costs more than it gains.
#[inline(always)]
fn take_next<S: Simd, const ANY: bool>(simd: S, bvh: &Bvh, stack: &mut Stack) -> u32 {
    let child = Child(stack.pop().unwrap_or(DONE.0));
    if !ANY {
        let index = if child.is_leaf() { 9 * child.triangles().0 } else { child.0 as usize };
        simd.prefetch(bvh.nodes, bvh.coordinates, child.is_leaf(), index);
    }
    child.0
}
