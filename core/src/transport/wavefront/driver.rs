//! Loop of the wavefront: trace, shade, trace shadow rays, until no path is left. Queues are compacted in
//! place: the next ray of a path overwrites a shaded ray.

use super::{BLOCK, Wavefront};
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::geometry::Ray;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::visibility::ShadowRays;
use core::ops::Range;

/// Tag bit of shadow rays to the environment, whose radiance is looked up after arrival: most are occluded,
/// and an environment map is large.
pub(in crate::transport) const TO_ENVIRONMENT: u32 = 1 << 31;

/// Shading by a method, called by the wavefront.
pub(in crate::transport) trait Shade {
    /// Maximum number of shadow rays per vertex.
    fn shadow_rays(&self) -> usize;

    /// Shades the vertices at the hits of the rays in `range`, at most [`BLOCK`]: adds to the radiance of
    /// their paths, and pushes shadow rays and at most one next ray per ray of `range`.
    fn shade(&mut self, wave: &mut Wavefront, range: Range<usize>, counters: &mut Counters);
}

impl Wavefront<'_> {
    /// Finds the nearest hits of the first `count` rays.
    pub(in crate::transport) fn trace<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        count: usize,
        coherence: Coherence,
        counters: &mut Counters,
    ) {
        counters.rays += count as u64;
        context.nearest_batch(&self.rays[..count], coherence, &mut self.hits[..count]);
    }

    /// Shades the first `count` rays, already traced, and continues until no path is left.
    pub(in crate::transport) fn follow<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        mut count: usize,
        shade: &mut impl Shade,
        counters: &mut Counters,
    ) {
        loop {
            count = self.shade_all(context, count, shade, counters);
            if count == 0 {
                return;
            }
            self.trace(context, count, Coherence::Incoherent, counters);
        }
    }

    /// Shades the hits of the first `count` rays. Returns the number of next rays.
    fn shade_all<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        count: usize,
        shade: &mut impl Shade,
        counters: &mut Counters,
    ) -> usize {
        self.next = 0;
        let each = shade.shadow_rays().max(1);
        let block = (self.shadow_rays.len() / each).clamp(1, BLOCK);
        let mut start = 0;
        while start < count {
            let end = count.min(start + block);
            // One shadow ray per vertex always fits.
            if self.shadows + each * (end - start) > self.shadow_rays.len() {
                self.trace_shadow_rays(context, counters);
            }
            shade.shade(self, start..end, counters);
            start = end;
        }
        self.trace_shadow_rays(context, counters);
        self.next
    }

    /// Traces the queue of shadow rays, and adds the light of unoccluded ones to their paths.
    fn trace_shadow_rays<F: Features>(&mut self, context: &SceneContext<F>, counters: &mut Counters) {
        let count = core::mem::take(&mut self.shadows);
        let Self { paths, shadow_rays: rays, shadow_light: light, shadow_hits: hits, hidden, .. } = self;
        let arrive = |ray: &Ray, light: Rgb| {
            let environment = context.scene.environment.as_ref().filter(|_| ray.tag & TO_ENVIRONMENT != 0);
            let radiance = environment.map_or(Rgb::ONE, |e| e.radiance(context.scene, ray.direction.into()));
            if let Some(path) = paths.get_mut((ray.tag & !TO_ENVIRONMENT) as usize) {
                path.add(light * radiance);
            }
        };
        let mut queue = ShadowRays { rays, light, hits, hidden };
        counters.dropped.unfinished +=
            context.trace_shadow_rays(&mut queue, count, &mut counters.shadow_rays, arrive);
    }
}
