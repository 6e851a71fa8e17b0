//! Batches of rays: tiles of neighbours that go the same way as packets, all others in step.

use super::Bvh;
use super::packet::{self, CLASSES, RAYS_MAX, class};
use super::ready::traceable;
use super::stream;
use crate::geometry::{Hit, Ray};
use halflight_simd::{Kernel, Simd, Stack};

/// What a batch does with the hits of its rays. All start as [`Hit::NONE`].
pub(super) trait Sink {
    /// No hit for any ray.
    fn clear(&mut self);
    /// Takes the hit of a ray, or none. An index beyond the end is harmless.
    fn put(&mut self, index: u32, hit: Hit);
}

/// Keeps the hits.
pub(super) struct Nearest<'a>(pub &'a mut [Hit]);

/// Keeps whether there was one.
pub(super) struct Hidden<'a>(pub &'a mut [u8]);

impl Sink for Nearest<'_> {
    #[inline(always)]
    fn clear(&mut self) {
        self.0.fill(Hit::NONE);
    }

    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot = hit;
        }
    }
}

impl Sink for Hidden<'_> {
    #[inline(always)]
    fn clear(&mut self) {
        self.0.fill(0);
    }

    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot = hit.is_some() as u8;
        }
    }
}

/// Rays in no order.
pub(super) struct Stream<'a, 'm, T, const ANY: bool> {
    pub bvh: &'a Bvh<'m>,
    pub rays: &'a [Ray],
    pub sink: T,
}

impl<T: Sink, const ANY: bool> Kernel for Stream<'_, '_, T, ANY> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        self.sink.clear();
        let indices = 0..self.rays.len() as u32;
        stream::trace::<S, T, ANY>(simd, self.bvh, self.rays, indices, &mut self.sink);
    }
}

/// Rays of a tile: neighbours.
const TILE: usize = RAYS_MAX;

/// Rays of a class that are not worth a packet.
const PACKET_MIN: usize = 12;

/// Most rays that wait to be traced in step.
const ALONE: usize = 512;

/// Rays that come tile by tile. Those of a tile that go the same way make a packet, the others are left for the
/// stream.
pub(super) struct Tiles<'a, 'm> {
    pub bvh: &'a Bvh<'m>,
    pub rays: &'a [Ray],
    pub sink: Nearest<'a>,
}

impl Kernel for Tiles<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        self.sink.clear();
        let mut stack = Stack::new();
        let mut alone = ([0u32; ALONE], 0);
        let mut tiles = self.rays.chunks(TILE);
        let mut base = 0;
        loop {
            let tile = tiles.next();
            if let Some(rays) = tile {
                let Sorted { order, ends } = Sorted::new(rays);
                let mut from = 0;
                for to in ends {
                    let class = order.get(from..to).unwrap_or(&[]);
                    from = to;
                    if class.len() >= PACKET_MIN {
                        packet::trace(simd, self.bvh, rays, class, base, &mut stack, &mut self.sink);
                    } else {
                        for &i in class {
                            alone.0[alone.1 & (ALONE - 1)] = base + u32::from(i);
                            alone.1 += 1;
                        }
                    }
                }
                base += rays.len() as u32;
            }
            if alone.1 > ALONE - TILE || (tile.is_none() && alone.1 > 0) {
                let indices = alone.0.iter().take(alone.1).copied();
                stream::trace::<S, _, false>(simd, self.bvh, self.rays, indices, &mut self.sink);
                alone.1 = 0;
            }
            if tile.is_none() {
                return;
            }
        }
    }
}

/// The rays of a tile by class.
struct Sorted {
    order: [u8; TILE],
    /// Where each class ends in the order.
    ends: [usize; CLASSES],
}

impl Sorted {
    /// Those that can be traced.
    #[inline(always)]
    fn new(rays: &[Ray]) -> Self {
        let mut classes = [u8::MAX; TILE];
        let mut ends = [0usize; CLASSES];
        for (ray, class_of) in rays.iter().zip(&mut classes) {
            if traceable(ray) {
                let c = class(ray.direction);
                *class_of = c as u8;
                ends[c % CLASSES] += 1;
            }
        }
        let mut sum = 0;
        for end in &mut ends {
            (*end, sum) = (sum, sum + *end);
        }
        let mut order = [0; TILE];
        for (i, &c) in classes.iter().take(rays.len()).enumerate() {
            if let Some(end) = ends.get_mut(c as usize) {
                order[*end & (TILE - 1)] = i as u8;
                *end += 1;
            }
        }
        Self { order, ends }
    }
}
