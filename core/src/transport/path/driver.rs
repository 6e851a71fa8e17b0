//! The wavefront: all paths of a wave advance together, one segment at a time, so that the tracer sees batches of rays
//! (pbrt-v4, chapter 15). Queues are compacted in place: the ray of a path that goes on overwrites one that was already
//! shaded.

use super::shadow_rays::Shadows;
use super::{BLOCK, LIGHT_SAMPLES, PathIntegrator, SurfaceInteraction};
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::transport::estimator::Counters;
use crate::transport::path::state::Wavefront;
use core::ops::Range;

impl<'a, F: Features> PathIntegrator<'a, F> {
    /// Traces the first `count` rays of the wave and all that follows from them.
    pub(in crate::transport) fn advance(&self, wave: &mut Wavefront, count: usize, counters: &mut Counters) {
        self.trace(wave, count, Coherence::Coherent, counters);
        self.trace_to_end(wave, count, counters);
    }

    /// Finds what the first `active` rays of the wave meet.
    pub(in crate::transport) fn trace(
        &self,
        wave: &mut Wavefront,
        active: usize,
        coherence: Coherence,
        counters: &mut Counters,
    ) {
        counters.rays += active as u64;
        let rays = &wave.rays[..active];
        self.context.nearest_batch(rays, coherence, &mut wave.hits[..active]);
    }

    /// Shades the first `active` rays of the wave, which were traced, and traces what follows until no path is left.
    pub(in crate::transport) fn trace_to_end(
        &self,
        wave: &mut Wavefront,
        active: usize,
        counters: &mut Counters,
    ) {
        let mut active = self.shade_hits(wave, active, counters);
        while active > 0 {
            self.trace(wave, active, Coherence::Incoherent, counters);
            active = self.shade_hits(wave, active, counters);
        }
    }

    /// Shades what they met; returns how many rays there are now.
    pub(in crate::transport) fn shade_hits(
        &self,
        wave: &mut Wavefront,
        active: usize,
        counters: &mut Counters,
    ) -> usize {
        let (mut going_on, mut shadows) = (0, 0);
        let mut block = [None; BLOCK];
        for i in 0..active {
            if i % BLOCK == 0 {
                self.prepare_block(wave, i..active.min(i + BLOCK), &mut block, counters);
            }
            let (ray, hit) = (wave.rays[i], wave.hits[i]);
            // Several lights at a vertex have no place where all vertices are lit. Not through cut-outs, which have one each.
            if shadows + LIGHT_SAMPLES > wave.shadow_rays.len() && !self.context.has_cutouts {
                self.trace_shadow_rays(wave, core::mem::take(&mut shadows), counters);
            }
            let Wavefront { paths, exchanges, shadow_rays, shadow_light, .. } = wave;
            let Some(path) = paths.get_mut(ray.tag as usize) else { continue };
            let Some(exchange) = exchanges.get_mut(ray.tag as usize) else { continue };
            let mut queue = Shadows { rays: shadow_rays, light: shadow_light, count: shadows };
            let next =
                self.shade(path, exchange, (&ray, &hit), block[i % BLOCK].as_ref(), &mut queue, counters);
            shadows = queue.count;
            if let Some(mut next) = next {
                next.tag = ray.tag;
                wave.rays[going_on] = next;
                going_on += 1;
            }
        }
        self.trace_shadow_rays(wave, shadows, counters);
        going_on
    }

    /// The surface points that the rays of `range` have met, with what caches know of them.
    #[inline]
    fn prepare_block(
        &self,
        wave: &Wavefront,
        range: Range<usize>,
        block: &mut [Option<SurfaceInteraction<'a>>; BLOCK],
        counters: &mut Counters,
    ) {
        let met = wave.rays[range.clone()].iter().zip(&wave.hits[range.clone()]);
        for ((ray, hit), met) in met.zip(block.iter_mut()) {
            let point = self.context.surface_at(ray, hit);
            *met = point.map(|point| SurfaceInteraction { point, indirect: None });
        }
        if let Some(caches) = self.caches {
            self.ask(caches, wave, range, block, counters);
        }
    }
}
