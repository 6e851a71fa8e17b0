//! The photon map (Jensen 1996): photons on surfaces, sorted so that those near a place are found quickly, and the
//! density estimate over them. Built in the bytes of the photons; with its tree it takes less than 24 of them for
//! each photon.
//!
//! Searches are exact: they find what brute force finds, by the same distances to the bit, and of photons at the
//! same distance those with the lower index. An index is a photon's place in the map, which is the same for the
//! same photons in the same order, on any number of threads and at any level.

mod batch;
pub mod brute;
mod build;
mod fence;
mod gather;
mod kernel;
mod layout;
mod morton;
mod nearest;
mod range;
mod record;
mod space;
mod tagged;

pub use fence::{Fence, PROBES};
pub use gather::{ALIKE, Density, FINER, FLATNESS, Response, Uniform};
pub use kernel::{Kernel, QueryDisc};
pub use morton::QueryOrder;
pub use nearest::Neighbours;
pub use record::Photon;

use crate::Level;
use crate::bvh::{ForkJoin, Serial};
use crate::memory::{Arena, Footprint, OutOfMemory};
use glam::Vec3;
use layout::{LEAF, Leaf, Levels, Node};
use space::Space;

/// Most photons of a map: what an index can name.
pub const PHOTONS_MAX: usize = u32::MAX as usize;

/// Memory for photons and for the map over them: filled first, then built.
pub struct Photons<'m> {
    leaves: &'m mut [Leaf],
    nodes: &'m mut [Node],
    capacity: usize,
}

impl<'m> Photons<'m> {
    /// Bytes for `capacity` photons, and for the map over them.
    pub fn footprint(capacity: usize) -> Footprint {
        let leaves = capacity.div_ceil(LEAF);
        Footprint::default().slice::<Leaf>(leaves).slice::<Node>(Levels::of(leaves).nodes)
    }

    /// Memory for `capacity` photons, at most [`PHOTONS_MAX`].
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Photons::footprint`].
    pub fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let capacity = capacity.min(PHOTONS_MAX);
        let leaves = capacity.div_ceil(LEAF);
        Ok(Self { leaves: arena.slice(leaves)?, nodes: arena.slice(Levels::of(leaves).nodes)?, capacity })
    }

    /// Where the photons go.
    pub fn as_mut_slice(&mut self) -> &mut [Photon] {
        let all: &mut [Photon] = bytemuck::cast_slice_mut(self.leaves);
        all.get_mut(..self.capacity).unwrap_or_default()
    }

    /// Builds the map over the first `count` photons, on one core.
    pub fn build(self, count: usize) -> PhotonMap<'m> {
        self.build_with(count, &Serial)
    }

    /// Builds it on the cores that `join` brings. The same map, to the bit.
    pub fn build_with<J: ForkJoin>(self, count: usize, join: &J) -> PhotonMap<'m> {
        build::build(self.leaves, count.min(self.capacity), self.nodes, join)
    }
}

/// Photons that can be searched.
#[derive(Clone, Copy, Debug)]
pub struct PhotonMap<'m> {
    leaves: &'m [Leaf],
    nodes: &'m [Node],
    levels: Levels,
    count: usize,
    refused: usize,
    space: Space,
}

/// What a map is besides the bytes that it lies in.
#[derive(Clone, Copy, Debug)]
pub struct MapShape {
    levels: Levels,
    count: usize,
    refused: usize,
    space: Space,
}

impl<'m> PhotonMap<'m> {
    /// All that [`PhotonMap::again`] needs.
    pub fn shape(&self) -> MapShape {
        let Self { levels, count, refused, space, .. } = *self;
        MapShape { levels, count, refused, space }
    }

    /// The map of this shape that was built in the bytes of `arena`, over [`Photons`] with room for `capacity`, and left
    /// there. Over other bytes it is a map of anything.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Photons::footprint`], or than the shape.
    pub fn again(shape: &MapShape, capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let available = arena.available();
        let short = OutOfMemory { needed: usize::MAX, available };
        let Photons { leaves, nodes, .. } = Photons::new(capacity, arena)?;
        let MapShape { levels, count, refused, space } = *shape;
        let (leaves, nodes): (&[Leaf], &[Node]) = (leaves, nodes);
        let leaves = leaves.get(..count.div_ceil(LEAF)).ok_or(short)?;
        let nodes = nodes.get(..levels.nodes).ok_or(short)?;
        Ok(Self { leaves, nodes, levels, count, refused, space })
    }
}

