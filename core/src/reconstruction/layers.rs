//! Layers of a picture: the surfaces of each pixel, for compositing and for denoisers.
//!
//! Albedo and normal are those behind smooth mirrors and glass, as a denoiser needs them (Áfra, Open Image
//! Denoise, 2019). Depth, position, material and object are those of the first surface. Rays pass cut-outs
//! and panes by the probability of their transparency.
//!
//! 1. The rays of the search of surfaces find the means of a pixel, so that films keep the same values.
//! 2. Where rays of a pixel or its neighbours hit several materials or objects, more rays find the
//!    fractions of both.

use super::chains::{Batch, Seen};
use super::first_surfaces::{BAND, BATCH, EDGE_RAYS, FirstSurfaces, RAYS, edge_rays, mean, ranks};
use super::surfaces::NO_CLUSTER;
use crate::bsdf::Features;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::Executor;
use crate::sampling::mix;
use crate::transport::Counters;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Materials and objects of a pixel that are kept.
pub const RANKS: usize = 6;

/// Number of no material and of no object.
pub const NO_ID: u32 = u32::MAX;

/// A material or an object, and the fraction of the pixel that it covers.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Coverage {
    /// Its number; [`NO_ID`] where a slot is empty.
    pub id: u32,
    /// Fraction of the pixel, 0 to 1.
    pub fraction: f32,
}

impl Default for Coverage {
    fn default() -> Self {
        Self { id: NO_ID, fraction: 0.0 }
    }
}

/// Means over a pixel of the surfaces that it sees. Rays that escape have albedo 1, no normal, and no part in
/// depth, position, materials and objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct PixelLayers {
    /// Albedo behind mirrors and smooth glass, 0 to 1.
    pub albedo: [f32; 3],
    /// Shading normal there, towards the viewer; shorter than 1 where the pixel sees several.
    pub normal: [f32; 3],
    /// Distance of the first surface from the camera along the ray; 0 if all rays escape.
    pub depth: f32,
    /// Position of the first surface; 0 if all rays escape.
    pub position: [f32; 3],
    /// Materials of the first surface, most frequent first.
    pub materials: [Coverage; RANKS],
    /// Objects of the first surface, most frequent first.
    pub objects: [Coverage; RANKS],
}

