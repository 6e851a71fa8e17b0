//! Subpaths of given random numbers, from the camera or from a light, with the sums of multiple importance
//! sampling. They are those of `bidirectional/mis.rs`, with as many light paths as pixels and one connection.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::EmissionSampler;
use crate::sampling::Numbers;
use crate::scene::SurfacePoint;
use crate::transport::bidirectional::ends::{End, sums_from_camera, sums_from_light};
use crate::transport::bidirectional::mis::{Counts, Sums};
use crate::transport::bidirectional::vertex::normal_for_lights;
use crate::transport::bidirectional::vertex::{is_bent, reverse_pdf};
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::points;
use crate::transport::walk::termination::MAX_CROSSINGS;
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Counts of path tracing.
pub(super) const PATH_TRACING: Counts = Counts { light_paths: 0.0, connections: 0.0, light_samples: 1.0 };

/// A subpath between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Subpath {
    /// Throughput of a camera subpath; W of a light subpath, over the number of pixels.
    pub throughput: [f32; 3],
    /// Density of the ray's direction per solid angle; infinite after a delta lobe and at the lens.
    pub pdf: f32,
    /// The last vertex: at first the origin of a light subpath.
    pub position: [f32; 3],
    /// Segments, the one under way included.
    pub segments: u32,
    /// Normal of the last vertex for light sampling.
    pub normal: [f32; 3],
    /// Surfaces passed by cut-out or coincidence.
    pub crossings: u32,
    /// Triangle that the ray starts on.
    pub triangle: u32,
    /// Light that a light subpath left.
    pub light: u32,
    /// Sums after the last scattering, or on arrival where the subpath has ended.
    pub sums: Sums,
    /// The sums of the techniques of path tracing alone.
    pub path_sums: Sums,
}

/// The end of a ray.
pub(super) enum Met<'a> {
    /// A surface that scatters.
    Surface(SurfacePoint<'a>),
    /// A surface that the subpath passes: its next ray.
    Passed(Ray),
    /// No surface.
    Nothing,
    /// Nothing that a subpath can go on from.
    Lost,
}

/// A vertex that a subpath has arrived at.
pub(super) struct Vertex<'v> {
    pub point: SurfacePoint<'v>,
    pub bsdf: Bsdf,
    /// Unit direction to the vertex before.
    pub back: Vec3,
    /// The same, local.
    pub wo: Vec3,
    /// Sums of all techniques and of path tracing, on arrival.
    pub sums: [Sums; 2],
    /// The shading normal depends on the subpath ([`is_bent`]).
    pub is_bent: bool,
}

impl Vertex<'_> {
    #[inline]
    pub(super) fn cos(&self, direction: Vec3) -> f32 {
        direction.dot(self.point.geometric_normal).abs()
    }
}

/// Shadow rays of a batch.
pub(super) struct Shadows<'w> {
    pub rays: ShadowRays<'w>,
    pub count: usize,
}

impl Shadows<'_> {
    pub(super) fn push(&mut self, tag: u32, ray: Ray, light: Rgb) {
        let slots = (self.rays.rays.get_mut(self.count), self.rays.light.get_mut(self.count));
        if let (Some(slot), Some(arrives)) = slots {
            (*slot, *arrives) = (Ray { tag, ..ray }, light.to_array());
            self.count += 1;
        }
    }

    /// Traces and forgets them; `arrive` gets those that nothing stops.
    pub(super) fn trace<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        counters: &mut Counters,
        arrive: impl FnMut(&Ray, Rgb),
    ) {
        let rays = &mut counters.shadow_rays;
        counters.dropped.unfinished += context.trace_shadow_rays(&mut self.rays, self.count, rays, arrive);
        self.count = 0;
    }
}

/// Makes subpaths and joins them.
#[derive(Clone, Copy)]
pub(super) struct Walk<'a, F> {
    pub context: SceneContext<'a, F>,
    pub emission: &'a EmissionSampler<'a>,
    /// Pixels across and down.
    pub size: [u32; 2],
    pub counts: Counts,
}