impl PhotonMap<'_> {
    /// How many photons there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// How many were left out because their place is not finite.
    pub fn refused(&self) -> usize {
        self.refused
    }

    /// A photon by its index.
    pub fn get(&self, index: u32) -> Option<Photon> {
        let index = index as usize;
        let leaf = self.leaves.get(index / LEAF).filter(|_| index < self.count)?;
        let photon = leaf.photon(index % LEAF);
        Some(Photon { position: self.space.leave(photon.position), ..photon })
    }

    /// Finds the nearest photons of `place` within `radius`, as many as `neighbours` was made for. Infinity is a
    /// radius; nothing is found within a negative one or one that is NaN, or from a place that is.
    pub fn nearest(&self, level: Level, place: Vec3, radius: f32, neighbours: &mut Neighbours) {
        let place = self.space.enter(place.to_array());
        // Nothing is at a negative squared distance.
        let squared_radius = self.space.squared(radius).unwrap_or(-1.0);
        level.dispatch(nearest::Search { map: self, place, squared_radius, neighbours });
    }

    /// The disc of the photons that are nearest to `place` by a search of `neighbours`, but of no larger radius than
    /// `farthest`, and a factor on densities there. The last of k photons says how far the disc reaches, so that only
    /// k - 1 of them are chance: E\[(k - 1) / (pi r²)\] is the density, E\[k / (pi r²)\] is larger. Where weights are zero
    /// on the edge of the disc, the last photon leaves itself out.
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
        // Rounding must not decide about the last one.
        let radius = if is_full { libm::sqrtf(squared) * (1.0 + 2.0 * f32::EPSILON) } else { farthest };
        (QueryDisc { place, normal, radius: radius.max(f32::MIN_POSITIVE), kernel }, factor)
    }

    /// Finds all photons within `radius` of `place`: how many they are, and in `found` their indices in rising
    /// order, as many as there is room for; what is in the rest of it is unspecified.
    pub fn within(&self, level: Level, place: Vec3, radius: f32, found: &mut [u32]) -> usize {
        let place = self.space.enter(place.to_array());
        let Some(squared_radius) = self.space.squared(radius) else { return 0 };
        level.dispatch(range::Range { map: self, place, squared_radius, found })
    }

    /// Estimates the density of photons on a disc, each with the response of the surface.
    pub fn gather<R: Response>(&self, level: Level, disc: &QueryDisc, response: &R) -> Density {
        level.dispatch(gather::Gather { map: self, disc, fence: None, response })
    }

    /// The same from what is seen of the disc.
    pub fn gather_within<R: Response>(
        &self,
        level: Level,
        disc: &QueryDisc,
        fence: &Fence,
        response: &R,
    ) -> Density {
        let fence = Some(fence).filter(|fence| !fence.is_open());
        level.dispatch(gather::Gather { map: self, disc, fence, response })
    }

    /// Calls `each` with the tag of every photon on a disc, as far as that is seen, and with its kernel weights
    /// per area, 1/m²: that on the disc, and that on one of half the radius.
    pub fn tagged_within(
        &self,
        level: Level,
        disc: &QueryDisc,
        fence: Option<&Fence>,
        each: impl FnMut(u32, [f32; 2]),
    ) {
        let fence = fence.filter(|fence| !fence.is_open());
        level.dispatch(tagged::TaggedPhotons { map: self, disc, fence, each });
    }

    /// [`PhotonMap::nearest`] for many places, of which `each` gets the index and what was found; in an order in
    /// which neighbours follow each other. `order` is working memory, one for each place: those beyond are left out.
    pub fn nearest_batch(
        &self,
        level: Level,
        places: &[Vec3],
        radius: f32,
        order: &mut [QueryOrder],
        neighbours: &mut Neighbours,
        each: impl FnMut(usize, &Neighbours),
    ) {
        let squared_radius = self.space.squared(radius).unwrap_or(-1.0);
        level.dispatch(batch::Searches { map: self, places, squared_radius, order, neighbours, each });
    }

    /// [`PhotonMap::gather`] for many discs, in such an order. `order` is working memory, one for each disc: those
    /// beyond are left out, as are those for which there is no density.
    pub fn gather_batch<R: Response>(
        &self,
        level: Level,
        discs: &[QueryDisc],
        response: &R,
        order: &mut [QueryOrder],
        densities: &mut [Density],
    ) {
        level.dispatch(batch::Gathers { map: self, discs, response, order, densities });
    }

    /// Lowest and highest corner of the box around the photons, in units of the map; empty where there are none.
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
