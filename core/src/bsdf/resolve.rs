//! BSDF of a hit from a material of the scene: looks up textures and clamps parameters.

use super::range::{MAX_INDEX, unit, unit_rgb};
use super::{Bsdf, Conductor, Dielectric, Diffuse, Features, Glossy, Mirror, Pane, Plastic, RoughDielectric};
use crate::Rgb;
use crate::scene::{Attributes, ColorInput, Material, SMOOTH_ALPHA, ScalarInput, Scene, Surface};

impl Bsdf {
    /// BSDF of `material` at a point with these attributes, seen from its front or its back.
    #[inline]
    pub fn at<F: Features>(scene: &Scene, material: &Material, attributes: &Attributes, front: bool) -> Bsdf {
        Self::of_texel::<F>((scene, material), None, attributes, front)
    }

    /// [`Bsdf::at`] with the texel of [`Surface::color`], if it has been looked up.
    #[inline]
    pub(crate) fn of_texel<F: Features>(
        (scene, material): (&Scene, &Material),
        texel: Option<Rgb>,
        attributes: &Attributes,
        front: bool,
    ) -> Bsdf {
        let color = |input: &ColorInput| match texel {
            Some(texel) => unit_rgb(input.of_texel(texel, attributes)),
            None => unit_rgb(input.at::<F>(scene, attributes)),
        };
        let alpha = |input: &ScalarInput| alpha(input.at::<F>(scene, attributes));
        match &material.surface {
            Surface::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse { reflectance: color(reflectance) }),
            Surface::Mirror { reflectance } if F::GLOSSY => {
                Bsdf::Mirror(Mirror { reflectance: color(reflectance) })
            }
            Surface::Pane { ior, tint } if F::GLOSSY => Bsdf::Pane(Pane::new(*ior, *tint)),
            Surface::Conductor { reflectance, roughness } if F::GLOSSY => {
                Bsdf::Conductor(Conductor { f0: color(reflectance), alpha: alpha(roughness) })
            }
            Surface::Glossy { base, specular, roughness, metallic, ior } if F::GLOSSY => {
                let (base, specular) = (color(base), unit_rgb(specular.at::<F>(scene, attributes)));
                let (alpha, metallic) = (alpha(roughness), unit(metallic.at::<F>(scene, attributes)));
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
            // A feature that the census has excluded: black.
            _ => Bsdf::Diffuse(Diffuse { reflectance: Rgb::ZERO }),
        }
    }
}

/// GGX alpha of a roughness; 0 if the lobe is too narrow for its width to matter.
#[inline]
fn alpha(roughness: f32) -> f32 {
    let alpha = unit(roughness * roughness);
    if alpha < SMOOTH_ALPHA { 0.0 } else { alpha }
}

#[inline]
fn dielectric(ior: f32, front: bool, tint: Rgb, alpha: f32) -> Bsdf {
    let ior = if ior > 0.0 && ior.is_finite() { ior.clamp(1.0 / MAX_INDEX, MAX_INDEX) } else { 1.0 };
    let eta = if front { ior } else { 1.0 / ior };
    // A rough boundary scatters transmitted light only by alpha (eta - 1).
    if alpha * (eta - 1.0).abs() < MIN_SCATTER {
        Bsdf::Dielectric(Dielectric { eta, tint })
    } else {
        Bsdf::RoughDielectric(RoughDielectric { eta, alpha, tint })
    }
}

/// Narrowest lobe of transmitted light that counts as rough. Its half-vector is a difference whose error,
/// 1e-7, must be small against the width.
const MIN_SCATTER: f32 = 1e-5;
