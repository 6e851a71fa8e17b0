//! Wavefront path tracing: all paths of a tile advance together, one segment at a time, so that rays are
//! traced in batches (pbrt-v4, chapter 15). The wavefront holds rays and path states, and calls a [`Shade`]
//! for blocks of vertices: trace, shade, trace shadow rays, until no path is left. Queues are compacted in
//! place: the next ray of a path overwrites a shaded ray.

use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::CIRCLE;
use crate::geometry::{Hit, MISS, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::walk::termination::MAX_CROSSINGS;
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};
use core::ops::Range;

/// Paths that advance together if memory allows: enough to fill batches of rays, few enough for the L2 cache.
pub const WAVE: usize = 2048;

/// Number of vertices that are shaded together.
pub(in crate::transport) const BLOCK: usize = 16;

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

/// State of one camera path between two vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct PathState {
    // The first twelve words are those that shading writes as records of lanes.
    /// β, the factor from radiance at the hit of the ray to radiance in the pixel.
    pub(in crate::transport) throughput: [f32; 3],
    /// Solid-angle pdf of the ray; infinite if no other technique can sample it.
    pub(in crate::transport) pdf: f32,
    /// Position of the last scattering vertex.
    pub(in crate::transport) position: [f32; 3],
    /// Product of the squared relative indices of refraction so far.
    pub(in crate::transport) eta_squared: f32,
    /// Normal at `position` for light sampling.
    pub(in crate::transport) normal: [f32; 3],
    /// Triangle at the origin of the ray, which the ray cannot hit again.
    pub(in crate::transport) triangle: u32,
    /// L, the radiance that the path has found so far.
    pub(in crate::transport) radiance: [f32; 3],
    /// Index of the pixel in the picture.
    pub(in crate::transport) pixel: u32,
    /// Part of `radiance` that is blur of density estimates.
    pub(in crate::transport) blur: [f32; 3],
    /// Index of the pixel in its tile.
    pub(in crate::transport) place: u32,
    /// Sample number of the pixel.
    pub(in crate::transport) sample: u32,
    /// Segments traced, including the current one.
    pub(in crate::transport) segments: u16,
    /// Number of skipped surfaces.
    pub(in crate::transport) crossings: u16,
    /// Classes of light that the path has to find behind its ray.
    pub(in crate::transport) classes: PathClasses,
    /// Length of the path from the camera to its last vertex.
    pub(in crate::transport) travelled: f32,
}

impl PathState {
    /// Path before its first segment: sample `sample` of pixel `pixel` of the picture, at `place` in its
    /// tile.
    pub(in crate::transport) fn new(pixel: u32, place: u32, sample: u32, classes: PathClasses) -> Self {
        let mut path = Self::default();
        path.begin(pixel, place, sample, classes);
        path
    }

    /// Replaces the path by [`PathState::new`]. In its slot of the wave, field by field: a copy of the whole
    /// would wait for the narrow fields.
    #[inline]
    pub(in crate::transport) fn begin(&mut self, pixel: u32, place: u32, sample: u32, classes: PathClasses) {
        *self = Self::zeroed();
        (self.throughput, self.pdf) = ([1.0; 3], f32::INFINITY);
        (self.pixel, self.place, self.sample) = (pixel, place, sample);
        (self.segments, self.classes) = (1, classes);
        (self.triangle, self.eta_squared) = (MISS, 1.0);
    }

    /// Adds to the radiance of the path.
    #[inline]
    pub(in crate::transport) fn add(&mut self, radiance: Rgb) {
        self.radiance = (Rgb::from(self.radiance) + radiance).to_array();
    }

    /// Continues with `next` behind the skipped `triangle`. `None` after [`MAX_CROSSINGS`] skipped surfaces.
    #[cold]
    pub(in crate::transport) fn skip_surface(
        &mut self,
        next: Ray,
        triangle: u32,
        counters: &mut Counters,
    ) -> Option<Ray> {
        if u32::from(self.crossings) >= MAX_CROSSINGS {
            counters.dropped.unfinished += 1;
            return None;
        }
        self.crossings += 1;
        self.triangle = triangle;
        Some(next)
    }
}

/// Slices for `capacity` paths. The tag of a ray is the index of its path.
pub struct Wavefront<'m> {
    pub(in crate::transport) paths: &'m mut [PathState],
    pub(in crate::transport) rays: &'m mut [Ray],
    pub(in crate::transport) hits: &'m mut [Hit],
    /// Number of rays of the next segment, at the front of `rays`, while the current segment is shaded.
    pub(in crate::transport) next: usize,
    pub(in crate::transport) shadow_rays: &'m mut [Ray],
    /// Unoccluded contribution of each shadow ray.
    pub(in crate::transport) shadow_light: &'m mut [[f32; 3]],
    /// Hits of shadow rays in scenes with cut-outs.
    pub(in crate::transport) shadow_hits: &'m mut [Hit],
    pub(in crate::transport) hidden: &'m mut [u8],
    /// Number of shadow rays in the queue.
    pub(in crate::transport) shadows: usize,
}

impl<'m> Wavefront<'m> {
    /// Number of paths of a wave of `capacity`: at least one circle of pixels.
    pub(in crate::transport) const fn capacity(capacity: usize) -> usize {
        if capacity < CIRCLE { CIRCLE } else { capacity }
    }

    /// Footprint of [`Wavefront::new`].
    pub(in crate::transport) fn footprint(capacity: usize) -> Footprint {
        let capacity = Self::capacity(capacity);
        Footprint::default()
            .slice::<PathState>(capacity)
            .slice::<Ray>(capacity)
            .slice::<Hit>(capacity)
            .slice::<Ray>(capacity)
            .slice::<[f32; 3]>(capacity)
            .slice::<Hit>(capacity)
            .slice::<u8>(capacity)
    }

    /// An empty wave.
    pub(in crate::transport) fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let capacity = Self::capacity(capacity);
        Ok(Self {
            paths: arena.slice(capacity)?,
            rays: arena.slice(capacity)?,
            hits: arena.slice(capacity)?,
            next: 0,
            shadow_rays: arena.slice(capacity)?,
            shadow_light: arena.slice(capacity)?,
            shadow_hits: arena.slice(capacity)?,
            hidden: arena.slice(capacity)?,
            shadows: 0,
        })
    }

    /// Queues `ray` of path `path`, in place of a shaded ray.
    #[inline]
    pub(in crate::transport) fn push_ray(&mut self, path: usize, ray: Ray) {
        if let Some(slot) = self.rays.get_mut(self.next) {
            *slot = Ray { tag: path as u32, ..ray };
            self.next += 1;
        }
    }

    /// Queues a shadow ray with its contribution `light`.
    #[inline]
    pub(in crate::transport) fn push_shadow_ray(&mut self, ray: Ray, light: Rgb) {
        let slots = (self.shadow_rays.get_mut(self.shadows), self.shadow_light.get_mut(self.shadows));
        if let (Some(slot), Some(contribution)) = slots {
            (*slot, *contribution) = (ray, light.to_array());
            self.shadows += 1;
        }
    }
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
    pub(in crate::transport) fn trace_shadow_rays<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        counters: &mut Counters,
    ) {
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
