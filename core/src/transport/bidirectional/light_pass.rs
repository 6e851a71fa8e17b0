//! The light pass of a sample of the picture: light paths whose vertices are stored for connections, and
//! splatted where the camera sees them (Veach 1997, section 10.2; Dutré et al. 1993).

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::film::{Splat, StripOffsets, Tile, sort_by_strip};
use crate::geometry::{Hit, Ray};
use crate::light::EmissionSampler;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::warp::concentric_disk;
use crate::transport::bidirectional::arrival::Arrival;
use crate::transport::bidirectional::ends::{End, sums_from_light};
use crate::transport::bidirectional::merge_photons::MergeRadii;
use crate::transport::bidirectional::mis::{Counts, Sums, weight_of_splat};
use crate::transport::bidirectional::vertex::{LightVertex, is_bent, reverse_pdf, scattering_from_light};
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::history::Rest;
use crate::transport::walk::light::{
    Continuation, LightPathState, LightWalk, MAX_CONTINUATION, Vertex, Visitor,
};
use crate::transport::walk::visibility::ShadowRays;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

pub use crate::transport::walk::light::{PATHS_PER_TASK, VERTICES_PER_TASK};

/// Dimensions of the sampler at a vertex of a light path.
pub(super) const DIMENSIONS: u32 = 5;

/// Distinguishes the random numbers of light paths from others.
pub(super) const SEED: u64 = 0x6269_6469_7265_6374;

/// Shadow rays to the camera that are traced together.
const SHADOW_RAYS: usize = 1024;

/// Least bit of the [`Rest`] in a marked splat.
const REST: u32 = 28;

/// The pixel of a marked splat, and the records that do not supply its light.
pub fn marked(pixel: u32) -> (u32, Rest) {
    (pixel & ((1 << REST) - 1), Rest::from_bits(pixel >> REST))
}

/// The outcome of a task beside its vertices and splats.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct TaskOutput {
    /// Vertices stored.
    pub vertices: u32,
    offsets: StripOffsets,
}

impl TaskOutput {
    /// The splats of each strip in the task's list.
    pub fn offsets(&self) -> &StripOffsets {
        &self.offsets
    }
}

/// Traces the light paths of a sample.
#[derive(Clone, Copy)]
pub struct LightPass<'a, F> {
    context: SceneContext<'a, F>,
    emission: &'a EmissionSampler<'a>,
    settings: PathSettings,
    counts: Counts,
    merging: Option<MergeRadii>,
    /// Light paths of the pass.
    paths: u32,
    /// True if splats are marked ([`marked`]).
    is_marking: bool,
}

impl<'a, F: Features> LightPass<'a, F> {
    /// A pass with the light paths of `counts`, for merges where there are some.
    pub fn new(
        context: SceneContext<'a, F>,
        emission: &'a EmissionSampler<'a>,
        settings: PathSettings,
        counts: Counts,
        merging: Option<MergeRadii>,
    ) -> Self {
        Self {
            context,
            emission,
            settings,
            counts,
            merging,
            paths: counts.light_paths as u32,
            is_marking: false,
        }
    }

    /// The same paths with the weights of other counts, and with marked splats ([`marked`]).
    pub fn weighted_by(self, counts: Counts, merging: Option<MergeRadii>) -> Self {
        Self { counts, merging, is_marking: true, ..self }
    }

    /// Working memory of a task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch()
            .slice::<Splat>(VERTICES_PER_TASK)
            .slice::<Ray>(SHADOW_RAYS)
            .slice::<[f32; 3]>(SHADOW_RAYS)
            .slice::<Hit>(SHADOW_RAYS)
            .slice::<u8>(SHADOW_RAYS)
    }

    /// Traces the paths of `task` for sample number `sample`: their vertices into `vertices`, splats sorted
    /// by strips into `splats`, each with room for [`VERTICES_PER_TASK`].
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`LightPass::scratch`].
    pub fn run(
        &self,
        (task, sample): (usize, u32),
        scratch: &mut Arena,
        vertices: &mut [LightVertex],
        splats: &mut [Splat],
        output: &mut TaskOutput,
    ) -> Result<Counters, OutOfMemory> {
        let Self { context, emission, settings, counts, merging, paths, is_marking } = *self;
        let mut arena = scratch.scratch();
        let mut writer = Writer {
            context,
            emission,
            settings,
            counts,
            merging,
            is_marking,
            vertices,
            stored: 0,
            splats: arena.slice(VERTICES_PER_TASK)?,
            splatted: 0,
            shadows: ShadowRays {
                rays: arena.slice(SHADOW_RAYS)?,
                light: arena.slice(SHADOW_RAYS)?,
                hits: arena.slice(SHADOW_RAYS)?,
                hidden: arena.slice(SHADOW_RAYS)?,
            },
            pending: 0,
        };
        let (seed, max_depth) = (settings.seed, settings.max_depth);
        let walk = LightWalk { context, emission, seed, paths, max_depth };
        let mut counters = walk.follow(task, sample, &mut arena, &mut writer)?;
        writer.trace(&mut counters);
        let pixels = Tile::count(settings.width, settings.height) * crate::film::PIXELS_PER_TILE;
        *output = TaskOutput {
            vertices: writer.stored as u32,
            offsets: sort_by_strip(&writer.splats[..writer.splatted], pixels, splats),
        };
        Ok(counters)
    }

    /// Tasks of a pass.
    pub fn tasks(&self) -> usize {
        (self.paths as usize).div_ceil(PATHS_PER_TASK)
    }
}

