//! Random walk of light subpaths, from the emission to the last surface. A [`Visitor`] acts at each vertex:
//! `photon_mapping/deposit.rs` stores photons of all light, `caustics/tracer.rs` those of caustics,
//! `bidirectional/light_pass.rs` vertices for connections.
//!
//! All paths of a task advance together, so that rays are traced in batches. Path `i` of map `n` depends on
//! (seed, n, i) alone.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::bvh::Coherence;
use crate::geometry::{Hit, Ray};
use crate::light::{EMISSION_DIMENSIONS, EmissionSampler};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::sampling::{Numbers, Sampler, mix};
use crate::scene::SurfacePoint;
use crate::transport::settings::{Counters, UNLIMITED};
use crate::transport::walk::context::{Origin, SceneContext};
use crate::transport::walk::dimension;
use crate::transport::walk::history::History;
use crate::transport::walk::light_lanes::{LOBE, Lanes, ROULETTE, SCATTERING};
use crate::transport::walk::shading_normal::{is_bent, sample_bent};
use crate::transport::walk::sums::Sums;
use crate::transport::walk::termination::{is_cut, survival_limit};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_simd::kernels::shade::BLOCK;

/// Number of light paths of a task.
pub const PATHS_PER_TASK: usize = 1024;

/// Capacity of a task in vertices. With a continuation probability of at most [`MAX_CONTINUATION`] the mean
/// is at most five vertices per path.
pub const VERTICES_PER_TASK: usize = 6 * PATHS_PER_TASK;

/// Maximum continuation probability of a path that stores its vertices.
pub(crate) const MAX_CONTINUATION: f32 = 0.8;

/// Dimension of the sampler at a vertex for the visitor.
const VISITOR: u32 = 3;

/// State of one light subpath between two vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct LightPathState {
    pub power: [f32; 3],
    /// Index of the path in its map.
    pub number: u32,
    /// Segments traced, including the current one.
    pub segments: u32,
    start: Origin,
    /// Index of the light, and below the position of emission.
    pub light: u32,
    pub origin: [f32; 3],
    /// Cell of the emission guide.
    pub cell: u32,
    /// Last vertex, for visitors that store it.
    pub position: [f32; 3],
    /// Running MIS sums of a bidirectional path.
    pub sums: Sums,
    /// R / (π² r² N) so far, for visitors that weight photons (`caustics/merge.rs`, `caustics/tracer.rs`).
    pub chain_ratio: f32,
    /// Root of the sum of squared pdfs of the techniques of path tracing, over the pdf of the technique of
    /// `chain_ratio`: 1 if that is the only technique, 0 if there is none.
    pub path_pdfs: f32,
    /// 1 if the last surface is a caster: purely specular; for bidirectional paths, also narrow gloss.
    pub from_caster: u32,
    /// Rough vertices of a bidirectional path, for its pilot.
    pub history: History,
    /// Product of the continuation probabilities so far.
    survived: f32,
}

impl LightPathState {
    /// `photon` of this path, which knows its length if paths have at most `max_depth` segments.
    #[inline]
    pub(in crate::transport) fn limited(&self, photon: Photon, max_depth: u32) -> Photon {
        match max_depth {
            UNLIMITED => photon,
            // Any camera path has one segment.
            _ => photon.with_remaining(max_depth.saturating_sub(self.segments + 1)),
        }
    }
}

/// Vertex of a light subpath.
pub(crate) struct Vertex<'v> {
    pub point: &'v SurfacePoint<'v>,
    pub bsdf: &'v Bsdf,
    /// Barycentric coordinates of the second and third corner of the triangle.
    pub barycentric: [f32; 2],
    /// Unit direction from which the light arrives.
    pub to_light: Vec3,
    /// Opacity, above 0: the fraction of the light paths here that hit the surface.
    opacity: f32,
    numbers: &'v dyn Numbers,
    /// First dimension of the vertex.
    first: u32,
}

