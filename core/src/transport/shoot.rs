//! Light paths: photons from the lights, left on every rough surface that they meet after the first (Jensen 1996).
//!
//! What they leave is, by [`Keep`], the light that surfaces reflect onto each other, and that mirrors and glass throw onto
//! surfaces, where light straight from a light is for shadow rays to find; all light; or caustics alone. All photons of a task advance together, so that the tracer
//! sees batches of rays. Photon `i` of map `n` follows from (seed, n, i) alone.
//!
//! Departures from the plain algorithm:
//! 1. After a photon was left, its path goes on with a probability of at most [`MOST`]. A path then leaves five photons
//!    on average at most, wherever it runs, so that [`ROOM`] for a task is enough: to be 14 standard deviations above
//!    the mean it would have to live through as many ends as no sequence of random numbers holds.
//! 2. The price: where surfaces are lighter than that, photons differ in power.

use super::estimator::{Counters, MAX_CROSSINGS, MAX_VERTICES};
use crate::bsdf::{Bsdf, Features};
use crate::bvh::{Bvh, Coherence};
use crate::geometry::{Hit, Ray};
use crate::light::{EMISSION_DIMENSIONS, Emission, Lights};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::sampling::{Sampler, mix};
use crate::scene::{Material, Scene, Surface, SurfacePoint};
use crate::{Level, Rgb};
use bytemuck::{Pod, Zeroable};
use core::marker::PhantomData;
use glam::Vec3;

/// Light paths of a task.
pub const PATHS: usize = 1024;

/// Photons that a task has room for.
pub const ROOM: usize = 6 * PATHS;

/// Probability with which a path goes on, at most, where it leaves a photon.
const MOST: f32 = 0.8;

/// Dimensions of the sampler at a vertex: where the path goes on, by which lobe, whether it does.
const SCATTERING: u32 = 0;
const LOBE: u32 = 1;
const ROULETTE: u32 = 2;

/// Whether the `n`th surface with a cut-out is met: `CROSSING + n`.
const CROSSING: u32 = 1 << 31;

/// The first dimension of the vertex at the end of the `n`th segment.
const fn vertex(n: u32) -> u32 {
    EMISSION_DIMENSIONS + 3 * (n - 1)
}

/// Whether photons are left on such a surface, and light is gathered from it: it has a diffuse part. What is only
/// glossy reflects too little of a disc of photons to see much of them; paths from the eye find its light.
#[inline]
pub(super) fn holds_photons(bsdf: &Bsdf) -> bool {
    matches!(bsdf, Bsdf::Diffuse(_) | Bsdf::Glossy(_) | Bsdf::Plastic(_)) && !bsdf.is_delta()
}

/// Smooth enough to throw light onto something else in a pattern that gathering would not find: largest GGX alpha.
const FOCUSING: f32 = 0.1;

/// Whether such a surface makes caustics: it mirrors or refracts, and has no diffuse part.
#[inline]
pub(super) fn focuses(bsdf: &Bsdf) -> bool {
    match bsdf {
        Bsdf::Mirror(_) | Bsdf::Dielectric(_) => true,
        Bsdf::Conductor(conductor) => conductor.alpha < FOCUSING,
        Bsdf::RoughDielectric(glass) => glass.alpha < FOCUSING,
        Bsdf::Diffuse(_) | Bsdf::Glossy(_) | Bsdf::Plastic(_) => bsdf.is_delta(),
    }
}

/// Whether `material` may be such a surface somewhere.
pub(super) fn may_focus(material: &Material) -> bool {
    match &material.surface {
        Surface::Diffuse { .. } => false,
        Surface::Mirror { .. } => true,
        Surface::Dielectric { roughness, .. } | Surface::Conductor { roughness, .. } => {
            roughness.texture.is_some() || roughness.value * roughness.value < FOCUSING
        }
        Surface::Glossy { .. } => material.surface.may_be_smooth(),
    }
}

