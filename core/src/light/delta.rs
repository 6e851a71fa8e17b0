//! Delta lights: points, spots and directional lights, which no path hits. Their light at a point has no
//! random numbers, so that all of few lights are evaluated once where many samples start at the same point.

use super::emitted::spot_falloff;
use super::sampler::{KindProbabilities, LightSample, LightSampler};
use crate::scene::{PointLight, Scene};
use glam::Vec3;

/// Most delta lights that are evaluated at a point.
const FEW: usize = 16;

impl LightSampler<'_> {
    /// True if there are point or directional lights, which no path hits.
    pub(crate) fn has_delta_lights(&self) -> bool {
        !self.points.is_empty() || !self.distant.is_empty()
    }

    /// Number of delta lights, if they are few enough for all to be evaluated; otherwise 0.
    pub(crate) fn few_delta_lights(&self) -> usize {
        let count = self.points.len() + self.distant.len();
        if count <= FEW { count } else { 0 }
    }

    /// Light from delta light number `index` at `position`, as a sample of probability 1.
    pub(crate) fn delta_light(&self, scene: &Scene, index: usize, position: Vec3) -> Option<LightSample> {
        match index.checked_sub(self.points.len()) {
            None => self.sample_point(scene, (self.emitters.len() + index) as u32, position, 1.0),
            Some(distant) => self.sample_distant(scene, distant, 1.0),
        }
    }

    /// Sampler of the other lights. Samples have the densities of all lights, with which paths weigh the
    /// lights that they hit, and stand for [`LightSampler::fraction_left`] of a sample.
    pub(crate) fn without_delta_lights(&self) -> Self {
        Self { leaves_out_delta: true, ..*self }
    }

    /// Probability of the kinds of lights that are sampled at a point: 1 unless delta lights are left out.
    #[inline]
    pub(crate) fn fraction_left(&self, position: Vec3, normal: Vec3) -> f32 {
        match self.leaves_out_delta {
            true => self.kinds_left(&self.kind_probabilities(position, normal))[1],
            false => 1.0,
        }
    }

    /// Probabilities of the kinds that have delta lights alone: those in the tree, and of the kinds that have
    /// others.
    #[inline]
    pub(super) fn kinds_left(&self, shares: &KindProbabilities) -> [f32; 2] {
        let tree = if self.emitters.is_empty() { shares.tree } else { 0.0 };
        [tree, 1.0 - shares.distant - tree]
    }

    /// Sample of the point or spot that is `light` of the tree.
    pub(super) fn sample_point(
        &self,
        scene: &Scene,
        light: u32,
        from: Vec3,
        probability: f32,
    ) -> Option<LightSample> {
        let index = *self.points.get(light as usize - self.emitters.len())?;
        let (position, intensity) = match scene.lights.get(index as usize)? {
            PointLight::Point { position, intensity } => (*position, *intensity),
            PointLight::Spot { position, direction, intensity, cos_inner, cos_outer } => {
                let cos = (from - *position).normalize_or_zero().dot(*direction);
                (*position, *intensity * spot_falloff(cos, *cos_inner, *cos_outer))
            }
            PointLight::Directional { .. } => return None,
        };
        let to_light = position - from;
        let distance = to_light.length();
        let radiance = intensity / distance / distance;
        if !(distance > 0.0 && radiance.max_element() > 0.0) {
            return None;
        }
        let direction = to_light / distance;
        let sample = LightSample::far(direction, radiance, probability, light);
        Some(LightSample { distance, delta: true, ..sample })
    }

    /// Sample of directional light number `index`.
    pub(super) fn sample_distant(
        &self,
        scene: &Scene,
        index: usize,
        probability: f32,
    ) -> Option<LightSample> {
        match scene.lights.get(*self.distant.get(index)? as usize)? {
            PointLight::Directional { direction, irradiance } => {
                let sample = LightSample::far(-*direction, *irradiance, probability, 0);
                Some(LightSample { delta: true, ..sample })
            }
            _ => None,
        }
    }
}
