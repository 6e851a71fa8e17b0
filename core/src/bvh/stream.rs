//! Incoherent rays, several at a time but each on its own: the walks of `WALKS` rays are interleaved step by
//! step, so that while one waits for a node the others compute.
//!
//! A walk is a chain of dependent steps (fetch, test, choose, fetch …) that leaves the processor idle most of
//! the time. What a step of one ray waits for is there when its turn comes again.

use super::Bvh;
use super::batch::Sink;
use super::walk::{Walk, traceable};
use crate::geometry::{Hit, Ray};
use halflight_simd::Simd;

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

/// Traces `rays` and puts their hits.
#[inline(always)]
pub(super) fn trace<S: Simd, T: Sink, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    walks: &mut Walks,
    sink: &mut T,
) {
    let mut waiting = rays.iter().zip(0u32..);
    let mut active = 0;
    for walk in &mut walks.walks {
        if !next::<T>(&mut waiting, walk, sink) {
            break;
        }
        active += 1;
    }
    // Walks that have found no ray to take over are swapped behind the active ones.
    while active > 0 {
        let mut i = 0;
        while i < active {
            let walk = &mut walks.walks[i];
            i += 1;
            if walk.step::<S, ANY>(simd, bvh) {
                continue;
            }
            sink.put(walk.index, walk.hit());
            if !next::<T>(&mut waiting, walk, sink) {
                active -= 1;
                walks.walks.swap(i - 1, active);
                i -= 1;
            }
        }
    }
}

/// Gives the walk the next ray that can be traced; whether there is one.
#[inline(always)]
fn next<'r, T: Sink>(
    waiting: &mut impl Iterator<Item = (&'r Ray, u32)>,
    walk: &mut Walk,
    sink: &mut T,
) -> bool {
    for (ray, index) in waiting {
        if traceable(ray) {
            walk.start(ray, index);
            return true;
        }
        sink.put(index, Hit::NONE);
    }
    false
}
