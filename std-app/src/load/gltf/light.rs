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

/// Width of the ramp that comes closest to the soft edge of a Blender lamp, in widths of that edge.
const RAMP: f64 = 0.8;

/// Cone with the falloff of a Blender lamp. Its exporter writes the blend b of a lamp as 1 - inner / outer.
/// Its light falls from cos outer + b (1 - cos outer) to cos outer by a cubic; ours is linear in the angle,
/// of the same power.
fn of_blender([inner, outer]: [f64; 2]) -> [f64; 2] {
    let height = 1.0 - outer.cos();
    let edge = (1.0 - inner / outer) * height;
    let width = RAMP * edge / (outer.cos() + 0.5 * edge).acos().sin();
    if width.is_nan() || width <= 1e-6 {
        return [inner, outer];
    }
    // The power of a ramp from a to b, over 2π, is 1 - (sin b - sin a) / (b - a); it grows with the middle.
    let power = |middle: f64| {
        let [a, b] = [middle - 0.5 * width, middle + 0.5 * width];
        1.0 - (b.sin() - a.sin()) / width
    };
    let (mut low, mut high) = (0.5 * width, outer);
    for _ in 0..50 {
        let middle = low.midpoint(high);
        if power(middle) < height - 0.5 * edge { low = middle } else { high = middle }
    }
    [low - 0.5 * width, (low + 0.5 * width).min(outer)]
}

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
            let [inner, outer] = match document.asset.generator.contains("Blender") {
                true => of_blender([inner, outer]),
                false => [inner, outer],
            };
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
