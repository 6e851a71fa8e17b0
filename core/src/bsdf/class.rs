//! Classes of surfaces, asked for at a hit (pbrt: `BxDFFlags`). Material-level answers are in
//! `scene/class.rs`.
//!
//! - *Diffuse*: a part of the light leaves in all directions. Photons are stored here.
//! - *Glossy*: a lobe of finite width. A narrow one makes caustics, a wide one is left to camera paths.
//! - *Specular*: one direction for each lobe ([`Bsdf::is_delta`]). No photon, no light sample.
//!
//! A coated surface has two classes, that of its coat and that of its base: the methods below say which one
//! decides.

use super::Bsdf;
use crate::scene::CAUSTIC_ALPHA;

/// The albedo of a base from which on it counts as diffuse. Below, the coat reflects nearly everything, and
/// photons would make fireflies.
const BASE: f32 = 0.02;

impl Bsdf {
    /// Whether photons are stored on it: it has a diffuse component, or a wide coat over one. A surface that
    /// is only glossy reflects too little of a kernel of photons; camera paths find its light.
    #[inline]
    pub(crate) fn stores_photons(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_) | Bsdf::Glossy(_) | Bsdf::Plastic(_)) && !self.is_delta()
    }

    /// Whether it has a diffuse component of some albedo.
    #[inline]
    pub(crate) fn has_diffuse(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_)) || self.base().max_element() >= BASE
    }

    /// Whether it ends a caustic: a photon has its weight here, and what it scatters is no caustic any more.
    #[inline]
    pub(crate) fn is_receiver(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_)) || self.stores_photons() && self.has_diffuse()
    }

    /// Whether photons are seen by the base alone, and paths go on through the coat as by a rough metal: in a
    /// narrow coat a photon would be a firefly. `apart` says whether that is possible, as it is where paths
    /// may meet each light by chance.
    #[inline]
    pub(crate) fn is_varnished(&self, apart: bool) -> bool {
        apart && self.has_rough_coat() && self.has_narrow_coat() && self.has_diffuse()
    }

    /// Whether light is gathered from photons on it: it has a base, or nothing narrow.
    #[inline]
    pub(crate) fn gathers_photons(&self, apart: bool) -> bool {
        self.stores_photons() && (!apart || self.has_diffuse() || !self.has_narrow_coat())
    }

    /// Whether it makes caustics: it reflects or refracts within a narrow lobe, and has no diffuse component.
    #[inline]
    pub(crate) fn is_caustic_caster(&self) -> bool {
        match self {
            Bsdf::Mirror(_) | Bsdf::Dielectric(_) => true,
            Bsdf::Conductor(conductor) => conductor.alpha < CAUSTIC_ALPHA,
            Bsdf::RoughDielectric(glass) => glass.alpha < CAUSTIC_ALPHA,
            Bsdf::Diffuse(_) | Bsdf::Glossy(_) | Bsdf::Plastic(_) => self.is_delta(),
        }
    }
}
