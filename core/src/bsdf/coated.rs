//! A rough or smooth coat over a diffuse base: what the coat does not reflect, on the way in and on the way
//! out, meets the base (Ashikhmin et al. 2000, §2.4; Kelemen and Szirmay-Kalos 2001):
//!
//! f = D G F / (4 cos θ_o cos θ_i) + base · T(θ_o) T(θ_i) / π
//!
//! Symmetric in the directions, hence reciprocal. [`super::Glossy`] and [`super::Plastic`] say what F, T and
//! base are, and why no energy is gained.

use super::BsdfSample;
use super::conductor::half_cosine;
use super::ggx::Ggx;
use crate::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// How much more a direction from the coat is worth than one from the base. Shadow rays find the lamps that
/// the base reflects; those that show in the coat it has to find alone. In a room whose floor mirrors its
/// windows 2 takes a seventh off the variance of the floor and 3.5 a fifth.
const ALONE: f32 = 2.0;

/// A kind of coat.
pub(super) trait Coat {
    /// GGX alpha; 0 is smooth.
    fn alpha(&self) -> f32;
    /// F: reflectance of a microfacet at the cosine `c`.
    fn reflectance(&self, c: f32) -> Rgb;
    /// T: the share of light from a direction of cosine `c` that passes the coat.
    fn transmittance(&self, c: f32) -> Rgb;
    /// What the coat reflects of light from `c`. An estimate.
    fn specular_albedo(&self, c: f32) -> Rgb;
    /// Factor of the base.
    fn base(&self) -> Rgb;
    /// ∫ 2c T(c) dc: how much of the light that leaves the base evenly gets out. An estimate.
    fn mean_transmittance(&self) -> Rgb;

