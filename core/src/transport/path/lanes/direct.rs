//! Next-event estimation at the vertices of a block: choice and samples of lights, and their shadow rays.

use super::Estimated;
use crate::bsdf::Features;
use crate::geometry::Ray;
use crate::sampling::Sampler;
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::LightEstimator;
use crate::transport::path::scalar::Path;
use crate::transport::path::sharing::{PathMemory, Sharing};
use crate::transport::walk::block::{Block, Stages};
use crate::transport::walk::block_stages::Numbered;
use crate::transport::walk::dimension;
use crate::transport::walk::points::Set;
use crate::transport::walk::shadow_tag::ShadowTag;
use crate::transport::wavefront::Wavefront;
use bytemuck::Zeroable;
use halflight_simd::kernels::shade::direct::Direct;
use halflight_simd::kernels::shade::{at, put};

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Takes light samples at the vertices of `lit` and queues their shadow rays.
    #[inline]
    pub(super) fn direct_in_block(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        (stage, lit): (&Numbered, u32),
    ) {
        let lit = block.begin_light(stage, lit);
        if E::ADDS_NOTHING {
            return self.direct_of((block, memory), wave, estimated, lit);
        }
        let several = lit & Set::of(&block.light_samples, |count| count > 1);
        for part in 0..self.estimator.light_samples(&self.context) {
            let active = lit & Set::of(&block.light_samples, |count| count > part);
            if several != 0 {
                self.number_in_net(block, wave, several, part);
            }
            self.direct_of((block, memory), wave, estimated, active);
        }
    }

    /// Random numbers of light sample `part` of the vertices of `several`, which have several each. The light
    /// samples of all paths of a pixel together form a net.
    fn number_in_net(&self, block: &mut Block<'a>, wave: &Wavefront, several: u32, part: u32) {
        let mut samples = block.samples.clone();
        for i in Set(several) {
            let Some(path) = wave.paths.get(block.path[i] as usize) else { continue };
            samples.place[i] = Sampler::replicate_place(self.settings.seed, path.pixel, path.sample & 1);
            samples.index[i] = (path.sample >> 1).wrapping_mul(block.light_samples[i]).wrapping_add(part);
        }
        samples.lights(self.context.level, dimension::OFFSETS, &mut block.numbers);
    }

    /// Takes a light sample at each vertex of `lit`.
    #[inline]
    fn direct_of(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        lit: u32,
    ) {
        if lit == 0 {
            return;
        }
        block.light(&self.context, lit);
        if !E::ADDS_NOTHING {
            for i in Set(block.light.exists) {
                let ends = estimated.at(i).is_some_and(|(vertex, rest)| rest.ends && !vertex.apart);
                block.light.alone |= u32::from(ends) << i;
            }
        }
        let apart = if E::ADDS_NOTHING { 0 } else { block.coats.apart & block.light.exists };
        if apart != 0 {
            block.weigh_apart(self.context.level);
            Set(apart).for_each(|i| put(&mut block.value, i, at(&block.apart.value, i)));
        }
        let Block { points, bsdf, light, value, pdf, each, throughput, shadows, .. } = &mut *block;
        let surface = &points.surface;
        Direct { surface, bsdf, light, value, pdf, each, throughput }.compute(self.context.level, shadows);
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(block.shadows.exists) {
            let is_apart = apart >> i & 1 == 1;
            if R::IN_CIRCLES && block.has_others() >> i & 1 == 1 {
                let path = memory.path(wave.paths, block.path[i] as usize, &mut none);
                let Some(Path { shared, .. }) = path else { continue };
                R::sample_light(shared, || {
                    if is_apart {
                        return at(&block.apart.base, i).into();
                    }
                    let wi = block.points.point(i).frame.to_local(at(&block.light.direction, i).into());
                    let (wo, f) = (at(&block.points.surface.wo, i).into(), at(&block.value, i).into());
                    block.others[i].base_part(wo, wi, f)
                });
            }
            let ShadowTag(tag) = ShadowTag::of_light_sample(block.path[i], block.environment >> i & 1 == 1);
            let [r, g, b, _] = block.shadows.contribution[i];
            let light = if is_apart { at(&block.apart.contribution, i) } else { [r, g, b] };
            let ray = block.shadow_ray(&self.context, i);
            wave.shadows.push(Ray { tag, ..ray }, light.into());
        }
    }

    /// Takes the light samples of the `single` vertices one by one, and connects all vertices by the
    /// estimator.
    #[inline]
    pub(super) fn direct_singly(
        &self,
        memory: &mut PathMemory<E::State, R>,
        wave: &mut Wavefront,
        estimated: &Estimated,
        Stages { met, single, .. }: Stages,
    ) {
        let (scene, mut none) = ((&self.context, &self.settings), (E::State::zeroed(), R::State::zeroed()));
        let connects = if self.estimator.connections() > 0 { met } else { 0 };
        for i in Set(single | connects) {
            let Some((vertex, rest)) = estimated.at(i) else { continue };
            let state = memory.states.get_mut(vertex.path).unwrap_or(&mut none.0);
            let shared = memory.shared.get_mut(vertex.path).unwrap_or(&mut none.1);
            if single >> i & 1 == 1 {
                self.direct((&*state, &mut *shared), vertex, rest, wave);
            }
            if R::may_connect(shared) {
                let tag = vertex.path as u32;
                let mut push = |ray, light| wave.shadows.push(Ray { tag, ..ray }, light);
                self.estimator.connect(scene, vertex, state, &mut push);
            }
        }
    }
}
