//! Subpaths of bidirectional path tracing, from the camera or from a light, with the sums of multiple
//! importance sampling (`sums.rs`).

use crate::Rgb;
use crate::bsdf::{BsdfSample, Features};
use crate::geometry::{Hit, MISS, Ray};
use crate::light::{EmissionSampler, LightType};
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::context::{Origin, SceneContext};
use crate::transport::walk::sums::{Counts, Sums};
use crate::transport::walk::termination::{is_cut, survive};
use crate::transport::walk::vertex::{Scatterer, is_bent_at};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// A subpath between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Subpath {
    /// Throughput of a camera subpath; W of a light subpath, over the number of light paths.
    pub throughput: [f32; 3],
    /// Density of the ray's direction per solid angle; infinite after a delta lobe and at the lens.
    pub pdf: f32,
    /// The last vertex: at first the origin of a light subpath.
    pub position: [f32; 3],
    /// Segments, the one under way included.
    pub segments: u32,
    /// Normal of the last vertex for light sampling.
    pub normal: [f32; 3],
    pub origin: Origin,
    /// Sums after the last scattering, or on arrival where the subpath has ended.
    pub sums: Sums,
}

impl Subpath {
    /// Leaves `vertex` with this `throughput` and with `sums`, by a `sample` of the BSDF `towards` a
    /// direction. The next ray, if there is light.
    #[inline]
    pub(crate) fn leave(
        &mut self,
        vertex: &Vertex,
        (sample, towards): (&BsdfSample, Vec3),
        throughput: Rgb,
        sums: Sums,
    ) -> Option<Ray> {
        if !(throughput.max_element() > 0.0 && throughput.is_finite()) {
            return None;
        }
        let point = vertex.at.point;
        self.throughput = throughput.to_array();
        self.pdf = if sample.delta { f32::INFINITY } else { sample.pdf };
        self.position = point.position.to_array();
        self.segments += 1;
        self.normal = vertex.at.normal_for_lights().to_array();
        self.origin.triangle = point.triangle;
        self.sums = sums;
        Some(point.spawn(towards))
    }
}

/// Continuation of a camera path that has survived.
pub(crate) struct Next {
    pub sample: BsdfSample,
    /// Direction of the sample in the world.
    pub towards: Vec3,
    pub throughput: Rgb,
    pub eta_squared: f32,
    /// True if the path is too long.
    pub is_cut: bool,
}

/// A vertex that a subpath has arrived at.
#[derive(Clone, Copy)]
pub(crate) struct Vertex<'v> {
    pub at: Scatterer<'v>,
    /// Unit direction to the vertex before.
    pub back: Vec3,
    /// The same, local.
    pub wo: Vec3,
    /// Sums on arrival.
    pub sums: Sums,
    /// The shading normal depends on the subpath ([`is_bent_at`]): no other subpath can come here.
    pub is_bent: bool,
}

impl<'v> Vertex<'v> {
    /// Vertex of a subpath that arrives by `direction`, without sums.
    #[inline]
    pub(crate) fn new(at: Scatterer<'v>, direction: Vec3) -> Self {
        let (back, wo) = (-direction, at.point.frame.to_local(-direction));
        Self { at, back, wo, sums: Sums::default(), is_bent: is_bent_at(at.point, back) }
    }
}

/// Makes subpaths and joins them.
#[derive(Clone, Copy)]
pub(crate) struct Walk<'a, F> {
    pub context: SceneContext<'a, F>,
    pub emission: &'a EmissionSampler<'a>,
    /// Pixels across and down.
    pub size: [u32; 2],
    pub counts: Counts,
}

