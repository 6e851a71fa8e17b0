//! Light paths of caustic photons (Jensen 1996): from a light through casters to the first receiver, where a
//! photon is stored with its MIS weight against camera paths (`merge.rs`).
//!
//! A light path continues from the first receiver in any way and stores a photon at each later receiver, so
//! that camera paths need not meet the caustic by chance. A path whose first surface is a receiver continues
//! only by the reflection of a smooth coat. With the records of an irradiance cache, only light straight from
//! a mirror or smooth glass is stored, because records supply all light that rough surfaces sent.
//! `walk/light.rs` has the walk.

use crate::bsdf::{BsdfSample, Features};
use crate::bvh::Bvh;
use crate::geometry::Ray;
use crate::light::{EmissionSampler, LightSampler, LightType, luminance};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::{Photon, PhotonMap};
use crate::scene::Scene;
use crate::transport::caustics::merge::is_wide_enough;
use crate::transport::photon_mapping::deposit::PhotonTracerSettings;
use crate::transport::photon_mapping::radius::RadiusSchedule;
use crate::transport::settings::Counters;
use crate::transport::walk::context::SceneContext;
pub use crate::transport::walk::light::PATHS_PER_TASK;
use crate::transport::walk::light::{Continuation, LightPathState, LightWalk, Vertex, Visitor};
use crate::transport::walk::mis::{ChainLink, merging_weight};
use crate::transport::walk::photon_buffer::PhotonBuffer;
use crate::transport::walk::vertex::Scatterer;
use crate::{Level, Rgb};
use bytemuck::{Pod, Zeroable};
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

/// Capacity of a task in photons; a path stores at most two on average.
pub const PHOTONS_PER_TASK: usize = 3 * PATHS_PER_TASK;

/// Maximum continuation probability of a path at a photon.
const MAX_CONTINUATION: f32 = 0.5;

/// Photons of less weight undergo Russian roulette and get this weight, because paths find their light.
const MIN_WEIGHT: f32 = 0.1;

/// Benefit of a photon that the camera does not see, relative to a visible one: some of its light comes back.
const INDIRECT: f32 = 0.02;

/// Assumed albedo of receivers.
const REFLECTED: f32 = 0.5;

/// Maximum number of glass surfaces between the camera and a visible photon.
const MAX_GLASS: u32 = 16;

/// Parts at both ends of the segment to the camera that the visibility test skips, relative to its length.
const NEAR: f32 = 1e-4;

/// Tracer of caustic photons: a pass whose tasks trace [`PATHS_PER_TASK`] light paths each.
#[derive(Clone, Copy)]
pub struct CausticPhotonTracer<'a, F> {
    walk: LightWalk<'a, F>,
    radii: RadiusSchedule,
    /// Pixels across and down.
    frame: [u32; 2],
    /// Points that see the photons in place of the camera.
    points: Option<&'a PhotonMap<'a>>,
    beside_records: bool,
}

/// Light path as a sample of the emission guide: its cell, and the benefit of its photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GuideSample {
    /// Cell of the guide.
    pub cell: u32,
    /// Benefit of its photons; zero if none was stored.
    pub benefit: f32,
    /// Block of the picture in which its last photon is visible, of [`BLOCKS`] across and down; a higher
    /// number if none is visible.
    pub block: u32,
    /// Radiance that its photons add to each pixel of their kernels, of light that path tracing rarely finds.
    pub light: f32,
    /// Expected number of hits of this light per path-traced sample of such a pixel.
    pub hits: f32,
    /// Radiance of such a sample; infinite if path tracing cannot find the light.
    pub flash: f32,
}

/// Blocks of the picture across and down, by which caustics are located.
pub const BLOCKS: u32 = 16;

