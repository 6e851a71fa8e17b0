//! Rough reflection of a BSDF as the lobe that a radiance cache serves.

use super::{All, Bsdf, fresnel};
use crate::Rgb;
use core::f32::consts::FRAC_1_PI;

/// GGX reflection. A microfacet reflects tint · (f0 F + (1 - f0) (1 - c)⁵), with F = 1 for Schlick's
/// reflectance, and with the reflectance F of a dielectric, where f0 is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MicrofacetLobe {
    /// GGX alpha, above 0.
    pub(crate) alpha: f32,
    /// Reflectance at normal incidence.
    pub(crate) f0: Rgb,
    /// Factor of the reflectance.
    pub(crate) tint: Rgb,
    /// Index of refraction of a dielectric.
    pub(crate) eta: Option<f32>,
}

impl Bsdf {
    /// Rough reflection of a metal or a coat. `None` for smooth and transmitting surfaces, and for a
    /// dielectric coat that is blended with metal.
    pub(crate) fn microfacet_lobe(&self) -> Option<MicrofacetLobe> {
        let lobe = match self {
            Bsdf::Conductor(b) => MicrofacetLobe { alpha: b.alpha, f0: b.f0, tint: Rgb::ONE, eta: None },
            Bsdf::Glossy(b) => MicrofacetLobe {
                alpha: b.alpha(),
                f0: b.lane().reflectance(1.0).into(),
                tint: Rgb::ONE,
                eta: None,
            },
            Bsdf::Plastic(b) => {
                let tint = b.coat_tint()?;
                MicrofacetLobe { alpha: b.alpha(), f0: Rgb::ONE, tint, eta: Some(b.eta()) }
            }
            _ => return None,
        };
        (lobe.alpha > 0.0).then_some(lobe)
    }

    /// base · T(θ_o) / π at the viewer's cosine `cos`: factor of ∫ L T(θ_i) cos dω in the radiance of the
    /// base. Zero without a coat.
    pub(crate) fn base_factor(&self, cos: f32) -> Rgb {
        match self {
            Bsdf::Glossy(_) | Bsdf::Plastic(_) => self.base() * self.transmittance_at(cos) * FRAC_1_PI,
            _ => Rgb::ZERO,
        }
    }

    /// GGX alpha of the rough reflection of a metal or of a coat. `None` for smooth and transmitting
    /// surfaces.
    pub(crate) fn reflection_alpha(&self) -> Option<f32> {
        let alpha = match self {
            Bsdf::Conductor(b) => b.alpha,
            Bsdf::Glossy(b) => b.alpha(),
            Bsdf::Plastic(b) => b.alpha(),
            _ => return None,
        };
        (alpha > 0.0).then_some(alpha)
    }

    /// Reflectance of a microfacet of a metal or a coat at the cosine `c`; 1 for other surfaces.
    pub(crate) fn facet_reflectance(&self, c: f32) -> Rgb {
        match (self, self.coat::<All>()) {
            (Bsdf::Conductor(b), _) => fresnel::schlick(b.f0.into(), c).into(),
            (_, Some(coat)) => coat.reflectance(c).into(),
            _ => Rgb::ONE,
        }
    }
}
