//! Shading of blocks of vertices in lanes, by the kernels of `halflight_simd::kernels::shade`.
//!
//! A stage is either a kernel over all vertices of the block or a loop over them. Loops gather inputs, look
//! up materials, textures, cells of an environment map and estimators, and replace the kernels at rare
//! vertices: normal maps, degenerate triangles, rough dielectrics, textured, point and directional lights.
//! Vertices at which an estimator weighs samples are shaded one by one (`path/scalar.rs`), as all are at
//! levels without lanes. Both compute the same bits.

mod direct;
mod points;
mod scatter;

use super::PathIntegrator;
use super::estimator::{LightEstimator, PathVertex, RemainingLight};
use super::scalar::Path;
use super::sharing::{PathMemory, Sharing};
use crate::bsdf::Features;
use crate::geometry::{Hit, Ray};
use crate::sampling::Sampler;
use crate::scene::SurfacePoint;
use crate::transport::settings::Counters;
use crate::transport::walk::block::{Block, Stages};
use crate::transport::walk::block_stages::Cleared;
use crate::transport::walk::points::Set;
use crate::transport::wavefront::{Shade, Wavefront};
use bytemuck::Zeroable;
use core::ops::Range;
use halflight_simd::kernels::shade::{BLOCK, put};

/// Vertices of a block as an estimator takes them, and the light that it leaves to their paths. None in lanes
/// without an estimator.
struct Estimated<'v, 'a> {
    vertices: [Option<(PathVertex<'v, 'a>, RemainingLight)>; BLOCK],
}

impl<'v, 'a> Estimated<'v, 'a> {
    /// Vertex `i` and the rest of its light.
    #[inline]
    fn at(&self, i: usize) -> Option<&(PathVertex<'v, 'a>, RemainingLight)> {
        self.vertices[i & 15].as_ref()
    }
}

/// Surface points of a block with the results of the lookups of an estimator.
struct Points<'a, L> {
    points: [Option<SurfacePoint<'a>>; BLOCK],
    found: [L; BLOCK],
}

/// Path tracer and the memory of a wave beside the wavefront.
pub(super) struct Shading<'i, 'a, 'm, F: Features, E: LightEstimator<F>, R: Sharing> {
    pub(super) integrator: &'i PathIntegrator<'a, F, E, R>,
    pub(super) memory: &'i mut PathMemory<'m, E::State, R>,
    pub(super) block: Block<'a>,
}

