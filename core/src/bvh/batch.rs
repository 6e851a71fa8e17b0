//! Batches of rays: coherent rays of a tile are traced as packets, all others as a stream.

use super::Bvh;
use super::packet::{CLASSES, Columns, Packet, RAYS_MAX, class};
use super::query::{Nearest, Sink};
use super::stream;
use super::traversal_ray::traceable;
use crate::geometry::Ray;
use halflight_simd::{Kernel, Simd, Stack};

/// Kernel for a batch of incoherent rays.
pub(super) struct Stream<'a, 'm, T, const ANY: bool> {
    pub bvh: &'a Bvh<'m>,
    pub rays: &'a [Ray],
    pub sink: T,
}

impl<T: Sink, const ANY: bool> Kernel for Stream<'_, '_, T, ANY> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        self.sink.clear(0, self.rays.len());
        let indices = 0..self.rays.len() as u32;
        stream::trace::<S, T, ANY>(simd, self.bvh, self.rays, indices, &mut self.sink);
    }
}

/// Rays of a tile.
const TILE: usize = RAYS_MAX;

/// Fewest rays of a class that repay a packet.
const PACKET_MIN: usize = 12;

/// Room for rays that wait for the stream.
const STREAM_SIZE: usize = 512;

/// Kernel for a batch that comes tile by tile. Rays of a tile that share a class make a packet; the others go
/// to the stream.
pub(super) struct Tiles<'a, 'm> {
    pub bvh: &'a Bvh<'m>,
    pub rays: &'a [Ray],
    pub sink: Nearest<'a>,
}

impl Kernel for Tiles<'_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let mut stack = Stack::new();
        let mut pending = ([0u32; STREAM_SIZE], 0);
        let mut tiles = self.rays.chunks(TILE);
        let mut base = 0;
        loop {
            let tile = tiles.next();
            if let Some(rays) = tile {
                // In most tiles all rays are of one class.
                let whole = Columns::whole(simd, rays);
                let mut classes = Classes::ALL;
                if whole.is_none() {
                    classes = Classes::new(rays);
                    self.sink.clear(base, rays.len());
                }
                while let Some(order) = classes.next() {
                    if order.len() >= PACKET_MIN {
                        let columns = match whole {
                            Some(columns) => columns,
                            None => Columns::gathered(simd, rays, order),
                        };
                        let packet = Packet { columns, rays, order, base, whole: whole.is_some() };
                        packet.trace(simd, self.bvh, &mut stack, &mut self.sink);
                    } else {
                        for &i in order {
                            pending.0[pending.1 & (STREAM_SIZE - 1)] = base + u32::from(i);
                            pending.1 += 1;
                        }
                    }
                }
                base += rays.len() as u32;
            }
            if pending.1 > STREAM_SIZE - TILE || (tile.is_none() && pending.1 > 0) {
                let indices = pending.0.iter().take(pending.1).copied();
                stream::trace::<S, _, false>(simd, self.bvh, self.rays, indices, &mut self.sink);
                pending.1 = 0;
            }
            if tile.is_none() {
                return;
            }
        }
    }
}

/// Rays of a tile, sorted by class.
struct Classes {
    order: [u8; TILE],
    /// End of each class in the order.
    ends: [u8; CLASSES],
    /// Next class.
    class: usize,
    from: usize,
}

impl Classes {
    /// A full tile of one class.
    const ALL: Classes = {
        let mut order = [0; TILE];
        let mut i = 0;
        while i < TILE {
            order[i] = i as u8;
            i += 1;
        }
        Classes { order, ends: [TILE as u8; CLASSES], class: CLASSES - 1, from: 0 }
    };

    /// Classes of the traceable rays.
    #[inline(always)]
    fn new(rays: &[Ray]) -> Self {
        let mut classes = [u8::MAX; TILE];
        let mut ends = [0u8; CLASSES];
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
            if let Some(end) = ends.get_mut(usize::from(c)) {
                order[usize::from(*end) & (TILE - 1)] = i as u8;
                *end += 1;
            }
        }
        Self { order, ends, class: 0, from: 0 }
    }

    /// Rays of the next class that is not empty.
    #[inline(always)]
    fn next(&mut self) -> Option<&[u8]> {
        while let Some(&end) = self.ends.get(self.class) {
            self.class += 1;
            let to = usize::from(end);
            if to > self.from {
                let from = core::mem::replace(&mut self.from, to);
                return self.order.get(from..to);
            }
        }
        None
    }
}
