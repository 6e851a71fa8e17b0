//! Camera paths of a block in lanes: their light samples and next rays, before their vertices are visited one
//! by one.

use crate::bsdf::{COATS, Features};
use crate::geometry::Ray;
use crate::sampling::Sampler;
use crate::transport::bidirectional::camera_path::CameraPath;
use crate::transport::bidirectional::camera_paths::CameraPaths;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::points::Set;
use halflight_simd::kernels::shade::put;

impl<'a, F: Features> CameraPaths<'a, F> {
    /// Light samples and next rays of the paths of `rays`, at most sixteen, whose points are in `block`.
    pub(super) fn shade(
        &self,
        block: &mut Block<'a>,
        (paths, sample): (&[CameraPath], u32),
        rays: &[Ray],
    ) -> Sets {
        let Self { context, settings, .. } = self;
        let (level, lights) = (context.level, &context.lights);
        block.clear_bsdfs();
        let mut onward = 0;
        for i in Set(block.points.met) {
            let Some(path) = rays.get(i).and_then(|ray| paths.get(ray.tag as usize)) else { continue };
            if path.segments >= settings.max_depth {
                continue;
            }
            block.segments[i] = path.segments;
            block.eta_squared[i] = path.eta_squared;
            put(&mut block.throughput, i, path.throughput);
            (block.samples.place[i], block.samples.index[i]) =
                Sampler::place(settings.seed, path.pixel, sample);
            let bsdf = block.points.bsdf::<F>(context.scene, i);
            block.put_bsdf::<F>(i, &bsdf, path.segments);
            block.others[i] = bsdf;
            onward |= 1 << i;
        }
        if onward == 0 {
            return Sets::default();
        }
        if block.coats.exists != 0 {
            block.coats.see(level, &block.points.surface, &COATS);
        }
        block.number(level, lights.has_many_lights());
        block.reach_lights(context, onward);
        let sets = block.sample_bsdfs::<F>(level, onward);
        block.scatter(level, &sets);
        sets
    }
}
