//! Transmittance of a coat, fitted as T(c) ≈ t₀ + t₅ (1 - c)⁵ by least squares under 2c dc, so that the light
//! that the coat lets through to its base follows from two integrals of the incident light.
//!
//! The fit is linear in T. With the moments a = ∫ 2c T dc and b = ∫ 2c (1 - c)⁵ T dc it is t₅ = (b - a / 21)
//! / (1/66 - 1/441) and t₀ = a - t₅ / 21; the fit keeps a and b. It is exact for the smooth coat of Schlick.
//! For dielectrics of alpha up to 0.35 the error in light of random bands is at most 0.5 %. The shadowing of
//! rougher microfacets dims T over all angles, which (1 - c)⁵ does not follow: at alpha 1 the fit is 14 % too
//! bright at c = 0.5.

use super::{AMPLITUDES, COSINES, ROUGHNESSES, STEP, amplitude, data, lerp, roughness};
use crate::bsdf::{fresnel, sqrt};

/// ∫ 2c (1 - c)⁵ dc.
const MEAN_WEIGHT: f32 = 1.0 / 21.0;
/// ∫ 2c (1 - c)¹⁰ dc - [`MEAN_WEIGHT`]².
const VARIANCE: f32 = 1.0 / 66.0 - MEAN_WEIGHT * MEAN_WEIGHT;

/// t₀ + t₅ (1 - c)⁵, per channel or for all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SchlickFit<T> {
    /// t₀.
    pub(crate) constant: T,
    /// t₅.
    pub(crate) edge: T,
}

impl SchlickFit<f32> {
    /// Fit with the moments ∫ 2c T dc and ∫ 2c (1 - c)⁵ T dc.
    #[inline]
    fn of([mean, edge_mean]: [f32; 2]) -> Self {
        let edge = (edge_mean - mean * MEAN_WEIGHT) * (1.0 / VARIANCE);
        Self { constant: mean - edge * MEAN_WEIGHT, edge }
    }
}

/// Fit to the albedo of a coat of GGX `alpha` with Schlick's reflectance: for F = 1, and for F = (1 - c)⁵.
#[inline]
pub(in crate::bsdf) fn schlick_albedo(alpha: f32) -> [SchlickFit<f32>; 2] {
    let of = |smooth: SchlickFit<f32>, table: &[[f32; 2]; ROUGHNESSES]| {
        if alpha == 0.0 {
            return smooth;
        }
        let rough = SchlickFit::of(along(table, roughness(alpha)));
        SchlickFit { constant: smooth.constant + rough.constant, edge: smooth.edge + rough.edge }
    };
    [of(SchlickFit { constant: 1.0, edge: 0.0 }, &WHITE), of(SchlickFit { constant: 0.0, edge: 1.0 }, &EDGE)]
}

/// Fit to the transmittance of a dielectric coat of index `eta` >= 1.
#[inline]
pub(in crate::bsdf) fn transmittance(alpha: f32, eta: f32) -> SchlickFit<f32> {
    let mut moments = [1.0 - fresnel::mean_external_reflectance(eta), MEAN_WEIGHT - edge_reflectance(eta)];
    if alpha > 0.0 {
        let ([k, t], at) = (amplitude(eta), roughness(alpha));
        let table = |k: usize| TRANSMITTANCE.get(k).map_or([0.0; 2], |table| along(table, at));
        let (low, high) = (table(k as usize), table(k as usize + 1));
        moments = core::array::from_fn(|m| moments[m] + lerp(low[m], high[m], t));
    }
    SchlickFit::of(moments)
}

/// ∫ 2c (1 - c)⁵ F(c) dc of a smooth dielectric boundary with `eta` >= 1: a polynomial in the root of the
/// amplitude r = (η - 1)/(η + 1), with error at most 1e-4 up to η = 10.
#[inline]
fn edge_reflectance(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    let q = sqrt(r);
    let p = 5.788_148_4 - 1.527_836_6 * q;
    r * (0.541_340_06 + q * (-2.687_063_8 + q * (6.531_36 + q * (-8.610_34 + q * p))))
}

