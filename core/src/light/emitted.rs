//! Radiance and power of a single light.

use super::area::{Emitter, Place};
use super::luminance;
use crate::Rgb;
use crate::features::All;
use crate::sampling::{Sampler, warp::uniform_triangle};
use crate::scene::{Attributes, Material, PointLight, Scene};

/// Points for the mean of a textured emission.
const TEXTURE_SAMPLES: u32 = 16;

/// Radiance that `triangle` emits at a point with these attributes, to its front or its back.
#[inline]
pub fn emitted(scene: &Scene, triangle: u32, attributes: &Attributes, front: bool) -> Rgb {
    match scene.mesh.material(triangle).and_then(|material| scene.materials.get(material as usize)) {
        Some(material) if front || material.two_sided => {
            // Textures may hold negative numbers; radiance may not.
            material.emission.at::<All>(scene, attributes).max(Rgb::ZERO)
        }
        _ => Rgb::ZERO,
    }
}

/// Radiance of the light at a point, times the opacity of a cut-out surface.
#[inline]
pub(super) fn emitted_at(scene: &Scene, emitter: &Emitter, place: &Place, front: bool) -> Rgb {
    if !emitter.is_textured() {
        return emitted(scene, place.triangle, &Attributes::NONE, front);
    }
    let attributes = &scene.mesh.attributes_at(place.triangle, place.barycentric);
    let opacity = material_of(scene, place.triangle).map_or(1.0, |m| m.opacity.at::<All>(scene, attributes));
    emitted(scene, place.triangle, attributes, front) * opacity.clamp(0.0, 1.0)
}

/// Mean luminance of a light, positive if its material emits at all.
pub(super) fn mean_luminance(scene: &Scene, emitter: &Emitter) -> f64 {
    let Some(material) = material_of(scene, emitter.triangle) else { return 0.0 };
    let constant = f64::from(luminance(material.emission.value));
    if !emitter.is_textured() {
        return constant;
    }
    let samples = (0..TEXTURE_SAMPLES).map(|i| {
        let u = Sampler::new(0, 0, i).pair(0);
        let place = emitter.place(if emitter.is_pair() { u } else { uniform_triangle(u).into() });
        f64::from(luminance(emitted_at(scene, emitter, &place, true)))
    });
    let mean = samples.filter(|l| l.is_finite()).sum::<f64>() / f64::from(TEXTURE_SAMPLES);
    // Sixteen points may miss emission.
    mean.max(1e-3 * constant)
}

fn material_of<'s>(scene: &'s Scene, triangle: u32) -> Option<&'s Material> {
    scene.materials.get(scene.mesh.material(triangle)? as usize)
}

/// Luminance of the intensity or irradiance; zero if not finite.
pub(super) fn strength(light: &PointLight) -> f64 {
    let color = match light {
        PointLight::Point { intensity, .. } | PointLight::Spot { intensity, .. } => intensity,
        PointLight::Directional { irradiance, .. } => irradiance,
    };
    let strength = f64::from(luminance(*color));
    if strength.is_finite() { strength.max(0.0) } else { 0.0 }
}

/// 1 inside the inner cone, 0 outside the outer cone, and linear in the angle in between.
pub(super) fn spot_falloff(cos: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    if cos >= cos_inner {
        return 1.0;
    }
    if cos <= cos_outer {
        return 0.0;
    }
    let [inside, angle, outside] = [cos_inner, cos, cos_outer].map(libm::acosf);
    (outside - angle) / (outside - inside)
}
