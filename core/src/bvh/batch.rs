//! Batches of rays: coherent ones as packets, in the order they come; incoherent ones interleaved.

use super::packet::{self, PacketStack, class};
use super::stream::{self, Walks};
use super::walk::{Walk, traceable};
use super::{Bvh, Coherence};
use crate::geometry::{Hit, Ray};
use halflight_simd::{Kernel, Simd};

/// What a batch does with the hit of each ray.
pub(super) trait Sink {
    fn put(&mut self, index: u32, hit: Hit);
}

pub(super) struct Nearest<'a>(pub &'a mut [Hit]);
pub(super) struct Hidden<'a>(pub &'a mut [u8]);

impl Sink for Nearest<'_> {
    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot = hit;
        }
    }
}

impl Sink for Hidden<'_> {
    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot = hit.is_some() as u8;
        }
    }
}

pub(super) struct Batch<'a, 'm, T, const ANY: bool> {
    pub bvh: &'a Bvh<'m>,
    pub rays: &'a [Ray],
    pub coherence: Coherence,
    pub sink: T,
}

impl<T: Sink, const ANY: bool> Kernel for Batch<'_, '_, T, ANY> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        match self.coherence {
            Coherence::Coherent => {
                let mut stacks = (PacketStack::new(), Walk::IDLE);
                let mut base = 0;
                for rays in self.rays.chunks(64) {
                    tile::<S, T, ANY>(simd, self.bvh, rays, base, &mut stacks, &mut self.sink);
                    base += 64;
                }
            }
            Coherence::Incoherent => {
                let mut walks = Walks::new();
                stream::trace::<S, T, ANY>(simd, self.bvh, self.rays, &mut walks, &mut self.sink);
            }
        }
    }
}

/// Up to 64 neighbours, one class after the other.
#[inline(always)]
fn tile<S: Simd, T: Sink, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    base: u32,
    stacks: &mut (PacketStack, Walk),
    sink: &mut T,
) {
    let mut classes = [u32::MAX; 64];
    for (i, (class_of, ray)) in classes.iter_mut().zip(rays).enumerate() {
        if traceable(ray) {
            *class_of = class(ray.direction);
        } else {
            sink.put(base + i as u32, Hit::NONE);
        }
    }
    let mut order = [0u32; 64];
    while let Some(&next) = classes.iter().find(|&&c| c != u32::MAX) {
        let mut count = 0;
        for (i, class_of) in classes.iter_mut().enumerate() {
            if *class_of == next {
                *class_of = u32::MAX;
                order[count & 63] = i as u32;
                count += 1;
            }
        }
        group::<S, T, ANY>(simd, bvh, rays, &order[..count.min(64)], base, stacks, sink);
    }
}

/// Up to 64 rays of one class.
#[inline(always)]
fn group<S: Simd, T: Sink, const ANY: bool>(
    simd: S,
    bvh: &Bvh,
    rays: &[Ray],
    order: &[u32],
    base: u32,
    stacks: &mut (PacketStack, Walk),
    sink: &mut T,
) {
    match order.len() {
        0..3 => {
            for &i in order {
                if let Some(ray) = rays.get(i as usize) {
                    sink.put(base + i, stacks.1.trace::<S, ANY>(simd, bvh, ray));
                }
            }
        }
        3..17 => packet::trace::<S, T, 1, ANY>(simd, bvh, rays, order, base, &mut stacks.0, sink),
        _ => packet::trace::<S, T, 4, ANY>(simd, bvh, rays, order, base, &mut stacks.0, sink),
    }
}
