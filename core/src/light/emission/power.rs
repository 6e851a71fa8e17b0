//! Power of lights, by which photons are emitted.

use crate::light::emitted::{mean_luminance, strength};
use crate::light::sampler::LightSampler;
use crate::scene::{PointLight, Scene};

/// Approximate luminance of the power of light `i`, with a disc of area `disc` for infinite light.
pub(super) fn power(scene: &Scene, lights: &LightSampler, disc: f64, i: usize) -> f64 {
    const PI: f64 = core::f64::consts::PI;
    if let Some(emitter) = lights.emitters.get(i) {
        let sides = if emitter.is_two_sided() { 2.0 } else { 1.0 };
        return PI * mean_luminance(scene, emitter) * f64::from(emitter.area) * sides;
    }
    match lights.without_surface(scene, i) {
        Some(light @ PointLight::Point { .. }) => 4.0 * PI * strength(light),
        Some(light @ PointLight::Spot { cos_outer, .. }) => {
            2.0 * PI * (1.0 - f64::from(*cos_outer)) * strength(light)
        }
        Some(light @ PointLight::Directional { .. }) => disc * strength(light),
        None => 4.0 * PI * disc * lights.environment.map_or(0.0, |sky| f64::from(sky.mean)),
    }
}
