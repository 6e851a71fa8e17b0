//! Photon map (Jensen 1996): an exact k-d tree over photons on surfaces, and the density estimate over them.
//! The map is built in the memory of the photons; tree and photon together take less than 24 bytes a photon.
//!
//! Searches are exact: they find the photons of brute force, with the same distances to the bit; among
//! photons at equal distance the lower index wins. The index of a photon is its position in the map. It
//! depends only on the photons and their order, not on the number of threads or the level.

mod batch;
pub mod brute;
mod build;
mod gather;
mod kernel;
mod kernel_boundary;
mod layout;
mod morton;
mod nearest;
mod range;
mod record;
mod space;
mod tagged;

pub use gather::{DensityEstimate, FINER_DISCS, FLATNESS, MIN_NORMAL_COSINE, Response, Uniform};
pub use kernel::{Kernel, QueryDisc};
pub use kernel_boundary::{KernelBoundary, PROBES};
pub use morton::QueryOrder;
pub use nearest::Neighbours;
pub use record::{MOST_REMAINING, Photon};

use crate::Level;
use crate::bvh::{ForkJoin, Serial};
use crate::memory::{Arena, Footprint, OutOfMemory};
use glam::Vec3;
use layout::{LEAF, Leaf, Levels, Node};
use space::Space;

/// Largest number of photons of a map, by the range of an index.
pub const PHOTONS_MAX: usize = u32::MAX as usize;

/// Memory for photons and the map over them: filled first, then built.
pub struct Photons<'m> {
    leaves: &'m mut [Leaf],
    nodes: &'m mut [Node],
    capacity: usize,
}

impl<'m> Photons<'m> {
    /// Bytes for `capacity` photons and the map over them.
    pub fn footprint(capacity: usize) -> Footprint {
        let leaves = capacity.div_ceil(LEAF);
        Footprint::default().slice::<Leaf>(leaves).slice::<Node>(Levels::of(leaves).nodes)
    }

    /// Memory for `capacity` photons, at most 2^32 - 1.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Photons::footprint`].
    pub fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let capacity = capacity.min(PHOTONS_MAX);
        let leaves = capacity.div_ceil(LEAF);
        Ok(Self { leaves: arena.slice(leaves)?, nodes: arena.slice(Levels::of(leaves).nodes)?, capacity })
    }

    /// The photons, to be filled in.
    pub fn as_mut_slice(&mut self) -> &mut [Photon] {
        let all: &mut [Photon] = bytemuck::cast_slice_mut(self.leaves);
        all.get_mut(..self.capacity).unwrap_or_default()
    }

    /// Builds the map over the first `count` photons, on one core.
    pub fn build(self, count: usize) -> PhotonMap<'m> {
        self.build_with(count, &Serial)
    }

    /// Builds the map over the first `count` photons on the cores of `join`; same bits as [`Photons::build`].
    /// The map is of no use where [`ForkJoin::is_over`] ends the build early.
    pub fn build_with<J: ForkJoin>(self, count: usize, join: &J) -> PhotonMap<'m> {
        build::build(self.leaves, count.min(self.capacity), self.nodes, join)
    }
}

/// Map of photons, ready for searches.
#[derive(Clone, Copy, Debug)]
pub struct PhotonMap<'m> {
    leaves: &'m [Leaf],
    nodes: &'m [Node],
    levels: Levels,
    count: usize,
    refused: usize,
    space: Space,
    /// Segments that the paths of photons of a density estimate have left at least.
    least_remaining: u32,
}

/// Everything of a map except the memory that holds it.
#[derive(Clone, Copy, Debug)]
pub struct MapShape {
    levels: Levels,
    count: usize,
    refused: usize,
    space: Space,
}

impl<'m> PhotonMap<'m> {
    /// Shape of this map, for [`PhotonMap::from_shape`].
    #[doc(hidden)]
    pub fn shape(&self) -> MapShape {
        let Self { levels, count, refused, space, .. } = *self;
        MapShape { levels, count, refused, space }
    }

    /// Map of this shape that was built before in the bytes of `arena`, over [`Photons`] of this `capacity`,
    /// and is still there. Other bytes give a map of arbitrary photons.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Photons::footprint`], or than the shape.
    #[doc(hidden)]
    pub fn from_shape(shape: &MapShape, capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let available = arena.available();
        let short = OutOfMemory { needed: usize::MAX, available };
        let Photons { leaves, nodes, .. } = Photons::new(capacity, arena)?;
        let MapShape { levels, count, refused, space } = *shape;
        let (leaves, nodes): (&[Leaf], &[Node]) = (leaves, nodes);
        let leaves = leaves.get(..count.div_ceil(LEAF)).ok_or(short)?;
        let nodes = nodes.get(..levels.nodes).ok_or(short)?;
        Ok(Self { leaves, nodes, levels, count, refused, space, least_remaining: 0 })
    }
}