impl Vertex<'_> {
    /// Random number of the visitor.
    pub(crate) fn visitor_number(&self) -> f32 {
        self.numbers.single(self.first + VISITOR)
    }

    /// Two random numbers of the visitor.
    pub(crate) fn visitor_pair(&self) -> [f32; 2] {
        self.numbers.pair(self.first + VISITOR)
    }

    /// Photon of light that arrives with `power`. A camera path at a cut-out sees the light on its solid
    /// part; photons carry only the fraction opacity of it, hence the division.
    pub(crate) fn photon(&self, power: Rgb) -> Photon {
        let power = power / self.opacity;
        Photon::new(self.point.position, self.to_light, self.point.geometric_normal, power)
    }
}

/// Continuation of a path behind a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Continuation {
    /// Upper bound of the continuation probability.
    pub most: f32,
    /// True if the path survives only if it scatters by a delta function or by a coat alone.
    pub specular_only: bool,
}

/// Action of a method at the vertices of light subpaths.
pub(crate) trait Visitor {
    /// Number of dimensions of the sampler at a vertex.
    const DIMENSIONS: u32 = 3;
    /// Seed that separates these random numbers from those of other visitors and of pixels.
    const SEED: u64;

    /// Called at each surface. `None` ends the path.
    fn meet(
        &mut self,
        state: &mut LightPathState,
        vertex: &Vertex,
        counters: &mut Counters,
    ) -> Option<Continuation>;

    /// True if the path samples the base or the coat of `vertex` separately.
    #[inline]
    fn is_apart(&self, _state: &LightPathState, _vertex: &Vertex) -> bool {
        false
    }

    /// True if densities of scattering at `vertex` enter the weights of the visitor.
    #[inline]
    fn has_densities(&self, _state: &LightPathState, _vertex: &Vertex) -> bool {
        true
    }

    /// Called before the path leaves the vertex by `sample`, from the local direction `from`. The flag
    /// `is_specular` marks a delta function or a coat alone.
    #[inline]
    fn leave(
        &self,
        _state: &mut LightPathState,
        _vertex: &Vertex,
        _from: Vec3,
        _sample: (&BsdfSample, bool),
    ) {
    }
}

/// Random walk of all light subpaths of a map, without its visitor.
#[derive(Clone, Copy)]
pub(crate) struct LightWalk<'a, F> {
    pub context: SceneContext<'a, F>,
    pub emission: &'a EmissionSampler<'a>,
    pub seed: u32,
    /// Number of light paths of a map.
    pub paths: u32,
    pub max_depth: u32,
}

impl<'a, F: Features> LightWalk<'a, F> {
    /// Number of tasks of a map.
    pub(crate) fn tasks(&self) -> usize {
        (self.paths as usize).div_ceil(PATHS_PER_TASK)
    }

    /// Scratch memory of one task.
    pub(crate) fn scratch() -> Footprint {
        Footprint::default()
            .slice::<LightPathState>(PATHS_PER_TASK)
            .slice::<Ray>(PATHS_PER_TASK)
            .slice::<Hit>(PATHS_PER_TASK)
    }