/// Stores and splats the vertices of a task.
struct Writer<'w, F> {
    context: SceneContext<'w, F>,
    emission: &'w EmissionSampler<'w>,
    settings: PathSettings,
    counts: Counts,
    merging: Option<MergeRadii>,
    is_marking: bool,
    vertices: &'w mut [LightVertex],
    stored: usize,
    splats: &'w mut [Splat],
    splatted: usize,
    /// To the camera; the tag is the position of the pixel in the film.
    shadows: ShadowRays<'w>,
    pending: usize,
}

impl<F: Features> Writer<'_, F> {
    fn arrive(&self, state: &LightPathState, vertex: &Vertex, cos: f32) -> Sums {
        let is_delta = vertex.bsdf.is_delta();
        if state.segments == 1 {
            let Self { context, emission, counts, .. } = self;
            let origin = (state.light, state.origin.into());
            let end = End { point: vertex.point, bsdf: vertex.bsdf, cos };
            return sums_from_light(context, emission, counts, origin, end, vertex.to_light);
        }
        let squared = vertex.point.position.distance_squared(state.position.into());
        state.sums.arrive(squared, cos, is_delta)
    }

    /// η at a rough vertex and the way by which light comes there, if it may be merged. `None` at a caster.
    fn merge(&self, state: &LightPathState, vertex: &Vertex) -> Option<(f32, Option<Arrival>)> {
        if vertex.bsdf.is_caustic_caster() {
            return None;
        }
        let position = vertex.point.position;
        let Some(radii) = self.merging else { return Some((0.0, None)) };
        let eta_vcm = radii.eta_vcm(vertex.bsdf, position);
        if eta_vcm == 0.0 || state.segments == 1 {
            return Some((0.0, None));
        }
        let squared = position.distance_squared(state.position.into());
        let arrival = Arrival::of(state.from_caster == 1, squared, radii.near(eta_vcm));
        Some((if arrival.is_some() { eta_vcm } else { 0.0 }, arrival))
    }

    fn store(&mut self, state: &LightPathState, vertex: &Vertex, counters: &mut Counters) {
        if self.counts.connections == 0.0 && self.merging.is_none() {
            return;
        }
        let merge = self.merge(state, vertex);
        let Some(slot) = self.vertices.get_mut(self.stored) else {
            counters.dropped.unfinished += 1;
            return;
        };
        *slot = LightVertex {
            position: vertex.point.position.to_array(),
            triangle: vertex.point.triangle,
            power: state.power,
            segments: state.segments.min(u32::from(u16::MAX)) as u16,
            to_light: vertex.to_light.to_array(),
            barycentric: vertex.barycentric,
            sums: Sums {
                pending_merge: merge.map_or(state.sums.pending_merge, |(eta_vcm, _)| eta_vcm),
                ..state.sums
            },
            ..LightVertex::default()
        }
        .with_arrival(merge.and_then(|(_, arrival)| arrival), state.history.rest());
        self.stored += 1;
    }

    /// Sends a shadow ray from the vertex to the lens, if the picture has a pixel there.
    fn splat(&mut self, state: &LightPathState, vertex: &Vertex, cos_in: f32) -> Option<()> {
        let PathSettings { width, height, max_depth, .. } = self.settings;
        // Light samples find direct light with less noise.
        if state.segments == 1 || state.segments + 1 > max_depth {
            return None;
        }
        let (camera, point) = (&self.context.scene.camera, vertex.point);
        let lens = if camera.lens_radius > 0.0 { vertex.visitor_pair() } else { [0.5; 2] };
        let seen = camera.project(width, height, point.position, lens)?;
        let is_inside = seen.raster.cmpge(glam::Vec2::ZERO).all()
            && seen.raster.x < width as f32
            && seen.raster.y < height as f32;
        if !is_inside {
            return None;
        }
        let to_camera = -seen.direction;
        let (wo, wi) = (point.frame.to_local(to_camera), point.frame.to_local(vertex.to_light));
        if !point.sides_agree(wo, to_camera) {
            return None;
        }
        let scattering = scattering_from_light(&self.context, (point, vertex.bsdf), wo, wi);
        let cos_out = to_camera.dot(point.geometric_normal).abs();
        let pixels = width as f32 * height as f32;
        let pdf_area = pixels * seen.pdf * cos_out / seen.distance / seen.distance;
        let merge = match self.merge(state, vertex) {
            None => state.sums.pending_merge * scattering.pdf_to_light,
            Some((eta_vcm, Some(arrival))) if arrival.is_merged(1) => eta_vcm,
            Some(_) => 0.0,
        };
        let weight = weight_of_splat(&self.counts, &state.sums, pdf_area, scattering.pdf_to_light, merge);
        // Power was counted by the geometric normal, which may differ from the shading normal (Veach 1997,
        // 5.3).
        let radiance = Rgb::from(state.power) * scattering.value * (pdf_area * weight / cos_in);
        if !(radiance.max_element() > 0.0 && radiance.is_finite()) {
            return None;
        }
        let ray = point.spawn_to(lens_point(camera, lens, point.position, &seen));
        let pixel = Tile::position([width, height], seen.raster.x as u32, seen.raster.y as u32) as u32;
        let mark = if self.is_marking { state.history.rest().bits() << REST } else { 0 };
        self.shadows.rays[self.pending] = Ray { tag: pixel | mark, ..ray };
        self.shadows.light[self.pending] = radiance.to_array();
        self.pending += 1;
        Some(())
    }

    /// Traces the pending shadow rays and adds the splats of those that reach the lens to the list.
    fn trace(&mut self, counters: &mut Counters) {
        let Self { context, shadows, pending, splats, splatted, .. } = self;
        let mut overflow = 0;
        let arrive = |ray: &Ray, light: Rgb| match splats.get_mut(*splatted) {
            Some(slot) => {
                *slot = Splat { pixel: ray.tag, radiance: light.to_array() };
                *splatted += 1;
            }
            None => overflow += 1,
        };
        let unfinished = context.trace_shadow_rays(shadows, *pending, &mut counters.shadow_rays, arrive);
        counters.dropped.unfinished += unfinished + overflow;
        *pending = 0;
    }
}

