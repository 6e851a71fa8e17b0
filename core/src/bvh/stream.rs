//! Incoherent rays, several at a time but each on its own: the walks of `WALKS` rays are interleaved step by
//! step, so that while one waits for a node the others compute.
//!
//! A walk is a chain of dependent steps (fetch, test, choose, fetch …) that leaves the processor idle most of
//! the time. What a step of one ray waits for is there when its turn comes again.

use super::Bvh;
use super::batch::Sink;
use super::layout::Child;
use super::walk::{Walk, traceable};
use crate::geometry::{Hit, MISS, Ray};
use halflight_simd::Simd;
use halflight_simd::kernels::boxes::ROBUST;

/// Rays in flight.
const WALKS: usize = 6;

/// The memory of the interleaved walks.
pub(super) struct Walks {
    walks: [Walk; WALKS],
}

impl Walks {
    pub(super) const fn new() -> Self {
        Self { walks: [const { Walk::IDLE }; WALKS] }
    }
}

/// Where walks come from.
pub(super) trait Source<T> {
    /// Sets the walk out on the next way there is; `false` when there is none.
    fn next(&mut self, walk: &mut Walk, sink: &T) -> bool;
}

/// Rays one after the other, the whole tree for each.
pub(super) struct Rays<'a> {
    pub rays: &'a [Ray],
    pub taken: usize,
}

impl<T: Sink> Source<T> for Rays<'_> {
    #[inline(always)]
    fn next(&mut self, walk: &mut Walk, _: &T) -> bool {
        while let Some(ray) = self.rays.get(self.taken) {
            let index = self.taken as u32;
            self.taken += 1;
            if traceable(ray) {
                walk.start(ray, index, Child::node(0).0, 0.0, Hit { t: ray.t_max, ..Hit::NONE });
                return true;
            }
        }
        false
    }
}

/// Subtrees (ray of the window, child, entry), for rays that may have found something already.
pub(super) struct Subtrees<'a, const ANY: bool> {
    pub rays: &'a [Ray],
    pub base: u32,
    pub jobs: core::slice::Iter<'a, (u32, u32, f32)>,
}

impl<T: Sink, const ANY: bool> Source<T> for Subtrees<'_, ANY> {
    #[inline(always)]
    fn next(&mut self, walk: &mut Walk, sink: &T) -> bool {
        for &(i, child, entry) in self.jobs.by_ref() {
            let Some(ray) = self.rays.get(i as usize) else { continue };
            let best = sink.found(self.base + i, ray.t_max);
            if entry <= best.t * ROBUST && !(ANY && best.triangle != MISS) {
                walk.start(ray, self.base + i, child, entry, best);
                return true;
            }
        }
        false
    }
}

/// Walks all that `source` has, and puts what is found.
#[inline(always)]
pub(super) fn trace<S: Simd, T: Sink, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    mut source: impl Source<T>,
    walks: &mut Walks,
    sink: &mut T,
) {
    let mut active = 0;
    for walk in &mut walks.walks {
        walk.idle = !source.next(walk, sink);
        active += !walk.idle as usize;
    }
    while active > 0 {
        for walk in &mut walks.walks {
            if walk.idle || walk.step::<S, ANY>(simd, bvh) {
                continue;
            }
            sink.put(walk.index, walk.hit());
            walk.idle = !source.next(walk, sink);
            active -= walk.idle as usize;
        }
    }
}
