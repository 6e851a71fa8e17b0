//! Parameters of BSDFs without a coat.

use crate::Rgb;
use halflight_simd::kernels::shade::ggx::Ggx;
use halflight_simd::kernels::shade::rough::RoughLanes;

/// Lambertian surface, f = ρ/π: scatters uniformly into the hemisphere of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo ρ, 0 … 1.
    pub reflectance: Rgb,
}

/// Perfect mirror: reflects into one direction, with the same reflectance at every angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Reflectance, 0 … 1.
    pub reflectance: Rgb,
}

/// Metal: GGX microfacets with Schlick's Fresnel term, a coloured mirror if smooth. Light that bounces
/// between microfacets is lost, as usual in single-scattering models.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Reflectance at normal incidence, 0 … 1.
    pub f0: Rgb,
    /// GGX alpha; 0 is smooth.
    pub alpha: f32,
}

/// Smooth glass or water, seen from one side: Fresnel reflection, and refraction by Snell's law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction on the far side over that on the viewer's side.
    pub eta: f32,
    /// Factor on the transmitted light, 0 … 1.
    pub tint: Rgb,
}

/// Rough glass, seen from one side. Masking and shadowing are independent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// Index of refraction on the far side over that on the viewer's side; not 1.
    pub eta: f32,
    /// GGX alpha.
    pub alpha: f32,
    /// Factor on the transmitted light, 0 … 1.
    pub tint: Rgb,
}

impl RoughDielectric {
    #[inline(always)]
    pub(super) fn lane(&self) -> RoughLanes<f32> {
        RoughLanes { tint: self.tint.into(), eta: self.eta, ggx: Ggx::new(self.alpha) }
    }
}