impl<'a, F: Features> Walk<'a, F> {
    /// For pictures of `size` pixels, with the techniques of bidirectional path tracing.
    pub(super) fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        size: [u32; 2],
    ) -> Self {
        let light_paths = size[0] as f32 * size[1] as f32;
        let counts = Counts { light_paths, connections: 1.0, light_samples: 1.0 };
        Self { context, emission, size, counts }
    }

    pub(super) fn has_light_paths(&self) -> bool {
        self.counts.light_paths > 0.0
    }

    /// A camera subpath through `raster`.
    pub(super) fn start_at_camera(&self, raster: Vec2, lens: [f32; 2]) -> (Subpath, Ray) {
        let ray = self.context.scene.camera.ray(self.size[0], self.size[1], raster.x, raster.y, lens);
        let pdf = f32::INFINITY;
        let subpath =
            Subpath { throughput: [1.0; 3], pdf, segments: 1, triangle: MISS, ..Subpath::default() };
        (subpath, ray)
    }

    /// A light subpath by the dimensions of emission of `numbers`.
    pub(super) fn start_at_light(&self, numbers: &impl Numbers) -> Option<(Subpath, Ray)> {
        let emitted = self.emission.emit(self.context.scene, &self.context.lights, numbers)?;
        let subpath = Subpath {
            throughput: (emitted.power / self.counts.light_paths).to_array(),
            position: emitted.ray.origin,
            segments: 1,
            triangle: emitted.triangle,
            light: emitted.light,
            ..Subpath::default()
        };
        Some((subpath, emitted.ray))
    }

    /// The end of `ray`, which `met` a surface at `hit`. `opacity` gives the random number of a surface with
    /// a cut-out after n others.
    pub(super) fn meet<'p>(
        &self,
        subpath: &mut Subpath,
        (ray, hit, met): (&Ray, &Hit, points::Met<'_, 'p>),
        at_lens: bool,
        opacity: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Met<'p> {
        if !hit.is_some() {
            return Met::Nothing;
        }
        let Some(point) = met.point() else { return Met::Lost };
        // Scattered at or passed before.
        let surfaces = subpath.segments - 1 + subpath.crossings;
        let is_skipped = self.context.is_skipped(&point, hit, subpath.triangle, || opacity(surfaces))
            || at_lens && subpath.segments == 1 && point.is_left_by(ray);
        if !is_skipped {
            return Met::Surface(point);
        }
        if subpath.crossings >= MAX_CROSSINGS {
            counters.dropped.unfinished += 1;
            return Met::Lost;
        }
        subpath.crossings += 1;
        subpath.triangle = hit.triangle;
        Met::Passed(point.spawn(ray.direction.into()))
    }

    /// The vertex where a camera subpath arrives.
    pub(super) fn camera_vertex<'p>(
        &self,
        subpath: &Subpath,
        (point, bsdf): (SurfacePoint<'p>, Bsdf),
        direction: Vec3,
        lens: [f32; 2],
    ) -> Vertex<'p> {
        let wo = point.frame.to_local(-direction);
        let is_bent = is_bent(&point, wo);
        let mut vertex = Vertex { point, bsdf, back: -direction, wo, sums: [Sums::default(); 2], is_bent };
        if self.has_light_paths() && !is_bent {
            vertex.sums[0] = self.sums_at_camera_vertex(subpath, &vertex, lens);
        }
        vertex
    }

    fn sums_at_camera_vertex(&self, subpath: &Subpath, vertex: &Vertex, lens: [f32; 2]) -> Sums {
        let (point, cos) = (&vertex.point, vertex.cos(vertex.back));
        let is_delta = vertex.bsdf.is_delta();
        if subpath.segments > 1 {
            let squared = point.position.distance_squared(subpath.position.into());
            return subpath.sums.arrive(squared, cos, is_delta);
        }
        let end = End { point, bsdf: &vertex.bsdf, cos };
        sums_from_camera(&self.context, &self.counts, self.size, lens, end)
    }

    /// The vertex where a light subpath arrives. `None` where its shading normal depends on the subpath.
    pub(super) fn light_vertex<'p>(
        &self,
        subpath: &Subpath,
        surface: (SurfacePoint<'p>, Bsdf),
        direction: Vec3,
    ) -> Option<Vertex<'p>> {
        let mut vertex = self.light_surface(surface, direction)?;
        let (cos, is_delta) = (vertex.cos(direction), vertex.bsdf.is_delta());
        vertex.sums = match subpath.segments {
            1 => {
                let Self { context, emission, counts, .. } = self;
                let origin = (subpath.light, subpath.position.into());
                let end = End { point: &vertex.point, bsdf: &vertex.bsdf, cos };
                [sums_from_light(context, emission, counts, origin, end, vertex.back); 2]
            }
            _ => {
                let squared = vertex.point.position.distance_squared(subpath.position.into());
                [subpath.sums, subpath.path_sums].map(|sums| sums.arrive(squared, cos, is_delta))
            }
        };
        Some(vertex)
    }

    /// The same without sums.
    pub(super) fn light_surface<'p>(
        &self,
        (point, bsdf): (SurfacePoint<'p>, Bsdf),
        direction: Vec3,
    ) -> Option<Vertex<'p>> {
        let wo = point.frame.to_local(-direction);
        let sums = [Sums::default(); 2];
        (!is_bent(&point, wo)).then_some(Vertex { point, bsdf, back: -direction, wo, sums, is_bent: false })
    }

    /// The subpath goes on from `vertex` by a `sample` of the BSDF. Its next ray.
    pub(super) fn scatter(
        &self,
        subpath: &mut Subpath,
        vertex: &Vertex,
        from_light: bool,
        sample: &BsdfSample,
    ) -> Option<Ray> {
        let Vertex { point, bsdf, back, wo, .. } = vertex;
        let towards = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, towards) {
            return None;
        }
        let mut throughput = Rgb::from(subpath.throughput) * sample.weight;
        if from_light {
            // Power is not squeezed by refraction, as radiance is; and where the shading normal is not that
            // of the triangle, it is the other cosine that counts (Veach 1997, sections 5.2 and 5.3).
            throughput *= sample.eta * sample.eta;
            if point.frame.normal != point.geometric_normal {
                let cosines = wo.z * vertex.cos(towards);
                throughput *= cosines / (vertex.cos(*back) * sample.direction.z.abs());
            }
        }
        if !(throughput.max_element() > 0.0 && throughput.is_finite()) {
            return None;
        }
        let sums = self.sums_after(vertex, sample, towards, from_light);
        [subpath.sums, subpath.path_sums] = sums;
        subpath.throughput = throughput.to_array();
        subpath.pdf = if sample.delta { f32::INFINITY } else { sample.pdf };
        subpath.position = point.position.to_array();
        subpath.normal = normal_for_lights(point, bsdf).to_array();
        subpath.triangle = point.triangle;
        subpath.segments += 1;
        Some(point.spawn(towards))
    }

    fn sums_after(&self, vertex: &Vertex, sample: &BsdfSample, towards: Vec3, from_light: bool) -> [Sums; 2] {
        if vertex.is_bent || !self.has_light_paths() {
            return [Sums::default(); 2];
        }
        if sample.delta {
            let cos_in = vertex.cos(vertex.back);
            return vertex.sums.map(|sums| sums.scatter_delta(cos_in, sample.eta));
        }
        let cos_out = vertex.cos(towards);
        let reverse = reverse_pdf(&self.context, (&vertex.point, &vertex.bsdf), vertex.wo, sample.direction);
        let all = vertex.sums[0].scatter(&self.counts, sample.pdf, reverse, cos_out, None);
        let paths = match from_light {
            true => vertex.sums[1].scatter(&PATH_TRACING, sample.pdf, reverse, cos_out, None),
            false => Sums::default(),
        };
        [all, paths]
    }

    /// Ends a light subpath at `vertex`: it keeps the sums on arrival.
    pub(super) fn end(&self, subpath: &mut Subpath, vertex: &Vertex) {
        [subpath.sums, subpath.path_sums] = vertex.sums;
    }
}
