//! Albedo tables: directional albedo and transmittance of a GGX coat, integrals without closed form.
//!
//! The tables store the difference of a rough coat from the smooth coat, which has a closed form, in steps of
//! [`STEP`], over sqrt(cos θ), sqrt(alpha) and the amplitude r = (η - 1)/(η + 1). `derive.rs` computes the
//! integrals in f64; its tests compare the tables with them and can print new tables.

mod data;
#[cfg(test)]
mod derive;
mod fit;

pub(crate) use fit::SchlickFit;
pub(in crate::bsdf) use fit::{schlick_albedo as schlick_albedo_fit, transmittance as transmittance_fit};

use super::fresnel;
use halflight_simd::kernels::shade::coat_tables::{
    AMPLITUDES, COSINES, CoatTables, ROUGHNESSES, STEP, along, amplitude, lerp, roughness, unit,
};

/// The tables that lanes read too.
pub(crate) static COATS: CoatTables = {
    const TABLE: usize = ROUGHNESSES * COSINES;
    let mut tables = [0; (AMPLITUDES + 2) * TABLE];
    let mut i = 0;
    while i < tables.len() {
        let table = match i / TABLE {
            AMPLITUDES => &data::WHITE,
            k if k < AMPLITUDES => &data::TRANSMITTANCE[k],
            _ => &data::EDGE,
        };
        tables[i] = table[i % TABLE / COSINES][i % COSINES];
        i += 1;
    }
    tables
};

/// Cosine-weighted mean over the hemisphere of the albedo of a coat with Schlick's reflectance: `white` for
/// F = 1, `edge` for F = (1 - c)^5. For any F0 it is F0 · (white - edge) + edge.
#[inline]
pub(super) fn schlick_mean(alpha: f32) -> [f32; 2] {
    /// Mean of (1 - c)^5.
    const SMOOTH: f32 = 1.0 / 21.0;
    if alpha == 0.0 {
        return [1.0, SMOOTH];
    }
    let [row, t] = roughness(alpha);
    [
        unit(1.0 + STEP * along(&data::WHITE_MEAN, row, t)),
        unit(SMOOTH + STEP * along(&data::EDGE_MEAN, row, t)),
    ]
}

/// Internal reflectance of a dielectric coat for uniform incident light. For rough coats it is the one-bounce
/// reflectance, averaged over 64 cosines as in Mitsuba's `roughplastic` (1.6 % below the integral), so that
/// pictures agree. The error makes surfaces darker; towards the smooth coat it vanishes.
#[inline]
pub(super) fn internal_reflectance(alpha: f32, eta: f32) -> f32 {
    let smooth = 1.0 - (1.0 - fresnel::mean_external_reflectance(eta)) / (eta * eta);
    if alpha == 0.0 {
        return smooth;
    }
    let ([k, s], [row, t]) = (amplitude(eta), roughness(alpha));
    let at = |k: usize| data::INTERNAL.get(k).map_or(0.0, |table| along(table, row, t));
    unit(smooth + STEP * lerp(at(k as usize), at(k as usize + 1), s))
}
