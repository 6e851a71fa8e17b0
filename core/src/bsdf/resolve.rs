//! From a material of the scene to the BSDF of a hit: textures are looked up, numbers brought into range.

use super::range::{GREATEST_INDEX, unit, unit_rgb};
use super::{Bsdf, Conductor, Dielectric, Diffuse, Features, Glossy, Mirror, Plastic, RoughDielectric};
use crate::Rgb;
use crate::scene::{ColorInput, Material, SMOOTH_ALPHA, ScalarInput, Scene, Surface};
use glam::Vec2;

impl Bsdf {
    /// What `material` does with light at texture coordinates `uv`, seen from its front or its back.
    #[inline]
    pub fn at<F: Features>(scene: &Scene, material: &Material, uv: Vec2, front: bool) -> Bsdf {
        let color = |input: &ColorInput| unit_rgb(input.at::<F>(scene, uv));
        let alpha = |input: &ScalarInput| alpha(input.at::<F>(scene, uv));
        match &material.surface {
            Surface::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse { reflectance: color(reflectance) }),
            Surface::Mirror { reflectance } if F::GLOSSY => {
                Bsdf::Mirror(Mirror { reflectance: color(reflectance) })
            }
            Surface::Conductor { reflectance, roughness } if F::GLOSSY => {
                Bsdf::Conductor(Conductor { f0: color(reflectance), alpha: alpha(roughness) })
            }
            Surface::Glossy { base, specular, roughness, metallic, ior } if F::GLOSSY => {
                let (base, specular) = (color(base), color(specular));
                let (alpha, metallic) = (alpha(roughness), unit(metallic.at::<F>(scene, uv)));
                match *ior {
                    Some(ior) => Bsdf::Plastic(Plastic::new(base, specular, alpha, metallic, ior)),
                    None if specular == Rgb::ZERO && metallic == 0.0 => {
                        Bsdf::Diffuse(Diffuse { reflectance: base })
                    }
                    None => Bsdf::Glossy(Glossy::new(base, specular, alpha, metallic)),
                }
            }
            Surface::Dielectric { ior, tint, roughness } if F::DIELECTRIC => {
                dielectric(*ior, front, unit_rgb(*tint), alpha(roughness))
            }
            // A feature that the census did not find: nothing comes back.
            _ => Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO }),
        }
    }
}

/// GGX alpha of a roughness; 0 where the lobe is too narrow for its width to matter.
#[inline]
fn alpha(roughness: f32) -> f32 {
    let alpha = unit(roughness * roughness);
    if alpha < SMOOTH_ALPHA { 0.0 } else { alpha }
}

#[inline]
fn dielectric(ior: f32, front: bool, tint: Rgb, alpha: f32) -> Bsdf {
    let ior =
        if ior > 0.0 && ior.is_finite() { ior.clamp(1.0 / GREATEST_INDEX, GREATEST_INDEX) } else { 1.0 };
    let eta = if front { ior } else { 1.0 / ior };
    // A rough boundary scatters what it transmits by alpha (eta - 1) only.
    if alpha * (eta - 1.0).abs() < MIN_SCATTER {
        Bsdf::Dielectric(Dielectric { eta, tint })
    } else {
        Bsdf::RoughDielectric(RoughDielectric { eta, alpha, tint })
    }
}

/// The narrowest lobe of transmitted light that still counts as rough: its half-vector is a difference
/// whose error, 1e-7, must be small against it.
const MIN_SCATTER: f32 = 1e-5;
