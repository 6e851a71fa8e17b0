//! First surfaces: the surfaces that each pixel sees, through mirrors and smooth glass.
//!
//! 1. A few camera rays a pixel find its cluster ([`super::chains`]), albedo, normal and depth.
//! 2. Where rays of a pixel or its neighbours disagree, more rays find the fractions of its clusters.
//! 3. Neighbours of pixels that see the rim of a lamp count as mixed: a sliver of lamp that no ray met
//!    outshines a surface.
//!
//! The rays have random numbers of their own, so that all that follows from them is independent of the film.

use super::chains::{Batch, Chains, Seen};
use super::components::SurfaceComponents;
use super::passes::for_pieces;
use super::surfaces::{NO_CLUSTER, PixelSurfaces, SLOTS};
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::{Executor, RenderContext};
use crate::sampling::Sampler;
use crate::scene::Camera;
use crate::transport::Counters;
use glam::Vec3;
use halflight_simd::kernels::shade::numbers::SampleBlock;

/// Rays of each pixel. A power of four, so that their positions form a net.
pub(super) const RAYS: usize = 16;
/// Largest and smallest number of rays of a pixel with an edge nearby.
pub(super) const EDGE_RAYS: [usize; 2] = [256, 64];
/// Segments of rays of edges per pixel of the picture. More pixels with edges have fewer rays each.
const EDGE_BUDGET: f64 = 48.0;
/// Rays that are traced together.
pub(super) const BATCH: usize = 1024;
/// Rows of a task.
pub(super) const BAND: usize = 4;
/// Fraction of the cluster of a pixel beside the rim of a lamp.
const BESIDE_LAMP: f32 = 0.9999;

/// Seed of the rays, distinct from that of the picture.
const STREAM: u32 = 0x51ab_3e29;
/// Dimensions of the position in the pixel and on the lens.
const PIXEL: u32 = 0;
const LENS: u32 = 1;

/// Search for the first surfaces of a view.
pub struct FirstSurfaces<'a, F> {
    pub(super) chains: Chains<'a, F>,
    pub(super) camera: Camera,
    pub(super) size: [u32; 2],
    seed: u32,
}

impl<'a, F: Features> FirstSurfaces<'a, F> {
    /// Search in the view of `context`; `components` are those of its mesh.
    pub fn new(context: &RenderContext<'a>, components: SurfaceComponents<'a>) -> Self {
        let size = [context.settings.width, context.settings.height];
        let chains = Chains::new(context.scene_context(), components);
        Self { chains, camera: context.scene.camera, size, seed: context.settings.seed ^ STREAM }
    }

    fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Bytes that [`FirstSurfaces::find`] takes from the arena. [`FirstSurfaces::kept_footprint`] of them
    /// stay taken.
    pub fn footprint(width: u32, height: u32) -> Footprint {
        let pixels = width as usize * height as usize;
        Self::kept_footprint(width, height).slice::<u32>(pixels).slice::<u8>(pixels)
    }

    /// Bytes that stay taken from the arena after [`FirstSurfaces::find`].
    pub fn kept_footprint(width: u32, height: u32) -> Footprint {
        Footprint::default().slice::<PixelSurfaces>(width as usize * height as usize)
    }

    /// Scratch memory of a task.
    pub fn scratch() -> Footprint {
        Batch::footprint(BATCH).slice::<u32>(EDGE_RAYS[0])
    }