    /// Probability of the coat's lobe: its part of the energy that leaves to `wo`, weighted by [`ALONE`].
    #[inline]
    fn coat_probability(&self, c: f32, transmittance: Rgb) -> f32 {
        let coat = ALONE * self.specular_albedo(c).element_sum();
        let base = (self.base() * transmittance * self.mean_transmittance()).element_sum();
        if base > 0.0 { (coat / (coat + base)).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// Whether the peak of the coat outshines a diffuse surface: of GGX at normal incidence that is F / (4 π α²),
/// here to a quarter of a white one's 1 / π.
#[inline]
pub(super) fn is_narrow(coat: &impl Coat) -> bool {
    coat.alpha() * coat.alpha() < coat.reflectance(1.0).max_element()
}

/// As [`sample`], by base or coat alone: weight and density are of that one, with the probability of its
/// choice. Whether it was the coat.
#[inline]
pub(super) fn sample_apart(coat: &impl Coat, wo: Vec3, u: [f32; 3]) -> Option<(BsdfSample, bool)> {
    let transmittance_o = coat.transmittance(wo.z);
    let is_coat = u[2] < coat.coat_probability(wo.z, transmittance_o);
    let wi = match is_coat {
        true => Ggx::new(coat.alpha()).sample_reflection(wo, [u[0], u[1]]),
        false => cosine_hemisphere([u[0], u[1]]),
    };
    let [of_base, of_coat] = evaluate_apart(coat, wo, wi);
    let (value, pdf) = if is_coat { of_coat } else { of_base };
    (pdf > 0.0).then(|| (BsdfSample::reflection(wi, value / pdf, pdf), is_coat))
}

/// As [`evaluate`], of the base and of the coat, which is rough.
#[inline]
pub(super) fn evaluate_apart(coat: &impl Coat, wo: Vec3, wi: Vec3) -> [(Rgb, f32); 2] {
    if !(wi.z > 0.0) {
        return [(Rgb::ZERO, 0.0); 2];
    }
    let transmittance_o = coat.transmittance(wo.z);
    let p = coat.coat_probability(wo.z, transmittance_o);
    let of_base = (base_value(coat, wi, transmittance_o), (1.0 - p) * (wi.z * FRAC_1_PI));
    let density = p * Ggx::new(coat.alpha()).reflection_density(wo, wo + wi);
    [of_base, (coat_value(coat, wo, wi), density)]
}

/// See [`super::Bsdf::sample`].
#[inline]
pub(super) fn sample(coat: &impl Coat, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
    let transmittance_o = coat.transmittance(wo.z);
    let p = coat.coat_probability(wo.z, transmittance_o);
    let smooth = coat.alpha() == 0.0;
    if u[2] < p {
        if smooth {
            return Some(BsdfSample::mirrored(wo, coat.reflectance(wo.z) / p, p));
        }
        let wi = Ggx::new(coat.alpha()).sample_reflection(wo, [u[0], u[1]]);
        return weighted(coat, wo, wi, transmittance_o, p);
    }
    let wi = cosine_hemisphere([u[0], u[1]]);
    if smooth && wi.z > 0.0 {
        // D, the cosine and π cancel.
        let weight = coat.base() * transmittance_o * coat.transmittance(wi.z) / (1.0 - p);
        return Some(BsdfSample::reflection(wi, weight, (1.0 - p) * wi.z * FRAC_1_PI));
    }
    weighted(coat, wo, wi, transmittance_o, p)
}

/// See [`super::Bsdf::evaluate`].
#[inline]
pub(super) fn evaluate(coat: &impl Coat, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
    if !(wi.z > 0.0) {
        return (Rgb::ZERO, 0.0);
    }
    let transmittance_o = coat.transmittance(wo.z);
    both_lobes(coat, wo, wi, transmittance_o, coat.coat_probability(wo.z, transmittance_o))
}

/// The part of f cos θ_i that the base reflects.
#[inline]
pub(super) fn of_base(coat: &impl Coat, wo: Vec3, wi: Vec3) -> Rgb {
    coat.base() * coat.transmittance(wo.z) * coat.transmittance(wi.z) * (wi.z.max(0.0) * FRAC_1_PI)
}

#[inline]
fn weighted(coat: &impl Coat, wo: Vec3, wi: Vec3, transmittance_o: Rgb, p: f32) -> Option<BsdfSample> {
    if !(wi.z > 0.0) {
        return None;
    }
    let (value, pdf) = both_lobes(coat, wo, wi, transmittance_o, p);
    (pdf > 0.0).then(|| BsdfSample::reflection(wi, value / pdf, pdf))
}

/// f cos θ_i and the density, of base and rough coat together.
#[inline]
fn both_lobes(coat: &impl Coat, wo: Vec3, wi: Vec3, transmittance_o: Rgb, p: f32) -> (Rgb, f32) {
    let value = value(coat, wo, wi, transmittance_o);
    let base_pdf = (1.0 - p) * (wi.z * FRAC_1_PI);
    if coat.alpha() == 0.0 {
        return (value, base_pdf);
    }
    (value, base_pdf + p * Ggx::new(coat.alpha()).reflection_density(wo, wo + wi))
}

/// f cos θ_i of base and rough coat together, for `wi` above the surface; T(θ_o) is known.
#[inline]
pub(super) fn value(coat: &impl Coat, wo: Vec3, wi: Vec3, transmittance_o: Rgb) -> Rgb {
    let base = base_value(coat, wi, transmittance_o);
    if coat.alpha() == 0.0 { base } else { base + coat_value(coat, wo, wi) }
}

/// f cos θ_i of the base alone.
#[inline]
pub(super) fn base_value(coat: &impl Coat, wi: Vec3, transmittance_o: Rgb) -> Rgb {
    coat.base() * transmittance_o * coat.transmittance(wi.z) * (wi.z * FRAC_1_PI)
}

/// f cos θ_i of a rough coat alone.
#[inline]
fn coat_value(coat: &impl Coat, wo: Vec3, wi: Vec3) -> Rgb {
    let ggx = Ggx::new(coat.alpha());
    let h = wo + wi;
    coat.reflectance(half_cosine(wo, h)) * (ggx.density(h) * ggx.visibility(wo, wi) * wi.z)
}
