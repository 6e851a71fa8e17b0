//! Traversal of all leaves within a radius, in the order of the map, for range queries and density estimates.

use super::PhotonMap;
use super::layout::{HALVES, LEAF, LEVELS, Leaf, WIDTH};
use halflight_simd::kernels::points::Place16;
use halflight_simd::{Kernel, Lanes, Mask, Simd};

/// Visitor of leaves. A trait, because a closure might be compiled without the instructions of the level.
pub(super) trait Visit<S: Simd> {
    /// Visits a leaf of this index. Implementations must be `inline(always)`.
    fn leaf(&mut self, simd: S, index: usize, leaf: &Leaf);
}

/// Number of leaves that are prefetched ahead of the visited leaf.
const PREFETCH_DISTANCE: usize = 4;

/// Calls `visitor` with every leaf that has a box within the finite squared radius of a place.
#[inline(always)]
pub(super) fn leaves_within<S: Simd>(
    simd: S,
    map: &PhotonMap,
    place: &Place16<S>,
    squared_radius: f32,
    visitor: &mut impl Visit<S>,
) {
    let Some(top) = map.levels.count.checked_sub(1) else { return };
    let mut walk = Walk::new(simd, map, place, squared_radius, top);
    // Ring of leaves whose prefetch is under way.
    let mut ring = [0; PREFETCH_DISTANCE];
    let (mut put, mut taken) = (0, 0);
    loop {
        if let Some(at) = walk.next(simd) {
            prefetch(simd, map, at);
            ring[put % PREFETCH_DISTANCE] = at;
            put += 1;
            if put - taken < PREFETCH_DISTANCE {
                continue;
            }
        } else if taken == put {
            return;
        }
        let at = ring[taken % PREFETCH_DISTANCE];
        taken += 1;
        let Some(leaf) = map.leaves.get(at) else { return };
        visitor.leaf(simd, at, leaf);
    }
}

/// State of the traversal.
struct Walk<'a, 'm, S: Simd> {
    map: &'a PhotonMap<'m>,
    place: &'a Place16<S>,
    limit: S::F16,
    /// Index on its level of each node on the path from the root, and the mask of its remaining children.
    path: [(usize, u32); LEVELS + 1],
    level: usize,
    top: usize,
}

impl<'a, 'm, S: Simd> Walk<'a, 'm, S> {
    #[inline(always)]
    fn new(simd: S, map: &'a PhotonMap<'m>, place: &'a Place16<S>, squared_radius: f32, top: usize) -> Self {
        let limit = simd.splat16(squared_radius);
        // An artificial parent whose only child is the root.
        let mut path = [(0, 0); LEVELS + 1];
        path[(top + 1) % (LEVELS + 1)] = (0, 1);
        Self { map, place, limit, path, level: top + 1, top: top + 1 }
    }

    /// Index of the next leaf.
    #[inline(always)]
    fn next(&mut self, simd: S) -> Option<usize> {
        loop {
            let (index, left) = self.path[self.level % (LEVELS + 1)];
            if left == 0 {
                if self.level >= self.top {
                    return None;
                }
                self.level += 1;
                continue;
            }
            self.path[self.level % (LEVELS + 1)].1 = left & (left - 1);
            let child = WIDTH * index + left.trailing_zeros() as usize;
            if self.level == 0 {
                return Some(child);
            }
            self.level -= 1;
            let node = self.map.nodes.get(self.map.levels.at(self.level, child))?;
            let left = self.place.squared_distances_to_boxes(simd, &node.boxes).le(self.limit).bits();
            self.path[self.level % (LEVELS + 1)] = (child, left);
        }
    }
}

/// Prefetches a leaf: three times four cache lines.
#[inline(always)]
fn prefetch<S: Simd>(simd: S, map: &PhotonMap, leaf: usize) {
    const LINES: usize = size_of::<Leaf>() / 64;
    let lines: &[[u8; 64]] = bytemuck::cast_slice(map.leaves);
    for first in [0, 4, 8] {
        simd.prefetch(lines, &[], false, LINES * leaf + first);
    }
}

/// Kernel of a range query from a place in units of the map. Writes the indices of the photons in ascending
/// order to `found`, as far as there is room, and returns their number.
pub(super) struct Range<'a, 'm> {
    pub map: &'a PhotonMap<'m>,
    pub place: [f32; 3],
    pub squared_radius: f32,
    pub found: &'a mut [u32],
}

impl Kernel for Range<'_, '_> {
    type Out = usize;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> usize {
        let Self { map, squared_radius, found, .. } = self;
        let place = Place16::new(simd, self.place);
        let found: &mut [f32] = bytemuck::cast_slice_mut(found);
        let mut list = List { place, limit: simd.splat16(squared_radius), found, count: 0 };
        leaves_within(simd, map, &place, squared_radius, &mut list);
        list.count
    }
}

/// Photons found by a range query.
struct List<'a, S: Simd> {
    place: Place16<S>,
    limit: S::F16,
    found: &'a mut [f32],
    count: usize,
}

impl<S: Simd> Visit<S> for List<'_, S> {
    #[inline(always)]
    fn leaf(&mut self, simd: S, index: usize, leaf: &Leaf) {
        for half in 0..HALVES {
            let near = self.place.squared_distances(simd, leaf.half(half)).le(self.limit);
            let numbers = simd.numbers16((LEAF * index + 16 * half) as u32);
            put(simd, near, numbers, self.found, self.count);
            self.count += near.bits().count_ones() as usize;
        }
    }
}

/// Packs the numbers that are `wanted` to `found[at..]`, as far as there is room.
#[inline(always)]
fn put<S: Simd>(simd: S, wanted: <S::F16 as Lanes>::Mask, numbers: S::F16, found: &mut [f32], at: usize) {
    let Some(rest) = found.get_mut(at..) else { return };
    if let Some(out) = rest.first_chunk_mut() {
        simd.pack16(wanted, numbers, out);
    } else {
        let mut out = [0.0; 16];
        simd.pack16(wanted, numbers, &mut out);
        let room = rest.len().min(wanted.bits().count_ones() as usize);
        rest[..room].copy_from_slice(&out[..room]);
    }
}