    /// Follows the paths of task `task` of map `map`.
    #[inline(never)]
    pub(crate) fn follow<V: Visitor>(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        visitor: &mut V,
    ) -> Result<Counters, OutOfMemory> {
        let first = task * PATHS_PER_TASK;
        let paths = (self.paths as usize).saturating_sub(first).min(PATHS_PER_TASK);
        // Each path has one point of the sequence; even and odd maps are independent.
        let seed = mix(V::SEED ^ u64::from(self.seed)) as u32;
        let numbers_of = |number| Sampler::replicate(seed, map >> 1, map & 1, number);
        let mut arena = scratch.scratch();
        let states = arena.slice::<LightPathState>(PATHS_PER_TASK)?;
        let rays = arena.slice::<Ray>(PATHS_PER_TASK)?;
        let hits = arena.slice::<Hit>(PATHS_PER_TASK)?;
        let mut counters = Counters::default();
        let (mut lanes, has_lanes) = (Lanes::new(), self.context.has_lanes());
        let mut active = 0;
        for (i, state) in states.iter_mut().enumerate().take(paths) {
            let number = (first + i) as u32;
            if let Some(emitted) =
                self.emission.emit(self.context.scene, &self.context.lights, &numbers_of(number))
            {
                *state = LightPathState {
                    power: (emitted.power / self.paths as f32).to_array(),
                    number,
                    segments: 1,
                    start: Origin { triangle: emitted.triangle, crossings: 0 },
                    light: emitted.light,
                    cell: emitted.cell,
                    origin: emitted.ray.origin,
                    survived: 1.0,
                    ..LightPathState::default()
                };
                rays[active] = Ray { tag: i as u32, ..emitted.ray };
                active += 1;
            }
        }
        while active > 0 {
            counters.rays += active as u64;
            self.context.nearest_batch(&rays[..active], Coherence::Incoherent, &mut hits[..active]);
            let mut going_on = 0;
            for i in 0..active {
                if i.is_multiple_of(BLOCK) {
                    let of_block = i..active.min(i + BLOCK);
                    let rays = &rays[of_block.clone()];
                    lanes.block.points.meet(&self.context, (rays, &hits[of_block]));
                    if has_lanes {
                        let place = Sampler::replicate_place(seed, map >> 1, map & 1);
                        let of_tag = |tag: u32| states.get(tag as usize).map(|s| (s.number, s.segments));
                        let limits = (place, V::DIMENSIONS, self.max_depth);
                        lanes.gather(&self.context, (rays, of_tag), limits);
                    }
                }
                let (ray, hit) = (rays[i], hits[i]);
                let Some(state) = states.get_mut(ray.tag as usize) else { continue };
                let numbers = numbers_of(state.number);
                let met = (&ray, &hit, &mut lanes, i % BLOCK);
                if let Some(next) = self.step(state, &numbers, met, visitor, &mut counters) {
                    rays[going_on] = Ray { tag: ray.tag, ..next };
                    going_on += 1;
                }
            }
            active = going_on;
        }
        Ok(counters)
    }

    /// A sample of `bsdf` without lanes, of the base or the coat alone if it `is_apart`, and the number of
    /// roulette. The flag marks a delta function or a coat alone.
    fn sample<N: Numbers>(
        numbers: &N,
        first: u32,
        (bsdf, from): (&Bsdf, Vec3),
        is_apart: bool,
    ) -> (Option<(BsdfSample, bool)>, f32) {
        let [u, v] = numbers.pair(first + SCATTERING);
        let lobe = if F::GLOSSY || F::DIELECTRIC { numbers.single(first + LOBE) } else { 0.0 };
        let sample = match is_apart {
            true => bsdf.sample_apart::<F>(from, [u, v, lobe], 1.0),
            false => bsdf.sample::<F>(from, [u, v, lobe]).map(|sample| (sample, sample.delta)),
        };
        (sample, numbers.single(first + ROULETTE))
    }

    /// As [`LightWalk::sample`], at a bent shading normal.
    fn sample_bent<N: Numbers>(
        context: &SceneContext<F>,
        (numbers, first): (&N, u32),
        (ray, hit): (&Ray, &Hit),
        surface: (&SurfacePoint, &Bsdf),
    ) -> (Option<(BsdfSample, bool)>, f32) {
        let [u, v] = numbers.pair(first + SCATTERING);
        let lobe = if F::GLOSSY || F::DIELECTRIC { numbers.single(first + LOBE) } else { 0.0 };
        let sample = sample_bent::<F>(context, (ray, hit), surface, [u, v, lobe]);
        (sample.map(|sample| (sample, false)), numbers.single(first + ROULETTE))
    }