impl<'a, F: Features> CausticPhotonTracer<'a, F> {
    /// A tracer over frozen structures, for photons that are gathered with kernel `radii` in a picture of
    /// `frame` pixels across and down. `F` has at least the features of the scene. The photon filter of
    /// `settings` is ignored.
    pub fn new(
        (scene, bvh, lights): (&'a Scene<'a>, &Bvh<'a>, &LightSampler<'a>),
        emission: &'a EmissionSampler<'a>,
        settings: PhotonTracerSettings,
        (radii, frame): (RadiusSchedule, [u32; 2]),
        level: Level,
    ) -> Self {
        let PhotonTracerSettings { seed, paths, max_depth, .. } = settings;
        let context = SceneContext::new(scene, bvh, lights, level);
        let walk = LightWalk { context, emission, seed, paths, max_depth };
        Self { walk, radii, frame, points: None, beside_records: false }
    }

    /// This tracer for photons of
    /// [`CausticMerging::beside_records`](crate::transport::CausticMerging::beside_records).
    pub fn beside_records(self, beside_records: bool) -> Self {
        Self { beside_records, ..self }
    }

    /// This tracer for photons near any of `points`, if there are some, in place of those seen by the camera.
    pub fn near(self, points: Option<&'a PhotonMap<'a>>) -> Self {
        Self { points, ..self }
    }

    /// Light paths of a map.
    pub fn paths(&self) -> u32 {
        self.walk.paths
    }

    /// Number of tasks of a map.
    pub fn tasks(&self) -> usize {
        self.walk.tasks()
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        LightWalk::<F>::scratch()
    }

