//! Material classes before any hit: the classes that a surface may have at some texture value. The classes
//! themselves, and those at a hit, are in `bsdf/class.rs`.

use super::{Material, Surface};
use crate::Rgb;

/// GGX alpha below which a surface is smooth. The half-vector of two f32 directions has an error of about
/// 1e-7, which is still a thousandth of the width of this lobe.
pub(crate) const SMOOTH_ALPHA: f32 = 1e-4;

/// GGX alpha below which a lobe makes caustics.
pub(crate) const CAUSTIC_ALPHA: f32 = 0.1;

/// Least albedo of a base that is diffuse for photons, with a margin for its textures.
const MIN_BASE_ALBEDO: f32 = 0.05;

impl Surface {
    /// True if the surface may have a diffuse component somewhere, with or without a coat.
    pub fn may_have_base(&self) -> bool {
        matches!(self, Surface::Diffuse { .. } | Surface::Glossy { .. })
    }

    /// True if the surface may be perfectly specular somewhere.
    pub fn may_be_smooth(&self) -> bool {
        match self {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. } | Surface::Pane { .. } | Surface::Dielectric { .. } => true,
            Surface::Conductor { roughness, .. } | Surface::Glossy { roughness, .. } => {
                roughness.texture.is_some() || roughness.value * roughness.value < SMOOTH_ALPHA
            }
        }
    }

    /// True if the surface may have a rough lobe somewhere that is not purely diffuse.
    pub fn may_be_rough(&self) -> bool {
        match self {
            Surface::Diffuse { .. } | Surface::Mirror { .. } | Surface::Pane { .. } => false,
            Surface::Glossy { .. } => true,
            Surface::Conductor { roughness, .. } | Surface::Dielectric { roughness, .. } => {
                roughness.texture.is_some() || roughness.value * roughness.value >= SMOOTH_ALPHA
            }
        }
    }
}

impl Material {
    /// True if the material may cast caustics somewhere, in patterns that gather rays would miss.
    pub(crate) fn may_be_caustic_caster(&self) -> bool {
        match &self.surface {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. } | Surface::Pane { .. } => true,
            Surface::Dielectric { roughness, .. } | Surface::Conductor { roughness, .. } => {
                roughness.texture.is_some() || roughness.value * roughness.value < CAUSTIC_ALPHA
            }
            Surface::Glossy { .. } => self.surface.may_be_smooth(),
        }
    }

    /// True if caustic photons may continue from the material, so that they are aimed at it: somewhere it is
    /// no receiver, at any width of its lobe.
    pub(crate) fn may_pass_caustics(&self) -> bool {
        match &self.surface {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. }
            | Surface::Pane { .. }
            | Surface::Dielectric { .. }
            | Surface::Conductor { .. } => true,
            Surface::Glossy { base, metallic, .. } => {
                // Without a base it reflects specularly, as far as is known without its textures.
                let base =
                    if metallic.texture.is_some() { Rgb::ZERO } else { base.value * (1.0 - metallic.value) };
                self.surface.may_be_smooth() || base.max_element() < MIN_BASE_ALBEDO
            }
        }
    }
}