impl<F: Features> Walk<'_, F> {
    #[inline]
    pub(crate) fn has_light_paths(&self) -> bool {
        self.counts.light_paths > 0.0
    }

    /// A camera subpath through `raster`.
    #[inline]
    pub(crate) fn start_at_camera(&self, raster: Vec2, lens: [f32; 2]) -> (Subpath, Ray) {
        let ray = self.context.scene.camera.ray(self.size[0], self.size[1], raster.x, raster.y, lens);
        let origin = Origin { triangle: MISS, crossings: 0 };
        let pdf = f32::INFINITY;
        (Subpath { throughput: [1.0; 3], pdf, segments: 1, origin, ..Subpath::default() }, ray)
    }

    /// `Err` if a `ray` passes `point`, its `hit`: the ray behind it. `opacity` gives the random number of a
    /// cut-out after n other surfaces, scattered at or passed.
    #[inline]
    pub(crate) fn stop(
        &self,
        subpath: &mut Subpath,
        (ray, hit, point): (&Ray, &Hit, &SurfacePoint),
        from_camera: bool,
        opacity: impl Fn(u32) -> f32,
        counters: &mut Counters,
    ) -> Result<(), Option<Ray>> {
        let segments = subpath.segments;
        let random = |crossings| opacity(segments - 1 + crossings);
        let at_lens = from_camera && segments == 1;
        let state = (&mut subpath.origin, &mut subpath.throughput);
        self.context.stop(state, (ray, hit, point), at_lens, random, counters)
    }

    /// The vertex where a camera subpath arrives.
    #[inline]
    pub(crate) fn camera_vertex<'v>(
        &self,
        subpath: &Subpath,
        at: Scatterer<'v>,
        direction: Vec3,
        lens: [f32; 2],
    ) -> Vertex<'v> {
        let mut vertex = Vertex::new(at, direction);
        if self.has_light_paths() && !vertex.is_bent {
            vertex.sums = match subpath.segments {
                1 => self.sums_from_camera(&vertex, lens),
                _ => self.sums_from(&subpath.sums, subpath.position.into(), &vertex),
            };
        }
        vertex
    }

    /// Sums where a subpath arrives that had `sums` behind its vertex at `position`.
    #[inline]
    pub(crate) fn sums_from(&self, sums: &Sums, position: Vec3, vertex: &Vertex) -> Sums {
        let Scatterer { point, bsdf } = vertex.at;
        let squared = point.position.distance_squared(position);
        sums.arrive(squared, vertex.at.cos(vertex.back), bsdf.is_delta())
    }

    /// Sums at the first vertex of a camera subpath.
    #[inline]
    fn sums_from_camera(&self, vertex: &Vertex, lens: [f32; 2]) -> Sums {
        let ([width, height], Scatterer { point, bsdf }) = (self.size, vertex.at);
        let seen = self.context.scene.camera.project(width, height, point.position, lens);
        seen.map_or(Sums::default(), |seen| {
            let sums = Sums::at_camera(&self.counts, width as f32 * height as f32 * seen.pdf);
            sums.arrive(seen.distance * seen.distance, vertex.at.cos(vertex.back), bsdf.is_delta())
        })
    }

    /// Sums at the first vertex of a light subpath from `origin` on `light`: both densities of the light as
    /// they are from there.
    #[inline]
    pub(crate) fn sums_from_light(&self, (light, origin): (u32, Vec3), vertex: &Vertex) -> Sums {
        let Self { context, emission, counts, .. } = self;
        let (at, to_light) = (vertex.at, vertex.back);
        let (kind, pdf_light, density) = at.densities_of_light(context, emission, (light, origin), to_light);
        let cos = at.cos(to_light);
        let sums = Sums::at_light(counts, pdf_light, density, cos, kind != LightType::Delta);
        Sums { last: if vertex.at.bsdf.is_delta() { 0.0 } else { sums.last }, ..sums }
    }

    /// A camera subpath leaves `vertex` with this `throughput`, by a `sample` of the BSDF `towards` a
    /// direction. Its next ray. `eta_vcm` is the number of merges if the vertex is rough.
    #[inline]
    pub(crate) fn scatter(
        &self,
        subpath: &mut Subpath,
        vertex: &Vertex,
        (sample, towards): (&BsdfSample, Vec3),
        throughput: Rgb,
        eta_vcm: Option<f32>,
    ) -> Option<Ray> {
        let sums = match vertex.is_bent || !self.has_light_paths() {
            true => Sums::default(),
            false => self.sums_behind(vertex, (sample, towards), [(&self.counts, &vertex.sums)], eta_vcm)[0],
        };
        subpath.leave(vertex, (sample, towards), throughput, sums)
    }

    /// Continuation of a camera path from `vertex` by a `sample` of the BSDF, and the probability of its
    /// survival; `None` if Russian roulette ends it. `eta_squared` is the product of its squared relative
    /// indices of refraction so far.
    #[inline]
    pub(crate) fn next(
        &self,
        (subpath, eta_squared): (&Subpath, f32),
        vertex: &Vertex,
        sample: BsdfSample,
        roulette: impl FnOnce() -> f32,
    ) -> Option<(Next, f32)> {
        let (segments, towards) = (subpath.segments, vertex.at.towards(&sample)?);
        let throughput = Rgb::from(subpath.throughput) * sample.weight;
        let eta_squared = eta_squared * (sample.eta * sample.eta);
        let survival = survive(segments, throughput * eta_squared, roulette)?;
        let is_cut = is_cut(segments, vertex.at.bsdf, &sample);
        let throughput = throughput / survival;
        Some((Next { sample, towards, throughput, eta_squared, is_cut }, survival))
    }

    /// A camera path goes on from `vertex` to `next`: its ray. `eta_vcm` is the number of merges if the
    /// vertex is rough.
    #[inline]
    pub(crate) fn go_on(
        &self,
        (subpath, eta_squared): (&mut Subpath, &mut f32),
        vertex: &Vertex,
        next: &Next,
        eta_vcm: Option<f32>,
        counters: &mut Counters,
    ) -> Option<Ray> {
        if next.is_cut {
            counters.dropped.unfinished += 1;
            return None;
        }
        *eta_squared = next.eta_squared;
        self.scatter(subpath, vertex, (&next.sample, next.towards), next.throughput, eta_vcm)
    }

    /// Sums behind `vertex`, of the techniques of some counts that have `sums` on arrival.
    #[inline]
    pub(crate) fn sums_behind<const N: usize>(
        &self,
        &Vertex { at, back, wo, .. }: &Vertex,
        (sample, towards): (&BsdfSample, Vec3),
        sums: [(&Counts, &Sums); N],
        eta_vcm: Option<f32>,
    ) -> [Sums; N] {
        if sample.delta {
            let cos_in = at.cos(back);
            return sums.map(|(_, sums)| sums.scatter_delta(cos_in, sample.eta));
        }
        let (cos_out, reverse) = (at.cos(towards), at.reverse_pdf(&self.context, wo, sample.direction));
        sums.map(|(counts, sums)| sums.scatter(counts, sample.pdf, reverse, cos_out, eta_vcm))
    }
}
