//! Next rays of the paths at the vertices of a block.

use super::Estimated;
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, COATS, Diffuse, Features};
use crate::sampling::Sampler;
use crate::transport::path::PathIntegrator;
use crate::transport::path::block::Block;
use crate::transport::path::estimator::LightEstimator;
use crate::transport::path::shade::Path;
use crate::transport::path::sharing::{PathMemory, Sharing};
use crate::transport::settings::Counters;
use crate::transport::walk::dimension;
use crate::transport::walk::points::Set;
use crate::transport::walk::termination::{CERTAIN_BELOW, MAX_VERTICES, is_cut, most_probable};
use crate::transport::wavefront::{BLOCK, Wavefront};
use bytemuck::Zeroable;
use halflight_simd::kernels::shade::coat::CoatSamples;
use halflight_simd::kernels::shade::scatter::Scatter;
use halflight_simd::kernels::shade::specular::SpecularSamples;
use halflight_simd::kernels::shade::{at, put};

/// Sets of vertices for [`Scatter`], and for the paths that go on.
#[derive(Default)]
struct Sets {
    active: u32,
    /// Paths that must survive.
    certain: u32,
    /// Paths that are too long.
    cut: u32,
    delta: u32,
    transmits: u32,
}

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Samples the next rays of the paths of `onward`.
    #[inline]
    pub(super) fn scatter_in_block(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        onward: u32,
        counters: &mut Counters,
    ) {
        if onward == 0 {
            return;
        }
        let level = self.context.level;
        let starts = onward & Set::of(&block.segments, |segments| segments == 1);
        if starts != 0 {
            let pairs = block.samples.second_pairs(level, dimension::PIXEL);
            let [u, v] = &mut block.numbers.scatter;
            for i in Set(starts) {
                (u[i], v[i]) = (pairs[0][i], pairs[1][i]);
            }
        }
        let mut sets = Sets { active: onward, ..Sets::default() };
        let long = onward & Set::of(&block.segments, |segments| segments >= CERTAIN_BELOW);
        block.most = [1.0; BLOCK];
        for i in Set(long) {
            block.most[i] = most_probable(block.segments[i]);
            sets.cut |= u32::from(block.segments[i] >= MAX_VERTICES) << i;
        }
        let others = onward & !block.in_lanes();
        self.sample_others((block, memory), wave, others, &mut sets);
        self.sample_coats((block, memory), wave, onward, &mut sets);
        if R::IN_CIRCLES {
            self.leave((block, memory), wave, &mut sets);
        }
        Scatter {
            surface: &block.points.surface,
            bsdf: &block.bsdf,
            given: &block.given,
            u: &block.numbers.scatter,
            roulette: &block.numbers.roulette,
            most: &block.most,
            throughput: &block.throughput,
            factor: &block.factor,
            eta_squared: &block.eta_squared,
            active: sets.active,
            certain: sets.certain,
        }
        .compute(level, &mut block.next);
        self.go_on((block, memory), wave, estimated, &sets, counters);
        // Lanes do not change it.
        if others | block.specular.exists != 0 {
            block.given.eta = [1.0; BLOCK];
        }
    }

    /// Samples the BSDFs of the `others`, which lanes do not sample.
    #[inline]
    fn sample_others(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        others: u32,
        sets: &mut Sets,
    ) {
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(others) {
            let (bsdf, segments) = (&block.others[i], block.segments[i]);
            let path = memory.path(wave.paths, block.path[i] as usize, &mut none);
            let Some(Path { path, shared, .. }) = path else { continue };
            let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);
            let lobe = sampler.single(dimension::vertex(segments) + dimension::LOBE);
            let u = [block.numbers.scatter[0][i], block.numbers.scatter[1][i], lobe];
            let wo = at(&block.points.surface.wo, i).into();
            let Some(sample) = bsdf.sample::<F>(wo, u) else {
                sets.active &= !(1 << i);
                continue;
            };
            R::sample_bsdf(shared, || match sample.delta {
                true => Rgb::ZERO,
                false => bsdf.base_part(wo, sample.direction, sample.weight * sample.pdf),
            });
            put(&mut block.given.direction, i, sample.direction.to_array());
            put(&mut block.given.weight, i, sample.weight.to_array());
            block.given.pdf[i] = if sample.delta { f32::INFINITY } else { sample.pdf };
            block.given.eta[i] = sample.eta;
            sets.cut |= u32::from(is_cut(segments, bsdf, &sample)) << i;
            sets.delta |= u32::from(sample.delta) << i;
            sets.transmits |= u32::from(bsdf.transmits()) << i;
        }
    }

    /// Samples the coats and the smooth surfaces among the vertices `onward`.
    #[inline]
    fn sample_coats(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        onward: u32,
        sets: &mut Sets,
    ) {
        let level = self.context.level;
        let Block { points, coats, specular, samples, numbers, given, .. } = &mut *block;
        let surface = &points.surface;
        let of_coats = coats.exists & onward;
        if of_coats | specular.exists & onward == 0 {
            return;
        }
        let lobe = match of_coats | specular.dielectric {
            0 => [0.0; BLOCK],
            _ => samples.singles(level, dimension::LOBE),
        };
        if of_coats != 0 {
            let samples = CoatSamples { surface, coats, tables: &COATS, u: &numbers.scatter, lobe: &lobe };
            let [exists, delta] = samples.compute(level, given);
            sets.active &= exists | !coats.exists;
            sets.delta |= delta;
        }
        if specular.exists != 0 {
            let exists = SpecularSamples { surface, specular, lobe: &lobe }.compute(level, given);
            sets.active &= exists | !specular.exists;
            sets.delta |= specular.exists;
            sets.transmits |= specular.dielectric;
        }
        if !R::IN_CIRCLES {
            return;
        }
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(sets.active & (block.coats.exists | block.specular.exists)) {
            let path = memory.path(wave.paths, block.path[i] as usize, &mut none);
            let Some(Path { shared, .. }) = path else { continue };
            R::sample_bsdf(shared, || match sets.delta >> i & 1 == 1 {
                true => Rgb::ZERO,
                false => {
                    let f = Rgb::from(at(&block.given.weight, i)) * block.given.pdf[i];
                    let wi = at(&block.given.direction, i).into();
                    block.others[i].base_part(at(&block.points.surface.wo, i).into(), wi, f)
                }
            });
        }
    }

    /// Calls the sharing rule for the paths that leave diffuse surfaces, and sets their factors to the light
    /// of the pixel.
    #[inline]
    fn leave(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        sets: &mut Sets,
    ) {
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(sets.active) {
            let path = memory.path(wave.paths, block.path[i] as usize, &mut none);
            let Some(Path { shared, .. }) = path else { continue };
            if block.bsdf.diffuse >> i & 1 == 1 {
                let reflectance = Rgb::from(at(&block.bsdf.reflectance, i));
                let throughput = Rgb::from(at(&block.throughput, i)) * reflectance;
                let surface = (&block.points.point(i), &Bsdf::Diffuse(Diffuse { reflectance }));
                let survives = R::leave(shared, surface, throughput, block.segments[i]);
                sets.certain |= u32::from(survives) << i;
            }
            put(&mut block.factor, i, R::throughput(shared, Rgb::ONE).to_array());
        }
    }

    /// Queues the next rays of the block.
    #[inline]
    fn go_on(
        &self,
        (block, memory): (&Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        sets: &Sets,
        counters: &mut Counters,
    ) {
        let next = &block.next;
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(next.exists) {
            let index = block.path[i] as usize;
            let Some(Path { path, state, .. }) = memory.path(wave.paths, index, &mut none) else { continue };
            let [r, g, b, mut pdf, x, y, z, eta_squared] = next.states[i];
            let (is_delta, transmits) = (sets.delta >> i & 1 == 1, sets.transmits >> i & 1 == 1);
            if !E::ADDS_NOTHING {
                let Some((vertex, rest)) = estimated.at(i) else { continue };
                let classes = if is_delta { Some(rest.narrow) } else { rest.wide };
                let Some(classes) = classes else { continue };
                path.classes = classes;
                if sets.cut >> i & 1 == 0 {
                    let sample = BsdfSample {
                        direction: at(&next.local, i).into(),
                        weight: Rgb::ONE,
                        pdf,
                        delta: is_delta,
                        transmitted: transmits,
                        eta: block.given.eta[i],
                    };
                    self.estimator.scattered(&self.context, vertex, state, (&sample, is_delta));
                    path.travelled = vertex.travelled;
                    // MIS compares one BSDF sample with n light samples.
                    pdf /= rest.light_samples as f32;
                }
            }
            if sets.cut >> i & 1 == 1 {
                counters.dropped.unfinished += 1;
                continue;
            }
            (path.throughput, path.pdf) = ([r, g, b], pdf);
            (path.position, path.eta_squared) = ([x, y, z], eta_squared);
            let [x, y, z, _] = next.normals[i];
            path.normal = if transmits { [0.0; 3] } else { [x, y, z] };
            path.triangle = block.points.triangle[i];
            path.segments += 1;
            wave.push_ray(index, bytemuck::cast(next.rays[i]));
        }
    }

    /// Queues the next rays of the `single` vertices.
    #[inline]
    pub(super) fn scatter_singly(
        &self,
        memory: &mut PathMemory<E::State, R>,
        wave: &mut Wavefront,
        estimated: &Estimated,
        single: u32,
        counters: &mut Counters,
    ) {
        let mut none = (E::State::zeroed(), R::State::zeroed());
        for i in Set(single) {
            let Some((vertex, rest)) = estimated.at(i) else { continue };
            if rest.ends && !vertex.apart {
                continue;
            }
            let Some(path) = memory.path(wave.paths, vertex.path, &mut none) else { continue };
            if let Some(ray) = self.scatter(path, vertex, rest, counters) {
                wave.push_ray(vertex.path, ray);
            }
        }
    }
}
