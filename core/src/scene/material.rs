//! What a surface does with light, as the scene file says it: inputs that may be textured.
//! [`crate::bsdf`] turns a material at a hit point into a BSDF.

use super::{ColorInput, ScalarInput, TextureId};
use crate::Rgb;

/// How the surface scatters. `roughness` is GGX alpha in 0 … 1; a textured roughness holds sqrt(alpha),
/// so its texel is squared after the product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Lambert, on both sides.
    Diffuse {
        /// Albedo, 0 … 1.
        reflectance: ColorInput,
    },
    /// Perfect mirror, on both sides.
    Mirror {
        /// Reflectance at every angle.
        reflectance: ColorInput,
    },
    /// GGX metal with Schlick's Fresnel term.
    Conductor {
        /// Reflectance at normal incidence.
        reflectance: ColorInput,
        /// sqrt(alpha).
        roughness: ScalarInput,
    },
    /// A specular coat over a diffuse base, fading to metal: what MTL's Kd + Ks and Pm mean.
    Glossy {
        /// Colour of the base; of the metal where `metallic` is 1.
        base: ColorInput,
        /// Reflectance of the coat at normal incidence.
        specular: ColorInput,
        /// sqrt(alpha) of the coat; 0 is a smooth coat.
        roughness: ScalarInput,
        /// 0 coat over base … 1 metal.
        metallic: ScalarInput,
        /// Index of refraction of a coat that is a dielectric (plastic, varnish): light that the base
        /// sends back is reflected inside once more. `None`: the base is seen as it is.
        ior: Option<f32>,
    },
    /// Glass, water: a boundary between two media. Rough where `roughness` > 0.
    Dielectric {
        /// Index of refraction inside (behind the front face) over outside.
        ior: f32,
        /// Factor on what is transmitted.
        tint: Rgb,
        /// sqrt(alpha).
        roughness: ScalarInput,
    },
}

/// A map that bends the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalMap {
    /// Tangent-space normals, RGB in 0 … 1, with a factor on their slopes.
    Tangent(TextureId, f32),
    /// Heights, with the factor that turns them into lengths of a texture-coordinate unit.
    Height(TextureId, f32),
}

/// All that is known of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// How it scatters.
    pub surface: Surface,
    /// Emitted radiance; black for nearly all materials.
    pub emission: ColorInput,
    /// Whether the back face emits as well.
    pub two_sided: bool,
    /// Probability that a ray meets the surface at all: cut-out.
    pub opacity: ScalarInput,
    /// Bends the shading normal.
    pub normal_map: Option<NormalMap>,
}

impl Material {
    /// A grey diffuse surface: what a face without material is made of.
    pub const GREY: Material = Material::diffuse(Rgb::splat(0.5));

    /// A diffuse surface.
    pub const fn diffuse(reflectance: Rgb) -> Self {
        let none = ColorInput { value: Rgb::ZERO, texture: None };
        Self {
            surface: Surface::Diffuse { reflectance: ColorInput { value: reflectance, texture: None } },
            emission: none,
            two_sided: false,
            opacity: ScalarInput { value: 1.0, texture: None },
            normal_map: None,
        }
    }

    /// Whether the material emits light at all.
    pub fn emits(&self) -> bool {
        self.emission.value.max_element() > 0.0
    }

    /// Whether a ray can pass through by opacity.
    pub fn has_cutout(&self) -> bool {
        self.opacity.value < 1.0 || self.opacity.texture.is_some()
    }
}
