//! Surface classes at a hit (pbrt: `BxDFFlags`). For classes of materials see `scene/class.rs`.
//!
//! - *Diffuse*: a part of the light leaves in all directions. Photons are stored here.
//! - *Glossy*: a lobe of finite width. A narrow lobe makes caustics, a wide lobe is left to camera paths.
//! - *Specular*: one direction for each lobe ([`Bsdf::is_delta`]). Neither photons nor light samples.
//!
//! A coated surface has two classes, that of its coat and that of its base. Each method below states which of
//! them decides.

use super::Bsdf;
use crate::scene::CAUSTIC_ALPHA;

/// Least albedo of a base that counts as diffuse. Below it the coat reflects nearly everything, and photons
/// would make fireflies.
const MIN_BASE_ALBEDO: f32 = 0.02;

impl Bsdf {
    /// True if photons are stored on the surface: it has a diffuse component, or a wide coat over one. A
    /// purely glossy surface reflects too little of a kernel of photons; camera paths find its light.
    #[inline]
    pub(crate) fn stores_photons(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_) | Bsdf::Glossy(_) | Bsdf::Plastic(_)) && !self.is_delta()
    }

    /// True if it has a diffuse component of at least this albedo.
    #[inline]
    pub(crate) fn has_diffuse(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_)) || self.base().max_element() >= MIN_BASE_ALBEDO
    }

    /// True if a coat, rough or smooth, covers such a component, and records may supply its light: two
    /// moments of the incident light determine the light that the coat transmits.
    #[inline]
    pub(crate) fn has_coated_base(&self) -> bool {
        matches!(self, Bsdf::Glossy(_) | Bsdf::Plastic(_)) && self.has_diffuse() && self.has_fitted_coat()
    }

    /// True if it ends a caustic: photons count here, and the light that it scatters is no caustic.
    #[inline]
    pub(crate) fn is_receiver(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_)) || self.stores_photons() && self.has_diffuse()
    }

    /// True if only the base gathers photons, and paths continue through the coat as through a rough metal.
    /// In a narrow coat a photon would be a firefly. `apart` says whether that is possible: it requires that
    /// paths can hit every light.
    #[inline]
    pub(crate) fn gathers_photons_on_base(&self, apart: bool) -> bool {
        apart && self.has_rough_coat() && self.has_narrow_coat() && self.has_diffuse()
    }

    /// True if photons on the surface estimate its light: it has a base, or no narrow lobe.
    #[inline]
    pub(crate) fn gathers_photons(&self, apart: bool) -> bool {
        self.stores_photons() && (!apart || self.has_diffuse() || !self.has_narrow_coat())
    }

    /// True if it casts caustics: it reflects or refracts within a narrow lobe, without a diffuse component.
    #[inline]
    pub(crate) fn is_caustic_caster(&self) -> bool {
        match self {
            Bsdf::Mirror(_) | Bsdf::Pane(_) | Bsdf::Dielectric(_) => true,
            Bsdf::Conductor(conductor) => conductor.alpha < CAUSTIC_ALPHA,
            Bsdf::RoughDielectric(glass) => glass.alpha < CAUSTIC_ALPHA,
            Bsdf::Diffuse(_) | Bsdf::Glossy(_) | Bsdf::Plastic(_) => self.is_delta(),
        }
    }
}