    /// Surfaces of all pixels, row by row from the top. `None` if the executor ended early.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`FirstSurfaces::footprint`], or the executor less than
    /// [`FirstSurfaces::scratch`].
    pub fn find<'m>(
        &self,
        arena: &mut Arena<'m>,
        executor: &mut impl Executor,
    ) -> Result<Option<&'m [PixelSurfaces]>, OutOfMemory> {
        let pixels = arena.slice::<PixelSurfaces>(self.pixels())?;
        let mut working = arena.scratch();
        let clusters = working.slice::<u32>(self.pixels())?;
        let rims = working.slice::<u8>(self.pixels())?;
        let band = BAND * self.size[0].max(1) as usize;

        let bands = pixels.chunks_mut(band).zip(clusters.chunks_mut(band));
        let passed = executor.pass(bands, |number, (pixels, clusters), worker| {
            self.find_in_band(number * band, pixels, clusters, &mut worker.scratch)
        })?;
        if !passed.is_complete {
            return Ok(None);
        }

        let clusters = &*clusters;
        for_pieces(executor, rims, band, |number, edges| {
            edges.iter_mut().zip(number * band..).for_each(|(edge, i)| {
                *edge = u8::from(self.is_at_edge(clusters, i));
            });
        });
        let edges: usize = rims.iter().map(|edge| usize::from(*edge)).sum();
        let segments = passed.counters.rays as f64 / (RAYS * self.pixels()) as f64;
        let rays = edge_rays(self.pixels() as f64, edges as f64 * segments);
        let bands = pixels.chunks_mut(band).zip(rims.chunks_mut(band));
        let passed = executor.pass(bands, |number, (pixels, rims), worker| {
            self.refine_band(number * band, (pixels, rims), rays, &mut worker.scratch)
        })?;
        if !passed.is_complete {
            return Ok(None);
        }

        for (i, _) in rims.iter().enumerate().filter(|(_, rim)| **rim != 0) {
            for neighbour in self.neighbourhood(i) {
                if let Some(pixel) = pixels.get_mut(neighbour) {
                    pixel.fractions[0] = pixel.fractions[0].min(BESIDE_LAMP);
                }
            }
        }
        Ok(Some(pixels))
    }

    /// Indices of a pixel and its neighbours in the picture.
    fn neighbourhood(&self, i: usize) -> impl Iterator<Item = usize> {
        let width = self.size[0].max(1) as usize;
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let rows = y.saturating_sub(1)..(y + 2).min(self.size[1] as usize);
        rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
    }

    /// True if rays of a pixel or its neighbours disagree.
    pub(super) fn is_at_edge(&self, clusters: &[u32], i: usize) -> bool {
        let cluster = clusters.get(i).copied().unwrap_or(NO_CLUSTER);
        cluster == NO_CLUSTER || self.neighbourhood(i).any(|other| clusters.get(other) != Some(&cluster))
    }

    /// First pass: the pixels of a band from index `first`, and their clusters, if all rays agree.
    #[inline(never)]
    fn find_in_band(
        &self,
        first: usize,
        pixels: &mut [PixelSurfaces],
        clusters: &mut [u32],
        scratch: &mut Arena,
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut batch = Batch::new(BATCH, &mut arena)?;
        let mut counters = Counters::default();
        const PIXELS: usize = BATCH / RAYS;
        let parts = pixels.chunks_mut(PIXELS).zip(clusters.chunks_mut(PIXELS));
        for (part, (pixels, clusters)) in parts.enumerate() {
            let index = |i: usize| first + part * PIXELS + i;
            counters.rays += self.trace(&mut batch, pixels.len(), RAYS, true, index);
            for ((pixel, cluster), seen) in pixels.iter_mut().zip(clusters).zip(batch.seen.chunks(RAYS)) {
                *pixel = mean(seen);
                let number = pixel.clusters[0];
                let agree = seen.iter().all(|seen| seen.cluster() == number);
                *cluster = if agree { number } else { NO_CLUSTER };
            }
        }
        Ok(counters)
    }

    /// Second pass: fractions of the clusters of pixels at edges, which `rims` marks, by `rays` rays. It
    /// leaves the marks of the rims of lamps.
    #[inline(never)]
    fn refine_band(
        &self,
        first: usize,
        (pixels, rims): (&mut [PixelSurfaces], &mut [u8]),
        rays: usize,
        scratch: &mut Arena,
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let mut batch = Batch::new(BATCH, &mut arena)?;
        let numbers = arena.slice::<u32>(EDGE_RAYS[0])?;
        let mut counters = Counters::default();
        let mut chosen = [0; BATCH / EDGE_RAYS[1]];
        let capacity = BATCH / rays.max(1);
        let mut next = 0;
        loop {
            let mut count = 0;
            let at_edges = (next..).zip(rims.iter().skip(next)).filter(|(_, edge)| **edge != 0);
            for (slot, (i, _)) in chosen.iter_mut().take(capacity).zip(at_edges) {
                *slot = i;
                next = i + 1;
                count += 1;
            }
            if count == 0 {
                break;
            }
            let index = |n: usize| first + chosen.get(n).copied().unwrap_or(0);
            counters.rays += self.trace(&mut batch, count, rays, false, index);
            for (&i, seen) in chosen.iter().take(count).zip(batch.seen.chunks(rays)) {
                let (Some(pixel), Some(rim)) = (pixels.get_mut(i), rims.get_mut(i)) else { continue };
                tally(seen, numbers, pixel);
                let sees_lamp = seen.iter().any(|seen| seen.is_lamp != 0);
                *rim = u8::from(pixel.fractions[0] < 1.0 && sees_lamp);
            }
        }
        Ok(counters)
    }

    /// Traces the first `rays` camera rays of `count` pixels, with the indices `index` in the picture.
    pub(super) fn trace(
        &self,
        batch: &mut Batch,
        count: usize,
        rays: usize,
        with_surfaces: bool,
        index: impl Fn(usize) -> usize,
    ) -> u64 {
        let rays = rays.max(1);
        let total = (count * rays).min(batch.rays.len());
        let sampler = |ray: usize| {
            let pixel = index(ray / rays) as u32;
            Sampler::replicate(self.seed, pixel, 0, (ray % rays) as u32)
        };
        self.aim(&mut batch.rays[..total], |ray| (index(ray / rays) as u32, (ray % rays) as u32));
        self.chains.trace(batch, total, with_surfaces, sampler)
    }

    /// Camera rays with these pixels and sample indices.
    pub(super) fn aim(&self, rays: &mut [Ray], number: impl Fn(usize) -> (u32, u32)) {
        const BLOCK: usize = 16;
        let ([width, height], level) = (self.size, self.chains.context.level);
        let mut samples = SampleBlock::EMPTY;
        let mut raster = [[0.0; BLOCK]; 2];
        let mut aimed = [[0.0; 8]; BLOCK];
        for (block, rays) in rays.chunks_mut(BLOCK).enumerate() {
            let numbers = samples.place.iter_mut().zip(&mut samples.index);
            for (i, (place, sample)) in numbers.enumerate() {
                let (pixel, index) = number(block * BLOCK + i.min(rays.len() - 1));
                (*place, *sample) = (Sampler::replicate_place(self.seed, pixel, 0), index);
                (raster[0][i], raster[1][i]) = ((pixel % width) as f32, (pixel / width) as f32);
            }
            let offsets = samples.pairs(level, PIXEL);
            for (raster, offset) in raster.iter_mut().zip(&offsets) {
                raster.iter_mut().zip(offset).for_each(|(raster, offset)| *raster += offset);
            }
            let in_lanes = self.camera.rays(level, self.size, &raster, &mut aimed);
            for (i, ray) in rays.iter_mut().enumerate() {
                let i = i % BLOCK;
                *ray = if in_lanes {
                    bytemuck::cast(aimed[i])
                } else {
                    let (pixel, index) = number(block * BLOCK + i);
                    let lens = Sampler::replicate(self.seed, pixel, 0, index).pair(LENS);
                    self.camera.ray(width, height, raster[0][i], raster[1][i], lens)
                };
                ray.tag = (block * BLOCK + i) as u32;
            }
        }
    }
}

