//! Rough or smooth coat over a diffuse base, over lanes: value, density and sampling. The base receives the
//! light that the coat transmits on the way in and on the way out (Ashikhmin et al. 2000, §2.4; Kelemen and
//! Szirmay-Kalos 2001):
//!
//! f = D G F / (4 cos θ_o cos θ_i) + base · T(θ_o) T(θ_i) / π
//!
//! The model is symmetric in the directions, hence reciprocal.
//!
//! A microfacet of a dielectric coat reflects tint · F + metal + (metallic - metal) · S, with Fresnel's F and
//! S = (1 - c)^5. One of a coat of Schlick reflects metal + (1 - metal) · S. The part of a coat that depends
//! on the viewer is computed once a vertex.

use super::bsdf::SampleLanes;
use super::coat_tables::{AMPLITUDES, CoatTables, STEP, TablePlace, amplitude, lerp, unit};
use super::fresnel::{dielectric, schlick_weight};
use super::ggx::Ggx;
use super::vector::{self, add, divide, mul, scale, sub};
use super::warp;
use crate::lanes::{Lanes, Mask, dot};
use core::f32::consts::FRAC_1_PI;

/// Weight of the coat over the base in the choice of the lobe. Light samples find the emitters that the base
/// reflects, whereas the coat has to find its reflections alone (docs/decisions/bsdfs.md#choice-of-the-coat).
pub const COAT_WEIGHT: f32 = 2.0;

/// Coats over lanes.
#[derive(Clone, Copy)]
pub struct CoatLanes<L: Lanes> {
    /// Factors of the bases.
    pub base: [L; 3],
    /// Factors of Fresnel's reflectance; reflectances at normal incidence of coats of Schlick.
    pub tint: [L; 3],
    /// Reflectances of the metals at normal incidence; of coats of Schlick with their metals.
    pub metal: [L; 3],
    /// Fractions of the metals; 1 for coats of Schlick.
    pub metallic: L,
    /// GGX alpha; 0 is smooth.
    pub alpha: L,
    /// Indices of refraction; above 1 for coats of Schlick, which do not use it.
    pub eta: L,
    /// Mean transmittances for uniform light from the bases.
    pub mean: [L; 3],
    /// Weights of the bases in the choice of the lobe.
    pub base_weight: L,
    /// Lanes with a coat.
    pub exists: L::Mask,
    /// Those of a dielectric. Others are coats of Schlick.
    pub dielectric: L::Mask,
    /// Transmittances T(θ_o), by [`CoatLanes::see`].
    pub transmittance: [L; 3],
    /// Probabilities of the coats in the choice of the lobe, by [`CoatLanes::see`].
    pub probability: L,
}

impl CoatLanes<f32> {
    /// Smooth black coat of Schlick over a black base.
    pub const SMOOTH: Self = Self {
        base: [0.0; 3],
        tint: [0.0; 3],
        metal: [0.0; 3],
        metallic: 0.0,
        alpha: 0.0,
        eta: 1.5,
        mean: [0.0; 3],
        base_weight: 1.0,
        exists: true,
        dielectric: false,
        transmittance: [1.0; 3],
        probability: 0.0,
    };
}

/// Transmittance of coats, and the numbers that it shares with their albedos.
struct Transmitted<L: Lanes> {
    transmittance: [L; 3],
    /// Fresnel's reflectance of dielectric coats.
    fresnel: L,
    /// Albedos for F = 1 and F = (1 - c)^5.
    white: L,
    edge: L,
}

impl<L: Lanes> CoatLanes<L> {
    #[inline(always)]
    pub(super) fn rough(&self) -> L::Mask {
        !self.alpha.eq(self.alpha.all(0.0))
    }

    /// tint · fresnel + metal + (metallic - metal) · schlick, for coats of Schlick without the first.
    #[inline(always)]
    fn mix(&self, fresnel: L, schlick: L) -> [L; 3] {
        let coat = scale(self.tint, fresnel);
        let coat = vector::select(self.dielectric, add(coat, self.metal), self.metal);
        add(coat, scale(sub([self.metallic; 3], self.metal), schlick))
    }

