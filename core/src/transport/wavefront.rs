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
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::{Origin, SceneContext};
use crate::transport::walk::dimension;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};
use core::ops::Range;
use halflight_simd::kernels::shade::BLOCK;

/// Paths that advance together if memory allows: enough to fill batches of rays, few enough for the L2 cache.
pub const WAVE: usize = 2048;

/// Shading by a method, called by the wavefront.
pub(crate) trait Shade {
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
    pub(crate) throughput: [f32; 3],
    /// Solid-angle pdf of the ray; infinite if no other technique can sample it.
    pub(crate) pdf: f32,
    /// Position of the last scattering vertex.
    pub(crate) position: [f32; 3],
    /// Product of the squared relative indices of refraction so far.
    pub(crate) eta_squared: f32,
    /// Normal at `position` for light sampling.
    pub(crate) normal: [f32; 3],
    /// Triangle at the origin of the ray, which the ray cannot hit again.
    pub(crate) triangle: u32,
    /// L, the radiance that the path has found so far.
    pub(crate) radiance: [f32; 3],
    /// Index of the pixel in the picture.
    pub(crate) pixel: u32,
    /// Part of `radiance` that is blur of density estimates.
    pub(crate) blur: [f32; 3],
    /// Index of the pixel in its tile.
    pub(crate) place: u32,
    /// Sample number of the pixel.
    pub(crate) sample: u32,
    /// Segments traced, including the current one.
    pub(crate) segments: u16,
    /// Number of skipped surfaces.
    pub(crate) crossings: u16,
    /// Classes of light that the path has to find behind its ray.
    pub(crate) classes: PathClasses,
    /// Length of the path from the camera to its last vertex.
    pub(crate) travelled: f32,
}

impl PathState {
    /// Path before its first segment: sample `sample` of pixel `pixel` of the picture, at `place` in its
    /// tile.
    pub(crate) fn new(pixel: u32, place: u32, sample: u32, classes: PathClasses) -> Self {
        let mut path = Self::default();
        path.begin(pixel, place, sample, classes);
        path
    }

    /// Replaces the path by [`PathState::new`]. In its slot of the wave, field by field: a copy of the whole
    /// would wait for the narrow fields.
    #[inline]
    pub(crate) fn begin(&mut self, pixel: u32, place: u32, sample: u32, classes: PathClasses) {
        *self = Self::zeroed();
        (self.throughput, self.pdf) = ([1.0; 3], f32::INFINITY);
        (self.pixel, self.place, self.sample) = (pixel, place, sample);
        (self.segments, self.classes) = (1, classes);
        (self.triangle, self.eta_squared) = (MISS, 1.0);
    }

    /// Adds to the radiance of the path.
    #[inline]
    pub(crate) fn add(&mut self, radiance: Rgb) {
        self.radiance = (Rgb::from(self.radiance) + radiance).to_array();
    }

    /// `Err` if the ray that `hit` a surface passes `point` there: the ray behind it, if there is one.
    #[inline]
    pub(crate) fn stop<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        (ray, hit): (&Ray, &Hit),
        point: &SurfacePoint,
        seed: u32,
        counters: &mut Counters,
    ) -> Result<(), Option<Ray>> {
        let segments = u32::from(self.segments);
        let mut origin = Origin { triangle: self.triangle, crossings: self.crossings.into() };
        let sampler = Sampler::new(seed, self.pixel, self.sample);
        let opacity = |crossings| sampler.single(dimension::opacity(segments, crossings));
        let met = (ray, hit, point);
        let state = (&mut origin, &mut self.throughput);
        context.stop(state, met, segments == 1, opacity, counters).inspect_err(|_| {
            (self.triangle, self.crossings) = (origin.triangle, origin.crossings as u16);
        })
    }
}

/// Slices for `capacity` paths. The tag of a ray is the index of its path.
pub struct Wavefront<'m> {
    pub(crate) paths: &'m mut [PathState],
    pub(crate) rays: &'m mut [Ray],
    pub(crate) hits: &'m mut [Hit],
    /// Number of rays of the next segment, at the front of `rays`, while the current segment is shaded.
    pub(crate) next: usize,
    pub(crate) shadows: ShadowRays<'m>,
}

impl<'m> Wavefront<'m> {
    /// Number of paths of a wave of `capacity`: at least one circle of pixels.
    pub(crate) const fn capacity(capacity: usize) -> usize {
        if capacity < CIRCLE { CIRCLE } else { capacity }
    }

    /// Footprint of [`Wavefront::new`].
    pub(crate) fn footprint(capacity: usize) -> Footprint {
        let capacity = Self::capacity(capacity);
        Footprint::default()
            .slice::<PathState>(capacity)
            .slice::<Ray>(capacity)
            .slice::<Hit>(capacity)
            .and(ShadowRays::footprint(capacity))
    }

    /// An empty wave.
    pub(crate) fn new(capacity: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let capacity = Self::capacity(capacity);
        Ok(Self {
            paths: arena.slice(capacity)?,
            rays: arena.slice(capacity)?,
            hits: arena.slice(capacity)?,
            next: 0,
            shadows: ShadowRays::new(capacity, arena)?,
        })
    }

    /// Queues `ray` of path `path`, in place of a shaded ray.
    #[inline]
    pub(crate) fn push_ray(&mut self, path: usize, ray: Ray) {
        if let Some(slot) = self.rays.get_mut(self.next) {
            *slot = Ray { tag: path as u32, ..ray };
            self.next += 1;
        }
    }
}

impl Wavefront<'_> {
    /// Finds the nearest hits of the first `count` rays.
    pub(crate) fn trace<F: Features>(
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
    pub(crate) fn follow<F: Features>(
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
        let block = (self.shadows.rays.len() / each).clamp(1, BLOCK);
        let mut start = 0;
        while start < count {
            let end = count.min(start + block);
            // One shadow ray per vertex always fits.
            if self.shadows.count + each * (end - start) > self.shadows.rays.len() {
                self.trace_shadow_rays(context, counters);
            }
            shade.shade(self, start..end, counters);
            start = end;
        }
        self.trace_shadow_rays(context, counters);
        self.next
    }

    /// Traces the queue of shadow rays, and adds the light of unoccluded ones to their paths.
    pub(crate) fn trace_shadow_rays<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        counters: &mut Counters,
    ) {
        let Self { paths, shadows, .. } = self;
        shadows.trace(context, counters, |ray, light| {
            let tag = ShadowTag(ray.tag);
            let environment = context.scene.environment.as_ref().filter(|_| tag.is_flagged());
            let radiance = environment.map_or(Rgb::ONE, |e| e.radiance(context.scene, ray.direction.into()));
            if let Some(path) = paths.get_mut(tag.path()) {
                path.add(light * radiance);
            }
        });
    }
}
