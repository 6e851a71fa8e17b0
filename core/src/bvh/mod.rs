//! Bounding volume hierarchy (BVH) with eight children per node, built over a mesh in the caller's memory.
//! Single rays and batches find the nearest hit or any hit. All ways of tracing agree to the bit.

mod batch;
mod binary;
pub mod brute;
mod build;
pub mod clearance;
mod collapse;
mod fork_join;
mod instances;
mod layout;
mod leaf;
mod packet;
mod query;
mod references;
mod split;
mod stream;
mod top;
mod traversal_ray;
mod walk;

pub use fork_join::{ForkJoin, Serial};

use crate::Level;
use crate::geometry::{Bounds, Hit, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::Mesh;
use batch::{Stream, Tiles};
use halflight_simd::{Kernel, Simd};
use instances::Entry;
use layout::{Child, Node};
use query::{Nearest, Occluded};

/// Coherence of the rays of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// Neighbours in the slice are neighbours in space, such as camera rays tile by tile.
    Coherent,
    /// Rays in no order, such as bounces. The tracer reorders them; the results are the same.
    Incoherent,
}

/// BVH over the triangles of a mesh, in the memory of an arena.
#[derive(Clone, Copy, Debug)]
pub struct Bvh<'m> {
    nodes: &'m [Node],
    /// Corner coordinates in runs, leaf by leaf.
    coordinates: &'m [f32],
    /// Index in the mesh of each triangle in the leaves.
    triangles: &'m [u32],
    /// Instances that rays enter; usually none.
    entries: &'m [Entry],
    /// The node that all rays begin with.
    root: Child,
    bounds: Bounds,
    /// Margin of the boxes.
    slack: f32,
}

impl<'m> Bvh<'m> {
    /// Bytes that [`Bvh::build`] takes from the arena. [`Bvh::kept_footprint`] of them stay taken; the rest
    /// is working memory, free again after the build.
    pub fn footprint(triangles: usize) -> Footprint {
        build::kept_footprint(triangles).and(build::working_footprint(triangles))
    }

    /// Bytes that stay taken from the arena after [`Bvh::build`].
    pub fn kept_footprint(triangles: usize) -> Footprint {
        build::kept_footprint(triangles)
    }

    /// [`Bvh::footprint`] of a mesh, with its instances.
    pub fn footprint_of(mesh: &Mesh) -> Footprint {
        build::kept_footprint_of(mesh).and(build::working_footprint_of(mesh))
    }

    /// [`Bvh::kept_footprint`] of a mesh, with its instances.
    pub fn kept_footprint_of(mesh: &Mesh) -> Footprint {
        build::kept_footprint_of(mesh)
    }

    /// Builds over `mesh` on one core at the baseline level.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Bvh::footprint_of`] the mesh.
    pub fn build(mesh: &Mesh, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        build::build(mesh, arena, Level::BASELINE, &Serial)
    }

    /// Builds over `mesh` at `level` on the cores of `join`; the tree is the same to the bit.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller than [`Bvh::footprint_of`] the mesh.
    pub fn build_with<J: ForkJoin>(
        mesh: &Mesh,
        arena: &mut Arena<'m>,
        level: Level,
        join: &J,
    ) -> Result<Self, OutOfMemory> {
        build::build(mesh, arena, level, join)
    }

    /// Bytes of the tree and its copy of the triangles, which [`Bvh::copied`] takes from an arena.
    pub fn used(&self) -> Footprint {
        Footprint::default()
            .slice::<Node>(self.nodes.len())
            .slice::<f32>(self.coordinates.len())
            .slice::<u32>(self.triangles.len())
            .slice::<Entry>(self.entries.len())
    }

    /// Copy in another arena, of exactly [`Bvh::used`] bytes, so that the memory of the build can be freed.
    ///
    /// # Errors
    /// [`OutOfMemory`] when the arena is smaller.
    pub fn copied<'n>(&self, arena: &mut Arena<'n>) -> Result<Bvh<'n>, OutOfMemory> {
        let nodes = arena.slice(self.nodes.len())?;
        let coordinates = arena.slice(self.coordinates.len())?;
        let triangles = arena.slice(self.triangles.len())?;
        let entries = arena.slice(self.entries.len())?;
        entries.copy_from_slice(self.entries);
        nodes.copy_from_slice(self.nodes);
        coordinates.copy_from_slice(self.coordinates);
        triangles.copy_from_slice(self.triangles);
        Ok(Bvh { nodes, coordinates, triangles, entries, ..*self })
    }

    /// Bounding box of all triangles that a ray can hit.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Nearest hit of one ray.
    pub fn nearest(&self, level: Level, ray: &Ray) -> Hit {
        level.dispatch(Single::<false> { bvh: self, ray })
    }

    /// True if the ray hits anything.
    pub fn occluded(&self, level: Level, ray: &Ray) -> bool {
        level.dispatch(Single::<true> { bvh: self, ray }).is_some()
    }

    /// Nearest hit of each ray. Rays beyond `hits` are not reported.
    pub fn nearest_batch(&self, level: Level, rays: &[Ray], coherence: Coherence, hits: &mut [Hit]) {
        let sink = Nearest(hits);
        match coherence {
            Coherence::Coherent if self.entries.is_empty() => level.dispatch(Tiles { bvh: self, rays, sink }),
            _ => level.dispatch(Stream::<_, false> { bvh: self, rays, sink }),
        }
    }

    /// For each ray 1 if it hits anything, else 0. Rays beyond `hidden` are not
    /// reported.
    pub fn occluded_batch(&self, level: Level, rays: &[Ray], hidden: &mut [u8]) {
        level.dispatch(Stream::<_, true> { bvh: self, rays, sink: Occluded(hidden) });
    }
}

/// Kernel for one ray.
struct Single<'a, 'm, const ANY: bool> {
    bvh: &'a Bvh<'m>,
    ray: &'a Ray,
}

impl<const ANY: bool> Kernel for Single<'_, '_, ANY> {
    type Out = Hit;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Hit {
        walk::trace::<S, ANY>(simd, self.bvh, self.ray)
    }
}

#[cfg(test)]
mod instance_tests;
#[cfg(test)]
mod tests;
