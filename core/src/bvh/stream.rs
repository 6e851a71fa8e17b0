//! Incoherent rays, several at a time but each on its own: the walks of `WALKS` rays are interleaved step by
//! step, so that while one waits for a node the others compute.
//!
//! A walk is a chain of dependent steps (fetch, test, choose, fetch …) that leaves the processor idle most of
//! the time. What a step of one ray waits for is there when its turn comes again.

use super::Bvh;
use super::batch::Sink;
use super::walk::Walk;
use crate::geometry::{MISS, Ray};
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

/// Walks the subtrees of `jobs` (ray of the window, child, entry) and puts what is nearer than what the rays
/// have found so far.
#[inline(always)]
pub(super) fn trace<S: Simd, T: Sink, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    jobs: &[(u32, u32, f32)],
    base: u32,
    walks: &mut Walks,
    sink: &mut T,
) {
    let mut waiting = jobs.iter();
    // Slots of the active walks come first; a walk that finds no job to take over trades places.
    let mut slots: [usize; WALKS] = core::array::from_fn(|i| i);
    let mut active = 0;
    for walk in &mut walks.walks {
        if !next::<T, ANY>(rays, &mut waiting, base, walk, sink) {
            break;
        }
        active += 1;
    }
    while active > 0 {
        let mut i = 0;
        while i < active {
            let walk = &mut walks.walks[slots[i] % WALKS];
            i += 1;
            if walk.step::<S, ANY>(simd, bvh) {
                continue;
            }
            sink.put(walk.index, walk.hit());
            if !next::<T, ANY>(rays, &mut waiting, base, walk, sink) {
                active -= 1;
                i -= 1;
                slots.swap(i, active);
            }
        }
    }
}

/// Gives the walk the next job that is still worth it; whether there is one.
#[inline(always)]
fn next<T: Sink, const ANY: bool>(
    rays: &[Ray],
    waiting: &mut core::slice::Iter<(u32, u32, f32)>,
    base: u32,
    walk: &mut Walk,
    sink: &T,
) -> bool {
    for &(i, child, entry) in waiting {
        let Some(ray) = rays.get(i as usize) else { continue };
        let best = sink.found(base + i, ray.t_max);
        if entry <= best.t * ROBUST && !(ANY && best.triangle != MISS) {
            walk.start(ray, base + i, child, entry, best);
            return true;
        }
    }
    false
}
