//! Materials of the scene description, with inputs that may be textured. [`crate::bsdf`] turns a material at
//! a hit into a BSDF.

use super::{ColorInput, ScalarInput, TextureId};
use crate::Rgb;

/// Scattering model. `roughness` is sqrt(alpha) of GGX in 0 … 1, constant or textured: it is squared after
/// the product with its texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Lambertian, on both sides.
    Diffuse {
        /// Albedo, 0 … 1.
        reflectance: ColorInput,
    },
    /// Perfect mirror, on both sides.
    Mirror {
        /// Reflectance at every angle.
        reflectance: ColorInput,
    },
    /// Two parallel smooth faces in air, as of a window: mirrors a part of the light, and lets the rest pass
    /// straight on. On both sides.
    Pane {
        /// Index of refraction, at least 1.
        ior: f32,
        /// Transmittance of the body at normal incidence.
        tint: Rgb,
    },
    /// GGX metal with Schlick's Fresnel term.
    Conductor {
        /// Reflectance at normal incidence.
        reflectance: ColorInput,
        /// sqrt(alpha).
        roughness: ScalarInput,
    },
    /// Specular coat over a diffuse base, blended with metal: the meaning of MTL's Kd + Ks and Pm.
    Glossy {
        /// Colour of the base, and of the metal if `metallic` is 1.
        base: ColorInput,
        /// Reflectance of the coat at normal incidence.
        specular: ColorInput,
        /// sqrt(alpha) of the coat; 0 is a smooth coat.
        roughness: ScalarInput,
        /// 0 coat over base … 1 metal.
        metallic: ScalarInput,
        /// Index of refraction of a dielectric coat (plastic, varnish), inside which light from the base is
        /// reflected back again. `None`: the coat does not change the light of the base.
        ior: Option<f32>,
    },
    /// Boundary between two media such as air and glass or water. Rough if `roughness` > 0.
    Dielectric {
        /// Index of refraction inside (behind the front face) over that outside.
        ior: f32,
        /// Factor on the transmitted light.
        tint: Rgb,
        /// sqrt(alpha).
        roughness: ScalarInput,
    },
}

impl Surface {
    /// Colour of the whole surface, or of the base below its coat. `None` for a pane or dielectric.
    #[inline]
    pub(crate) fn color(&self) -> Option<&ColorInput> {
        match self {
            Self::Diffuse { reflectance } | Self::Mirror { reflectance } => Some(reflectance),
            Self::Conductor { reflectance, .. } => Some(reflectance),
            Self::Glossy { base, .. } => Some(base),
            Self::Pane { .. } | Self::Dielectric { .. } => None,
        }
    }
}

/// Texture that perturbs the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalMap {
    /// Tangent-space normals, RGB in 0 … 1, and a factor on their slopes.
    Tangent(TextureId, f32),
    /// Heights, and the factor that converts them to the unit of texture coordinates.
    Height(TextureId, f32),
}

/// Description of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Scattering model.
    pub surface: Surface,
    /// Emitted radiance; black for nearly all materials.
    pub emission: ColorInput,
    /// True if the back face emits as well.
    pub two_sided: bool,
    /// Probability that a ray hits the surface (cut-out).
    pub opacity: ScalarInput,
    /// Perturbation of the shading normal.
    pub normal_map: Option<NormalMap>,
}

impl Material {
    /// Grey diffuse surface, for faces without material.
    pub const GREY: Material = Material::diffuse(Rgb::splat(0.5));

    /// Diffuse surface.
    pub const fn diffuse(reflectance: Rgb) -> Self {
        Self {
            surface: Surface::Diffuse { reflectance: ColorInput::constant(reflectance) },
            emission: ColorInput::constant(Rgb::ZERO),
            two_sided: false,
            opacity: ScalarInput::constant(1.0),
            normal_map: None,
        }
    }

    /// Black surface that emits `radiance` from its front, where its corners go counter-clockwise.
    pub const fn lamp(radiance: Rgb) -> Self {
        Self { emission: ColorInput::constant(radiance), ..Self::diffuse(Rgb::ZERO) }
    }

    /// True if the material emits light.
    #[inline]
    pub fn emits(&self) -> bool {
        self.emission.value.max_element() > 0.0
    }

    /// True if it is a pane that colours rays that pass it.
    #[inline]
    pub(crate) fn is_tinted_pane(&self) -> bool {
        matches!(self.surface, Surface::Pane { tint, .. } if tint != Rgb::splat(tint.x))
    }

    /// True if a ray may pass straight through, by opacity or because it is a pane.
    #[inline]
    pub fn has_cutout(&self) -> bool {
        self.opacity.value < 1.0 || self.opacity.varies() || matches!(self.surface, Surface::Pane { .. })
    }
}