    /// One vertex at `hit` of `ray`; returns the next ray.
    fn step<V: Visitor, N: Numbers>(
        &self,
        state: &mut LightPathState,
        numbers: &N,
        (ray, hit, lanes, i): (&Ray, &Hit, &mut Lanes<'a>, usize),
        visitor: &mut V,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let met = lanes.block.points.at(i);
        let point = met.point()?;
        let direction = Vec3::from(ray.direction);
        let segments = state.segments;
        let opacity = |crossings| numbers.single(dimension::opacity(segments, crossings));
        let end = (ray, hit, &point);
        if let Err(behind) =
            self.context.stop((&mut state.start, &mut state.power), end, false, opacity, counters)
        {
            return behind;
        }
        if state.segments >= self.max_depth {
            return None;
        }
        let is_in_lanes = lanes.has(i);
        let bsdf = if is_in_lanes { lanes.block.others[i & 15] } else { met.bsdf::<F>(self.context.scene) };
        let first = EMISSION_DIMENSIONS + V::DIMENSIONS * (state.segments - 1);
        let (barycentric, to_light, opacity) = ([hit.u, hit.v], -direction, self.context.opacity_at(&point));
        let vertex = Vertex { point: &point, bsdf: &bsdf, barycentric, to_light, opacity, numbers, first };
        let onward = visitor.meet(state, &vertex, counters)?;
        if state.segments + 1 >= self.max_depth {
            return None;
        }
        let from = point.frame.to_local(-direction);
        // A diffuse surface has no specular lobe.
        if onward.specular_only && matches!(bsdf, Bsdf::Diffuse(_)) {
            return None;
        }
        let is_apart = F::GLOSSY && visitor.is_apart(state, &vertex);
        let is_free = !(is_apart || onward.specular_only || visitor.has_densities(state, &vertex));
        let is_bent = is_free && is_bent(&point, &bsdf);
        let (sample, roulette) = match is_in_lanes && !is_apart {
            _ if is_bent => Self::sample_bent(&self.context, (numbers, first), (ray, hit), (&point, &bsdf)),
            true => {
                let (sample, roulette) = lanes.sample::<F>(self.context.level, i);
                (sample.map(|sample| (sample, sample.delta)), roulette)
            }
            false => Self::sample(numbers, first, (&bsdf, from), is_apart),
        };
        let (sample, is_specular) = sample.filter(|(_, specular)| *specular || !onward.specular_only)?;
        let towards = point.frame.to_world(sample.direction);
        if !is_bent && !point.sides_agree(sample.direction, towards) {
            return None;
        }
        visitor.leave(state, &vertex, from, (&sample, is_specular));
        let power = Rgb::from(state.power);
        if power.max_element() <= 0.0 {
            return None;
        }
        let next = match is_bent {
            true => power * sample.weight,
            false => scattered(power, &point, (direction, from), (towards, &sample)),
        };
        // Paths keep their power where possible: absorption ends paths instead.
        let survival = survival_limit(state.segments + 1) / state.survived;
        let kept = next.max_element() / power.max_element();
        let continuation_probability = kept.min(onward.most).min(survival);
        if !(continuation_probability > 0.0 && roulette < continuation_probability && next.is_finite()) {
            return None;
        }
        if is_cut(state.segments, &bsdf, &sample) {
            counters.dropped.unfinished += 1;
            return None;
        }
        state.power = (next / continuation_probability).to_array();
        state.segments += 1;
        state.start.triangle = hit.triangle;
        state.survived *= continuation_probability;
        Some(point.spawn(towards))
    }
}

/// The `power` of a light path that comes along `direction`, `from` in the frame, and is scattered `towards`.
/// Unlike radiance, power is not scaled by refraction; with a shading normal, the other cosine counts (Veach
/// 1997, sections 5.2 and 5.3).
pub(crate) fn scattered(
    power: Rgb,
    point: &SurfacePoint,
    (direction, from): (Vec3, Vec3),
    (towards, sample): (Vec3, &BsdfSample),
) -> Rgb {
    let power = power * sample.weight * (sample.eta * sample.eta);
    if point.frame.normal == point.geometric_normal {
        return power;
    }
    let flat = |way: Vec3| way.dot(point.geometric_normal).abs();
    power * (from.z * flat(towards) / (flat(direction) * sample.direction.z.abs()))
}