impl PhotonMap<'_> {
    /// This map for density estimates of the photons whose paths have `segments` segments left, besides one.
    /// All photons were stored by paths of limited length unless `segments` is 0.
    pub(crate) fn with_remaining(self, segments: u32) -> Self {
        Self { least_remaining: segments, ..self }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True without photons.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of photons left out because their position is not finite.
    pub fn refused(&self) -> usize {
        self.refused
    }

    /// Photon at an index.
    pub fn get(&self, index: u32) -> Option<Photon> {
        let index = index as usize;
        let leaf = self.leaves.get(index / LEAF).filter(|_| index < self.count)?;
        let photon = leaf.photon(index % LEAF);
        Some(Photon { position: self.space.to_scene(photon.position), ..photon })
    }

    /// Finds the photons nearest to `place` within `radius`, at most the `k` of `neighbours`. The radius may
    /// be infinite. A negative or NaN radius and a NaN place find nothing.
    pub fn nearest(&self, level: Level, place: Vec3, radius: f32, neighbours: &mut Neighbours) {
        let place = self.space.to_map(place.to_array());
        // No photon has a negative squared distance.
        let squared_radius = self.space.squared_to_map(radius).unwrap_or(-1.0);
        level.dispatch(nearest::Search { map: self, place, squared_radius, neighbours });
    }

    /// Disc through the k-th nearest photon of `place`, of radius at most `farthest`, and a factor on its
    /// density. The k-th photon defines the radius, so that only k - 1 photons are random: E\[(k - 1) / (pi
    /// r²)\] is the density, E\[k / (pi r²)\] is larger. A kernel that is zero on the edge of the disc
    /// excludes the last photon by itself.
    pub fn disc_of_nearest(
        &self,
        level: Level,
        (place, normal): (Vec3, Vec3),
        farthest: f32,
        kernel: Kernel,
        neighbours: &mut Neighbours,
    ) -> (QueryDisc, f32) {
        self.nearest(level, place, farthest, neighbours);
        let squared = neighbours.squared_radius();
        let k = neighbours.len() as f32;
        let is_full = squared < f32::INFINITY && k > 1.0;
        let factor = if is_full && kernel == Kernel::Constant { (k - 1.0) / k } else { 1.0 };
        // Rounding must not exclude the last photon.
        let radius = if is_full { libm::sqrtf(squared) * (1.0 + 2.0 * f32::EPSILON) } else { farthest };
        (QueryDisc { place, normal, radius: radius.max(f32::MIN_POSITIVE), kernel }, factor)
    }

    /// Finds all photons within `radius` of `place` and returns their number. `found` receives their indices
    /// in ascending order, as far as there is room; its remaining elements are unspecified.
    pub fn within(&self, level: Level, place: Vec3, radius: f32, found: &mut [u32]) -> usize {
        let place = self.space.to_map(place.to_array());
        let Some(squared_radius) = self.space.squared_to_map(radius) else { return 0 };
        level.dispatch(range::Range { map: self, place, squared_radius, found })
    }

    /// Density of photons on a disc, each weighted with the response of the surface.
    pub fn gather<R: Response>(&self, level: Level, disc: &QueryDisc, response: &R) -> DensityEstimate {
        level.dispatch(gather::Gather { map: self, disc, boundary: None, response })
    }

    /// Density over the part of the disc that is visible by `boundary`.
    pub fn gather_within<R: Response>(
        &self,
        level: Level,
        disc: &QueryDisc,
        boundary: &KernelBoundary,
        response: &R,
    ) -> DensityEstimate {
        let boundary = Some(boundary).filter(|boundary| !boundary.is_open());
        level.dispatch(gather::Gather { map: self, disc, boundary, response })
    }

    /// Calls `each` for every photon on the visible part of a disc, with its tag and two kernel weights per
    /// area in 1/m²: on the disc, and on the disc of half the radius.
    pub fn tagged_within(
        &self,
        level: Level,
        disc: &QueryDisc,
        boundary: Option<&KernelBoundary>,
        each: impl FnMut(u32, [f32; 2]),
    ) {
        let boundary = boundary.filter(|boundary| !boundary.is_open());
        level.dispatch(tagged::TaggedPhotons { map: self, disc, boundary, each });
    }

    /// [`PhotonMap::nearest`] for many places, in Morton order. `each` receives the index of a place and its
    /// photons. `order` is working memory, one element for each place; places beyond it are skipped.
    pub fn nearest_batch(
        &self,
        level: Level,
        places: &[Vec3],
        radius: f32,
        order: &mut [QueryOrder],
        neighbours: &mut Neighbours,
        each: impl FnMut(usize, &Neighbours),
    ) {
        let squared_radius = self.space.squared_to_map(radius).unwrap_or(-1.0);
        level.dispatch(batch::NearestBatch { map: self, places, squared_radius, order, neighbours, each });
    }

    /// [`PhotonMap::gather`] for many discs, in Morton order. `order` is working memory, one element for each
    /// disc. Discs beyond `order` or `densities` are skipped.
    pub fn gather_batch<R: Response>(
        &self,
        level: Level,
        discs: &[QueryDisc],
        response: &R,
        order: &mut [QueryOrder],
        densities: &mut [DensityEstimate],
    ) {
        level.dispatch(batch::GatherBatch { map: self, discs, response, order, densities });
    }

    /// Lower and upper corner of the bounding box of the photons, in units of the map; empty without photons.
    fn bounds(&self) -> [[f32; 3]; 2] {
        let boxes = self.nodes.last().unwrap_or(&Node::EMPTY).boxes;
        let lo = [0, 1, 2].map(|row| boxes[row].iter().fold(f32::INFINITY, |a, &b| a.min(b)));
        let hi = [3, 4, 5].map(|row| boxes[row].iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b)));
        [lo, hi]
    }
}

#[cfg(test)]
pub(crate) use tests::{lines, with_map_of};

#[cfg(test)]
mod tests;
