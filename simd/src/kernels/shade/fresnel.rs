//! Fresnel equations of a dielectric boundary, and Schlick's approximation, over lanes.

use super::vector::{add, divide, scale, sub};
use crate::lanes::Lanes;

/// Reflectance of unpolarised light at a boundary of relative index `eta` = n_t / n_i, for the cosine of
/// incidence `c` > 0; 1 at total internal reflection. (Cook and Torrance 1982, eq. 16, with g = eta cos θ_t.)
#[inline(always)]
pub fn dielectric<L: Lanes>(c: L, eta: L) -> L {
    let (zero, one) = (c.all(0.0), c.all(1.0));
    let g2 = square_g(c, eta);
    between(c, g2.sqrt(), eta).select(zero.lt(g2), one)
}

/// g² = (eta cos θ_t)², below zero at total reflection. (eta - 1)(eta + 1) keeps the digits that eta² - 1
/// loses near 1.
#[inline(always)]
pub fn square_g<L: Lanes>(c: L, eta: L) -> L {
    let one = c.all(1.0);
    (eta - one) * (eta + one) + c * c
}

/// [`dielectric`] for known g = eta cos θ_t: without cancellation near the onset of total reflection.
#[inline(always)]
pub fn between<L: Lanes>(c: L, g: L, eta: L) -> L {
    let [s, p] = polarized(c, g, eta);
    c.all(0.5) * (s + p)
}

/// Reflectances of light polarised perpendicular and parallel to the plane of incidence, for known
/// g = eta cos θ_t.
#[inline(always)]
pub fn polarized<L: Lanes>(c: L, g: L, eta: L) -> [L; 2] {
    let r_s = (c - g) / (c + g);
    let eta2_c = eta * eta * c;
    let r_p = (eta2_c - g) / (eta2_c + g);
    [r_s * r_s, r_p * r_p]
}

/// Probability of reflection, in proportion to the energy of each side.
#[inline(always)]
pub(super) fn reflection_probability<L: Lanes>(reflectance: L, [r, g, b]: [L; 3]) -> L {
    let (zero, one) = (r.all(0.0), r.all(1.0));
    let transmitted = (one - reflectance) * (r + g + b) * zero.all(1.0 / 3.0);
    let sum = reflectance + transmitted;
    (reflectance / sum).select(zero.lt(sum), one)
}

/// Refraction of `wo` at a microfacet of normal `m`, c = wo·m > 0, into the medium of relative index `eta`
/// (Walter et al. 2007, eq. 40). The caller excludes total reflection.
#[inline(always)]
pub(super) fn refract<L: Lanes>(wo: [L; 3], m: [L; 3], c: L, eta: L) -> [L; 3] {
    // The g of `dielectric`, so that both agree on the onset of total reflection.
    let g = square_g(c, eta).max(c.all(0.0)).sqrt();
    divide(sub(scale(m, c - g), wo), eta)
}

/// (1 - c)^5, the weight of white in Schlick's approximation; `c` in 0 … 1.
#[inline(always)]
pub fn schlick_weight<L: Lanes>(c: L) -> L {
    let m = (c.all(1.0) - c).max(c.all(0.0)).min(c.all(1.0));
    let m2 = m * m;
    m2 * m2 * m
}

/// Schlick 1994, eq. 24: `f0` at normal incidence, white at grazing incidence.
#[inline(always)]
pub fn schlick<L: Lanes>(f0: [L; 3], c: L) -> [L; 3] {
    add(f0, scale(sub([c.all(1.0); 3], f0), schlick_weight(c)))
}

/// Reflectance at normal incidence of a boundary of relative index `eta`.
#[inline]
#[must_use]
pub fn normal_incidence(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Cosine-weighted mean of [`dielectric`] over the hemisphere for `eta` >= 1: a polynomial in the amplitude
/// (η - 1)/(η + 1), with error at most 6e-4 up to η = 10 (the exact integral needs logarithms).
#[inline]
#[must_use]
pub fn mean_external_reflectance(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    let p = 7.973_348 - 2.666_957_2 * r;
    r * (0.579_872_35 + r * (-1.437_609_5 + r * (5.702_148 + r * (-9.190_549 + r * p))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-7);
        assert_eq!(dielectric(0.3, 1.0), 0.0);
        // Brewster's angle of glass: only r_s remains, ((1 - 2.25) / (1 + 2.25))².
        let brewster = 1.0 / (1.0f32 + 2.25).sqrt();
        assert!((dielectric(brewster, 1.5) - 0.5 * (1.25f32 / 3.25).powi(2)).abs() < 1e-6);
        // From inside beyond the critical angle, sin θ = 1/1.5.
        assert_eq!(dielectric((1.0 - 1.0f32 / 2.25).sqrt() - 1e-4, 1.0 / 1.5), 1.0);
        assert!(dielectric(1e-6, 1.5) > 0.9999);
    }

    #[test]
    fn the_same_from_both_sides() {
        for eta in [1.0 + 1e-6, 1.33, 1.5, 10.0f32] {
            for c in [0.01f32, 0.2, 0.5, 0.9, 1.0] {
                let c_t = (1.0 - (1.0 - c * c) / (eta * eta)).sqrt();
                let (a, b) = (dielectric(c, eta), dielectric(c_t, 1.0 / eta));
                // The rounding of c_t grows by eta² / c on the way back.
                assert!((a - b).abs() < 5e-7 * eta * eta / c, "{eta} {c}: {a} {b}");
            }
        }
    }

    #[test]
    fn stays_within_zero_and_one() {
        for eta in [0.1, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.5, 10.0, 1e4f32] {
            for c in [1e-30, 1e-6, 1e-3, 0.5, 1.0f32] {
                let f = dielectric(c, eta);
                assert!((0.0..=1.0).contains(&f), "{eta} {c}: {f}");
            }
        }
    }
}
