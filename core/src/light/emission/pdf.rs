//! Density of emission at paths from the camera, for MIS between light paths and camera paths.
//!
//! A light path leaves its light at x₀ into ω with density p(x₀) p(ω). The étendue dA cos θ dω therefore has
//! density p(x₀) p(ω) / cos θ. Étendue is invariant along the path. The same number over the density of the
//! direction in which a camera path hits x₀ is the ratio of the densities of both paths
//! (`transport/caustics/merge.rs`).

use super::EmissionSampler;
use crate::light::sampler::{LightSample, LightSampler};
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_cone_pdf};
use crate::scene::{PointLight, Scene};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Kinds of light by the techniques of camera paths that find them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightType {
    /// Light with a surface, found by hits and by next-event estimation.
    Area,
    /// Environment, found by escape and by next-event estimation.
    Infinite,
    /// Light without extent, found by next-event estimation alone.
    Delta,
}

impl LightSampler<'_> {
    /// Index of the emitter that contains `triangle`.
    #[cfg(feature = "reference")]
    pub(crate) fn emitter_index(&self, triangle: u32) -> Option<u32> {
        self.emitter_of(triangle).map(|(index, _)| index as u32)
    }

    /// Index of the environment in the order of emission, the last of all lights.
    #[cfg(feature = "reference")]
    pub(crate) fn environment_index(&self) -> u32 {
        (self.finite_count() + self.distant.len()) as u32
    }
}

impl EmissionSampler<'_> {
    /// Density of emissive `triangle` at `place` in unit direction `way`, per m² sr of étendue.
    pub(crate) fn density_of_surface(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        triangle: u32,
        (place, way): (Vec3, Vec3),
    ) -> f32 {
        lights
            .emitter_of(triangle)
            .map_or(0.0, |(index, _)| self.density_of_emitter(scene, lights, index, (place, way)))
    }

    /// Density of emitter `index` at `place` in unit direction `way`, per m² sr of étendue.
    pub(crate) fn density_of_emitter(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        index: usize,
        (place, way): (Vec3, Vec3),
    ) -> f32 {
        let Some(emitter) = lights.emitters.get(index) else { return 0.0 };
        let sides = if emitter.is_two_sided() { 2.0 } else { 1.0 };
        self.density(scene, lights, index, way, place) * FRAC_1_PI / (emitter.area * sides)
    }

    /// Density of the environment in unit `direction` from `position`, per m² sr of étendue.
    pub(crate) fn density_of_environment(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        direction: Vec3,
        position: Vec3,
    ) -> f32 {
        match (&lights.environment, &scene.environment) {
            (Some(sampler), Some(environment)) => {
                let index = lights.finite_count() + lights.distant.len();
                let density = self.density(scene, lights, index, -direction, position);
                let of_line = self.entrance.density(direction, position);
                density * sampler.pdf(environment, Vec3::ZERO, direction) * of_line
            }
            _ => 0.0,
        }
    }

    /// Density of a light without extent at `position`, per m² of surface that faces it.
    pub(crate) fn density_of_delta(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        light: u32,
        position: Vec3,
    ) -> f32 {
        let index = light as usize;
        let ((way, on), density) = match lights.without_surface(scene, index) {
            Some(PointLight::Point { position: from, .. }) => {
                ((position - *from, *from), UNIFORM_SPHERE_PDF / from.distance_squared(position))
            }
            Some(PointLight::Spot { position: from, cos_outer, .. }) => {
                let spread = uniform_cone_pdf(1.0 - cos_outer);
                ((position - *from, *from), spread / from.distance_squared(position))
            }
            Some(PointLight::Directional { direction, .. }) => {
                ((*direction, position), self.entrance.density(*direction, position))
            }
            None => return 0.0,
        };
        self.density(scene, lights, index, way.normalize_or_zero(), on) * density
    }

    /// Density of the light of `sample`, drawn at `position`: per m² sr of étendue, for a delta light per m²
    /// of surface that faces it.
    pub(crate) fn density_of_sample(
        &self,
        scene: &Scene,
        lights: &LightSampler,
        sample: &LightSample,
        position: Vec3,
    ) -> f32 {
        let (light, direction) = (sample.light, sample.direction);
        match self.light_type(lights, light) {
            LightType::Area => {
                let place = position + sample.distance * direction;
                self.density_of_emitter(scene, lights, light as usize, (place, -direction))
            }
            LightType::Infinite => self.density_of_environment(scene, lights, direction, position),
            LightType::Delta => self.density_of_delta(scene, lights, light, position),
        }
    }

    /// Type of `light`, in the order of emission.
    pub(crate) fn light_type(&self, lights: &LightSampler, light: u32) -> LightType {
        let index = light as usize;
        if index < lights.emitters.len() {
            LightType::Area
        } else if index < lights.finite_count() + lights.distant.len() {
            LightType::Delta
        } else {
            LightType::Infinite
        }
    }
}
