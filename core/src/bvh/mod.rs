//! The bounding volume hierarchy: build, and trace for the nearest hit or any hit.

pub mod brute;

use crate::Level;
use crate::geometry::{Hit, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::Mesh;

/// How alike the rays of a batch are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// Neighbours in the slice are neighbours in space: camera rays, tile by tile.
    Coherent,
    /// In no order: bounces. Traced in the tracer's own order; the results do not depend on it.
    Incoherent,
}

/// A hierarchy over the triangles of a mesh, in the memory of an arena.
#[derive(Clone, Copy)]
pub struct Bvh<'m> {
    mesh: Mesh<'m>,
}

impl<'m> Bvh<'m> {
    /// Bytes that [`Bvh::build`] takes from the arena.
    pub fn footprint(_triangles: usize) -> Footprint {
        Footprint::default()
    }

    /// Builds over `mesh`.
    pub fn build(mesh: &Mesh<'m>, _arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        Ok(Self { mesh: *mesh })
    }

    /// The nearest hit of one ray.
    pub fn nearest(&self, _level: Level, ray: &Ray) -> Hit {
        brute::nearest(&self.mesh, ray)
    }

    /// Whether the ray meets anything.
    pub fn occluded(&self, level: Level, ray: &Ray) -> bool {
        self.nearest(level, ray).is_some()
    }

    /// Bytes of `scratch` that a batch of `rays` rays wants.
    pub const fn batch_scratch(rays: usize) -> usize {
        rays * 8
    }

    /// The nearest hit of each ray. `scratch` holds at least [`Bvh::batch_scratch`] / 4 words.
    pub fn nearest_batch(
        &self,
        level: Level,
        rays: &[Ray],
        _: Coherence,
        _scratch: &mut [u32],
        hits: &mut [Hit],
    ) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.nearest(level, ray);
        }
    }

    /// For each ray 1 where something is in the way and 0 where not.
    pub fn occluded_batch(
        &self,
        level: Level,
        rays: &[Ray],
        _: Coherence,
        _scratch: &mut [u32],
        hidden: &mut [u8],
    ) {
        for (ray, hidden) in rays.iter().zip(hidden) {
            *hidden = self.occluded(level, ray) as u8;
        }
    }
}
