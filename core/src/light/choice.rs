//! Lights that samples choose, one by one and for blocks of vertices.

use super::area::Emitter;
use super::environment_visibility::WarpedSample;
use super::sampler::{LightSample, LightSampler, sample_emitter};
use super::tree::ChosenBlock;
use crate::sampling::ONE_MINUS_EPSILON;
use crate::scene::Scene;
use crate::{Level, Rgb};
use glam::Vec3;
use halflight_simd::kernels::shade::direct::LightBlock;
use halflight_simd::kernels::shade::emitter::EmitterBlock;
use halflight_simd::kernels::shade::sky::{SkyBlock, SkySamples};
use halflight_simd::kernels::shade::{BLOCK, Row, Row3, put};

/// Light that [`LightSampler::choose`] chose, with the probability of the choice.
#[derive(Clone, Copy)]
pub(crate) enum ChosenLight<'m> {
    /// Area light number `light`.
    Emitter { emitter: &'m Emitter, light: u32, probability: f32 },
    /// Point or spot number `light`.
    Point { light: u32, probability: f32 },
    /// The environment.
    Environment { probability: f32 },
    /// Directional light number `index`.
    Distant { index: usize, probability: f32 },
}

impl ChosenLight<'_> {
    /// True for a light without extent.
    #[inline]
    fn is_delta(&self) -> bool {
        matches!(self, Self::Point { .. } | Self::Distant { .. })
    }

    /// Makes an area light without texture the light of vertex `i` (below 16) of a block. Returns its first
    /// triangle, the probability of the choice and its number; `None` for other lights.
    #[inline]
    pub(crate) fn put(&self, block: &mut EmitterBlock, i: usize) -> Option<(u32, f32, u32)> {
        match *self {
            Self::Emitter { emitter, probability, light } if !emitter.is_textured() => {
                emitter.put(block, i);
                Some((emitter.triangle, probability, light))
            }
            _ => None,
        }
    }
}

impl<'m> LightSampler<'m> {
    /// Chooses lights for the vertices of a block in `active` by the numbers `u`; `None` in scenes with an
    /// environment or directional lights.
    #[inline]
    pub(crate) fn choose_block(&self, places: (&Row3, &Row3), u: &Row, active: u32) -> Option<ChosenBlock> {
        let is_near = self.environment_weight + self.distant_weight == 0.0;
        is_near.then(|| self.tree.sample_block(places, u, active))
    }

