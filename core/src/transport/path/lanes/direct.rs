//! Next-event estimation at the vertices of a block: choice and samples of lights, and their shadow rays.

use super::Estimated;
use crate::Rgb;
use crate::bsdf::{COATS, Features};
use crate::geometry::Ray;
use crate::light::{ChosenLight, emitted};
use crate::sampling::Sampler;
use crate::transport::path::PathIntegrator;
use crate::transport::path::block::{Block, Stages, put_light};
use crate::transport::path::estimator::LightEstimator;
use crate::transport::path::shade::Path;
use crate::transport::path::sharing::{PathMemory, Sharing};
use crate::transport::walk::dimension;
use crate::transport::walk::points::Set;
use crate::transport::wavefront::{BLOCK, TO_ENVIRONMENT, Wavefront};
use bytemuck::Zeroable;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::coat::CoatLight;
use halflight_simd::kernels::shade::direct::Direct;
use halflight_simd::kernels::shade::emitter::EmitterSamples;
use halflight_simd::kernels::shade::{at, put};

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Takes light samples at the vertices of `lit` and queues their shadow rays.
    #[inline]
    pub(super) fn direct_in_block(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        mut lit: u32,
    ) {
        lit &= !(block.specular.exists | block.smooth_coats);
        let others = lit & !block.in_lanes();
        block.side = block.points.surface.frame[2];
        for i in Set(others) {
            if block.others[i].is_delta() {
                lit &= !(1 << i);
            }
            if F::DIELECTRIC && block.others[i].transmits() {
                put(&mut block.side, i, [0.0; 3]);
            }
        }
        if E::ADDS_NOTHING {
            return self.direct_of((block, memory), wave, estimated, (lit, others & lit));
        }
        let several = lit & Set::of(&block.light_samples, |count| count > 1);
        for part in 0..self.estimator.light_samples(&self.context) {
            let active = lit & Set::of(&block.light_samples, |count| count > part);
            if several != 0 {
                self.number_in_net(block, wave, several, part);
            }
            self.direct_of((block, memory), wave, estimated, (active, others & active));
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

    /// Takes a light sample at each vertex of `lit`, the `others` of them without lanes.
    #[inline]
    fn direct_of(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        (lit, others): (u32, u32),
    ) {
        if lit == 0 {
            return;
        }
        let environment = self.sample_lights(block, lit);
        for i in Set(others & block.light.exists) {
            let wi = block.points.point(i).frame.to_local(at(&block.light.direction, i).into());
            let (f, pdf) = block.others[i].evaluate::<F>(at(&block.points.surface.wo, i).into(), wi);
            put(&mut block.value, i, f.to_array());
            block.pdf[i] = pdf;
        }
        if block.coats.exists & block.light.exists != 0 {
            let Block { points, coats, light, value, pdf, .. } = &mut *block;
            let surface = &points.surface;
            CoatLight { surface, coats, tables: &COATS, direction: &light.direction }.compute(
                self.context.level,
                value,
                pdf,
            );
        }
        if !E::ADDS_NOTHING {
            for i in Set(block.light.exists) {
                let ends = estimated.at(i).is_some_and(|(_, rest)| rest.ends);
                block.light.alone |= u32::from(ends) << i;
            }
        }
        let Block { points, bsdf, light, value, pdf, each, throughput, shadows, .. } = &mut *block;
        let surface = &points.surface;
        Direct { surface, bsdf, light, value, pdf, each, throughput }.compute(self.context.level, shadows);
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(block.shadows.exists) {
            if R::IN_CIRCLES && (others | block.coats.exists) >> i & 1 == 1 {
                let path = memory.path(wave.paths, block.path[i] as usize, &mut none);
                let Some(Path { shared, .. }) = path else { continue };
                R::sample_light(shared, || {
                    let wi = block.points.point(i).frame.to_local(at(&block.light.direction, i).into());
                    let (wo, f) = (at(&block.points.surface.wo, i).into(), at(&block.value, i).into());
                    block.others[i].base_part(wo, wi, f)
                });
            }
            let is_later = environment >> i & 1 == 1;
            let tag = block.path[i] | if is_later { TO_ENVIRONMENT } else { 0 };
            let [r, g, b, _] = block.shadows.contribution[i];
            let ray: Ray = bytemuck::cast(block.shadows.rays[i]);
            wave.push_shadow_ray(Ray { tag, ..ray }, Rgb::new(r, g, b));
        }
    }

    /// Chooses and samples the lights of the vertices in `lit`. Returns the set of samples whose radiance is
    /// looked up after the shadow rays.
    #[inline]
    fn sample_lights(&self, block: &mut Block<'a>, mut lit: u32) -> u32 {
        let (scene, lights) = (self.context.scene, self.context.lights);
        let light = &mut block.light;
        (light.exists, light.bounded, light.area, light.alone, light.balance) = (0, 0, 0, 0, 0);
        let emitters = &mut block.emitters;
        let (mut areas, mut environment) = (0, 0);
        if block.is_lone {
            (areas, lit) = (lit, 0);
        } else if let Some((triangle, probability)) = lights.put_lone(emitters) {
            (block.lamp, block.probability) = ([triangle; BLOCK], [probability; BLOCK]);
            block.is_lone = true;
            (areas, lit) = (lit, 0);
        } else {
            (emitters.triangles, emitters.rectangles, emitters.two_sided) = (0, 0, 0);
        }
        let places = (&block.points.surface.position, &block.side);
        let chosen = lights.choose_block(places, &block.numbers.choice, lit);
        lit &= chosen.as_ref().map_or(lit, |chosen| chosen.exists);
        for i in Set(lit) {
            let (position, side) =
                (Vec3::from(at(&block.points.surface.position, i)), Vec3::from(at(&block.side, i)));
            let chosen = match &chosen {
                Some(chosen) => lights.chosen(chosen, i),
                None => match lights.choose(position, side, block.numbers.choice[i]) {
                    Some(chosen) => chosen,
                    None => continue,
                },
            };
            if let Some((triangle, probability)) = chosen.put(emitters, i) {
                (block.lamp[i], block.probability[i]) = (triangle, probability);
                areas |= 1 << i;
                continue;
            }
            let u = [block.numbers.light[0][i], block.numbers.light[1][i]];
            // A visibility table holds for one side only.
            let table = if side == Vec3::ZERO { None } else { lights.visibility(position, side) };
            let warped = table.map(|table| table.warp(u));
            if let ChosenLight::Environment { probability } = chosen {
                let is_put = lights.put_environment(&mut block.sky, i, (side, u), warped, probability);
                environment |= u32::from(is_put) << i;
                continue;
            }
            let sample = lights.sample_chosen(scene, position, side, u, chosen, warped);
            if let Some((sample, _)) = sample {
                put_light(&mut block.light, i, &sample, position);
            }
        }
        if environment != 0 {
            let scene = (scene, self.context.level);
            environment = lights.sample_environments(scene, &block.sky, &mut block.light, environment);
        }
        if areas != 0 {
            self.sample_areas(block, areas);
        }
        environment
    }

    /// Samples the area lights of the vertices in `areas`.
    #[inline]
    fn sample_areas(&self, block: &mut Block<'a>, areas: u32) {
        let samples = EmitterSamples {
            lights: &block.emitters,
            from: &block.points.surface.position,
            normal: &block.side,
            u: &block.numbers.light,
            probability: &block.probability,
            active: areas,
        }
        .compute(self.context.level);
        let mut bright = 0;
        for i in Set(samples.exists) {
            let triangle = block.lamp[i] + (samples.second >> i & 1);
            let radiance = emitted(self.context.scene, triangle, Vec2::ZERO, samples.front >> i & 1 == 1);
            put(&mut block.light.radiance, i, radiance.to_array());
            bright |= u32::from(radiance.max_element() > 0.0) << i;
        }
        let light = &mut block.light;
        if light.exists == 0 {
            (light.direction, light.end, light.pdf) = (samples.direction, samples.end, samples.pdf);
        } else {
            for i in Set(bright) {
                put(&mut light.direction, i, at(&samples.direction, i));
                put(&mut light.end, i, at(&samples.end, i));
                light.pdf[i] = samples.pdf[i];
            }
        }
        light.exists |= bright;
        light.bounded |= bright;
        light.area |= bright;
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
        if E::ADDS_NOTHING {
            return;
        }
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
                let mut push = |ray, light| wave.push_shadow_ray(Ray { tag, ..ray }, light);
                self.estimator.connect(scene, vertex, state, &mut push);
            }
        }
    }
}