/// The way a light path goes on from `bsdf`: mirrors and dielectrics store nothing, and have no limit.
pub(super) fn continuation(bsdf: &Bsdf) -> Continuation {
    Continuation { most: if bsdf.is_delta() { 1.0 } else { MAX_CONTINUATION }, specular_only: false }
}

/// The point of the lens from which the camera sees `position` as `seen`.
pub(in crate::transport) fn lens_point(
    camera: &crate::scene::Camera,
    lens: [f32; 2],
    position: Vec3,
    seen: &crate::scene::Projection,
) -> Vec3 {
    if let Some(start) = camera.start {
        // Rays of a far camera start on a plane, because the eye is too far for f32.
        let beyond = seen.distance - start.depth / seen.direction.dot(camera.forward);
        return position - seen.direction * beyond.max(0.0);
    }
    let offset = camera.lens_radius * concentric_disk(lens);
    camera.eye + offset.x * camera.right + offset.y * camera.up
}

impl<F: Features> Visitor for Writer<'_, F> {
    const DIMENSIONS: u32 = DIMENSIONS;
    const SEED: u64 = SEED;

    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let wi = vertex.point.frame.to_local(vertex.to_light);
        if is_bent(vertex.point, wi) {
            return None;
        }
        let cos_in = vertex.to_light.dot(vertex.point.geometric_normal).abs();
        state.sums = self.arrive(state, vertex, cos_in);
        state.history = state.history.on_light_path(vertex.bsdf);
        if !vertex.bsdf.is_delta() {
            self.store(state, vertex, counters);
            if self.pending == SHADOW_RAYS {
                self.trace(counters);
            }
            let _ = self.splat(state, vertex, cos_in);
        }
        Some(continuation(vertex.bsdf))
    }

    fn leave(
        &self,
        state: &mut LightPathState,
        vertex: &Vertex,
        from: Vec3,
        (sample, _): (&BsdfSample, bool),
    ) {
        let (point, bsdf) = (vertex.point, vertex.bsdf);
        let cos_in = vertex.to_light.dot(point.geometric_normal).abs();
        state.sums = if sample.delta {
            state.sums.scatter_delta(cos_in, sample.eta)
        } else {
            let towards = point.frame.to_world(sample.direction);
            let cos_out = towards.dot(point.geometric_normal).abs();
            let reverse = reverse_pdf(&self.context, (point, bsdf), from, sample.direction);
            let eta_vcm = self.merge(state, vertex).map(|(eta_vcm, _)| eta_vcm);
            state.sums.scatter(&self.counts, sample.pdf, reverse, cos_out, eta_vcm)
        };
        state.from_caster = u32::from(sample.delta || bsdf.is_caustic_caster());
        state.position = point.position.to_array();
    }
}