/// Which photons are left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// All but those that come straight from a light.
    #[default]
    Reflected,
    /// All.
    All,
    /// Those that came from a light by mirrors and glass alone, at least one of them. Their paths end there.
    Caustic,
}

/// What is shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShootSettings {
    /// Which photons are left.
    pub keep: Keep,
    /// Another seed, other photons.
    pub seed: u32,
    /// Light paths for each map.
    pub paths: u32,
    /// The largest number of segments between camera and light, of which the last is the camera's.
    pub max_depth: u32,
}

/// Shoots the photons of one scene: a pass of tasks of [`PATHS`] paths.
#[derive(Clone, Copy)]
pub struct Shooter<'a, F> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    lights: &'a Lights<'a>,
    emission: &'a Emission<'a>,
    settings: ShootSettings,
    level: Level,
    features: PhantomData<F>,
}

/// A path between two of its vertices.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct State {
    power: [f32; 3],
    /// Which path of the map.
    number: u32,
    /// Segments traced, the one under way included.
    segments: u32,
    /// Surfaces passed through by cut-out.
    crossings: u32,
    /// The triangle that the ray starts on, which it cannot meet again.
    triangle: u32,
}

/// Where the photons of a task go.
struct Pile<'p> {
    photons: &'p mut [Photon],
    count: usize,
}

impl Pile<'_> {
    fn leave(&mut self, photon: Photon, counters: &mut Counters) {
        match self.photons.get_mut(self.count) {
            Some(slot) => {
                *slot = photon;
                self.count += 1;
            }
            None => counters.dropped.unfinished += 1,
        }
    }
}

