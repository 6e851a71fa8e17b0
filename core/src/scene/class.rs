//! Classes of materials, before anything is hit: the classes that a surface may have somewhere. A texture may
//! hold any value. Answers at a hit are in `bsdf/class.rs`, which names the classes.

use super::{Material, Surface};
use crate::Rgb;

/// Surfaces below this alpha are smooth. A half-vector of two f32 directions has an error of about 1e-7:
/// here still a thousandth of the lobe's width.
pub(crate) const SMOOTH_ALPHA: f32 = 1e-4;

/// GGX alpha below which a lobe makes caustics.
pub(crate) const CAUSTIC_ALPHA: f32 = 0.1;

/// The albedo of a base from which on it is diffuse for photons, with a margin for its textures.
const LEAST_BASE: f32 = 0.05;

impl Surface {
    /// Whether it may be diffuse alone, somewhere.
    pub fn may_be_diffuse(&self) -> bool {
        matches!(self, Surface::Diffuse { .. } | Surface::Glossy { ior: None, .. })
    }

    /// Whether it may reflect or refract into one direction only, somewhere.
    pub fn may_be_smooth(&self) -> bool {
        match self {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. } | Surface::Dielectric { .. } => true,
            Surface::Conductor { roughness, .. } | Surface::Glossy { roughness, .. } => {
                roughness.texture.is_some() || roughness.value * roughness.value < SMOOTH_ALPHA
            }
        }
    }

    /// Whether it may scatter, somewhere, and yet not be diffuse alone.
    pub fn may_be_rough(&self) -> bool {
        match self {
            Surface::Diffuse { .. } | Surface::Mirror { .. } => false,
            Surface::Glossy { .. } => true,
            Surface::Conductor { roughness, .. } | Surface::Dielectric { roughness, .. } => {
                roughness.texture.is_some() || roughness.value * roughness.value >= SMOOTH_ALPHA
            }
        }
    }
}

impl Material {
    /// Whether it may make caustics somewhere, in patterns that gather rays would not find.
    pub(crate) fn may_be_caustic_caster(&self) -> bool {
        match &self.surface {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. } => true,
            Surface::Dielectric { roughness, .. } | Surface::Conductor { roughness, .. } => {
                roughness.texture.is_some() || roughness.value * roughness.value < CAUSTIC_ALPHA
            }
            Surface::Glossy { .. } => self.surface.may_be_smooth(),
        }
    }

    /// Whether caustic photons may go on from it, so that they are aimed at it: it is no receiver somewhere,
    /// however wide its lobe is.
    pub(crate) fn may_pass_caustics(&self) -> bool {
        match &self.surface {
            Surface::Diffuse { .. } => false,
            Surface::Mirror { .. } | Surface::Dielectric { .. } | Surface::Conductor { .. } => true,
            Surface::Glossy { base, metallic, .. } => {
                // Without a base it reflects specularly, as far as is known without its textures.
                let base =
                    if metallic.texture.is_some() { Rgb::ZERO } else { base.value * (1.0 - metallic.value) };
                self.surface.may_be_smooth() || base.max_element() < LEAST_BASE
            }
        }
    }
}