    /// Traces the photons of task `task` of map number `map` (below 2^31). Unused elements of `out` get
    /// photons without a position, which a map rejects. A length of [`PHOTONS_PER_TASK`] suffices.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`CausticPhotonTracer::scratch`] bytes.
    #[inline(never)]
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let mut buffer = PhotonBuffer::new(out);
        let store = |_: &LightPathState, photon, _, counters: &mut Counters| buffer.push(photon, counters);
        let counters = self.walk.follow(
            task,
            map,
            scratch,
            &mut MisDepositor { tracer: self, store, continues: true },
        )?;
        buffer.finish();
        Ok(counters)
    }

    /// Traces the same light paths without storing photons. `out` gets a sample of the guide for each path,
    /// up to [`PATHS_PER_TASK`].
    ///
    /// # Errors
    /// As [`CausticPhotonTracer::run`].
    pub fn sample_guide(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [GuideSample],
    ) -> Result<Counters, OutOfMemory> {
        let first = (task * PATHS_PER_TASK) as u32;
        out.fill(GuideSample::default());
        let store = |state: &LightPathState, photon: Photon, weight: PhotonWeight, _: &mut Counters| {
            if let Some(sample) = out.get_mut((state.number - first) as usize) {
                let position = photon.position();
                let power = luminance(photon.power());
                let radius = self.radii.radius(position);
                let pixels = 1.0 / (radius * radius);
                sample.cell = state.cell;
                let light = REFLECTED / PI * power * pixels / PI;
                let Some(block) = self.block(position) else {
                    sample.benefit += power * pixels * INDIRECT;
                    if weight.ratio == 0.0 {
                        // No path finds what the surface sends on to others, wherever they are.
                        sample.light += INDIRECT * light;
                        (sample.hits, sample.flash) = (0.0, f32::INFINITY);
                        sample.block = BLOCKS * BLOCKS + state.number;
                    }
                    return;
                };
                sample.benefit += power * pixels;
                sample.block = block;
                let whole = light * weight.probability / weight.weight;
                sample.light += light;
                (sample.hits, sample.flash) = (weight.ratio / weight.probability, whole / weight.ratio);
            }
        };
        self.walk.follow(task, map, scratch, &mut MisDepositor { tracer: self, store, continues: false })
    }

    /// Block of points in the order of their map with one in a kernel around `position`; `None` if none has.
    fn block_of(&self, points: &PhotonMap, position: Vec3) -> Option<u32> {
        let mut found = [0];
        let count = points.within(self.walk.context.level, position, self.radii.radius(position), &mut found);
        let blocks = u64::from(BLOCKS * BLOCKS);
        (count > 0).then(|| (u64::from(found[0]) * blocks / points.len() as u64) as u32)
    }

    /// Block of the picture in which the camera sees `position`, directly or through glass; `None` if it does
    /// not.
    fn block(&self, position: Vec3) -> Option<u32> {
        if let Some(points) = self.points {
            return self.block_of(points, position);
        }
        let context = &self.walk.context;
        let camera = &context.scene.camera;
        let [width, height] = self.frame;
        let at = camera.project(width, height, position, [0.5; 2])?.raster;
        let frame = Vec2::new(width as f32, height as f32);
        if at.cmplt(Vec2::ZERO).any() || at.cmpge(frame).any() {
            return None;
        }
        let eye = camera.origin_towards(position);
        let to_eye = eye - position;
        let mut ray = Ray::segment(position + NEAR * to_eye, (1.0 - NEAR) * to_eye, 1.0);
        let mut crossed = 0;
        loop {
            let hit = context.nearest(&ray);
            let Some(point) = context.surface_at(&ray, &hit) else {
                let [x, y] = (at / frame * BLOCKS as f32).to_array();
                return Some((y as u32).min(BLOCKS - 1) * BLOCKS + (x as u32).min(BLOCKS - 1));
            };
            crossed += 1;
            if crossed > MAX_GLASS || !point.material.may_pass_caustics() {
                return None;
            }
            ray = point.spawn_to(eye);
        }
    }

    /// MIS weight of a photon of this path at `position`.
    fn weight(&self, state: &LightPathState, position: Vec3) -> PhotonWeight {
        let ratio =
            state.path_pdfs / (self.radii.merge_factor(position, self.walk.paths as f32) * state.chain_ratio);
        let weight = merging_weight(ratio);
        // Zero over zero: without any other technique the weight is one.
        let weight = if state.path_pdfs == 0.0 { 1.0 } else { weight };
        PhotonWeight { weight, probability: (weight / MIN_WEIGHT).min(1.0), ratio }
    }

    /// `chain_ratio` and `path_pdfs` before the first surface. `back` is the pdf of the direction to the
    /// light; `None` after a specular scattering.
    fn first(&self, state: &LightPathState, vertex: &Vertex, back: Option<f32>) -> (f32, f32) {
        let LightWalk { context, emission, .. } = &self.walk;
        let at = Scatterer { point: vertex.point, bsdf: vertex.bsdf };
        let origin = (state.light, state.origin.into());
        let (kind, pdf, density) = at.densities_of_light(context, emission, origin, vertex.to_light);
        let with = back.map_or(0.0, |back| pdf / back);
        (density, if kind == LightType::Delta { with } else { libm::sqrtf(1.0 + with * with) })
    }
}

/// MIS weight of a photon, and its Russian roulette.
#[derive(Clone, Copy)]
struct PhotonWeight {
    /// MIS weight against camera paths.
    weight: f32,
    /// Probability that it is stored.
    probability: f32,
    /// Density of camera paths over that of photons.
    ratio: f32,
}

impl PhotonWeight {
    /// Weight of a photon whose power includes it already.
    const ONE: PhotonWeight = PhotonWeight { weight: 1.0, probability: 1.0, ratio: 0.0 };

    /// Factor on the power of the photon at `vertex`; `None` if roulette rejects it.
    fn factor(&self, vertex: &Vertex) -> Option<f32> {
        (vertex.visitor_number() < self.probability).then(|| self.weight / self.probability)
    }
}

/// `LightPathState::path_pdfs` of a path behind a receiver: its power includes its weight, and
/// `LightPathState::chain_ratio` is the kernel radius at the last receiver.
const SCATTERED: f32 = -1.0;

/// Visitor that stores photons with their weights.
struct MisDepositor<'s, 'a, F, L> {
    tracer: &'s CausticPhotonTracer<'a, F>,
    store: L,
    /// True if paths continue from the first receiver.
    continues: bool,
}