impl<'a, F: Features> Shooter<'a, F> {
    /// A shooter over frozen structures. `F` has at least the features of the scene.
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &'a Bvh<'a>,
        lights: &'a Lights<'a>,
        emission: &'a Emission<'a>,
        settings: ShootSettings,
        level: Level,
    ) -> Self {
        Self { scene, bvh, lights, emission, settings, level, features: PhantomData }
    }

    /// Number of tasks of a map.
    pub fn tasks(&self) -> usize {
        (self.settings.paths as usize).div_ceil(PATHS)
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        Footprint::default().slice::<State>(PATHS).slice::<Ray>(PATHS).slice::<Hit>(PATHS)
    }

    /// Photons that a task needs room for.
    pub fn room(&self) -> usize {
        if self.settings.keep == Keep::Caustic { PATHS } else { ROOM }
    }

    /// Shoots the photons of task `task` of map number `map` (below 2^31). All of `out` is written; what is not needed,
    /// with photons of no place, which a map refuses. Room for [`Shooter::room`] is enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`Shooter::scratch`] bytes.
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let states = arena.slice::<State>(PATHS)?;
        let rays = arena.slice::<Ray>(PATHS)?;
        let hits = arena.slice::<Hit>(PATHS)?;
        let mut counters = Counters::default();
        let mut pile = Pile { photons: out, count: 0 };
        let first = task * PATHS;
        let paths = (self.settings.paths as usize).saturating_sub(first).min(PATHS);
        let mut active = 0;
        for (i, state) in states.iter_mut().enumerate().take(paths) {
            let number = (first + i) as u32;
            let sampler = self.sampler(map, number);
            if let Some(emitted) = self.emission.emit(self.scene, self.lights, &sampler) {
                let power = (emitted.power / self.settings.paths as f32).to_array();
                *state = State { power, number, segments: 1, crossings: 0, triangle: emitted.triangle };
                rays[active] = Ray { tag: i as u32, ..emitted.ray };
                active += 1;
            }
        }
        while active > 0 {
            counters.rays += active as u64;
            self.bvh.nearest_batch(self.level, &rays[..active], Coherence::Incoherent, &mut hits[..active]);
            let mut going_on = 0;
            for i in 0..active {
                let (ray, hit) = (rays[i], hits[i]);
                let Some(state) = states.get_mut(ray.tag as usize) else { continue };
                let sampler = self.sampler(map, state.number);
                if let Some(next) = self.meet(state, &sampler, &ray, &hit, &mut pile, &mut counters) {
                    rays[going_on] = Ray { tag: ray.tag, ..next };
                    going_on += 1;
                }
            }
            active = going_on;
        }
        pile.photons[pile.count..].fill(Photon::NONE);
        Ok(counters)
    }

    /// The random numbers of a path. Their seed is none that pixels have.
    #[inline]
    fn sampler(&self, map: u32, number: u32) -> Sampler {
        const PHOTONS: u64 = 0x7068_6f74_6f6e_7321;
        let seed = mix(PHOTONS ^ u64::from(self.settings.seed)) as u32;
        Sampler::replicate(seed, map >> 1, map & 1, number)
    }

    /// One vertex: what the path of `ray` met. The ray by which it goes on.
    fn meet(
        &self,
        state: &mut State,
        sampler: &Sampler,
        ray: &Ray,
        hit: &Hit,
        pile: &mut Pile,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let scene = self.scene;
        let point = SurfacePoint::at::<F>(scene, ray, hit).filter(|_| hit.is_some())?;
        let direction = Vec3::from(ray.direction);
        let passes = F::CUTOUT && point.material.has_cutout() && {
            let opacity = point.material.opacity.at::<F>(scene, point.uv);
            sampler.single(CROSSING + state.crossings) >= opacity
        };
        if passes || hit.triangle == state.triangle {
            if state.crossings >= MAX_CROSSINGS {
                counters.dropped.unfinished += 1;
                return None;
            }
            state.crossings += 1;
            state.triangle = hit.triangle;
            return Some(point.spawn(direction));
        }
        let max_depth = self.settings.max_depth;
        if state.segments >= max_depth {
            return None;
        }
        let bsdf = Bsdf::at::<F>(scene, point.material, point.uv, point.front);
        let power = Rgb::from(state.power);
        let holds = holds_photons(&bsdf);
        let leaves = holds && (state.segments > 1 || self.settings.keep == Keep::All);
        if leaves {
            let photon = Photon::new(point.position, -direction, point.geometric_normal, power);
            pile.leave(photon, counters);
        }
        let ends = self.settings.keep == Keep::Caustic && (holds || !focuses(&bsdf));
        if ends || state.segments + 1 >= max_depth {
            return None;
        }

        let from = point.frame.to_local(-direction);
        let first = vertex(state.segments);
        let [u, v] = sampler.pair(first + SCATTERING);
        let lobe = if F::GLOSSY || F::DIELECTRIC { sampler.single(first + LOBE) } else { 0.0 };
        let sample = bsdf.sample::<F>(from, [u, v, lobe])?;
        let towards = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, towards) {
            return None;
        }
        // Power is not squeezed by refraction, as radiance is; and where the shading normal is not that of the
        // triangle, it is the other cosine that counts (Veach 1997, sections 5.2 and 5.3).
        let mut next = power * sample.weight * (sample.eta * sample.eta);
        if point.frame.normal != point.geometric_normal {
            let flat = |way: Vec3| way.dot(point.geometric_normal).abs();
            next *= from.z * flat(towards) / (flat(direction) * sample.direction.z.abs());
        }
        // Power that goes on is the same where it can be: what is absorbed ends paths.
        let most = if leaves { MOST } else { 1.0 };
        let survival = (next.max_element() / power.max_element()).min(most);
        if !(survival > 0.0 && sampler.single(first + ROULETTE) < survival && next.is_finite()) {
            return None;
        }
        if state.segments >= MAX_VERTICES {
            counters.dropped.unfinished += 1;
            return None;
        }
        state.power = (next / survival).to_array();
        state.segments += 1;
        state.triangle = hit.triangle;
        Some(point.spawn(towards))
    }
}
