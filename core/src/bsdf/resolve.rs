//! From what the file says to what a hit needs: textures are looked up, numbers brought into range.

use super::ggx::SMOOTH_ALPHA;
use super::{Bsdf, Conductor, Dielectric, Diffuse, Features, Glossy, Mirror, Plastic, RoughDielectric};
use crate::Rgb;
use crate::scene::{ColorInput, Material, ScalarInput, Scene, Surface, TextureId};
use glam::{Vec2, Vec3, Vec4};

impl ColorInput {
    /// The colour at texture coordinates `uv`.
    #[inline]
    pub fn at<F: Features>(&self, scene: &Scene, uv: Vec2) -> Rgb {
        match self.texture {
            Some(id) if F::TEXTURES => self.value * texel(scene, id, uv).truncate(),
            _ => self.value,
        }
    }
}

impl ScalarInput {
    /// The number at texture coordinates `uv`.
    #[inline]
    pub fn at<F: Features>(&self, scene: &Scene, uv: Vec2) -> f32 {
        match self.texture {
            Some((id, channel)) if F::TEXTURES => {
                let texel = texel(scene, id, uv).to_array();
                self.value * texel.get(channel as usize).copied().unwrap_or(1.0)
            }
            _ => self.value,
        }
    }
}

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

/// Nothing transparent comes near; beyond, refraction from inside multiplies the rounding of a direction.
pub(super) const GREATEST_INDEX: f32 = 20.0;

/// The narrowest lobe of transmitted light that still counts as rough: its half-vector is a difference
/// whose error, 1e-7, must be small against it.
const MIN_SCATTER: f32 = 1e-5;

/// Linear RGBA of a texture; white where the scene has no such texture.
#[inline]
fn texel(scene: &Scene, id: TextureId, uv: Vec2) -> Vec4 {
    scene.textures.get(id.0 as usize).map_or(Vec4::ONE, |texture| texture.lookup(uv).into())
}

/// `x` within 0 … 1; 0 where it is not a number.
#[inline]
pub(super) fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Every channel within 0 … 1.
#[inline]
pub(super) fn unit_rgb(c: Rgb) -> Rgb {
    Vec3::new(unit(c.x), unit(c.y), unit(c.z))
}
