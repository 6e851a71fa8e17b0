//! Shading vertex by vertex: at levels without lanes, and the reference of `lanes`, whose kernels shade a
//! block of sixteen. The steps are in textbook order for the whole block: escape and emission, light of the
//! estimator, next-event estimation (`direct.rs`), next direction by BSDF sampling and Russian roulette.

use super::PathIntegrator;
use super::estimator::{EmissionHit, KnownLight, LightEstimator, PathVertex, RemainingLight};
use super::sharing::PathMemory;
use super::sharing::Sharing;
use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::{Hit, Ray};
use crate::light::emitted;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::block::Block;
use crate::transport::walk::dimension;
use crate::transport::walk::mis::{environment_heuristic, power_heuristic};
use crate::transport::walk::termination::{continuation_probability, is_cut};
use crate::transport::wavefront::{BLOCK, PathState, Shade, Wavefront};
use bytemuck::Zeroable;
use core::ops::Range;
use glam::Vec3;

/// Path tracer and the memory of a wave beside the wavefront.
pub(super) struct Shading<'i, 'a, 'm, F: Features, E: LightEstimator<F>, R: Sharing> {
    pub(super) integrator: &'i PathIntegrator<'a, F, E, R>,
    pub(super) memory: &'i mut PathMemory<'m, E::State, R>,
    pub(super) block: Block<'a>,
}

/// One path of a wave, with the states of the estimator and of sharing.
pub(super) struct Path<'p, S, T> {
    pub(super) path: &'p mut PathState,
    pub(super) state: &'p mut S,
    pub(super) shared: &'p mut T,
}

impl<F: Features, E: LightEstimator<F>, R: Sharing> Shade for Shading<'_, '_, '_, F, E, R> {
    fn shadow_rays(&self) -> usize {
        let PathIntegrator { context, estimator, .. } = self.integrator;
        (estimator.light_samples(context) + estimator.connections()) as usize
    }

    fn shade(&mut self, wave: &mut Wavefront, range: Range<usize>, counters: &mut Counters) {
        if self.integrator.context.has_lanes() {
            return self.shade_block(wave, range, counters);
        }
        let Self { integrator, memory, .. } = self;
        let PathIntegrator { context, settings, estimator, .. } = integrator;
        // Placeholders of stateless estimators and sharing rules.
        let mut none = (E::State::zeroed(), R::State::zeroed());

        let mut points = [const { None }; BLOCK];
        for (point, i) in points.iter_mut().zip(range.clone()) {
            *point = context.surface_at(&wave.rays[i], &wave.hits[i]);
        }
        let mut found = [E::Found::default(); BLOCK];
        estimator.look_up((context, settings), (wave, range.clone()), &points, &mut found, counters);

        let mut vertices = [const { None }; BLOCK];
        for (((vertex, point), found), i) in vertices.iter_mut().zip(&points).zip(&found).zip(range) {
            let (ray, hit) = (wave.rays[i], wave.hits[i]);
            let index = ray.tag as usize;
            let Some(path) = memory.path(wave.paths, index, &mut none) else { continue };
            match integrator.arrive(path, (&ray, &hit), (point.as_ref(), found), counters) {
                Ok(met) => *vertex = Some(met),
                Err(Some(through)) => wave.push_ray(index, through),
                Err(None) => {}
            }
        }
        let mut rests = [const { None }; BLOCK];
        for ((rest, vertex), found) in rests.iter_mut().zip(&vertices).zip(found) {
            let Some(vertex) = vertex else { continue };
            let Some(path) = memory.path(wave.paths, vertex.path, &mut none) else { continue };
            *rest = Some(integrator.known(path, vertex, found));
        }
        let lit = || vertices.iter().flatten().zip(rests.iter().flatten());
        for (vertex, rest) in lit() {
            let state = memory.states.get_mut(vertex.path).unwrap_or(&mut none.0);
            let shared = memory.shared.get_mut(vertex.path).unwrap_or(&mut none.1);
            integrator.direct((&*state, &mut *shared), vertex, rest, wave);
            if R::may_connect(shared) {
                let tag = vertex.path as u32;
                let mut push = |ray, light| wave.push_shadow_ray(Ray { tag, ..ray }, light);
                estimator.connect((context, settings), vertex, state, &mut push);
            }
        }
        for (vertex, rest) in lit().filter(|(vertex, rest)| !rest.ends || vertex.apart) {
            let Some(path) = memory.path(wave.paths, vertex.path, &mut none) else { continue };
            if let Some(ray) = integrator.scatter(path, vertex, rest, counters) {
                wave.push_ray(vertex.path, ray);
            }
        }
    }
}

