//! Light paths for caustics: from the lights by mirrors and glass to the first rough surface, where a photon is left
//! (Jensen 1996), weighted for the paths from the eye that it shares its light with (`merge.rs`).
//!
//! All photons of a task advance together, so that the tracer sees batches of rays. Photon `i` of map `n` follows from
//! (seed, n, i) alone. A path ends at the first rough surface, but for what a smooth coat mirrors there.

use super::estimator::{Counters, MAX_CROSSINGS, MAX_VERTICES};
use super::merge::{ChainLink, Discs, ends_chain};
use super::shoot::ShootSettings;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::bvh::{Bvh, Coherence};
use crate::geometry::{Hit, Ray};
use crate::light::{EMISSION_DIMENSIONS, Emission, Found, Lights, luminance, throws};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::photon::Photon;
use crate::sampling::{Sampler, mix};
use crate::scene::{Scene, SurfacePoint};
use crate::{Level, Rgb};
use bytemuck::{Pod, Zeroable};
use core::marker::PhantomData;
use glam::Vec3;

/// Light paths of a task.
pub const PATHS: usize = 1024;

/// Photons that a task has room for: coats that mirror let a path leave two on average at most.
pub const ROOM: usize = 3 * PATHS;

/// Probability with which a path goes on, at most, where it leaves a photon.
const MOST: f32 = 0.5;

/// Photons of less weight than this are left so much less often, with this weight: paths find their light.
const LEAST_WEIGHT: f32 = 0.1;

/// What light outside of the picture, or hidden from the eye, counts: some of it comes back.
const INDIRECT: f32 = 0.02;

/// Surfaces of glass between the eye and what it sees, at most, and how far from both ends it is looked for them, in
/// shares of the distance.
const MOST_GLASS: u32 = 16;
const NEAR: f32 = 1e-4;

/// Dimensions of the sampler at a vertex: where the path goes on, by which lobe, whether it does, whether it leaves
/// its photon.
const SCATTERING: u32 = 0;
const LOBE: u32 = 1;
const ROULETTE: u32 = 2;
const LEAVING: u32 = 3;

/// Whether the `n`th surface with a cut-out is met: `CROSSING + n`.
const CROSSING: u32 = 1 << 31;

/// The first dimension of the vertex at the end of the `n`th segment.
const fn vertex(n: u32) -> u32 {
    EMISSION_DIMENSIONS + 4 * (n - 1)
}

/// Shoots photons of caustics: a pass of tasks of [`PATHS`] paths.
#[derive(Clone, Copy)]
pub struct CausticShooter<'a, F> {
    scene: &'a Scene<'a>,
    bvh: &'a Bvh<'a>,
    lights: &'a Lights<'a>,
    emission: &'a Emission<'a>,
    settings: ShootSettings,
    discs: Discs,
    /// Pixels across and down.
    frame: [u32; 2],
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
    /// Which light it left, and where.
    light: u32,
    origin: [f32; 3],
    /// From which cell of the guide.
    cell: u32,
    /// R / (π² r² N) so far.
    chain: f32,
    /// Root of the sum of squares of the densities of the path tracer's techniques, over that of which `chain` tells:
    /// 1 where that is the only one, 0 where there is none.
    others: f32,
}

/// What became of a light path: what its photons are worth, and from which cell of the guide it came.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Find {
    /// Its cell.
    pub cell: u32,
    /// Zero where nothing was left.
    pub worth: f32,
}

impl<'a, F: Features> CausticShooter<'a, F> {
    /// A shooter over frozen structures, for photons that will be gathered from `discs` in a picture of so many pixels
    /// across and down. `F` has at least the features
    /// of the scene.
    pub fn new(
        (scene, bvh, lights): (&'a Scene<'a>, &'a Bvh<'a>, &'a Lights<'a>),
        emission: &'a Emission<'a>,
        settings: ShootSettings,
        (discs, frame): (Discs, [u32; 2]),
        level: Level,
    ) -> Self {
        Self { scene, bvh, lights, emission, settings, discs, frame, level, features: PhantomData }
    }

    /// Number of tasks of a map.
    pub fn tasks(&self) -> usize {
        (self.settings.paths as usize).div_ceil(PATHS)
    }

    /// Working memory of one task.
    pub fn scratch() -> Footprint {
        Footprint::default().slice::<State>(PATHS).slice::<Ray>(PATHS).slice::<Hit>(PATHS)
    }