impl<F: Features, L> MisDepositor<'_, '_, F, L> {
    /// True if light is merged at the receiver `vertex`, not at the receiver before it.
    fn is_merged(&self, state: &LightPathState, vertex: &Vertex) -> bool {
        let from = if state.path_pdfs == SCATTERED { state.chain_ratio } else { 0.0 };
        is_wide_enough(self.tracer.radii.radius(vertex.point.position), from)
    }

    /// Weight of a photon at the receiver `vertex`.
    fn weight(&self, state: &LightPathState, vertex: &Vertex) -> PhotonWeight {
        match state.path_pdfs {
            SCATTERED => PhotonWeight::ONE,
            _ => self.tracer.weight(state, vertex.point.position),
        }
    }
}

impl<F: Features, L: FnMut(&LightPathState, Photon, PhotonWeight, &mut Counters)> Visitor
    for MisDepositor<'_, '_, F, L>
{
    const DIMENSIONS: u32 = 4;
    const SEED: u64 = 0x6361_7573_7469_6373;

    #[inline]
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation> {
        let is_receiver = vertex.bsdf.is_receiver();
        let is_known = self.tracer.beside_records && state.from_caster == 0;
        let has_photon = is_receiver && state.segments > 1 && !is_known;
        if has_photon && self.is_merged(state, vertex) {
            let weight = self.weight(state, vertex);
            if let Some(factor) = weight.factor(vertex) {
                let photon = vertex.photon(Rgb::from(state.power) * factor);
                (self.store)(state, state.limited(photon, self.tracer.walk.max_depth), weight, counters);
            }
        }
        Some(Continuation {
            most: if has_photon { MAX_CONTINUATION } else { 1.0 },
            specular_only: is_receiver && !(has_photon && self.continues),
        })
    }

    /// Photons straight from a light are not scattered by a rough coat: path tracing finds that light.
    #[inline]
    fn is_apart(&self, state: &LightPathState, vertex: &Vertex) -> bool {
        state.segments > 1 && vertex.bsdf.gathers_photons_on_base(self.tracer.walk.context.separates_coats())
    }

    /// Behind a receiver the power includes the weight.
    #[inline]
    fn has_densities(&self, state: &LightPathState, vertex: &Vertex) -> bool {
        state.path_pdfs != SCATTERED && !vertex.bsdf.is_receiver()
    }

    /// Multiplies `chain_ratio` by the ρ of a caster; sets it and `path_pdfs` at the first vertex.
    #[inline]
    fn leave(
        &self,
        state: &mut LightPathState,
        vertex: &Vertex,
        from: Vec3,
        (sample, is_specular): (&BsdfSample, bool),
    ) {
        state.from_caster = vertex.bsdf.is_delta().into();
        if vertex.bsdf.is_receiver() && !is_specular {
            if state.path_pdfs != SCATTERED {
                // The path continues with the power of its photon.
                let factor = self.weight(state, vertex).factor(vertex).unwrap_or(0.0);
                state.power = (Rgb::from(state.power) * factor).to_array();
            }
            (state.path_pdfs, state.chain_ratio) =
                (SCATTERED, self.tracer.radii.radius(vertex.point.position));
        }
        if state.path_pdfs == SCATTERED {
            return;
        }
        // The reverse direction, in which the path tracer samples.
        let Vertex { point, bsdf, .. } = *vertex;
        let coat_alone = is_specular && !sample.delta;
        let there = ChainLink { point, bsdf, near: from, far: sample.direction, coat_alone };
        let back = if sample.delta { 1.0 } else { there.pdf(&self.tracer.walk.context) };
        if state.segments == 1 {
            let back = (!sample.delta).then_some(back);
            (state.chain_ratio, state.path_pdfs) = self.tracer.first(state, vertex, back);
        }
        state.chain_ratio *= if sample.delta {
            sample.eta * sample.eta
        } else {
            sample.pdf / back * (from.z / sample.direction.z).abs()
        };
    }
}
