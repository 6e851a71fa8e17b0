//! Diffuse base of a surface, and the directional dependence of its light by the transmittance of the coat.

use super::albedo::SchlickFit;
use super::{All, Bsdf, COATS};
use crate::Rgb;
use bytemuck::{Pod, Zeroable};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;
use halflight_simd::kernels::shade::bsdf::viewer;
use halflight_simd::kernels::shade::coat_lanes::CoatLanes;

/// Largest alpha of a coat whose transmittance follows the fit, and largest reflectance at normal incidence
/// of a coat of Schlick that does at any alpha.
const MAX_FITTED_ALPHA: f32 = 0.35;
const MAX_FITTED_SPECULAR: f32 = 0.1;

/// Coat over a diffuse base.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CoatTransmittance {
    /// Reflectance of Schlick's coat at normal incidence.
    specular: [f32; 3],
    /// GGX alpha.
    alpha: f32,
    /// Index of refraction of a dielectric coat; zero for others.
    eta: f32,
}

impl CoatTransmittance {
    /// No coat: the reflected radiance is the same in all directions.
    pub(crate) const NONE: CoatTransmittance = CoatTransmittance { specular: [0.0; 3], alpha: 0.0, eta: 0.0 };

    pub(super) fn dielectric(alpha: f32, eta: f32) -> Self {
        Self { alpha, eta, ..Self::NONE }
    }

    pub(super) fn schlick(alpha: f32, specular: Rgb) -> Self {
        Self { alpha, specular: specular.to_array(), ..Self::NONE }
    }

    /// Transmittance T at the cosine `c` for light from the base, up to a factor.
    #[inline]
    pub(crate) fn transmittance(&self, c: f32) -> Rgb {
        let Self { specular: tint, alpha, eta } = *self;
        if eta == 0.0 && tint == [0.0; 3] {
            return Rgb::ONE;
        }
        let coat = CoatLanes { tint, alpha, eta, dielectric: eta > 0.0, ..CoatLanes::SMOOTH };
        coat.transmittance(&COATS, c).into()
    }
}

impl Bsdf {
    /// Coat over the diffuse base; `None` without a base.
    #[inline]
    pub(crate) fn coat_transmittance(&self) -> Option<CoatTransmittance> {
        match self {
            Bsdf::Diffuse(_) => Some(CoatTransmittance::NONE),
            Bsdf::Glossy(b) => b.coat_transmittance(),
            Bsdf::Plastic(b) => b.coat_transmittance(),
            _ => None,
        }
    }

    /// Fit to T(θ_i) of the coat over the base; `None` without a coat or without a base.
    #[inline]
    pub(crate) fn base_transmittance_fit(&self) -> Option<SchlickFit<Rgb>> {
        match self {
            Bsdf::Glossy(b) => Some(b.transmittance_fit()),
            Bsdf::Plastic(b) => Some(b.transmittance_fit()),
            _ => None,
        }
    }

    /// True if [`Bsdf::base_transmittance_fit`] is good to half a percent. It is not for very rough coats,
    /// whose shadowing dims T over all angles, unless they reflect little.
    #[inline]
    pub(crate) fn has_fitted_coat(&self) -> bool {
        match self {
            Bsdf::Glossy(b) => {
                b.alpha() <= MAX_FITTED_ALPHA || b.specular().max_element() <= MAX_FITTED_SPECULAR
            }
            Bsdf::Plastic(b) => b.alpha() <= MAX_FITTED_ALPHA,
            _ => false,
        }
    }

    /// Radiance that the base under a coat reflects to `wo` of light with the irradiance E and the moment
    /// M₅ = ∫ L (1 - cos)⁵ cos dω: base · T(θ_o) (t₀ E + t₅ M₅) / π. Black without a coat.
    #[inline]
    pub(crate) fn base_radiance(&self, wo: Vec3, irradiance: Rgb, edge_moment: Rgb) -> Rgb {
        let Some(SchlickFit { constant, edge }) = self.base_transmittance_fit() else { return Rgb::ZERO };
        let transmitted = (constant * irradiance + edge * edge_moment).max(Rgb::ZERO);
        self.base() * self.transmittance_at(viewer(wo.into())[2]) * transmitted * FRAC_1_PI
    }

