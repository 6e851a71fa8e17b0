//! The k nearest photons: depth first, the nearest child that is left first, until none can hold a nearer
//! photon.
//!
//! Distances of a node's children are computed once, sixteen at a time, and stay where they are until it is
//! done: a stack of at most [`LEVELS`] rows. Photons of a leaf that are near enough are appended to the
//! candidates, which are cut back now and then ([`halflight_simd::kernels::select`]); their limit prunes the
//! walk.

use super::PhotonMap;
use super::layout::{HALVES, LEAF, LEVELS, WIDTH};
use crate::memory::{Arena, Footprint, OutOfMemory};
use halflight_simd::kernels::points::Place16;
use halflight_simd::kernels::select::{Candidates, OVERRUN};
use halflight_simd::{Kernel, Lanes, Mask, Simd};

/// Candidates at which `k` of them are selected: more is less work for each, but prunes later.
const fn patience(k: usize) -> usize {
    k.saturating_add(k / 4).saturating_add(8)
}

/// Room for candidates of `k` photons: a leaf more than what starts a selection.
const fn room(k: usize) -> usize {
    patience(k).saturating_add(LEAF + OVERRUN)
}

/// What a search for the `k` nearest photons finds, and its working memory.
pub struct Neighbours<'m> {
    k: usize,
    values: [&'m mut [f32]; 2],
    numbers: [&'m mut [f32]; 2],
    count: usize,
    /// Squared distance of the last in units of the map; infinite where fewer than `k` were found.
    limit: f32,
    /// From units of the map to those of the scene.
    space: super::space::Space,
}

impl<'m> Neighbours<'m> {
    /// Bytes for searches of the `k` nearest.
    pub fn footprint(k: usize) -> Footprint {
        let one = Footprint::default().slice::<f32>(room(k));
        one.and(one).and(one).and(one)
    }

    /// For searches of the `k` nearest.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Neighbours::footprint`].
    pub fn new(k: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let mut slice = || arena.slice(room(k));
        let (values, numbers) = ([slice()?, slice()?], [slice()?, slice()?]);
        Ok(Self { k, values, numbers, count: 0, limit: f32::INFINITY, space: super::space::Space::of(0.0) })
    }

    /// How many were found: `k`, or fewer where there are not so many within the radius.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether none was found.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The photons that were found, by their index in the map and the square of their distance; in no order.
    pub fn iter(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let found = self.values[0].iter().zip(self.numbers[0].iter()).take(self.count);
        found.map(|(&value, number)| (number.to_bits(), self.space.leave_squared(value)))
    }

    /// That in units of the map.
    pub(super) fn limit(&self) -> f32 {
        self.limit
    }

    /// The square of the distance of the last of `k` photons; infinite where fewer were found.
    pub fn squared_radius(&self) -> f32 {
        self.space.leave_squared(self.limit)
    }
}

/// One search, from a place in units of the map.
pub(super) struct Search<'a, 'm, 'n> {
    pub map: &'a PhotonMap<'m>,
    pub place: [f32; 3],
    pub squared_radius: f32,
    pub neighbours: &'a mut Neighbours<'n>,
}

impl Kernel for Search<'_, '_, '_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        search(simd, self.map, self.place, self.squared_radius, self.neighbours);
    }
}

/// Finds the nearest photons within a squared radius (below infinity) of a place in units of the map.
#[inline(always)]
pub(super) fn search<S: Simd>(
    simd: S,
    map: &PhotonMap,
    place: [f32; 3],
    squared_radius: f32,
    neighbours: &mut Neighbours,
) {
    let Neighbours { k, values: [values, spare_values], numbers: [numbers, spare_numbers], .. } = neighbours;
    let k = *k;
    let candidates = Candidates::new([values, spare_values], [numbers, spare_numbers]);
    let mut walk = Walk { map, place: Place16::new(simd, place), limit: squared_radius, k, candidates };
    if k > 0 {
        walk.run(simd);
    }
    let limit = walk.candidates.keep_smallest(simd, k);
    neighbours.count = walk.candidates.count();
    neighbours.limit = limit;
    neighbours.space = map.space;
}

struct Walk<'a, 'm, S: Simd> {
    map: &'a PhotonMap<'m>,
    place: Place16<S>,
    /// Photons beyond this are not among the nearest.
    limit: f32,
    k: usize,
    candidates: Candidates<'a>,
}

impl<S: Simd> Walk<'_, '_, S> {
    #[inline(always)]
    fn run(&mut self, simd: S) {
        let Some(top) = self.map.levels.count.checked_sub(1) else { return };
        // Of each node on the way down: its index on its level, and the distances of its children that are
        // left.
        let mut indices = [0; LEVELS];
        let mut rows = [[f32::INFINITY; 16]; LEVELS];
        let mut level = top;
        let mut index = 0;
        loop {
            let Some(node) = self.map.nodes.get(self.map.levels.at(level, index)) else { return };
            let mut row = self.place.squared_distances_to_boxes(simd, &node.boxes);
            if level == 0 {
                while let Some(child) = self.nearest_child(simd, &mut row) {
                    self.leaf(simd, WIDTH * index + child);
                }
                level = 1;
                if level > top {
                    return;
                }
                (index, row) = (indices[level], simd.load16(&rows[level]));
            }
            // Down to the nearest child that is left of this node, or of the first one above that has any.
            index = loop {
                if let Some(child) = self.nearest_child(simd, &mut row) {
                    (indices[level], rows[level]) = (index, row.to_array());
                    level -= 1;
                    break WIDTH * index + child;
                }
                level += 1;
                if level > top || level >= LEVELS {
                    return;
                }
                (index, row) = (indices[level], simd.load16(&rows[level]));
            };
        }
    }

    /// The nearest child within the limit, which it takes out of the row.
    #[inline(always)]
    fn nearest_child(&self, simd: S, row: &mut S::F16) -> Option<usize> {
        let nearest = row.smallest();
        if nearest > self.limit {
            return None;
        }
        let bits = row.eq(simd.splat16(nearest)).bits();
        let first = bits & bits.wrapping_neg();
        *row = simd.splat16(f32::INFINITY).select(simd.mask16(first), *row);
        Some(first.trailing_zeros() as usize % WIDTH)
    }

    #[inline(always)]
    fn leaf(&mut self, simd: S, index: usize) {
        let Some(leaf) = self.map.leaves.get(index) else { return };
        let limit = simd.splat16(self.limit);
        for half in 0..HALVES {
            let distances = self.place.squared_distances(simd, leaf.half(half));
            let near = distances.le(limit);
            if near.any() {
                let numbers = simd.numbers16((LEAF * index + 16 * half) as u32);
                self.candidates.push16(simd, near, distances, numbers);
            }
        }
        if self.candidates.count() >= patience(self.k) {
            let last = self.candidates.keep_smallest(simd, self.k);
            self.limit = self.limit.min(last);
        }
    }
}
