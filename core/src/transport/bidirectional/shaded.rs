//! A vertex of a camera path whose light sample and next ray have been computed in lanes.

use crate::Rgb;
use crate::bsdf::{Bsdf, BsdfSample, Features};
use crate::geometry::Ray;
use crate::light::LightSample;
use crate::transport::walk::block::Block;
use crate::transport::walk::block_scatter::Sets;
use crate::transport::walk::context::SceneContext;
use glam::Vec3;
use halflight_simd::kernels::shade::at;

/// A vertex of a block, with its light sample and next ray.
#[derive(Clone, Copy)]
pub(in crate::transport) struct Shaded<'s> {
    pub(in crate::transport) block: &'s Block<'s>,
    pub(in crate::transport) sets: &'s Sets,
    pub(in crate::transport) i: usize,
}

/// A light sample, with f |cos| of its direction and the density of BSDF sampling there.
pub(in crate::transport) struct Lit {
    pub(in crate::transport) light: LightSample,
    pub(in crate::transport) value: Rgb,
    pub(in crate::transport) pdf: f32,
    pub(in crate::transport) ray: Ray,
}

/// The next ray of a path.
pub(super) struct Next {
    pub(super) ray: Ray,
    pub(super) sample: BsdfSample,
    pub(super) throughput: [f32; 3],
    pub(super) eta_squared: f32,
    pub(super) is_cut: bool,
}

impl<'s> Shaded<'s> {
    /// BSDF at the vertex.
    pub(in crate::transport) fn bsdf(&self) -> &'s Bsdf {
        &self.block.others[self.i & 15]
    }

    fn is_in(&self, set: u32) -> bool {
        set >> (self.i & 15) & 1 == 1
    }

    /// The light sample of the vertex, with its radiance in the scene of `context`.
    pub(in crate::transport) fn lit<F: Features>(&self, context: &SceneContext<F>) -> Option<Lit> {
        let Self { block, i, .. } = *self;
        let (scene, light, i) = (context.scene, &block.light, i & 15);
        let [r, g, b, pdf] = block.shadows.contribution[i];
        if !self.is_in(block.shadows.exists) {
            return None;
        }
        let direction = Vec3::from(at(&light.direction, i));
        let environment = scene.environment.as_ref().filter(|_| self.is_in(block.environment));
        let factor = environment.map_or(Rgb::ONE, |e| e.radiance(scene, direction));
        let radiance = Rgb::from(at(&light.radiance, i)) * factor;
        Some(Lit {
            light: LightSample {
                direction,
                distance: block.distance[i],
                target: None,
                radiance,
                pdf: light.pdf[i],
                delta: self.is_in(light.alone),
                light: block.sampled[i],
            },
            value: Rgb::new(r, g, b),
            pdf,
            ray: block.shadow_ray(context, i),
        })
    }

    /// The next ray; `None` if the path ends.
    pub(super) fn next(&self) -> Option<Next> {
        let Self { block, sets, i } = *self;
        let (next, i) = (&block.next, i & 15);
        let [r, g, b, pdf, .., eta_squared] = next.states[i];
        let delta = self.is_in(sets.delta);
        let direction = Vec3::from(at(&next.local, i));
        self.is_in(next.exists).then(|| Next {
            ray: bytemuck::cast(next.rays[i]),
            sample: BsdfSample {
                direction,
                weight: Rgb::ONE,
                pdf,
                delta,
                transmitted: direction.z < 0.0,
                eta: block.given.eta[i],
            },
            throughput: [r, g, b],
            eta_squared,
            is_cut: self.is_in(sets.cut),
        })
    }
}