    /// Fraction of `f`, which is f(wo, wi) |cos θ_i|, that the base reflects: 0 … 1.
    #[inline]
    pub(crate) fn base_part(&self, wo: Vec3, wi: Vec3, f: Rgb) -> Rgb {
        if let Bsdf::Diffuse(_) = self {
            return Rgb::ONE;
        }
        let Some(coat) = self.coat::<All>() else { return Rgb::ZERO };
        let coat = CoatLanes { transmittance: coat.transmittance(&COATS, wo.z), ..coat };
        let base = Rgb::from(coat.base_value(&COATS, wi.with_z(wi.z.max(0.0)).into()));
        Rgb::select(f.cmpgt(base), base / f, Rgb::ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Glossy, Plastic, fresnel};
    use crate::sampling::Random;
    use crate::sampling::warp::cosine_hemisphere;

    /// Directions ∝ cos: E, M₅ and the reflected radiance are means over the same ones.
    const DIRECTIONS: u32 = 256;

    /// Largest deviation of [`Bsdf::base_radiance`] from the mean of f L over cosine-distributed directions,
    /// relative, in light of which a narrow spot at a random place has most.
    fn deviation(bsdf: &Bsdf, seed: u32) -> f32 {
        let random = Random::new(11, seed);
        let spot = cosine_hemisphere([random.single(0), random.single(1)]);
        let wo = cosine_hemisphere([random.single(2), random.single(3)]);
        let (mut irradiance, mut moment, mut exact) = (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO);
        for i in 1..=DIRECTIONS {
            let wi = cosine_hemisphere([random.single(4 * i), random.single(4 * i + 1)]);
            let light = Rgb::new(random.single(4 * i + 2), 1.0, if wi.dot(spot) > 0.95 { 30.0 } else { 0.1 });
            let share = light * (core::f32::consts::PI / DIRECTIONS as f32);
            irradiance += share;
            moment += share * fresnel::schlick_weight(wi.z);
            let (of_base, _) = bsdf.evaluate_apart::<All>(wo, wi, 1.0)[0];
            exact += share * of_base / wi.z;
        }
        let found = bsdf.base_radiance(wo, irradiance, moment);
        ((found - exact) / exact).abs().max_element()
    }

    #[test]
    fn the_base_of_a_smooth_schlick_coat_reflects_as_by_brute_force() {
        let (colour, specular) = (Rgb::new(0.8, 0.5, 0.1), Rgb::new(0.04, 0.3, 0.7));
        let bsdf = Bsdf::Glossy(Glossy::new(colour, specular, 0.0, 0.2));
        for seed in 0..20 {
            assert!(deviation(&bsdf, seed) < 1e-5, "{}", deviation(&bsdf, seed));
        }
    }

    #[test]
    fn the_base_of_any_coat_reflects_nearly_as_by_brute_force_even_in_the_light_of_a_spot() {
        let colour = Rgb::new(0.8, 0.5, 0.1);
        for alpha in [0.0, 0.01, 0.09, 0.2, 0.3] {
            let coats = [
                Bsdf::Glossy(Glossy::new(colour, Rgb::new(0.04, 0.3, 0.1), alpha, 0.0)),
                Bsdf::Plastic(Plastic::new(colour, Rgb::splat(0.04), alpha, 0.0, 1.5)),
                Bsdf::Plastic(Plastic::new(colour, Rgb::ONE, alpha, 0.4, 2.0)),
            ];
            for bsdf in coats {
                for seed in 0..10 {
                    let deviation = deviation(&bsdf, seed);
                    assert!(deviation < 0.04, "{bsdf:?}, seed {seed}: {deviation}");
                }
            }
        }
    }

    #[test]
    fn base_and_coat_together_are_the_surface() {
        let random = Random::new(12, 0);
        for alpha in [0.0, 0.05, 0.4] {
            let bsdf = Bsdf::Plastic(Plastic::new(Rgb::splat(0.5), Rgb::splat(0.04), alpha, 0.0, 1.5));
            for i in 0..1000 {
                let [wo, wi] = [0, 2]
                    .map(|k| cosine_hemisphere([random.single(4 * i + k), random.single(4 * i + k + 1)]));
                let (whole, density) = bsdf.evaluate::<All>(wo, wi);
                let [base, coat] = bsdf.evaluate_apart::<All>(wo, wi, 1.0);
                assert!(((base.0 + coat.0) / whole - Rgb::ONE).abs().max_element() < 1e-5);
                assert!(((base.1 + coat.1) / density - 1.0).abs() < 1e-5);
                // Without the base all samples are of the coat.
                let [base, coat] = bsdf.evaluate_apart::<All>(wo, wi, 0.0);
                assert!(base.1 == 0.0 && base.0 != Rgb::ZERO);
                let (sample, is_coat) = bsdf.sample_apart::<All>(wo, [0.3, 0.6, 0.999_999], 0.0).unwrap();
                assert!(is_coat && sample.delta == (alpha == 0.0) && coat.1 >= 0.0);
            }
        }
    }
}
