//! Shading of blocks of vertices in lanes, by the kernels of `halflight_simd::kernels::shade`: the path
//! tracer without an estimator and without sharing.
//!
//! A stage is either a kernel over all vertices of the block or a loop over them. Loops gather inputs, look
//! up materials and textures, and replace the kernels at rare vertices: normal maps, degenerate triangles,
//! BSDFs other than diffuse and rough metal, lights other than area lights. Both compute the same bits.

use super::PathIntegrator;
use super::block::{Block, Set, put_light};
use super::estimator::LightEstimator;
use super::shade::Shading;
use super::sharing::Sharing;
use crate::Rgb;
use crate::bsdf::{Bsdf, Features};
use crate::geometry::Ray;
use crate::light::emitted;
use crate::sampling::Sampler;
use crate::transport::settings::Counters;
use crate::transport::walk::dimension;
use crate::transport::walk::termination::{CERTAIN_BELOW, MAX_VERTICES, is_cut, most_probable};
use crate::transport::wavefront::{BLOCK, TO_ENVIRONMENT, Wavefront};
use bytemuck::Zeroable;
use core::ops::Range;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::direct::Direct;
use halflight_simd::kernels::shade::emitter::EmitterSamples;
use halflight_simd::kernels::shade::scatter::Scatter;
use halflight_simd::kernels::shade::surface::Surfaces;
use halflight_simd::kernels::shade::{at, put};

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> Shading<'_, 'a, '_, F, E, R> {
    /// Shades the vertices of `range` in lanes.
    pub(super) fn shade_block(&mut self, wave: &mut Wavefront, range: Range<usize>, counters: &mut Counters) {
        let Self { integrator, block, .. } = self;
        let context = &integrator.context;
        let hits = integrator.gather_block(block, wave, range.clone());
        if hits == 0 {
            return;
        }
        let mut copies = [Ray::zeroed(); BLOCK];
        let rays = wave.rays.get(range.start..range.start + BLOCK).unwrap_or_else(|| {
            let there = &wave.rays[range.clone()];
            copies.iter_mut().zip(there).for_each(|(copy, ray)| *copy = *ray);
            &copies
        });
        let rays: &[[f32; 8]] = bytemuck::cast_slice(rays);
        let Some(rays) = rays.first_chunk() else { return };
        let surfaces = Surfaces {
            corners: &block.corners,
            normals: (!context.scene.mesh.normals.is_empty()).then_some(&block.normals),
            weights: &block.weights,
            rays,
        };
        surfaces.compute(context.level, &mut block.surface);
        let met = integrator.arrive_in_block(block, (wave, range), hits, counters);
        if met == 0 {
            return;
        }
        block.samples.dimension = block.segments.map(dimension::vertex);
        let chooses = context.lights.has_many_lights();
        block.samples.vertices(context.level, dimension::OFFSETS, chooses, &mut block.numbers);
        if !context.lights.is_empty() {
            integrator.direct_in_block(block, wave, met);
        }
        integrator.scatter_in_block(block, wave, met, counters);
    }
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Collects triangles and states of the rays in `range` that hit a surface; adds the environment to the
    /// paths of the others. Returns the set of hits.
    #[inline]
    fn gather_block(&self, block: &mut Block<'a>, wave: &mut Wavefront, range: Range<usize>) -> u32 {
        let scene = self.context.scene;
        let mesh = &scene.mesh;
        let mut hits = 0;
        for (i, (ray, hit)) in wave.rays[range.clone()].iter().zip(&wave.hits[range]).enumerate() {
            let i = i & 15;
            let index = ray.tag as usize;
            let Some(path) = wave.paths.get_mut(index) else { continue };
            if !hit.is_some() {
                self.escape(path, &E::State::zeroed(), ray);
                continue;
            }
            let Some(triangle) = mesh.triangles.get(hit.triangle as usize) else { continue };
            let Some(material) = scene.materials.get(triangle.material as usize) else { continue };
            let [a, b, c] = triangle.vertices;
            let corner = |vertex: u32| mesh.positions.get(vertex as usize);
            let (Some(&a), Some(&b), Some(&c)) = (corner(a), corner(b), corner(c)) else { continue };
            put(&mut block.corners[0], i, a);
            put(&mut block.corners[1], i, b);
            put(&mut block.corners[2], i, c);
            if !mesh.normals.is_empty() {
                for (rows, vertex) in block.normals.iter_mut().zip(triangle.vertices) {
                    put(rows, i, mesh.normals.get(vertex as usize).copied().unwrap_or_default());
                }
            }
            (block.weights[0][i], block.weights[1][i]) = (hit.u, hit.v);
            put(&mut block.throughput, i, path.throughput);
            block.eta_squared[i] = path.eta_squared;
            (block.samples.place[i], block.samples.index[i]) =
                Sampler::place(self.settings.seed, path.pixel, path.sample);
            block.path[i] = ray.tag;
            block.segments[i] = u32::from(path.segments);
            block.triangle[i] = hit.triangle;
            block.material[i] = material;
            hits |= 1 << i;
        }
        hits
    }

    /// Adds emission at the hits, continues behind skipped surfaces, and looks up BSDFs. Returns the set of
    /// scattering vertices.
    #[inline]
    fn arrive_in_block(
        &self,
        block: &mut Block<'a>,
        (wave, range): (&mut Wavefront, Range<usize>),
        hits: u32,
        counters: &mut Counters,
    ) -> u32 {
        let scene = self.context.scene;
        let mut met = hits;
        if (F::TEXTURES || F::NORMAL_MAPS || F::CUTOUT) && !scene.textures.is_empty() {
            for i in Set(hits) {
                let t = scene.mesh.corner_texcoords(block.triangle[i]);
                let (u, v) = (block.weights[0][i], block.weights[1][i]);
                block.uv[i] = (1.0 - u - v) * t[0] + u * t[1] + v * t[2];
            }
        }
        let mut special = hits & !block.surface.regular;
        if F::NORMAL_MAPS {
            let mapped = |i: &usize| block.material[*i].normal_map.is_some();
            special |= Set(hits).filter(mapped).fold(0, |set, i| set | 1 << i);
        }
        for i in Set(special) {
            let (ray, hit) = (wave.rays[range.start + i], wave.hits[range.start + i]);
            match self.context.surface_at(&ray, &hit) {
                Some(point) => block.put_point(i, &point, Vec3::from(ray.direction)),
                None => met &= !(1 << i),
            }
        }
        (block.bsdf.diffuse, block.bsdf.metal) = (0, 0);
        for i in Set(met) {
            let (index, segments, triangle) = (block.path[i] as usize, block.segments[i], block.triangle[i]);
            let Some(path) = wave.paths.get_mut(index) else { continue };
            let (material, front) = (block.material[i], block.surface.front >> i & 1 == 1);
            let is_cutout = F::CUTOUT && material.has_cutout();
            if triangle == path.triangle || is_cutout || segments == 1 && !front {
                let (ray, hit) = (wave.rays[range.start + i], wave.hits[range.start + i]);
                let point = block.point(i);
                let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);
                let opacity = || sampler.single(dimension::opacity(segments, u32::from(path.crossings)));
                if segments == 1 && point.is_left_by(&ray)
                    || self.context.is_skipped(&point, &hit, path.triangle, opacity)
                {
                    met &= !(1 << i);
                    let through = point.spawn(ray.direction.into());
                    if let Some(next) = path.skip_surface(through, triangle, counters) {
                        // At most in place of this ray: later ones are still read.
                        wave.push_ray(index, next);
                    }
                    continue;
                }
            }
            if material.emits() {
                let direction = Vec3::from(wave.rays[range.start + i].direction);
                self.emission(path, &E::State::zeroed(), &block.point(i), direction);
            }
            if segments >= self.settings.max_depth {
                met &= !(1 << i);
                continue;
            }
            let bsdf = Bsdf::at::<F>(scene, material, block.uv[i], front);
            if path.classes.ends_at(&bsdf) {
                met &= !(1 << i);
                continue;
            }
            path.classes = path.classes.behind(&bsdf);
            match bsdf {
                Bsdf::Diffuse(b) => {
                    put(&mut block.bsdf.reflectance, i, b.reflectance.to_array());
                    block.bsdf.diffuse |= 1 << i;
                }
                Bsdf::Conductor(b) if F::GLOSSY && b.alpha > 0.0 => {
                    put(&mut block.bsdf.reflectance, i, b.f0.to_array());
                    block.bsdf.alpha[i] = b.alpha;
                    block.bsdf.metal |= 1 << i;
                }
                _ => block.others[i] = bsdf,
            }
        }
        met
    }

    /// Takes a light sample at each vertex of `met` and queues its shadow ray.
    #[inline]
    fn direct_in_block(&self, block: &mut Block<'a>, wave: &mut Wavefront, met: u32) {
        let (scene, lights, level) = (self.context.scene, self.context.lights, self.context.level);
        let others = met & !(block.bsdf.diffuse | block.bsdf.metal);
        let mut lit = met;
        block.side = block.surface.frame[2];
        for i in Set(others) {
            if block.others[i].is_delta() {
                lit &= !(1 << i);
            }
            if F::DIELECTRIC && block.others[i].transmits() {
                put(&mut block.side, i, [0.0; 3]);
            }
        }
        if lit == 0 {
            return;
        }
        let light = &mut block.light;
        (light.exists, light.bounded, light.area, light.delta, light.balance) = (0, 0, 0, 0, 0);
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
        let places = (&block.surface.position, &block.side);
        let chosen = lights.choose_block(places, &block.numbers.choice, lit);
        lit &= chosen.as_ref().map_or(lit, |chosen| chosen.exists);
        for i in Set(lit) {
            let (position, side) =
                (Vec3::from(at(&block.surface.position, i)), Vec3::from(at(&block.side, i)));
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
            let sample = lights.sample_chosen(scene, position, side, u, chosen, warped);
            if let Some((sample, later)) = sample {
                put_light(&mut block.light, i, &sample, position, later && lights.has_visibility());
                environment |= u32::from(later) << i;
            }
        }
        if areas != 0 {
            self.sample_areas(block, areas);
        }
        for i in Set(others & block.light.exists) {
            let wi = block.point(i).frame.to_local(at(&block.light.direction, i).into());
            let (f, pdf) = block.others[i].evaluate::<F>(at(&block.surface.wo, i).into(), wi);
            put(&mut block.value, i, f.to_array());
            block.pdf[i] = pdf;
        }
        let Block { surface, bsdf, light, value, pdf, throughput, shadows, .. } = &mut *block;
        Direct { surface, bsdf, light, value, pdf, throughput }.compute(level, shadows);
        let shadows = &block.shadows;
        for i in Set(shadows.exists) {
            let is_later = environment >> i & 1 == 1;
            let tag = block.path[i] | if is_later { TO_ENVIRONMENT } else { 0 };
            let [r, g, b, _] = shadows.contribution[i];
            let ray: Ray = bytemuck::cast(shadows.rays[i]);
            wave.push_shadow_ray(Ray { tag, ..ray }, Rgb::new(r, g, b));
        }
    }

    /// Samples the area lights of the vertices in `areas`.
    #[inline]
    fn sample_areas(&self, block: &mut Block<'a>, areas: u32) {
        let samples = EmitterSamples {
            lights: &block.emitters,
            from: &block.surface.position,
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

    /// Samples the next rays of the paths of `met`.
    #[inline]
    fn scatter_in_block(
        &self,
        block: &mut Block<'a>,
        wave: &mut Wavefront,
        met: u32,
        counters: &mut Counters,
    ) {
        let level = self.context.level;
        let starts = met & Set::of(&block.segments, |segments| segments == 1);
        if starts != 0 {
            let pairs = block.samples.second_pairs(level, dimension::PIXEL);
            let [u, v] = &mut block.numbers.scatter;
            for i in Set(starts) {
                (u[i], v[i]) = (pairs[0][i], pairs[1][i]);
            }
        }
        let (mut active, mut cut, mut transmits) = (met, 0, 0);
        let long = met & Set::of(&block.segments, |segments| segments >= CERTAIN_BELOW);
        block.most = [1.0; BLOCK];
        let others = met & !(block.bsdf.diffuse | block.bsdf.metal);
        for i in Set(long) {
            block.most[i] = most_probable(block.segments[i]);
            cut |= u32::from(block.segments[i] >= MAX_VERTICES) << i;
        }
        for i in Set(others) {
            let (bsdf, segments) = (&block.others[i], block.segments[i]);
            let Some(path) = wave.paths.get(block.path[i] as usize) else { continue };
            let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);
            let lobe = sampler.single(dimension::vertex(segments) + dimension::LOBE);
            let u = [block.numbers.scatter[0][i], block.numbers.scatter[1][i], lobe];
            let Some(sample) = bsdf.sample::<F>(at(&block.surface.wo, i).into(), u) else {
                active &= !(1 << i);
                continue;
            };
            put(&mut block.given.direction, i, sample.direction.to_array());
            put(&mut block.given.weight, i, sample.weight.to_array());
            block.given.pdf[i] = if sample.delta { f32::INFINITY } else { sample.pdf };
            block.given.eta[i] = sample.eta;
            cut |= u32::from(is_cut(segments, bsdf, &sample)) << i;
            transmits |= u32::from(bsdf.transmits()) << i;
        }
        Scatter {
            surface: &block.surface,
            bsdf: &block.bsdf,
            given: &block.given,
            u: &block.numbers.scatter,
            roulette: &block.numbers.roulette,
            most: &block.most,
            throughput: &block.throughput,
            eta_squared: &block.eta_squared,
            active,
        }
        .compute(level, &mut block.next);
        let next = &block.next;
        // Lanes do not change it.
        if others != 0 {
            block.given.eta = [1.0; BLOCK];
        }
        for i in Set(next.exists) {
            let index = block.path[i] as usize;
            let Some(path) = wave.paths.get_mut(index) else { continue };
            if cut >> i & 1 == 1 {
                counters.dropped.unfinished += 1;
                continue;
            }
            let [r, g, b, pdf, x, y, z, eta_squared] = next.states[i];
            (path.throughput, path.pdf) = ([r, g, b], pdf);
            (path.position, path.eta_squared) = ([x, y, z], eta_squared);
            let [x, y, z, _] = next.normals[i];
            path.normal = if transmits >> i & 1 == 1 { [0.0; 3] } else { [x, y, z] };
            path.triangle = block.triangle[i];
            path.segments += 1;
            wave.push_ray(index, bytemuck::cast(next.rays[i]));
        }
    }
}