impl<S, R: Sharing> PathMemory<'_, S, R> {
    /// Path `index` of the wave; `none` replaces missing states.
    #[inline]
    pub(super) fn path<'p>(
        &'p mut self,
        paths: &'p mut [PathState],
        index: usize,
        none: &'p mut (S, R::State),
    ) -> Option<Path<'p, S, R::State>> {
        Some(Path {
            path: paths.get_mut(index)?,
            state: self.states.get_mut(index).unwrap_or(&mut none.0),
            shared: self.shared.get_mut(index).unwrap_or(&mut none.1),
        })
    }
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Adds the emission at the hit of `ray` and prepares the scattering vertex. `Err` if there is none:
    /// `Some` next ray behind a skipped surface, or `None` if the path ends.
    #[inline]
    fn arrive<'v>(
        &self,
        Path { path, state, shared }: Path<E::State, R::State>,
        (ray, hit): (&Ray, &Hit),
        (point, found): (Option<&'v SurfacePoint<'a>>, &E::Found),
        counters: &mut Counters,
    ) -> Result<PathVertex<'v, 'a>, Option<Ray>> {
        R::resume(shared, path);
        if !hit.is_some() {
            self.escape(path, state, ray);
            return Err(None);
        }
        let point = point.ok_or(None)?;
        let segments = u32::from(path.segments);
        let direction = Vec3::from(ray.direction);
        let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);

        // A camera on a surface does not see the back of that surface.
        let opacity = || sampler.single(dimension::opacity(segments, u32::from(path.crossings)));
        if segments == 1 && point.is_left_by(ray)
            || self.context.is_skipped(point, hit, path.triangle, opacity)
        {
            return Err(path.skip_surface(point.spawn(direction), hit.triangle, counters));
        }
        self.emission(path, state, point, direction);
        if segments >= self.settings.max_depth {
            return Err(None);
        }
        let bsdf = self.context.bsdf_at(point);
        if path.classes.ends_at(&bsdf) {
            return Err(None);
        }
        self.enter((path, state, shared), point, &bsdf)?;
        Ok(self.vertex(path, (ray, point), (bsdf, found)))
    }

    /// Prepares a path to scatter at `point`. `Err` if it ends.
    #[inline]
    pub(super) fn enter(
        &self,
        (path, state, shared): (&mut PathState, &E::State, &mut R::State),
        point: &SurfacePoint,
        bsdf: &Bsdf,
    ) -> Result<(), Option<Ray>> {
        if path.segments > 1 {
            let share = self.estimator.share_left(state, path.position.into(), (point, bsdf));
            if share == 0.0 {
                return Err(None);
            }
            path.throughput = (share * Rgb::from(path.throughput)).to_array();
        }
        R::arrive(shared, point, bsdf, path);
        Ok(())
    }

    /// Vertex of `path` at the end of `ray`.
    #[inline]
    pub(super) fn vertex<'v>(
        &self,
        path: &PathState,
        (ray, point): (&Ray, &'v SurfacePoint<'a>),
        (bsdf, found): (Bsdf, &E::Found),
    ) -> PathVertex<'v, 'a> {
        let segments = u32::from(path.segments);
        let near = if segments == 1 { self.context.scene.camera.eye } else { path.position.into() };
        let distance = near.distance(point.position);
        PathVertex {
            path: ray.tag as usize,
            pixel: path.pixel,
            sample: path.sample,
            point,
            sampler: Sampler::new(self.settings.seed, path.pixel, path.sample),
            first: dimension::vertex(segments),
            segments,
            wo: point.frame.to_local(-Vec3::from(ray.direction)),
            normal: if F::DIELECTRIC && bsdf.transmits() { Vec3::ZERO } else { point.frame.normal },
            distance,
            travelled: path.travelled + distance,
            throughput: path.throughput.into(),
            apart: F::GLOSSY && self.estimator.separates_coat(&self.context, &bsdf, found),
            came: path.classes,
            rest: path.classes.behind(&bsdf),
            bsdf,
        }
    }

    /// Adds radiance of the environment along the escaping ray.
    pub(super) fn escape(&self, path: &mut PathState, state: &E::State, ray: &Ray) {
        let scene = self.context.scene;
        let Some(environment) = scene.environment.as_ref().filter(|_| path.classes.has_environment()) else {
            return;
        };
        let (position, direction) = (Vec3::from(path.position), Vec3::from(ray.direction));
        let radiance = environment.radiance(scene, direction);
        let mut weight = 1.0;
        if path.pdf < f32::INFINITY && radiance != Rgb::ZERO {
            let pdf = self.context.lights.pdf_escape(scene, position, path.normal.into(), direction);
            weight = environment_heuristic(&self.context.lights, path.pdf, pdf);
        }
        let hit = EmissionHit::Environment { direction, position };
        let weight = self.estimator.weight_hit(&self.context, state, hit, weight);
        path.add(Rgb::from(path.throughput) * radiance * weight);
    }

    /// Adds emission of the surface at `point`.
    #[inline]
    pub(super) fn emission(
        &self,
        path: &mut PathState,
        state: &E::State,
        point: &SurfacePoint,
        direction: Vec3,
    ) {
        if !(point.material.emits() && path.classes.has_emission()) {
            return;
        }
        let (scene, triangle) = (self.context.scene, point.triangle);
        let radiance = emitted(scene, triangle, point.uv, point.front);
        if radiance == Rgb::ZERO {
            return;
        }
        let position = Vec3::from(path.position);
        let mut weight = 1.0;
        if path.pdf < f32::INFINITY {
            let distance = position.distance(point.position);
            let normal = path.normal.into();
            let pdf = self.context.lights.pdf_hit(scene, position, normal, triangle, distance, direction);
            weight = power_heuristic(path.pdf, pdf);
        }
        let hit = EmissionHit::Surface { triangle, position: point.position, direction: -direction };
        let weight = self.estimator.weight_hit(&self.context, state, hit, weight);
        path.add(Rgb::from(path.throughput) * radiance * weight);
    }

    /// Adds light that the estimator supplies at `vertex`. Returns the light that the path still has to find.
    #[inline]
    pub(super) fn known(
        &self,
        Path { path, state, shared }: Path<E::State, R::State>,
        vertex: &PathVertex,
        found: E::Found,
    ) -> RemainingLight {
        let mut add = |KnownLight { contribution, blur }: KnownLight| {
            // Not shared: other paths look up the data structure at their own vertices.
            R::add_own(shared, path, contribution);
            path.blur = (Rgb::from(path.blur) + R::throughput(shared, vertex.throughput) * blur).to_array();
        };
        self.estimator.at_vertex((&self.context, &self.settings), vertex, state, found, &mut add)
    }

    /// Next ray of the path from `vertex`, if the path survives, to find the `rest` of the light.
    #[inline]
    pub(super) fn scatter(
        &self,
        Path { path, state, shared }: Path<E::State, R::State>,
        vertex: &PathVertex,
        rest: &RemainingLight,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let PathVertex { point, ref bsdf, ref sampler, wo, first, segments, apart, .. } = *vertex;
        let [u, v] = dimension::scattering(sampler, segments);
        let lobe = if F::GLOSSY || F::DIELECTRIC { sampler.single(first + dimension::LOBE) } else { 0.0 };
        let (sample, is_coat) = match apart {
            true => bsdf.sample_apart::<F>(wo, [u, v, lobe], rest.base_weight)?,
            false => bsdf.sample::<F>(wo, [u, v, lobe]).map(|sample| (sample, sample.delta))?,
        };
        R::sample_bsdf(shared, || match is_coat {
            true => Rgb::ZERO,
            false if apart => Rgb::ONE,
            false => bsdf.base_part(wo, sample.direction, sample.weight * sample.pdf),
        });
        path.classes = if is_coat { rest.narrow } else { rest.wide? };
        let mut throughput = vertex.throughput * sample.weight;
        // A coat over a cached base is dark, but all noise of the pixel is its own.
        let is_first_coat = is_coat && rest.base_weight < 1.0 && segments == 1;
        let survives = R::leave(shared, (point, bsdf), throughput, segments) || is_first_coat;
        let direction = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, direction) {
            return None;
        }
        path.eta_squared *= sample.eta * sample.eta;
        let pixel_throughput = R::throughput(shared, throughput) * path.eta_squared;
        let continuation_probability =
            if survives { 1.0 } else { continuation_probability(segments, pixel_throughput) };
        if continuation_probability < 1.0 {
            if sampler.single(first + dimension::ROULETTE) >= continuation_probability {
                return None;
            }
            throughput /= continuation_probability;
        }
        if throughput == Rgb::ZERO {
            return None;
        }
        if is_cut(segments, bsdf, &sample) {
            counters.dropped.unfinished += 1;
            return None;
        }
        self.estimator.scattered(&self.context, vertex, state, (&sample, is_coat));
        path.throughput = throughput.to_array();
        // MIS compares one BSDF sample with n light samples.
        path.pdf = if sample.delta { f32::INFINITY } else { sample.pdf / rest.light_samples as f32 };
        path.position = point.position.to_array();
        path.normal = vertex.normal.to_array();
        path.travelled = vertex.travelled;
        path.segments += 1;
        path.triangle = point.triangle;
        Some(point.spawn(direction))
    }
}