    /// Shoots the photons of task `task` of map number `map` (below 2^31). All of `out` is written; what is not needed,
    /// with photons of no place, which a map refuses. Room for [`ROOM`] is enough.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `scratch` has less than [`CausticShooter::scratch`] bytes.
    pub fn run(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Photon],
    ) -> Result<Counters, OutOfMemory> {
        let (mut count, mut lost) = (0, 0);
        let mut counters = self.shoot(task, map, scratch, &mut |_, photon| match out.get_mut(count) {
            Some(slot) => {
                *slot = photon;
                count += 1;
            }
            None => lost += 1,
        })?;
        counters.dropped.unfinished += lost;
        out[count..].fill(Photon::NONE);
        Ok(counters)
    }

    /// Shoots the same photons to see where those are from that show in the picture. `out` gets one for each path, up
    /// to [`PATHS`].
    ///
    /// # Errors
    /// As [`CausticShooter::run`].
    pub fn look(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        out: &mut [Find],
    ) -> Result<Counters, OutOfMemory> {
        let first = (task * PATHS) as u32;
        out.fill(Find::default());
        self.shoot(task, map, scratch, &mut |state, photon| {
            if let Some(find) = out.get_mut((state.number - first) as usize) {
                let worth = luminance(photon.power()) * self.importance(photon.position());
                *find = Find { cell: state.cell, worth: find.worth + worth };
            }
        })
    }

    /// About how much of the light at `place` gets into the picture, relative to others.
    fn importance(&self, place: Vec3) -> f32 {
        let camera = &self.scene.camera;
        let to_eye = camera.eye - place;
        let pixels = 1.0 / self.discs.radius(place);
        let importance = pixels * pixels;
        let seen = -to_eye;
        let depth = seen.dot(camera.forward) * camera.tan_half_fov;
        let [width, height] = [self.frame[0] as f32, self.frame[1] as f32];
        let inside = depth > 0.0
            && seen.dot(camera.up).abs() <= depth
            && seen.dot(camera.right).abs() * height <= depth * width;
        if !inside {
            return importance * INDIRECT;
        }
        // What is seen through glass is seen.
        let mut ray = Ray::segment(place + NEAR * to_eye, (1.0 - NEAR) * to_eye, 1.0);
        for _ in 0..MOST_GLASS {
            let hit = self.bvh.nearest(self.level, &ray);
            let Some(point) = SurfacePoint::at::<F>(self.scene, &ray, &hit).filter(|_| hit.is_some()) else {
                return importance;
            };
            if !throws(point.material) {
                break;
            }
            ray = point.spawn_to(camera.eye);
        }
        importance * INDIRECT
    }

    /// Shoots the photons of a task to `leave`.
    fn shoot(
        &self,
        task: usize,
        map: u32,
        scratch: &mut Arena,
        leave: &mut dyn FnMut(&State, Photon),
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let states = arena.slice::<State>(PATHS)?;
        let rays = arena.slice::<Ray>(PATHS)?;
        let hits = arena.slice::<Hit>(PATHS)?;
        let mut counters = Counters::default();
        let first = task * PATHS;
        let paths = (self.settings.paths as usize).saturating_sub(first).min(PATHS);
        let mut active = 0;
        for (i, state) in states.iter_mut().enumerate().take(paths) {
            let number = (first + i) as u32;
            let sampler = self.sampler(map, number);
            if let Some(emitted) = self.emission.emit(self.scene, self.lights, &sampler) {
                *state = State {
                    power: (emitted.power / self.settings.paths as f32).to_array(),
                    number,
                    segments: 1,
                    triangle: emitted.triangle,
                    light: emitted.light,
                    cell: emitted.cell,
                    origin: emitted.ray.origin,
                    ..State::default()
                };
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
                if let Some(next) = self.meet(state, &sampler, &ray, &hit, leave, &mut counters) {
                    rays[going_on] = Ray { tag: ray.tag, ..next };
                    going_on += 1;
                }
            }
            active = going_on;
        }
        Ok(counters)
    }

    /// The random numbers of a path. Their seed is none that pixels have.
    #[inline]
    fn sampler(&self, map: u32, number: u32) -> Sampler {
        const CAUSTICS: u64 = 0x6361_7573_7469_6373;
        let seed = mix(CAUSTICS ^ u64::from(self.settings.seed)) as u32;
        Sampler::replicate(seed, map >> 1, map & 1, number)
    }

    /// One vertex: what the path of `ray` met. The ray by which it goes on.
    fn meet(
        &self,
        state: &mut State,
        sampler: &Sampler,
        ray: &Ray,
        hit: &Hit,
        leave: &mut dyn FnMut(&State, Photon),
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
        let first = vertex(state.segments);
        let ends = ends_chain(&bsdf);
        let leaves = ends && state.segments > 1;
        if leaves {
            let (weight, chance) = self.weight(state, point.position);
            if sampler.single(first + LEAVING) < chance {
                let power = power * (weight / chance);
                let photon = Photon::new(point.position, -direction, point.geometric_normal, power);
                leave(state, photon);
            }
        }
        if state.segments + 1 >= max_depth {
            return None;
        }

        let from = point.frame.to_local(-direction);
        let [u, v] = sampler.pair(first + SCATTERING);
        let lobe = if F::GLOSSY || F::DIELECTRIC { sampler.single(first + LOBE) } else { 0.0 };
        let sample = bsdf.sample::<F>(from, [u, v, lobe]).filter(|sample| sample.delta || !ends)?;
        let towards = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, towards) {
            return None;
        }
        self.link(state, &point, &bsdf, from, &sample, -direction);
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

    /// The share that photons have in the light of this path at `place`, and the probability with which one is left.
    fn weight(&self, state: &State, place: Vec3) -> (f32, f32) {
        let ratio = state.others / (self.discs.reach(place, self.settings.paths as f32) * state.chain);
        let weight = 1.0 / (1.0 + ratio * ratio);
        // Zero over zero: without any other technique photons have it all.
        let weight = if state.others == 0.0 { 1.0 } else { weight };
        (weight, (weight / LEAST_WEIGHT).min(1.0))
    }

    /// Takes note of what a surface does with the densities of both ways, at the first of a path also of how the path
    /// tracer finds its light.
    fn link(
        &self,
        state: &mut State,
        point: &SurfacePoint,
        bsdf: &Bsdf,
        from: Vec3,
        sample: &BsdfSample,
        to_light: Vec3,
    ) {
        // The way back, as the path tracer goes it.
        let there = ChainLink { point, bsdf, near: from, far: sample.direction };
        let back = if sample.delta { 1.0 } else { there.density::<F>(self.scene) };
        if state.segments == 1 {
            (state.chain, state.others) =
                self.first(state, point, bsdf, (!sample.delta).then_some(back), to_light);
        }
        state.chain *= if sample.delta {
            sample.eta * sample.eta
        } else {
            sample.pdf / back * (from.z / sample.direction.z).abs()
        };
    }

    /// `chain` and `others` before the first surface: `back` is the density of the direction to the light, where it is
    /// not the only one.
    fn first(
        &self,
        state: &State,
        point: &SurfacePoint,
        bsdf: &Bsdf,
        back: Option<f32>,
        to_light: Vec3,
    ) -> (f32, f32) {
        let Self { scene, lights, emission, .. } = *self;
        let normal = if F::DIELECTRIC && bsdf.transmits() { Vec3::ZERO } else { point.frame.normal };
        let position = point.position;
        let with = |chosen: f32| back.map_or(0.0, |back| chosen / back);
        let by_chance = |chosen: f32| libm::sqrtf(1.0 + with(chosen) * with(chosen));
        match emission.found(lights, state.light) {
            Found::OnSurface => {
                let density = emission.density_of_emitter(scene, lights, state.light as usize, -to_light);
                let chosen = match (back, lights.triangle_of(state.light)) {
                    (Some(_), Some(triangle)) => {
                        let distance = position.distance(state.origin.into());
                        lights.pdf_hit(scene, position, normal, triangle, distance, to_light)
                    }
                    _ => 0.0,
                };
                (density, by_chance(chosen))
            }
            Found::InSky => {
                let density = emission.density_of_sky(scene, lights, to_light, position);
                let chosen = match back {
                    Some(_) => lights.pdf_escape(scene, position, normal, to_light),
                    None => 0.0,
                };
                (density, by_chance(chosen))
            }
            Found::ByChoice => {
                let density = emission.density_of_choice(scene, lights, state.light, position);
                (density, with(lights.probability(state.light, position, normal)))
            }
        }
    }
}
