//! Punctual lights (`KHR_lights_punctual`). Candela and lux become W/sr and W/m² by 683 lm/W, the luminous
//! efficacy by which exporters convert.

use super::Source;
use super::json::{Document, Light};
use crate::load::placed::Placement;
use crate::load::placed_light::PlacedLight;
use core::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use glam::DVec3;
use halflight_core::Rgb;
use halflight_core::scene::PointLight;

/// Lumen per watt.
const EFFICACY: f64 = 683.0;

/// The light of a node, along its −z axis.
pub(super) fn light(
    document: &Document,
    number: usize,
    placement: &Placement,
    source: &mut Source,
) -> Option<PlacedLight> {
    let Some(light) = document.extensions.lights.lights.get(number) else {
        source.note("light that does not exist left out");
        return None;
    };
    let Light { color, intensity, .. } = light;
    let color = color.unwrap_or([1.0; 3]).map(|channel| channel.max(0.0));
    let power = color.map(|channel| channel * intensity.unwrap_or(1.0).max(0.0) / EFFICACY);
    let position = placement.offset;
    let Some(direction) = (placement.linear * DVec3::NEG_Z).try_normalize() else {
        source.note("light without a direction left out");
        return None;
    };
    let direction = direction.as_vec3();
    let light = match &light.kind[..] {
        "point" => PointLight::Point { position: position.as_vec3(), intensity: Rgb::ZERO },
        "spot" => {
            let outer = light.spot.outer_cone_angle.unwrap_or(FRAC_PI_4).clamp(1e-3, FRAC_PI_2);
            let inner = light.spot.inner_cone_angle.clamp(0.0, outer);
            PointLight::Spot {
                position: position.as_vec3(),
                direction,
                intensity: Rgb::ZERO,
                cos_inner: inner.cos() as f32,
                cos_outer: outer.cos() as f32,
            }
        }
        "directional" => PointLight::Directional { direction, irradiance: Rgb::ZERO },
        other => {
            let short: String = other.chars().take(24).collect();
            source.note(format!("light of the unknown kind `{short}` left out"));
            return None;
        }
    };
    Some(PlacedLight { position: position.into(), power, light })
}
