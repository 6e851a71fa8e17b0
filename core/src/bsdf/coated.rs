//! Rough or smooth coat over a diffuse base. The base receives the light that the coat transmits on the way
//! in and on the way out (Ashikhmin et al. 2000, §2.4; Kelemen and Szirmay-Kalos 2001):
//!
//! f = D G F / (4 cos θ_o cos θ_i) + base · T(θ_o) T(θ_i) / π
//!
//! The model is symmetric in the directions, hence reciprocal. [`super::Glossy`] and [`super::Plastic`]
//! define F, T and base, and show that energy is conserved.

use super::BsdfSample;
use super::albedo::SchlickFit;
use super::conductor::half_cosine;
use super::ggx::Ggx;
use crate::Rgb;
use crate::sampling::warp::cosine_hemisphere;
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;
use halflight_simd::kernels::shade::coat::COAT_WEIGHT;

/// Model of a coat.
pub(super) trait Coat {
    /// GGX alpha; 0 is smooth.
    fn alpha(&self) -> f32;
    /// F: reflectance of a microfacet at the cosine `c`.
    fn reflectance(&self, c: f32) -> Rgb;
    /// T: transmittance at the cosine `c`.
    fn transmittance(&self, c: f32) -> Rgb;
    /// Directional albedo of the coat at the cosine `c`, an estimate.
    fn specular_albedo(&self, c: f32) -> Rgb;
    /// Factor of the base.
    fn base(&self) -> Rgb;
    /// ∫ 2c T(c) dc: mean transmittance for uniform light from the base, an estimate.
    fn mean_transmittance(&self) -> Rgb;

    /// Least-squares fit to T.
    fn transmittance_fit(&self) -> SchlickFit<Rgb>;

    /// Directional albedo at normal incidence, an estimate.
    fn normal_albedo(&self) -> Rgb {
        self.specular_albedo(1.0) + self.base() * self.transmittance(1.0) * self.mean_transmittance()
    }

    /// Probability of the coat's lobe: its share of the energy that leaves towards `wo`, with the weight
    /// [`COAT_WEIGHT`] of the coat, and `base_weight` of the base.
    #[inline]
    fn coat_probability(&self, c: f32, transmittance: Rgb, base_weight: f32) -> f32 {
        let coat = COAT_WEIGHT * self.specular_albedo(c).element_sum();
        let base = (self.base() * transmittance * self.mean_transmittance()).element_sum() * base_weight;
        if base > 0.0 { (coat / (coat + base)).clamp(0.0, 1.0) } else { 1.0 }
    }
}

/// True if the peak of the coat is brighter than a quarter of a white diffuse surface (1 / π). At normal
/// incidence the peak of GGX is F / (4 π α²).
#[inline]
pub(super) fn is_narrow(coat: &impl Coat) -> bool {
    coat.alpha() * coat.alpha() < coat.reflectance(1.0).max_element()
}

/// [`sample`] of base or coat alone, the base chosen with the weight `base_weight`. Weight and density are
/// those of the chosen lobe, including the probability of the choice. The flag is true for the coat.
#[inline]
pub(super) fn sample_apart(
    coat: &impl Coat,
    wo: Vec3,
    u: [f32; 3],
    base_weight: f32,
) -> Option<(BsdfSample, bool)> {
    let transmittance_o = coat.transmittance(wo.z);
    let p = coat.coat_probability(wo.z, transmittance_o, base_weight);
    let is_coat = u[2] < p;
    let wi = match is_coat {
        true if coat.alpha() == 0.0 => {
            return Some((BsdfSample::mirrored(wo, coat.reflectance(wo.z) / p, p), true));
        }
        true => Ggx::new(coat.alpha()).sample_reflection(wo, [u[0], u[1]]),
        false => cosine_hemisphere([u[0], u[1]]),
    };
    let [of_base, of_coat] = evaluate_apart(coat, wo, wi, base_weight);
    let (value, pdf) = if is_coat { of_coat } else { of_base };
    (pdf > 0.0).then(|| (BsdfSample::reflection(wi, value / pdf, pdf), is_coat))
}

/// [`evaluate`] of the base and of the coat, each alone, with the densities of [`sample_apart`]; zeros for a
/// smooth coat.
#[inline]
pub(super) fn evaluate_apart(coat: &impl Coat, wo: Vec3, wi: Vec3, base_weight: f32) -> [(Rgb, f32); 2] {
    if !(wi.z > 0.0) {
        return [(Rgb::ZERO, 0.0); 2];
    }
    let transmittance_o = coat.transmittance(wo.z);
    let p = coat.coat_probability(wo.z, transmittance_o, base_weight);
    let of_base = (base_value(coat, wi, transmittance_o), (1.0 - p) * (wi.z * FRAC_1_PI));
    if coat.alpha() == 0.0 {
        return [of_base, (Rgb::ZERO, 0.0)];
    }
    let density = p * Ggx::new(coat.alpha()).reflection_density(wo, wo + wi);
    [of_base, (coat_value(coat, wo, wi), density)]
}

/// Part of a coat that depends on the viewer alone.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CoatView {
    /// T(θ_o).
    transmittance: Rgb,
    /// Probability of the coat in the choice of the lobe.
    probability: f32,
}

impl CoatView {
    /// `coat`, seen at the cosine `c`.
    #[inline]
    pub(super) fn of(coat: &impl Coat, c: f32) -> Self {
        let transmittance = coat.transmittance(c);
        Self { transmittance, probability: coat.coat_probability(c, transmittance, 1.0) }
    }
}

/// See [`super::Bsdf::sample`].
#[inline]
pub(super) fn sample(coat: &impl Coat, view: CoatView, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
    let CoatView { transmittance: transmittance_o, probability: p } = view;
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
pub(super) fn evaluate(coat: &impl Coat, view: CoatView, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
    if !(wi.z > 0.0) {
        return (Rgb::ZERO, 0.0);
    }
    both_lobes(coat, wo, wi, view.transmittance, view.probability)
}

/// f cos θ_i of the base.
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

/// f cos θ_i and density of base and rough coat together.
#[inline]
fn both_lobes(coat: &impl Coat, wo: Vec3, wi: Vec3, transmittance_o: Rgb, p: f32) -> (Rgb, f32) {
    let value = value(coat, wo, wi, transmittance_o);
    let base_pdf = (1.0 - p) * (wi.z * FRAC_1_PI);
    if coat.alpha() == 0.0 {
        return (value, base_pdf);
    }
    (value, base_pdf + p * Ggx::new(coat.alpha()).reflection_density(wo, wo + wi))
}

/// f cos θ_i of base and rough coat together, for `wi` above the surface and known T(θ_o).
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
