//! Next rays of the paths at the vertices of a block.

use super::Estimated;
use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Diffuse, Features};
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::LightEstimator;
use crate::transport::path::scalar::Path;
use crate::transport::path::sharing::{PathMemory, Sharing};
use crate::transport::settings::Counters;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::block_stages::Numbered;
use crate::transport::walk::points::Set;
use crate::transport::wavefront::Wavefront;
use bytemuck::Zeroable;
use halflight_simd::kernels::shade::{at, put};

impl<'a, F: Features, E: LightEstimator<F>, R: Sharing> PathIntegrator<'a, F, E, R> {
    /// Samples the next rays of the paths of `onward`.
    #[inline]
    pub(super) fn scatter_in_block(
        &self,
        (block, memory): (&mut Block<'a>, &mut PathMemory<E::State, R>),
        wave: &mut Wavefront,
        estimated: &Estimated<'_, 'a>,
        (stage, onward): (&Numbered, u32),
        counters: &mut Counters,
    ) {
        if onward == 0 {
            return;
        }
        let level = self.context.level;
        let mut sets = block.sample_bsdfs::<F>(level, stage, onward);
        if !E::ADDS_NOTHING {
            // A coat over a cached base is dark, but all noise of the pixel is its own.
            let dark = |i: &usize| block.segments[*i] == 1 && block.coats.base_weight[*i] < 1.0;
            sets.certain |= Set(sets.coat).filter(dark).fold(0, |set, i| set | 1 << i);
        }
        if R::IN_CIRCLES {
            self.leave((block, memory), wave, &mut sets);
        }
        block.scatter(level, &sets);
        self.go_on((block, memory), wave, estimated, &sets, counters);
    }

    /// Calls the sharing rule for the samples of coats and rare surfaces and for the paths that leave diffuse
    /// surfaces, and sets their factors to the light of the pixel.
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
            if block.has_others() >> i & 1 == 1 {
                let bit = |set: u32| set >> i & 1 == 1;
                R::sample_bsdf(shared, || match bit(sets.delta | sets.coat) {
                    true => Rgb::ZERO,
                    false if bit(block.coats.apart) => Rgb::ONE,
                    false => {
                        let f = Rgb::from(at(&block.given.weight, i)) * block.given.pdf[i];
                        let wi = at(&block.given.direction, i).into();
                        block.others[i].base_part(at(&block.points.surface.wo, i).into(), wi, f)
                    }
                });
            }
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
                let is_coat = is_delta || sets.coat >> i & 1 == 1;
                let classes = if is_coat { Some(rest.narrow) } else { rest.wide };
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
                    self.estimator.scattered(&self.context, vertex, state, (&sample, is_coat));
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