    /// Reflectance of a microfacet at the cosine `c`.
    #[inline(always)]
    pub fn reflectance(&self, c: L) -> [L; 3] {
        let fresnel = if self.dielectric.any() { dielectric(c, self.eta) } else { c };
        self.mix(fresnel, schlick_weight(c))
    }

    /// `f0 · (white - edge) + edge`: albedo of a coat of Schlick.
    #[inline(always)]
    fn albedo(f0: [L; 3], white: L, edge: L) -> [L; 3] {
        add(scale(f0, white - edge), [edge; 3])
    }

    /// Transmittance at the cosine `c`; the albedos of dielectric coats are computed if `all`.
    #[inline(always)]
    fn transmitted(&self, tables: &CoatTables, c: L, all: bool) -> Transmitted<L> {
        let (one, step, amplitudes) = (c.all(1.0), c.all(STEP), c.all(AMPLITUDES as f32));
        let rough = self.rough() & self.exists;
        let (mut fresnel, mut white, mut edge) = (c, one, schlick_weight(c));
        if self.dielectric.any() {
            fresnel = dielectric(c, self.eta);
        }
        let mut of_dielectric = one - fresnel;
        if rough.any() {
            let at = TablePlace::new(c, self.alpha);
            if (rough & self.dielectric).any() {
                let [k, t] = amplitude(self.eta);
                let difference = lerp(at.value(tables, k), at.value(tables, k + one), t);
                of_dielectric = unit(of_dielectric + step * difference).select(rough, of_dielectric);
            }
            if all || (rough & !self.dielectric).any() {
                white = unit(one + step * at.value(tables, amplitudes)).select(rough, one);
                edge = unit(edge + step * at.value(tables, amplitudes + one)).select(rough, edge);
            }
        }
        let of_schlick = sub([one; 3], Self::albedo(self.tint, white, edge));
        let transmittance = vector::select(self.dielectric, [of_dielectric; 3], of_schlick);
        Transmitted { transmittance, fresnel, white, edge }
    }

    /// Transmittance T at the cosine `c`.
    #[inline(always)]
    pub fn transmittance(&self, tables: &CoatTables, c: L) -> [L; 3] {
        self.transmitted(tables, c, false).transmittance
    }

    /// `self` with T(θ_o) and the probability of the coat for a viewer at the cosine `c`: the fraction of the
    /// coat in the energy that leaves, with the weights [`COAT_WEIGHT`] and `base_weight`.
    #[inline(always)]
    #[must_use]
    pub fn see(self, tables: &CoatTables, c: L) -> Self {
        let (zero, one) = (c.all(0.0), c.all(1.0));
        let sum = |[a, b, c]: [L; 3]| a + b + c;
        let Transmitted { transmittance, fresnel, white, edge } = self.transmitted(tables, c, true);
        let mut albedo = Self::albedo(self.metal, white, edge);
        if self.dielectric.any() {
            // The albedo tables of Schlick's coat also serve the dielectric coat.
            let amplitude = (self.eta - one) / (self.eta + one);
            let by_table = edge + amplitude * amplitude * (white - edge);
            let of_dielectric = self.mix(by_table.select(self.rough(), fresnel), edge);
            albedo = vector::select(self.dielectric, of_dielectric, albedo);
        }
        let coat = c.all(COAT_WEIGHT) * sum(albedo);
        let base = sum(mul(mul(self.base, transmittance), self.mean)) * self.base_weight;
        let probability = unit(coat / (coat + base)).select(zero.lt(base), one);
        Self { transmittance, probability, ..self }
    }

    /// base · T(θ_o) · T(θ_i).
    #[inline(always)]
    fn reflected(&self, tables: &CoatTables, wi: [L; 3]) -> [L; 3] {
        mul(mul(self.base, self.transmittance), self.transmittance(tables, wi[2]))
    }

    /// f cos θ_i of the base alone, for `wi` above the horizon.
    #[inline(always)]
    pub fn base_value(&self, tables: &CoatTables, wi: [L; 3]) -> [L; 3] {
        scale(self.reflected(tables, wi), wi[2] * wi[2].all(FRAC_1_PI))
    }