impl<F: Features> FirstSurfaces<'_, F> {
    /// Bytes that [`FirstSurfaces::layers`] takes from the arena; none stay taken.
    pub fn layers_footprint(width: u32, height: u32) -> Footprint {
        Footprint::default().slice::<u32>(width as usize * height as usize)
    }

    /// Finds the layers of all pixels, row by row from the top. `objects`: object of each triangle and
    /// then of each instance, or empty.
    /// False if the executor ended early: `out` then has pixels without values.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`FirstSurfaces::layers_footprint`], or the executor less
    /// than [`FirstSurfaces::scratch`].
    pub fn layers(
        &self,
        objects: &[u32],
        out: &mut [PixelLayers],
        arena: &mut Arena,
        executor: &mut impl Executor,
    ) -> Result<bool, OutOfMemory> {
        let keys = arena.slice::<u32>(out.len())?;
        let band = BAND * self.size[0].max(1) as usize;
        let bands = out.chunks_mut(band).zip(keys.chunks_mut(band));
        let passed = executor.pass(bands, |number, (pixels, keys), worker| {
            self.layers_of_band(number * band, (pixels, keys), objects, &mut worker.scratch)
        })?;
        if !passed.is_complete {
            return Ok(false);
        }
        let (keys, pixels) = (&*keys, out.len());
        let edges = (0..pixels).filter(|&i| self.is_at_edge(keys, i)).count();
        let segments = passed.counters.rays as f64 / (RAYS * pixels.max(1)) as f64;
        let rays = edge_rays(pixels as f64, edges as f64 * segments);
        let passed = executor.pass(out.chunks_mut(band), |number, pixels, worker| {
            self.refine_layers(number * band, pixels, (objects, keys, rays), &mut worker.scratch)
        })?;
        Ok(passed.is_complete)
    }

    /// First pass: means of the pixels of a band from index `first`, and a key of their material and object.
    #[inline(never)]
    fn layers_of_band(
        &self,
        first: usize,
        (pixels, keys): (&mut [PixelLayers], &mut [u32]),
        objects: &[u32],
        scratch: &mut Arena,
    ) -> Result<Counters, OutOfMemory> {
        const PIXELS: usize = BATCH / RAYS;
        let mut arena = scratch.scratch();
        let mut batch = Batch::new(BATCH, &mut arena)?;
        let numbers = arena.slice::<u32>(EDGE_RAYS[0])?;
        let mut counters = Counters::default();
        let parts = pixels.chunks_mut(PIXELS).zip(keys.chunks_mut(PIXELS));
        for (part, (pixels, keys)) in parts.enumerate() {
            let first = first + part * PIXELS;
            counters.rays += self.trace(&mut batch, pixels.len(), RAYS, true, |i| first + i);
            // The camera rays again: the trace has replaced them.
            let count = (pixels.len() * RAYS).min(batch.rays.len());
            self.aim(&mut batch.rays[..count], |ray| ((first + ray / RAYS) as u32, (ray % RAYS) as u32));
            let seen = batch.seen.chunks(RAYS).zip(batch.rays.chunks(RAYS));
            for ((pixel, key), (seen, rays)) in pixels.iter_mut().zip(keys).zip(seen) {
                let means = mean(seen);
                (pixel.albedo, pixel.normal) = (means.albedo, means.normal);
                (pixel.depth, pixel.position) = self.first_points(seen, rays);
                self.count(seen, objects, numbers, pixel);
                *key = pixel.key();
            }
        }
        Ok(counters)
    }

    /// Second pass: fractions of the materials and objects of pixels at edges, by `rays` rays.
    fn refine_layers(
        &self,
        first: usize,
        pixels: &mut [PixelLayers],
        (objects, keys, rays): (&[u32], &[u32], usize),
        scratch: &mut Arena,
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut batch = Batch::new(BATCH, &mut arena)?;
        let numbers = arena.slice::<u32>(EDGE_RAYS[0])?;
        let mut counters = Counters::default();
        for (i, pixel) in pixels.iter_mut().enumerate().filter(|(i, _)| self.is_at_edge(keys, first + i)) {
            counters.rays += self.trace(&mut batch, 1, rays, false, |_| first + i);
            let count = rays.min(batch.seen.len());
            self.count(&batch.seen[..count], objects, numbers, pixel);
        }
        Ok(counters)
    }

    /// Mean distance from the camera and mean position of first surfaces.
    fn first_points(&self, seen: &[Seen], rays: &[crate::geometry::Ray]) -> (f32, [f32; 3]) {
        let (mut depth, mut position, mut hits) = (0.0, Vec3::ZERO, 0.0);
        for (seen, ray) in seen.iter().zip(rays).filter(|(seen, _)| seen.first != NO_ID) {
            let direction = Vec3::from(ray.direction);
            position += Vec3::from(ray.origin) + seen.depth * direction;
            // Rays of a far camera start on their way.
            let before = self.camera.start.map_or(0.0, |start| start.depth);
            depth += seen.depth + before / direction.dot(self.camera.forward);
            hits += 1.0;
        }
        if hits > 0.0 { (depth / hits, (position / hits).to_array()) } else { Default::default() }
    }

    /// Counts the materials and objects of the rays of a pixel.
    fn count(&self, seen: &[Seen], objects: &[u32], numbers: &mut [u32], pixel: &mut PixelLayers) {
        let mesh = &self.chains.context.scene.mesh;
        pixel.materials = coverage(seen, numbers, |triangle| mesh.material(triangle).unwrap_or(NO_ID));
        pixel.objects = coverage(seen, numbers, |triangle| {
            objects.get(mesh.index_among_objects(triangle)).copied().unwrap_or(NO_ID)
        });
    }
}

impl PixelLayers {
    /// Hash of the material and the object that all rays hit; [`NO_CLUSTER`] if they hit several.
    fn key(&self) -> u32 {
        let [material, object] = [self.materials[0], self.objects[0]];
        if [material, object].iter().any(|most| most.fraction > 0.0 && most.fraction < 1.0) {
            return NO_CLUSTER;
        }
        match (mix(u64::from(material.id) << 32 | u64::from(object.id)) >> 32) as u32 {
            NO_CLUSTER => 0,
            key => key,
        }
    }
}

/// Most frequent numbers of the first triangles of rays, by the fraction of rays.
fn coverage(seen: &[Seen], numbers: &mut [u32], number: impl Fn(u32) -> u32) -> [Coverage; RANKS] {
    let mut found = 0;
    for (slot, id) in
        numbers.iter_mut().zip(seen.iter().map(|seen| number(seen.first)).filter(|id| *id != NO_ID))
    {
        *slot = id;
        found += 1;
    }
    let numbers = numbers.get_mut(..found).unwrap_or_default();
    let all = seen.len().max(1) as f32;
    ranks::<RANKS>(numbers).map(|(count, id)| Coverage { id, fraction: count as f32 / all })
}