/// Interpolated moments of a row of roughnesses.
#[inline]
fn along(row: &[[f32; 2]; ROUGHNESSES], [j, s]: [f32; 2]) -> [f32; 2] {
    let at = |j: usize| row.get(j).copied().unwrap_or_default();
    let (low, high) = (at(j as usize), at(j as usize + 1));
    core::array::from_fn(|m| lerp(low[m], high[m], s))
}

/// Moments of the difference of a rough coat from the smooth coat, per roughness.
static WHITE: [[f32; 2]; ROUGHNESSES] = moments(&data::WHITE);
static EDGE: [[f32; 2]; ROUGHNESSES] = moments(&data::EDGE);
static TRANSMITTANCE: [[[f32; 2]; ROUGHNESSES]; AMPLITUDES] = {
    let mut all = [[[0.0; 2]; ROUGHNESSES]; AMPLITUDES];
    let mut k = 0;
    while k < AMPLITUDES {
        all[k] = moments(&data::TRANSMITTANCE[k]);
        k += 1;
    }
    all
};

/// Moments of each row of `table`, which is linear between its nodes.
const fn moments(table: &[[i16; COSINES]; ROUGHNESSES]) -> [[f32; 2]; ROUGHNESSES] {
    let mut all = [[0.0; 2]; ROUGHNESSES];
    let mut j = 0;
    while j < ROUGHNESSES {
        let mut i = 0;
        while i < COSINES {
            let value = table[j][i] as f32 * STEP;
            all[j][0] += value * WEIGHTS[i][0];
            all[j][1] += value * WEIGHTS[i][1];
            i += 1;
        }
        j += 1;
    }
    all
}

