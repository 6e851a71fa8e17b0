//! Light samples of the vertices of a block: choice of the lights, points on them, and the BSDFs' values in
//! their directions.

use crate::Level;
use crate::bsdf::{COATS, Features};
use crate::geometry::Ray;
use crate::light::{ChosenLight, LightSample, emitted};
use crate::scene::Attributes;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_stages::Numbered;
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::points::Set;
use glam::Vec3;
use halflight_simd::kernels::shade::coat::CoatLight;
use halflight_simd::kernels::shade::coat_apart::ApartLight;
use halflight_simd::kernels::shade::direct::Direct;
use halflight_simd::kernels::shade::emitter::EmitterSamples;
use halflight_simd::kernels::shade::rough::Rough;
use halflight_simd::kernels::shade::{BLOCK, at, put};

impl Block<'_> {
    /// Leaves the vertices in `lit` that light samples can reach, and sets the normals for light sampling.
    #[inline]
    pub(crate) fn begin_light(&mut self, _: &Numbered, lit: u32) -> u32 {
        let mut lit = lit & !(self.specular.exists | self.smooth_coats);
        self.side = self.points.surface.frame[2];
        for i in Set(lit & !self.in_lanes()) {
            if self.others[i].is_delta() {
                lit &= !(1 << i);
            }
        }
        for i in Set(lit & self.rough.exists) {
            put(&mut self.side, i, [0.0; 3]);
        }
        lit
    }

    /// Samples lights at the vertices in `lit`, which [`Block::begin_light`] has left, and evaluates the
    /// BSDFs that lanes of shadow rays do not.
    #[inline]
    pub(crate) fn light<F: Features>(&mut self, context: &SceneContext<F>, lit: u32) {
        self.sample_lights(context, lit);
        for i in Set(lit & self.light.exists & !self.in_lanes()) {
            let wi = self.points.point(i).frame.to_local(at(&self.light.direction, i).into());
            let (f, pdf) = self.others[i].evaluate::<F>(at(&self.points.surface.wo, i).into(), wi);
            put(&mut self.value, i, f.to_array());
            self.pdf[i] = pdf;
        }
        if self.coats.exists & !self.coats.apart & self.light.exists != 0 {
            let Block { points, coats, light, value, pdf, .. } = self;
            let surface = &points.surface;
            CoatLight { surface, coats, tables: &COATS, direction: &light.direction }.compute(
                context.level,
                value,
                pdf,
            );
        }
        if self.rough.exists & self.light.exists != 0 {
            let Block { points, rough, light, value, pdf, .. } = self;
            Rough { surface: &points.surface, rough }.light(context.level, &light.direction, value, pdf);
        }
    }

    /// Takes light samples at the vertices in `lit`: unweighted shadow rays, with f |cos| and the density of
    /// BSDF sampling.
    #[inline]
    pub(crate) fn reach_lights<F: Features>(
        &mut self,
        context: &SceneContext<F>,
        stage: &Numbered,
        lit: u32,
    ) {
        self.shadows.exists = 0;
        let lit = if context.lights.is_empty() { 0 } else { self.begin_light(stage, lit) };
        if lit != 0 {
            self.light(context, lit);
            let Block { points, bsdf, light, value, pdf, each, throughput, shadows, .. } = self;
            let surface = &points.surface;
            Direct { surface, bsdf, light, value, pdf, each, throughput }.reach(context.level, shadows);
        }
    }

    /// Shadow ray of vertex `i`, which has one.
    #[inline]
    pub(crate) fn shadow_ray<F: Features>(&self, context: &SceneContext<F>, i: usize) -> Ray {
        let ray = bytemuck::cast(self.shadows.rays[i]);
        if self.light.area >> i & 1 == 1 { context.ended_at_lamp(self.sampled[i], ray) } else { ray }
    }

    /// Evaluates and weighs the light samples of coats apart from their bases, after [`Block::light`].
    #[inline]
    pub(crate) fn weigh_apart(&mut self, level: Level) {
        let Block { points, coats, light, each, throughput, apart, supplied, .. } = self;
        let (surface, tables, supplied) = (&points.surface, &COATS, *supplied);
        ApartLight { surface, coats, tables, light, each, throughput, supplied }.compute(level, apart);
    }

    /// Chooses and samples the lights of the vertices in `lit`.
    #[inline]
    fn sample_lights<F: Features>(&mut self, context: &SceneContext<F>, mut lit: u32) {
        let (scene, lights) = (context.scene, &context.lights);
        let block = &mut *self;
        let light = &mut block.light;
        (light.exists, light.bounded, light.area, light.alone, light.balance) = (0, 0, 0, 0, 0);
        let (mut areas, mut environment) = (0, 0);
        if block.is_lone {
            (areas, lit) = (lit, 0);
        } else if let Some((triangle, probability)) = lights.put_lone(&mut block.emitters) {
            (block.lamp, block.probability) = ([triangle; BLOCK], [probability; BLOCK]);
            block.sampled = [0; BLOCK];
            block.is_lone = true;
            (areas, lit) = (lit, 0);
        } else {
            let emitters = &mut block.emitters;
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
            if let Some((triangle, probability, light)) = chosen.put(&mut block.emitters, i) {
                (block.lamp[i], block.probability[i], block.sampled[i]) = (triangle, probability, light);
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
                block.sampled[i] = lights.environment_number();
                continue;
            }
            let sample = lights.sample_chosen(scene, position, side, u, chosen, warped);
            if let Some((sample, _)) = sample {
                block.put_light(i, &sample, position);
            }
        }
        if environment != 0 {
            let scene = (scene, context.level);
            environment = lights.sample_environments(scene, &block.sky, &mut block.light, environment);
        }
        block.environment = environment;
        if areas != 0 {
            block.sample_areas(context, areas);
        }
    }

    /// Samples the area lights of the vertices in `areas`.
    #[inline]
    fn sample_areas<F: Features>(&mut self, context: &SceneContext<F>, areas: u32) {
        let block = self;
        let samples = EmitterSamples {
            lights: &block.emitters,
            from: &block.points.surface.position,
            normal: &block.side,
            u: &block.numbers.light,
            probability: &block.probability,
            active: areas,
        }
        .compute(context.level);
        let mut bright = 0;
        for i in Set(samples.exists) {
            let triangle = block.lamp[i] + (samples.second >> i & 1);
            let radiance = emitted(context.scene, triangle, &Attributes::NONE, samples.front >> i & 1 == 1);
            put(&mut block.light.radiance, i, radiance.to_array());
            bright |= u32::from(radiance.max_element() > 0.0) << i;
        }
        let light = &mut block.light;
        if light.exists == 0 {
            (light.direction, light.end, light.pdf) = (samples.direction, samples.end, samples.pdf);
            block.distance = samples.distance;
        } else {
            for i in Set(bright) {
                put(&mut light.direction, i, at(&samples.direction, i));
                put(&mut light.end, i, at(&samples.end, i));
                (light.pdf[i], block.distance[i]) = (samples.pdf[i], samples.distance[i]);
            }
        }
        light.exists |= bright;
        light.bounded |= bright;
        light.area |= bright;
    }

    /// Stores a light sample of the vertex `i` at `position`.
    fn put_light(&mut self, i: usize, sample: &LightSample, position: Vec3) {
        let LightSample { direction, distance, target, radiance, pdf, delta, light: number } = *sample;
        let (light, i) = (&mut self.light, i & 15);
        put(&mut light.direction, i, direction.to_array());
        put(&mut light.radiance, i, radiance.to_array());
        light.pdf[i] = pdf;
        let end = match target {
            // Offset from the light's surface, to the side of the vertex.
            Some(target) => Some(target.position + target.error * target.normal),
            None if distance < f32::INFINITY => Some(position + distance * direction),
            None => None,
        };
        put(&mut light.end, i, end.unwrap_or(position).to_array());
        light.exists |= 1 << i;
        light.bounded |= u32::from(end.is_some()) << i;
        light.area |= u32::from(target.is_some()) << i;
        light.alone |= u32::from(delta) << i;
        (self.sampled[i], self.distance[i]) = (number, distance);
    }
}
