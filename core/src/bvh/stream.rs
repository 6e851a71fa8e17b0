//! Rays in no order, each on its own way but in step: of [`SLOTS`] rays in flight, first all those at a node
//! take a step, then all those at a leaf, then those that found something, and those that are done make room.
//!
//! A walk alone is a chain of dependent steps with branches that cannot be guessed. In step, the same is done
//! for one independent walk after the other:
//! 1. Which walks do the same next is a set of bits. What is guessed wrong is the end of a set, not every
//!    step.
//! 2. Nothing on a stack needs a test when it is taken: a new best hit has taken off all that is farther.
//! 3. Rays are set up in a loop of their own, [`AHEAD`] at a time.
//! 4. Any-hit walks visit what is cheap for its size first ([`super::collapse`] lays the children out so):
//!    near boxes first was slower.

use super::Bvh;
use super::layout::Child;
use super::leaf::{meets_doubtful, take};
use super::query::Sink;
use super::traversal_ray::{TraversalRay, traceable};
use crate::geometry::{Hit, Ray};
use core::hint::select_unpredictable;
use halflight_simd::kernels::boxes::ROBUST;
use halflight_simd::kernels::triangles::Areas;
use halflight_simd::{Simd, Stack, StackMemory};

/// Rays in flight. Few on small machines: each has a stack.
const SLOTS: usize = if cfg!(target_pointer_width = "64") { 32 } else { 4 };

/// Rays set up at a time.
const AHEAD: usize = 64;

/// A ray in flight.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Slot {
    ray: TraversalRay,
    hit: Hit,
}

impl Slot {
    const EMPTY: Slot = Slot { ray: TraversalRay::NONE, hit: Hit::NONE };
}

/// At the bottom of every stack.
const DONE: Child = Child::NONE;

/// The rays to be traced, set up some time ahead.
struct Queue<'a, I> {
    rays: &'a [Ray],
    indices: I,
    ahead: [TraversalRay; AHEAD],
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

    /// Sets up the next rays; leaves out those that cannot be traced.
    #[inline(always)]
    fn fill(&mut self) {
        (self.count, self.taken) = (0, 0);
        while self.count < AHEAD {
            let Some(index) = self.indices.next() else { return };
            let Some(ray) = self.rays.get(index as usize) else { continue };
            self.ahead[self.count & (AHEAD - 1)] = TraversalRay::new(ray, index);
            self.count += traceable(ray) as usize;
        }
    }
}

/// Traces the rays `indices` of `rays` and puts what is found.
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
    let mut queue = Queue { rays, indices, ahead: [TraversalRay::NONE; AHEAD], count: 0, taken: 0 };
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
            let (Slot { ray, hit }, stack) = (&mut slots[i], &mut stacks[i]);
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
            next[i] = Child::node(0).0;
            nodes |= 1 << i;
        }
        if nodes | leaves == 0 {
            return;
        }

        while let Some(i) = pop(&mut nodes) {
            let (Slot { ray, .. }, stack) = (&mut slots[i], &mut stacks[i]);
            let Some(node) = bvh.nodes.get(next[i] as usize) else { return };
            let (entry, exit) = ray.slab8(simd).interval(simd, &node.rows, ray.t_max);
            if ANY {
                simd.push8_unordered(entry, exit, &node.rows[6], stack);
            } else {
                simd.push8(node.order_of(ray.octant()), entry, exit, &node.rows[6], stack);
            }
            next[i] = take_next::<S, ANY>(simd, bvh, stack);
        }

        let (mut at_leaf, mut met) = (leaves, 0u32);
        while let Some(i) = pop(&mut at_leaf) {
            let (Slot { ray, hit }, stack) = (&mut slots[i], &mut stacks[i]);
            let leaf = Child(next[i]);
            let (first, count) = leaf.triangles();
            let Some(areas) = ray.shear8(simd).areas(simd, bvh.coordinates, 9 * first, count, ray.t_max)
            else {
                return;
            };
            if ANY {
                let mut any = areas.hits != 0;
                if areas.doubtful != 0 {
                    any |= meets_doubtful(bvh, ray, leaf, areas.doubtful);
                }
                // A hit is as likely as not: not to be guessed.
                hit.triangle = select_unpredictable(any, 0, hit.triangle);
                stack.truncate(select_unpredictable(any, 1, usize::MAX));
                next[i] = take_next::<S, ANY>(simd, bvh, stack);
            } else {
                found[i] = areas;
                met |= ((areas.hits | areas.doubtful != 0) as u32) << i;
            }
        }
        if ANY {
            continue;
        }
        while let Some(i) = pop(&mut met) {
            let (Slot { ray, hit }, stack) = (&mut slots[i], &mut stacks[i]);
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

/// Takes the lowest slot out of a set of them.
#[inline(always)]
fn pop(slots: &mut u32) -> Option<usize> {
    if *slots == 0 {
        return None;
    }
    let lowest = slots.trailing_zeros() as usize & (SLOTS - 1);
    *slots &= *slots - 1;
    Some(lowest)
}

/// Takes a child from the stack, and asks the memory for what is in it; for any-hit rays, which take fewer
/// steps, that costs more than it brings.
#[inline(always)]
fn take_next<S: Simd, const ANY: bool>(simd: S, bvh: &Bvh, stack: &mut Stack) -> u32 {
    let child = Child(stack.pop().unwrap_or(DONE.0));
    if !ANY {
        let index = if child.is_leaf() { 9 * child.triangles().0 } else { child.0 as usize };
        simd.prefetch(bvh.nodes, bvh.coordinates, child.is_leaf(), index);
    }
    child.0
}