/// ∫ 2c h dc and ∫ 2c (1 - c)⁵ h dc of the hat function h of each node over q = sqrt(c), by midpoints:
/// 2c dc = 4q³ dq.
const WEIGHTS: [[f32; 2]; COSINES] = {
    const CELLS: usize = COSINES - 1;
    const POINTS: usize = 64;
    let mut weights = [[0.0f64; 2]; COSINES];
    let mut n = 0;
    while n < CELLS * POINTS {
        let (i, t) = (n / POINTS, ((n % POINTS) as f64 + 0.5) / POINTS as f64);
        let q = (i as f64 + t) / CELLS as f64;
        let (d, m) = (4.0 * q * q * q / (CELLS * POINTS) as f64, 1.0 - q * q);
        let edge = d * m * m * m * m * m;
        weights[i] = [weights[i][0] + (1.0 - t) * d, weights[i][1] + (1.0 - t) * edge];
        weights[i + 1] = [weights[i + 1][0] + t * d, weights[i + 1][1] + t * edge];
        n += 1;
    }
    let mut rounded = [[0.0f32; 2]; COSINES];
    let mut i = 0;
    while i < COSINES {
        rounded[i] = [weights[i][0] as f32, weights[i][1] as f32];
        i += 1;
    }
    rounded
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::bsdf::{Bsdf, Glossy, Plastic};
    use crate::sampling::Random;
    use std::prelude::v1::*;

    const SAMPLES: usize = 4000;

    /// Transmittance of the coat of `bsdf` for light from the cosine `c`.
    fn transmittance_at(bsdf: &Bsdf, c: f32) -> f32 {
        bsdf.coat_transmittance().unwrap().transmittance(c).x
    }

    /// ∫ L (t₀ + t₅ (1 - c)⁵) cos over ∫ L T cos for light of the radiance `light` over c, in f64.
    fn ratio(bsdf: &Bsdf, light: &dyn Fn(f64) -> f64) -> f64 {
        let fit = bsdf.base_transmittance_fit().unwrap();
        let (mut exact, mut fitted) = (0.0, 0.0);
        for i in 0..SAMPLES {
            let c = (i as f64 + 0.5) / SAMPLES as f64;
            let weighted = light(c) * c;
            exact += weighted * f64::from(transmittance_at(bsdf, c as f32));
            let edge = (1.0 - c).powi(5);
            fitted += weighted * (f64::from(fit.constant.x) + f64::from(fit.edge.x) * edge);
        }
        fitted / exact
    }

    #[test]
    fn a_smooth_coat_of_schlick_is_exact() {
        for f0 in [0.0, 0.04, 0.3, 0.9] {
            let fit = Bsdf::Glossy(Glossy::new(Rgb::splat(0.5), Rgb::splat(f0), 0.0, 0.0))
                .base_transmittance_fit()
                .unwrap();
            assert!((fit.constant.x - (1.0 - f0)).abs() < 1e-6 && (fit.edge.x - (f0 - 1.0)).abs() < 1e-6);
        }
    }

    #[test]
    fn light_through_a_coat_follows_from_two_moments() {
        let plastic = |alpha: f32, eta: f32| {
            Bsdf::Plastic(Plastic::new(Rgb::splat(0.5), Rgb::splat(1.0), alpha, 0.0, eta))
        };
        let glossy =
            |alpha: f32, f0: f32| Bsdf::Glossy(Glossy::new(Rgb::splat(0.5), Rgb::splat(f0), alpha, 0.0));
        for alpha in [0.0, 1e-3, 0.02, 0.1, 0.2, 0.35, 0.6, 1.0] {
            let mut coats = vec![glossy(alpha, 0.04), glossy(alpha, 0.1)];
            if alpha <= 0.35 {
                coats.extend([
                    plastic(alpha, 1.3),
                    plastic(alpha, 1.5),
                    plastic(alpha, 2.0),
                    glossy(alpha, 0.3),
                ]);
            }
            for bsdf in coats {
                assert!(bsdf.has_fitted_coat());
                let uniform = ratio(&bsdf, &|_| 1.0) - 1.0;
                assert!(uniform.abs() < 1e-3, "{bsdf:?}: {uniform}");
                // Light of sixteen bands of height, each of random brightness.
                let (mut squares, mut sum, random) = (0.0, 0.0, Random::new(3, 1));
                for trial in 0..64 {
                    let light = |c: f64| f64::from(random.single(16 * trial + (c * 16.0) as u32));
                    let error = ratio(&bsdf, &light) - 1.0;
                    squares += error * error;
                    sum += error;
                }
                let (rms, mean) = ((squares / 64.0).sqrt(), sum / 64.0);
                assert!(rms < 5e-3 && mean.abs() < 1.5e-3, "{bsdf:?}: rms {rms}, mean {mean}");
                // All light from above, or from the rim.
                let (high, low) =
                    (ratio(&bsdf, &|c| f64::from(c > 0.5)), ratio(&bsdf, &|c| f64::from(c < 0.3)));
                assert!((high - 1.0).abs() < 0.01 && (low - 1.0).abs() < 0.025, "{bsdf:?}: {high} {low}");
            }
        }
        assert!(!plastic(0.6, 1.5).has_fitted_coat() && !glossy(0.6, 0.3).has_fitted_coat());
    }

    #[test]
    fn the_polynomial_is_the_integral() {
        for eta in [1.0, 1.05, 1.2, 1.5, 2.0, 3.0, 9.0f32] {
            let n = 100_000;
            let integral: f64 = (0..n)
                .map(|i| (f64::from(i) + 0.5) / f64::from(n))
                .map(|c| 2.0 * c * (1.0 - c).powi(5) * f64::from(fresnel::dielectric(c as f32, eta)))
                .sum::<f64>()
                / f64::from(n);
            assert!((f64::from(edge_reflectance(eta)) - integral).abs() < 1.2e-4, "{eta}");
        }
    }
}
