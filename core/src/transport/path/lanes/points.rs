//! Points whose irradiance is estimated, as the first vertices of a block: white surfaces that are viewed
//! along their normals.

use super::Estimated;
use crate::bsdf::Features;
use crate::sampling::Sampler;
use crate::transport::path::PathIntegrator;
use crate::transport::path::estimator::{LightEstimator, RemainingLight};
use crate::transport::path::point_samples::Starts;
use crate::transport::path::points::WHITE;
use crate::transport::path::sharing::PathWave;
use crate::transport::settings::Counters;
use crate::transport::walk::block::Block;
use crate::transport::walk::points::Set;
use bytemuck::Zeroable;
use glam::Vec3;
use halflight_simd::kernels::shade::{BLOCK, at, put};

impl<'a, F: Features, E: LightEstimator<F>> PathIntegrator<'a, F, E> {
    /// Light samples and next rays of paths at their points.
    pub(in crate::transport::path) fn leave_in_block(
        &self,
        block: &mut Block<'a>,
        starts: &Starts<'_, 'a, E::Found>,
        PathWave { wave, memory }: &mut PathWave<E::State, ()>,
        counters: &mut Counters,
    ) {
        let (level, lights) = (self.context.level, &self.context.lights);
        let mut none = (E::State::zeroed(), ());
        let mut estimated = Estimated { vertices: [const { None }; BLOCK] };
        let (mut lit, mut onward) = (0, 0);
        let stage = block.clear();
        for (i, point) in starts.surfaces.iter().enumerate() {
            let (Some(point), index) = (point, starts.first + i) else { continue };
            let Some(path) = memory.path(wave.paths, index, &mut none) else { continue };
            block.points.put_at_normal(i, point);
            (block.path[i], block.segments[i], block.eta_squared[i]) = (index as u32, 1, 1.0);
            (block.samples.place[i], block.samples.index[i]) =
                Sampler::place(self.settings.seed, path.path.pixel, path.path.sample);
            put(&mut block.throughput, i, [1.0; 3]);
            block.put::<F>(&stage, i, &WHITE);
            let rest = if E::ADDS_NOTHING {
                let rest = starts.part.rest(RemainingLight::of(path.path.classes));
                path.path.classes = rest.wide.unwrap_or(path.path.classes);
                rest
            } else {
                let vertex = self.start_vertex(index, path.path, point);
                let rest = self.rest_at_start(path, &vertex, (starts.part, starts.found[i]));
                (block.light_samples[i], block.each[i]) =
                    (rest.light_samples, 1.0 / rest.light_samples as f32);
                estimated.vertices[i] = Some((vertex, rest));
                rest
            };
            lit |= u32::from(!rest.is_lit) << i;
            onward |= u32::from(!rest.ends && rest.wide.is_some()) << i;
        }
        let filled = block.see(level, stage);
        let stage = block.number(level, filled, lights.has_many_lights());
        if !lights.is_empty() {
            for i in Set(lit) {
                let [position, normal] = [&block.points.surface.position, &block.points.surface.frame[2]]
                    .map(|rows| Vec3::from(at(rows, i)));
                put(&mut block.throughput, i, [lights.fraction_left(position, normal); 3]);
            }
            self.direct_in_block((block, memory), wave, &estimated, (&stage, lit));
            block.throughput = [[1.0; BLOCK]; 3];
        }
        self.scatter_in_block((block, memory), wave, &estimated, (&stage, onward), counters);
        for (i, point) in starts.surfaces.iter().enumerate() {
            point.iter().for_each(|point| self.clear_free(memory, starts.first + i, point));
        }
    }
}