impl<F: Features, E: LightEstimator<F>, R: Sharing> Shade for Shading<'_, '_, '_, F, E, R> {
    fn shadow_rays(&self) -> usize {
        let PathIntegrator { context, estimator, .. } = self.integrator;
        (estimator.light_samples(context) + estimator.connections()) as usize
    }

    fn shade(&mut self, wave: &mut Wavefront, range: Range<usize>, counters: &mut Counters) {
        let Self { integrator, memory, block } = self;
        let PathIntegrator { context, settings, estimator, .. } = integrator;
        let hits = integrator.gather_block(block, memory, wave, range.clone());
        if hits == 0 {
            return;
        }
        let traced = (&wave.rays[range.clone()], &wave.hits[range.clone()]);
        let hits = block.points.compute(context, traced, hits);
        let mut points = Points { points: [const { None }; BLOCK], found: [E::Found::default(); BLOCK] };
        let has_lanes = context.has_lanes();
        if !(E::ADDS_NOTHING && has_lanes) {
            Set(hits).for_each(|i| points.points[i] = Some(block.points.point(i)));
            let Points { points, found } = &mut points;
            estimator.look_up((context, settings), (wave, range.clone()), points, found, counters);
        }
        let mut estimated = Estimated { vertices: [const { None }; BLOCK] };
        let wave_at = (&mut *wave, range.start);
        let (stages, cleared) =
            integrator.arrive_in_block((block, memory), wave_at, (&points, hits), &mut estimated, counters);
        let chooses = context.lights.has_many_lights();
        let numbered = (has_lanes && stages.met != 0).then(|| {
            let filled = block.see(context.level, cleared);
            block.number(context.level, filled, chooses)
        });
        if let Some(stage) = numbered.as_ref().filter(|_| !context.lights.is_empty()) {
            integrator.direct_in_block((block, memory), wave, &estimated, (stage, stages.lit));
        }
        integrator.direct_singly(memory, wave, &estimated, stages);
        if let Some(stage) = &numbered {
            let onward = (stage, stages.onward);
            integrator.scatter_in_block((block, memory), wave, &estimated, onward, counters);
        }
        integrator.scatter_singly(memory, wave, &estimated, stages.single, counters);
    }
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Collects triangles and states of the rays in `range` that hit a surface; adds the environment to the
    /// paths of the others. Returns the set of hits.
    #[inline]
    fn gather_block(
        &self,
        block: &mut Block<'a>,
        memory: &mut PathMemory<E::State, R>,
        wave: &mut Wavefront,
        range: Range<usize>,
    ) -> u32 {
        let mut none = (E::State::zeroed(), R::State::zeroed());
        let mut hits = 0;
        for (i, (ray, hit)) in wave.rays[range.clone()].iter().zip(&wave.hits[range]).enumerate() {
            let i = i & 15;
            let index = ray.tag as usize;
            let Some(Path { path, state, shared }) = memory.path(wave.paths, index, &mut none) else {
                continue;
            };
            R::resume(shared, path);
            if !hit.is_some() {
                self.escape(path, state, ray);
                continue;
            }
            if !block.points.gather(self.context.scene, i, hit) {
                continue;
            }
            block.eta_squared[i] = path.eta_squared;
            (block.samples.place[i], block.samples.index[i]) =
                Sampler::place(self.settings.seed, path.pixel, path.sample);
            block.path[i] = ray.tag;
            block.segments[i] = u32::from(path.segments);
            hits |= 1 << i;
        }
        hits
    }

    /// Adds emission at the `hits`, whose rays start at `first`, continues behind skipped surfaces, looks up
    /// BSDFs, and adds the light of the estimator. Returns the scattering vertices.
    #[inline]
    fn arrive_in_block<'v>(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        (wave, first): (&mut Wavefront, usize),
        (points, hits): (&'v Points<'a, E::Found>, u32),
        estimated: &mut Estimated<'v, 'a>,
        counters: &mut Counters,
    ) -> (Stages, Cleared) {
        let mut none = (E::State::zeroed(), R::State::zeroed());
        let (mut stages, has_lanes) = (Stages::default(), self.context.has_lanes());
        let stage = block.clear();
        for i in Set(hits) {
            let index = block.path[i] as usize;
            let Some(mut path) = memory.path(wave.paths, index, &mut none) else { continue };
            let ray = wave.rays[first + i];
            let hit = (&ray, &wave.hits[first + i]);
            if let Err(next) = self.arrive_at(block, i, &mut path, hit, counters) {
                // At most in place of this ray: later ones are still read.
                next.into_iter().for_each(|through| wave.push_ray(index, through));
                continue;
            }
            // Not copied: a copy would wait for its fields to be written.
            let bsdf = block.points.bsdf::<F>(self.context.scene, i);
            let entered = !path.path.classes.ends_at(&bsdf) && {
                let Path { path, state, shared } = &mut path;
                self.enter((path, state, shared), &block.points.point(i), &bsdf).is_ok()
            };
            if !entered {
                continue;
            }
            put(&mut block.throughput, i, path.path.throughput);
            let (one, mut apart) = (1 << i, None);
            if E::ADDS_NOTHING && has_lanes {
                path.path.classes = path.path.classes.behind(&bsdf);
            } else if let Some(point) = &points.points[i] {
                let found = points.found[i];
                let vertex = self.vertex(path.path, (&ray, point), (bsdf, &found));
                let rest = self.known(path, &vertex, found);
                let is_single = !has_lanes || self.estimator.weighs_samples(&bsdf);
                apart = vertex.apart.then_some((rest.base_weight, rest.is_lit));
                (block.light_samples[i], block.each[i]) =
                    (rest.light_samples, 1.0 / rest.light_samples as f32);
                if is_single {
                    stages.single |= one;
                } else {
                    stages.onward |= if rest.ends && !vertex.apart { 0 } else { one };
                    stages.lit |= if rest.is_lit && !vertex.apart { 0 } else { one };
                }
                estimated.vertices[i] = Some((vertex, rest));
                if is_single {
                    continue;
                }
            }
            stages.met |= one;
            block.put::<F>(&stage, i, &bsdf);
            if let Some((base_weight, is_supplied)) = apart {
                block.separate_coat(&stage, i, base_weight, is_supplied);
            }
        }
        if E::ADDS_NOTHING {
            (stages.lit, stages.onward) = (stages.met, stages.met);
        }
        (stages, stage)
    }

    /// Adds emission at vertex `i`, the `hit` of `ray`. `Err` if the path does not scatter there: the next
    /// ray behind a skipped surface, or `None` if the path ends.
    #[inline]
    fn arrive_at(
        &self,
        block: &Block<'a>,
        i: usize,
        Path { path, state, .. }: &mut Path<E::State, R::State>,
        (ray, hit): (&Ray, &Hit),
        counters: &mut Counters,
    ) -> Result<(), Option<Ray>> {
        let (segments, triangle) = (block.segments[i], block.points.triangle[i]);
        let (material, front) = (block.points.material[i], block.points.is_front(i));
        let is_cutout = F::CUTOUT && material.has_cutout();
        if triangle == path.triangle || is_cutout || segments == 1 && !front {
            let point = block.points.point(i);
            path.stop(&self.context, (ray, hit), &point, self.settings.seed, counters)?;
        }
        if material.emits() {
            self.emission(path, state, &block.points.point(i), ray.direction.into());
        }
        if segments >= self.settings.max_depth { Err(None) } else { Ok(()) }
    }
}