    /// f cos θ_i of rough coats alone, and the density of their samples without the probability of the
    /// choice.
    #[inline(always)]
    pub(super) fn lobe(&self, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let ggx = Ggx::new(self.alpha);
        let h = add(wo, wi);
        let reflectance = self.reflectance(dot(wo, h) / vector::length(h));
        let lobe = ggx.density(h) * ggx.visibility(wo, wi) * wi[2];
        (scale(reflectance, lobe), ggx.reflection_density(wo, h))
    }

    /// f cos θ_i and density of base and rough coat together, zeros below the horizon.
    #[inline(always)]
    pub fn evaluate(&self, tables: &CoatTables, wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let above = wi[2].all(0.0).lt(wi[2]);
        let (value, pdf) = self.both(self.reflected(tables, wi), wo, wi);
        (vector::select(above, value, [wi[2].all(0.0); 3]), pdf.select(above, wi[2].all(0.0)))
    }

    /// [`CoatLanes::evaluate`] above the horizon, for known base · T(θ_o) · T(θ_i).
    #[inline(always)]
    fn both(&self, reflected: [L; 3], wo: [L; 3], wi: [L; 3]) -> ([L; 3], L) {
        let (one, lambert, p) = (wi[2].all(1.0), wi[2] * wi[2].all(FRAC_1_PI), self.probability);
        let (mut value, mut pdf) = (scale(reflected, lambert), (one - p) * lambert);
        let rough = self.rough() & self.exists & one.all(0.0).lt(wi[2]);
        if rough.any() {
            let (lobe, density) = self.lobe(wo, wi);
            value = vector::select(rough, add(value, lobe), value);
            pdf = (pdf + p * density).select(rough, pdf);
        }
        (value, pdf)
    }

    /// Directions of the lobes that are chosen: of the coat in the lanes `of_coat`, which are rough, of the
    /// base elsewhere.
    #[inline(always)]
    pub(super) fn direction(&self, of_coat: L::Mask, wo: [L; 3], u: [L; 2]) -> [L; 3] {
        let mut direction = wo;
        if (!of_coat).any() {
            direction = warp::cosine_hemisphere(u);
        }
        if of_coat.any() {
            let reflected = Ggx::new(self.alpha).sample_reflection(wo, u);
            direction = vector::select(of_coat, reflected, direction);
        }
        direction
    }

    /// Samples a direction.
    #[inline(always)]
    pub fn sample(&self, tables: &CoatTables, wo: [L; 3], [u, v, lobe]: [L; 3]) -> SampleLanes<L> {
        let (zero, one) = (u.all(0.0), u.all(1.0));
        let (p, rough, is_coat) = (self.probability, self.rough(), lobe.lt(self.probability));
        let delta = is_coat & !rough;
        let mut sample = SampleLanes::mirrored(wo, [zero; 3], p);
        if (delta & self.exists).any() {
            sample.weight = divide(self.reflectance(wo[2]), p);
        }
        if (!delta & self.exists).any() {
            let wi = self.direction(is_coat & rough & self.exists, wo, [u, v]);
            let reflected = self.reflected(tables, wi);
            let (mut weight, mut pdf) = (reflected, (one - p) * wi[2] * zero.all(FRAC_1_PI));
            let mut exists = zero.lt(wi[2]);
            if rough.any() {
                let (value, density) = self.both(reflected, wo, wi);
                weight = vector::select(rough, divide(value, density), weight);
                pdf = density.select(rough, pdf);
                exists = exists & (!rough | zero.lt(density));
            }
            if (!rough).any() {
                // Under a smooth coat D, the cosine and π cancel.
                weight = vector::select(rough, weight, divide(reflected, one - p));
            }
            let wide = SampleLanes { direction: wi, weight, pdf, eta: one, exists, delta: one.lt(zero) };
            sample = sample.select(delta, wide);
        }
        SampleLanes { exists: sample.exists & self.exists, delta: delta & self.exists, ..sample }
    }
}
