//! Batches of rays: neighbours that go the same way as packets, what is left over interleaved.
//!
//! Rays are taken in windows, in the order they come: near ones in the slice are expected to start near each
//! other. Within a window they are sorted by class (octant and dominant axis), and each class is cut into
//! packets.

use super::packet::{self, CLASSES, Jobs, PacketStack, class};
use super::stream::{self, Rays, Subtrees, Walks};
use super::walk::traceable;
use super::{Bvh, Coherence};
use crate::geometry::{Hit, Ray};
use halflight_simd::{Kernel, Simd};

/// Rays of a window of incoherent rays: enough to fill packets of most classes.
const WINDOW: usize = 512;

/// Rays of a tile of coherent rays.
const TILE: usize = 64;

/// Packets of fewer rays than this are not worth it.
const PACKET_MIN: usize = 6;

/// What a batch does with the hits of its rays. All start as [`Hit::NONE`].
pub(super) trait Sink {
    /// No hit for any of `count` rays from `base` on.
    fn clear(&mut self, base: u32, count: usize);
    /// Takes over a hit that is not farther than any before, or none.
    fn put(&mut self, index: u32, hit: Hit);
    /// The hit so far; of distance `t_max` where there is none.
    fn found(&self, index: u32, t_max: f32) -> Hit;
}

/// Keeps the hits.
pub(super) struct Nearest<'a>(pub &'a mut [Hit]);

/// Keeps whether there was one.
pub(super) struct Hidden<'a>(pub &'a mut [u8]);

impl Sink for Nearest<'_> {
    #[inline(always)]
    fn clear(&mut self, base: u32, count: usize) {
        self.0.iter_mut().skip(base as usize).take(count).for_each(|hit| *hit = Hit::NONE);
    }

    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            slot.take(hit);
        }
    }

    #[inline(always)]
    fn found(&self, index: u32, t_max: f32) -> Hit {
        match self.0.get(index as usize) {
            Some(hit) if hit.is_some() => *hit,
            _ => Hit { t: t_max, ..Hit::NONE },
        }
    }
}

impl Sink for Hidden<'_> {
    #[inline(always)]
    fn clear(&mut self, base: u32, count: usize) {
        self.0.iter_mut().skip(base as usize).take(count).for_each(|hidden| *hidden = 0);
    }

    #[inline(always)]
    fn put(&mut self, index: u32, hit: Hit) {
        if let Some(slot) = self.0.get_mut(index as usize) {
            *slot |= hit.is_some() as u8;
        }
    }

    #[inline(always)]
    fn found(&self, index: u32, t_max: f32) -> Hit {
        let hidden = self.0.get(index as usize).is_some_and(|&hidden| hidden != 0);
        if hidden { Hit { triangle: 0, ..Hit::NONE } } else { Hit { t: t_max, ..Hit::NONE } }
    }
}

/// A batch, for one level.
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
        let mut stack = PacketStack::new();
        let mut walks = Walks::new();
        let mut jobs = Jobs::new();
        let mut sorted = Sorted { order: [0; WINDOW] };
        let coherent = self.coherence == Coherence::Coherent;
        let size = if coherent { TILE } else { WINDOW };
        let mut base = 0;
        for rays in self.rays.chunks(size) {
            self.sink.clear(base, rays.len());
            let ends = sorted.sort(rays);
            let mut from = 0;
            for to in ends {
                let mut order = sorted.order.get(from..to).unwrap_or(&[]);
                from = to;
                while order.len() >= PACKET_MIN {
                    let most = if coherent { 64 } else { 16 };
                    let (packet, others) = order.split_at(order.len().min(most));
                    order = others;
                    let sink = &mut self.sink;
                    if packet.len() <= 16 {
                        packet::trace::<S, T, 1, ANY>(
                            simd, self.bvh, rays, packet, base, &mut stack, &mut jobs, sink,
                        );
                    } else {
                        packet::trace::<S, T, 4, ANY>(
                            simd, self.bvh, rays, packet, base, &mut stack, &mut jobs, sink,
                        );
                    }
                    if jobs.is_crowded() {
                        let subtrees = Subtrees::<ANY> { rays, base, jobs: jobs.take().iter() };
                        stream::trace::<S, T, ANY>(simd, self.bvh, subtrees, &mut walks, sink);
                    }
                }
                for &i in order {
                    jobs.push_root(i);
                }
            }
            let subtrees = Subtrees::<ANY> { rays, base, jobs: jobs.take().iter() };
            stream::trace::<S, T, ANY>(simd, self.bvh, subtrees, &mut walks, &mut self.sink);
            base += rays.len() as u32;
        }
    }
}

/// A batch of rays that part company too early for packets to pay: bounces on their way to the nearest hit.
pub(super) struct Lone<'a, 'm> {
    pub bvh: &'a Bvh<'m>,
    pub rays: &'a [Ray],
    pub sink: Nearest<'a>,
}

impl Kernel for Lone<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        self.sink.clear(0, self.rays.len());
        let rays = Rays { rays: self.rays, taken: 0 };
        stream::trace::<S, _, false>(simd, self.bvh, rays, &mut Walks::new(), &mut self.sink);
    }
}

/// The rays of a window by class.
struct Sorted {
    order: [u32; WINDOW],
}

impl Sorted {
    /// Fills `order` with the rays that can be traced and returns where each class ends.
    #[inline(always)]
    fn sort(&mut self, rays: &[Ray]) -> [usize; CLASSES] {
        let mut classes = [u8::MAX; WINDOW];
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
        for (i, &c) in classes.iter().take(rays.len()).enumerate() {
            if let Some(end) = ends.get_mut(c as usize) {
                self.order[*end & (WINDOW - 1)] = i as u32;
                *end += 1;
            }
        }
        ends
    }
}
