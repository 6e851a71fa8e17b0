//! Lights without surface in the coordinates of files, and their move to those of the core.

use super::notes::Notes;
use super::scene_file::BRIGHTEST;
use super::transform::SceneTransform;
use halflight_core::scene::PointLight;

/// A light in f64: `light` has its direction and cone.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedLight {
    /// Position of a point or spot light.
    pub(super) position: [f64; 3],
    /// Radiant intensity, W/sr, or irradiance, W/m².
    pub(super) power: [f64; 3],
    pub(super) light: PointLight,
}

impl PlacedLight {
    /// A light with f32 coordinates.
    pub(super) fn new(light: PointLight) -> Self {
        let (position, power) = match light {
            PointLight::Point { position, intensity } | PointLight::Spot { position, intensity, .. } => {
                (position, intensity)
            }
            PointLight::Directional { irradiance, .. } => (glam::Vec3::ZERO, irradiance),
        };
        let [position, power] = [position.to_array(), power.to_array()].map(|vector| vector.map(f64::from));
        Self { position, power, light }
    }

    /// The light in the coordinates of the core; too bright ones are limited, those beyond f32 left out.
    pub(super) fn in_core(&self, transform: &SceneTransform, notes: &mut Notes) -> Option<PointLight> {
        let mut light = self.light;
        if !transform.point(self.position).is_finite() {
            notes.add(1, "light at a position that is not finite left out");
            return None;
        }
        let factor = match light {
            PointLight::Directional { .. } => 1.0,
            _ => transform.intensity_factor(),
        };
        let channels = self.power.map(|channel| channel * factor);
        if channels.iter().any(|&channel| channel > BRIGHTEST) {
            notes.add(1, format!("light too bright for a scene of this size is limited to {BRIGHTEST:e}"));
        }
        let power = channels.map(|channel| channel.min(BRIGHTEST) as f32).into();
        match &mut light {
            PointLight::Point { position, intensity } | PointLight::Spot { position, intensity, .. } => {
                (*position, *intensity) = (transform.point(self.position), power);
            }
            PointLight::Directional { irradiance, .. } => *irradiance = power,
        }
        Some(light)
    }
}