    /// Light of vertex `i` of a block.
    #[inline]
    pub(crate) fn chosen(&self, block: &ChosenBlock, i: usize) -> ChosenLight<'m> {
        self.light(block.lights[i % BLOCK], block.probabilities[i % BLOCK])
    }

    /// Light number `light` of the tree.
    #[inline]
    pub(super) fn light(&self, light: u32, probability: f32) -> ChosenLight<'m> {
        match self.emitters.get(light as usize) {
            Some(emitter) => ChosenLight::Emitter { emitter, light, probability },
            None => ChosenLight::Point { light, probability },
        }
    }

    /// Makes the only light, an area light without texture, the light of every vertex of a block. Returns its
    /// first triangle and the probability of the choice; `None` in other scenes.
    #[inline]
    pub(crate) fn put_lone(&self, block: &mut EmitterBlock) -> Option<(u32, f32)> {
        let [emitter] = self.emitters else { return None };
        if self.count() > 1 || emitter.is_textured() {
            return None;
        }
        (block.triangles, block.rectangles, block.two_sided) = (0, 0, 0);
        (0..16).for_each(|i| emitter.put(block, i));
        Some((emitter.triangle, 1.0))
    }

    /// Chooses the light of a sample by the number `choice`.
    #[inline]
    pub(crate) fn choose(&self, position: Vec3, normal: Vec3, choice: f32) -> Option<ChosenLight<'m>> {
        let shares = self.kind_probabilities(position, normal);
        let choice = match self.leaves_out_delta {
            true => {
                let [left_out, left] = self.kinds_left(&shares);
                left_out + choice * left
            }
            false => choice,
        };
        if choice < shares.tree {
            let rescaled = (choice / shares.tree).min(ONE_MINUS_EPSILON);
            let (light, probability, _) = self.tree.sample(position, normal, rescaled)?;
            let probability = probability * shares.tree;
            return Some(self.light(light, probability));
        }
        let choice = choice - shares.tree;
        if choice < shares.environment {
            return Some(ChosenLight::Environment { probability: shares.environment });
        }
        let choice = ((choice - shares.environment) / shares.distant).clamp(0.0, ONE_MINUS_EPSILON);
        let (index, probability, _) = self.distant_table.sample(choice)?;
        Some(ChosenLight::Distant { index, probability: probability * shares.distant })
    }

    /// Puts the environment into a block, sampled at `u` or as `warped` by its visibility, as the light of
    /// vertex `i` that is chosen with `probability`. False without a sample.
    #[inline]
    pub(crate) fn put_environment(
        &self,
        block: &mut SkyBlock,
        i: usize,
        (normal, u): (Vec3, [f32; 2]),
        warped: Option<WarpedSample>,
        probability: f32,
    ) -> bool {
        let (u, normal, density) = match warped {
            Some(WarpedSample { place, density }) => (place, Vec3::ZERO, density),
            None => (u, normal, 1.0),
        };
        put(&mut block.normal, i, normal.to_array());
        [block.factors[0][i & 15], block.factors[1][i & 15]] = [density, probability];
        self.environment.is_some_and(|environment| environment.put(block, i, u))
    }

    /// Number of the environment in the order of emission.
    #[inline]
    pub(crate) fn environment_number(&self) -> u32 {
        (self.in_tree() + self.distant.len()) as u32
    }

    /// Samples the environment at the vertices of `active`, into the block of lights. The radiance is still
    /// to be multiplied by that of the environment. Returns the set of samples.
    #[inline]
    pub(crate) fn sample_environments(
        &self,
        (scene, level): (&Scene, Level),
        sky: &SkyBlock,
        light: &mut LightBlock,
        active: u32,
    ) -> u32 {
        let (Some(sampler), Some(environment)) = (&self.environment, &scene.environment) else { return 0 };
        let samples = SkySamples { sky, to_world: sampler.map_to_world(environment), active };
        let exists = samples.compute(level, &mut light.direction, &mut light.pdf);
        (0..BLOCK).filter(|i| exists >> i & 1 == 1).for_each(|i| put(&mut light.radiance, i, [1.0; 3]));
        light.exists |= exists;
        if self.has_visibility() {
            light.balance |= exists;
        }
        exists
    }

    /// [`LightSampler::sample_deferred`] of a chosen light.
    #[inline]
    pub(crate) fn sample_chosen(
        &self,
        scene: &Scene,
        position: Vec3,
        normal: Vec3,
        u: [f32; 2],
        chosen: ChosenLight,
        warped: Option<WarpedSample>,
    ) -> Option<(LightSample, bool)> {
        if self.leaves_out_delta && chosen.is_delta() {
            return None;
        }
        match chosen {
            ChosenLight::Emitter { emitter, light, probability } => {
                let sample = sample_emitter(scene, emitter, position, normal, u, probability)?;
                Some((LightSample { light, ..sample }, false))
            }
            ChosenLight::Point { light, probability } => {
                let sample = self.sample_point(scene, light, position, probability)?;
                Some((LightSample { light, ..sample }, false))
            }
            ChosenLight::Environment { probability } => {
                let (sampler, environment) = (self.environment?, scene.environment.as_ref()?);
                let (direction, pdf) = match warped {
                    Some(warped) => sampler.sample_at(environment, warped)?,
                    None => sampler.sample(environment, normal, u)?,
                };
                let light = self.environment_number();
                Some((LightSample::far(direction, Rgb::ONE, pdf * probability, light), true))
            }
            ChosenLight::Distant { index, probability } => {
                let light = (self.in_tree() + index) as u32;
                let sample = self.sample_distant(scene, index, probability)?;
                Some((LightSample { light, ..sample }, false))
            }
        }
    }
}