/// Number of rays of each pixel at an edge in a picture of so many `pixels`. A ray of each of these takes
/// `segments` in all.
pub(super) fn edge_rays(pixels: f64, segments: f64) -> usize {
    let [most, least] = EDGE_RAYS;
    let mut rays = most;
    while rays > least && rays as f64 * segments > pixels * EDGE_BUDGET {
        rays /= 2;
    }
    rays
}

/// A whole pixel of the first ray's cluster with the means of all.
pub(super) fn mean(seen: &[Seen]) -> PixelSurfaces {
    let (mut albedo, mut normal, mut depth, mut hits) = (Vec3::ZERO, Vec3::ZERO, 0.0, 0.0);
    for seen in seen {
        albedo += Vec3::from(seen.albedo);
        normal += Vec3::from(seen.normal);
        depth += seen.depth;
        hits += f32::from(u8::from(seen.depth > 0.0));
    }
    let inverse = 1.0 / seen.len().max(1) as f32;
    let mut pixel = PixelSurfaces {
        clusters: [NO_CLUSTER; SLOTS],
        fractions: [0.0; SLOTS],
        albedo: (albedo * inverse).to_array(),
        normal: (normal * inverse).to_array(),
        depth: if hits > 0.0 { depth / hits } else { 0.0 },
    };
    (pixel.clusters[0], pixel.fractions[0]) = (seen.first().map_or(NO_CLUSTER, Seen::cluster), 1.0);
    pixel
}

/// Most frequent clusters of the rays of a pixel, and their fractions.
fn tally(seen: &[Seen], numbers: &mut [u32], pixel: &mut PixelSurfaces) {
    let count = seen.len().min(numbers.len());
    let Some(numbers) = numbers.get_mut(..count) else { return };
    numbers.iter_mut().zip(seen).for_each(|(number, seen)| *number = seen.cluster());
    let best = ranks::<SLOTS>(numbers);
    pixel.clusters = best.map(|(_, number)| number);
    pixel.fractions = best.map(|(rays, _)| rays as f32 / count.max(1) as f32);
}

/// Most frequent numbers and how often they occur, most frequent first, the lower number first among equals.
/// Slots without a number have none. Sorts `numbers`.
pub(super) fn ranks<const N: usize>(numbers: &mut [u32]) -> [(usize, u32); N] {
    numbers.sort_unstable();
    let mut best = [(0usize, NO_CLUSTER); N];
    for run in numbers.chunk_by(|a, b| a == b) {
        // Insertion: a later number is behind those as frequent.
        let mut entry = (run.len(), run.first().copied().unwrap_or(NO_CLUSTER));
        for slot in &mut best {
            if entry.0 > slot.0 {
                core::mem::swap(&mut entry, slot);
            }
        }
    }
    best
}
