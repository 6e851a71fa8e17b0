//! Search for the k nearest photons: depth first, nearest child first, until no node can hold a nearer
//! photon.
//!
//! The distances of a node's children are computed once, sixteen at a time, and stay on a stack of at most
//! [`LEVELS`] rows until the node is done. Photons of a leaf within the limit are appended to the candidates.
//! A selection cuts the candidates back to k now and then ([`halflight_simd::kernels::select`]) and lowers
//! the limit, which prunes the search.

use super::PhotonMap;
use super::layout::{HALVES, LEAF, LEVELS, WIDTH};
use crate::memory::{Arena, Footprint, OutOfMemory};
use halflight_simd::kernels::points::Place16;
use halflight_simd::kernels::select::{Candidates, OVERRUN};
use halflight_simd::{Kernel, Lanes, Mask, Simd};

/// Number of candidates that starts a selection of `k`. A larger number means fewer selections, but later
/// pruning.
const fn selection_threshold(k: usize) -> usize {
    k.saturating_add(k / 4).saturating_add(8)
}

/// Room for candidates of `k` photons: a leaf more than the number that starts a selection.
const fn candidate_capacity(k: usize) -> usize {
    selection_threshold(k).saturating_add(LEAF + OVERRUN)
}

/// The `k` nearest photons of a search, and its working memory.
pub struct Neighbours<'m> {
    k: usize,
    values: [&'m mut [f32]; 2],
    numbers: [&'m mut [f32]; 2],
    count: usize,
    /// Squared distance of the k-th photon in units of the map; infinite if fewer than `k` were found.
    limit: f32,
    /// Units of the map, for conversion to units of the scene.
    space: super::space::Space,
}

impl<'m> Neighbours<'m> {
    /// Bytes for searches of the `k` nearest.
    pub fn footprint(k: usize) -> Footprint {
        let one = Footprint::default().slice::<f32>(candidate_capacity(k));
        one.and(one).and(one).and(one)
    }

    /// Memory for searches of the `k` nearest.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Neighbours::footprint`].
    pub fn new(k: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let mut slice = || arena.slice(candidate_capacity(k));
        let (values, numbers) = ([slice()?, slice()?], [slice()?, slice()?]);
        Ok(Self { k, values, numbers, count: 0, limit: f32::INFINITY, space: super::space::Space::of(0.0) })
    }

    /// Number of photons found: `k`, or fewer if the radius holds fewer.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if no photon was found.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Indices in the map and squared distances of the photons found, in no order.
    pub fn iter(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let found = self.values[0].iter().zip(self.numbers[0].iter()).take(self.count);
        found.map(|(&value, number)| (number.to_bits(), self.space.squared_to_scene(value)))
    }

    /// Squared distance of the k-th photon in units of the map; infinite if fewer than `k` were found.
    pub(super) fn limit(&self) -> f32 {
        self.limit
    }

    /// Squared distance of the k-th photon; infinite if fewer were found.
    pub fn squared_radius(&self) -> f32 {
        self.space.squared_to_scene(self.limit)
    }
}

/// Kernel of one search, from a place in units of the map.
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

/// Finds the nearest photons within a finite squared radius of a place, in units of the map.
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
    /// Photons beyond this squared distance are not among the nearest.
    limit: f32,
    k: usize,
    candidates: Candidates<'a>,
}

impl<S: Simd> Walk<'_, '_, S> {
    #[inline(always)]
    fn run(&mut self, simd: S) {
        let Some(top) = self.map.levels.count.checked_sub(1) else { return };
        // Index on its level of each node on the path from the root, and the distances of its remaining
        // children.
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
            // Descends to the nearest remaining child of this node, or of the lowest ancestor that still has
            // one.
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

    /// Removes and returns the nearest child of the row that is within the limit.
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
        if self.candidates.count() >= selection_threshold(self.k) {
            let last = self.candidates.keep_smallest(simd, self.k);
            self.limit = self.limit.min(last);
        }
    }
}
