//! Irradiance at points by path tracing: each path starts at a point as if at a white diffuse surface, which
//! reflects irradiance / π.
//!
//! The plain algorithm is [`crate::transport::path::reference::irradiance`]; both compute the same bits.
//! Departures from it:
//! 1. The light of few delta lights is the same in all samples of a point: it is evaluated once for a call.
//! 2. The paths behind the points advance as those of pixels do.

use super::PathIntegrator;
use super::estimator::{LightEstimator, PathVertex, RemainingLight};
use super::points::{IrradiancePoint, LightPart, WHITE};
use super::scalar::Path;
use super::sharing::{PathMemory, PathWave};
use crate::Rgb;
use crate::bsdf::Features;
use crate::bvh::Coherence;
use crate::film::Pixel;
use crate::geometry::{MISS, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::block::Block;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::dimension;
use crate::transport::walk::path_classes::PathClasses;
use crate::transport::wavefront::{PathState, Wavefront};
use bytemuck::Zeroable;
use core::f32::consts::PI;
use core::ops::Range;
use glam::Vec3;
use halflight_simd::kernels::shade::BLOCK;

impl<'a, F: Features, E: LightEstimator<F>> PathIntegrator<'a, F, E> {
    /// Scratch memory of [`PathIntegrator::sample_irradiance`] beside that of a wave.
    pub fn scratch_of_points(points: usize) -> Footprint {
        Footprint::default().slice::<[f32; 3]>(points)
    }

    /// Traces `samples` of each of `points` and adds their irradiance in W/m² to `out`, in the order of
    /// `points`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if `scratch` has less than [`PathIntegrator::scratch_with`] and
    /// [`PathIntegrator::scratch_of_points`] bytes.
    #[inline(never)]
    pub fn sample_irradiance(
        &self,
        (points, part): (&[IrradiancePoint], LightPart),
        samples: Range<u32>,
        wave: usize,
        scratch: &mut Arena,
        out: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        let mut arena = scratch.scratch();
        let lights = self.context.lights;
        let has_few = lights.few_delta_lights() > 0 && part != LightPart::Indirect;
        let certain = arena.slice::<[f32; 3]>(if has_few { points.len() } else { 0 })?;
        let most = samples.len().saturating_mul(points.len());
        let mut wave = PathWave::<E::State, ()>::new(wave.min(most), &mut arena)?;
        let mut counters = Counters::default();
        let mut at_points = *self;
        if has_few {
            at_points.context.lights = lights.without_delta_lights();
            self.light_of_delta_lights(points, &mut wave.wave, certain, &mut counters);
        }
        let each = |sample| points.iter().zip(0..).map(move |(point, place)| (point.number, place, sample));
        let mut all = samples.flat_map(each).peekable();
        while all.peek().is_some() {
            let mut count = 0;
            for (number, place, sample) in all.by_ref().take(wave.wave.paths.len()) {
                let path = &mut wave.wave.paths[count];
                path.begin(number, place, sample, PathClasses::ALL);
                if let Some(certain) = certain.get(place as usize) {
                    path.radiance = *certain;
                }
                wave.begin(count, 0);
                count += 1;
            }
            counters.paths += count as u64;
            at_points.leave_points((points, part), &mut wave, count, &mut counters);
            self.trace_from_points(&mut wave, &mut counters);
            for i in 0..count {
                let path = wave.wave.paths[i];
                let Some(pixel) = out.get_mut(path.place as usize) else { continue };
                if pixel.add(path.sample, wave.radiance(i) * PI, &mut counters.dropped) {
                    pixel.add_blur(path.sample, Rgb::from(path.blur) * PI);
                }
            }
        }
        Ok(counters)
    }

    /// Writes the radiance that white surfaces at `points` reflect of the delta lights to `certain`. Shadow
    /// rays are traced by lights, so that their order is that of the lights for any wave.
    fn light_of_delta_lights(
        &self,
        points: &[IrradiancePoint],
        wave: &mut Wavefront,
        certain: &mut [[f32; 3]],
        counters: &mut Counters,
    ) {
        certain.fill([0.0; 3]);
        let SceneContext { scene, lights, .. } = &self.context;
        if self.settings.max_depth < 2 {
            return;
        }
        let capacity = wave.paths.len().max(1);
        for light in 0..lights.few_delta_lights() {
            for (points, certain) in points.chunks(capacity).zip(certain.chunks_mut(capacity)) {
                for (i, (point, path)) in points.iter().zip(wave.paths.iter_mut()).enumerate() {
                    *path = PathState::new(point.number, i as u32, 0, PathClasses::ALL);
                    let point = point.surface();
                    let Some(sample) = lights.delta_light(scene, light, point.position) else { continue };
                    let wi = point.frame.to_local(sample.direction);
                    let (f, _) = WHITE.evaluate::<F>(Vec3::Z, wi);
                    if !point.sides_agree(wi, sample.direction) || f == Rgb::ZERO {
                        continue;
                    }
                    if let Some(ray) = self.context.shadow_ray(&point, &sample) {
                        wave.shadows.push(Ray { tag: i as u32, ..ray }, f * sample.radiance);
                    }
                }
                wave.trace_shadow_rays(&self.context, counters);
                for (certain, path) in certain.iter_mut().zip(&*wave.paths) {
                    *certain = (Rgb::from(*certain) + Rgb::from(path.radiance)).to_array();
                }
            }
        }
    }

    /// Takes the light samples and the next directions at the points of the first `count` paths.
    fn leave_points(
        &self,
        (points, part): (&[IrradiancePoint], LightPart),
        wave: &mut PathWave<E::State, ()>,
        count: usize,
        counters: &mut Counters,
    ) {
        wave.wave.next = 0;
        if self.settings.max_depth < 2 {
            return;
        }
        let most =
            (self.estimator.light_samples(&self.context) + self.estimator.connections()).max(1) as usize;
        let step = (wave.wave.shadows.rays.len() / most).clamp(1, BLOCK);
        let has_lanes = self.context.has_lanes() && !self.estimator.weighs_samples(&WHITE);
        let mut block = has_lanes.then(Block::new);
        for start in (0..count).step_by(step) {
            let range = start..count.min(start + step);
            if wave.wave.shadows.count + most * range.len() > wave.wave.shadows.rays.len() {
                wave.wave.trace_shadow_rays(&self.context, counters);
            }
            let mut surfaces = [const { None }; BLOCK];
            for (surface, path) in surfaces.iter_mut().zip(&wave.wave.paths[range.clone()]) {
                *surface = points.get(path.place as usize).map(IrradiancePoint::surface);
            }
            let mut found = [E::Found::default(); BLOCK];
            if E::LOOKS_UP_POINTS {
                range.clone().for_each(|i| wave.wave.rays[i].tag = i as u32);
                let (scene, range) = ((&self.context, &self.settings), range.clone());
                self.estimator.look_up(scene, (&wave.wave, range), &surfaces, &mut found, counters);
            }
            let starts = Starts { surfaces: &surfaces, found: &found, part, first: start };
            match &mut block {
                Some(block) => self.leave_in_block(block, &starts, wave, counters),
                None => self.leave_singly(&starts, wave, counters),
            }
        }
        wave.wave.trace_shadow_rays(&self.context, counters);
    }

    /// Follows the paths that have left their points to their ends.
    fn trace_from_points(&self, wave: &mut PathWave<E::State, ()>, counters: &mut Counters) {
        let count = wave.wave.next;
        wave.wave.trace(&self.context, count, Coherence::Incoherent, counters);
        self.trace_to_end(wave, count, counters);
    }

    /// The start of path number `i` at its `point`.
    pub(super) fn start_vertex<'v>(
        &self,
        i: usize,
        path: &PathState,
        point: &'v SurfacePoint<'a>,
    ) -> PathVertex<'v, 'a> {
        PathVertex {
            path: i,
            pixel: path.pixel,
            sample: path.sample,
            point,
            bsdf: WHITE,
            sampler: Sampler::new(self.settings.seed, path.pixel, path.sample),
            first: dimension::vertex(1),
            segments: 1,
            wo: Vec3::Z,
            normal: point.frame.normal,
            distance: 0.0,
            travelled: 0.0,
            throughput: Rgb::ONE,
            apart: false,
            came: path.classes,
            rest: path.classes,
        }
    }

    /// Light that a path has to find from its start, after the light that was `found` there.
    pub(super) fn rest_at_start(
        &self,
        path: Path<E::State, ()>,
        vertex: &PathVertex,
        (part, found): (LightPart, E::Found),
    ) -> RemainingLight {
        // Photons have the light of surfaces: a path from a free point begins as one from a camera.
        let rest = match is_free::<F, E>(vertex.point) {
            true => RemainingLight::all(vertex),
            false => self.known(path, vertex, found),
        };
        part.rest(rest)
    }

    /// Light samples and next rays of paths at their points, one by one.
    fn leave_singly(
        &self,
        starts: &Starts<'_, 'a, E::Found>,
        PathWave { wave, memory }: &mut PathWave<E::State, ()>,
        counters: &mut Counters,
    ) {
        let mut none = (E::State::zeroed(), ());
        for (k, point) in starts.surfaces.iter().enumerate() {
            let (Some(point), i) = (point, starts.first + k) else { continue };
            let Some(path) = memory.path(wave.paths, i, &mut none) else { continue };
            let vertex = self.start_vertex(i, path.path, point);
            let rest = self.rest_at_start(path, &vertex, (starts.part, starts.found[k]));
            let state = memory.states.get(i).unwrap_or(&none.0);
            let left = self.context.lights.fraction_left(point.position, point.frame.normal);
            let lit = PathVertex { throughput: Rgb::splat(left), ..vertex };
            self.direct((state, &mut ()), &lit, &rest, wave);
            if rest.ends {
                continue;
            }
            let Some(path) = memory.path(wave.paths, i, &mut none) else { continue };
            if let Some(ray) = self.scatter(path, &vertex, &rest, counters) {
                wave.push_ray(i, ray);
            }
            self.clear_free(memory, i, point);
        }
    }

    /// A path from a free `point` goes on as one from a camera.
    pub(super) fn clear_free(&self, memory: &mut PathMemory<E::State, ()>, i: usize, point: &SurfacePoint) {
        if let Some(state) = memory.states.get_mut(i).filter(|_| is_free::<F, E>(point)) {
            *state = E::State::zeroed();
        }
    }
}

/// True if the estimator has nothing to look up at `point`.
fn is_free<F: Features, E: LightEstimator<F>>(point: &SurfacePoint) -> bool {
    point.triangle == MISS && !E::LOOKS_UP_POINTS
}

impl LightPart {
    /// The part of the `rest` of the light at a point that is of this part.
    pub(super) fn rest(self, rest: RemainingLight) -> RemainingLight {
        match self {
            Self::All => rest,
            Self::Direct => RemainingLight::of(PathClasses::EMITTED),
            Self::Indirect => {
                rest.and(RemainingLight { is_lit: true, ..RemainingLight::of(PathClasses::SCATTERED) })
            }
        }
    }
}

/// Starts of the paths of a block.
pub(super) struct Starts<'s, 'a, L> {
    /// Their points.
    pub(super) surfaces: &'s [Option<SurfacePoint<'a>>; BLOCK],
    /// Results of the look-ups of the estimator there.
    pub(super) found: &'s [L; BLOCK],
    pub(super) part: LightPart,
    /// Number of the first path.
    pub(super) first: usize,
}
