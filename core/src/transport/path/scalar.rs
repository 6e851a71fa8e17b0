//! The scalar fall-back of shading: the events of one vertex of a path in textbook order, escape, emission,
//! light of the estimator, next-event estimation (`direct.rs`), next direction by BSDF sampling and Russian
//! roulette. `lanes` calls them for vertices that it does not shade in lanes: at levels without lanes all of
//! them, elsewhere those at which an estimator weighs samples.

use super::PathIntegrator;
use super::estimator::{EmissionHit, KnownLight, LightEstimator, PathVertex, RemainingLight};
use super::sharing::{PathMemory, Sharing};
use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::Ray;
use crate::light::emitted;
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::dimension;
use crate::transport::walk::mis::{environment_heuristic, power_heuristic};
use crate::transport::walk::termination::{is_cut, survive};
use crate::transport::walk::vertex::Scatterer;
use crate::transport::wavefront::PathState;
use glam::Vec3;

/// One path of a wave, with the states of the estimator and of sharing.
pub(super) struct Path<'p, S, T> {
    pub(super) path: &'p mut PathState,
    pub(super) state: &'p mut S,
    pub(super) shared: &'p mut T,
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
        let distance = match segments {
            1 => self.context.scene.camera.origin_towards(point.position),
            _ => path.position.into(),
        }
        .distance(point.position);
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
        let radiance = emitted(scene, triangle, &point.attributes, point.front);
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
        let throughput = vertex.throughput * sample.weight;
        // A coat over a cached base is dark, but all noise of the pixel is its own.
        let is_first_coat = is_coat && rest.base_weight < 1.0 && segments == 1;
        let survives = R::leave(shared, (point, bsdf), throughput, segments) || is_first_coat;
        let direction = Scatterer { point, bsdf }.towards(&sample)?;
        path.eta_squared *= sample.eta * sample.eta;
        let pixel_throughput = R::throughput(shared, throughput) * path.eta_squared;
        let roulette = || sampler.single(first + dimension::ROULETTE);
        let survival = if survives { Some(1.0) } else { survive(segments, pixel_throughput, roulette) };
        let throughput = throughput / survival?;
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
