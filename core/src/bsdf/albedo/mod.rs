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

use super::range::unit;
use super::{fresnel, sqrt};
use halflight_simd::kernels::shade::coat_tables::{
    AMPLITUDES, COSINES, CoatTables, LAST_AMPLITUDE, ROUGHNESSES, STEP,
};

/// The tables that lanes read too.
pub(crate) static COATS: CoatTables = {
    let mut tables = [[[0; COSINES]; ROUGHNESSES]; AMPLITUDES + 2];
    let mut k = 0;
    while k < AMPLITUDES {
        tables[k] = data::TRANSMITTANCE[k];
        k += 1;
    }
    tables[AMPLITUDES] = data::WHITE;
    tables[AMPLITUDES + 1] = data::EDGE;
    tables
};

/// Position on an axis of a table: the node below, and the fraction of the distance to the next node.
type Place = (usize, f32);

/// Position of `x` in 0 … 1 among `nodes` nodes.
#[inline]
fn place(x: f32, nodes: usize) -> Place {
    let at = unit(x) * (nodes - 1) as f32;
    let below = (at as usize).min(nodes - 2);
    (below, at - below as f32)
}

/// Position of `alpha` among the roughnesses. The differences grow as alpha², the fourth power of the axis,
/// and so does the interpolation between the smooth coat and the first node.
#[inline]
fn roughness(alpha: f32) -> Place {
    match place(sqrt(alpha), ROUGHNESSES) {
        (0, t) => (0, t * t * t * t),
        other => other,
    }
}

#[inline]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Interpolated value of a row, in units of [`STEP`].
#[inline]
fn along<const N: usize>(row: &[i16; N], (i, t): Place) -> f32 {
    let at = |i: usize| row.get(i).copied().map_or(0.0, f32::from);
    lerp(at(i), at(i + 1), t)
}

/// Interpolated value of a table, in units of [`STEP`].
#[inline]
fn across<const N: usize, const M: usize>(table: &[[i16; N]; M], (j, s): Place, place: Place) -> f32 {
    let at = |j: usize| table.get(j).map_or(0.0, |row| along(row, place));
    lerp(at(j), at(j + 1), s)
}

/// Directional albedo of a coat with Schlick's reflectance: `white` for F = 1, `edge` for F = (1 - c)^5. For
/// any F0 it is F0 · (white - edge) + edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SchlickAlbedo {
    pub(super) white: f32,
    pub(super) edge: f32,
}

impl SchlickAlbedo {
    /// Albedo at the cosine `c` of a coat of GGX `alpha`; exact for the smooth coat, alpha 0.
    #[inline]
    pub(super) fn directional(c: f32, alpha: f32) -> Self {
        let smooth = fresnel::schlick_weight(c);
        if alpha == 0.0 {
            return Self { white: 1.0, edge: smooth };
        }
        let at = (roughness(alpha), place(sqrt(c), COSINES));
        Self {
            white: unit(1.0 + STEP * across(&COATS[AMPLITUDES], at.0, at.1)),
            edge: unit(smooth + STEP * across(&COATS[AMPLITUDES + 1], at.0, at.1)),
        }
    }

    /// Cosine-weighted mean over the hemisphere.
    #[inline]
    pub(super) fn mean(alpha: f32) -> Self {
        /// Mean of (1 - c)^5.
        const SMOOTH: f32 = 1.0 / 21.0;
        if alpha == 0.0 {
            return Self { white: 1.0, edge: SMOOTH };
        }
        let at = roughness(alpha);
        Self {
            white: unit(1.0 + STEP * along(&data::WHITE_MEAN, at)),
            edge: unit(SMOOTH + STEP * along(&data::EDGE_MEAN, at)),
        }
    }

    /// Albedo of a coat with reflectance `f0` at normal incidence.
    #[inline]
    pub(super) fn of(&self, f0: crate::Rgb) -> crate::Rgb {
        f0 * (self.white - self.edge) + crate::Rgb::splat(self.edge)
    }
}

/// Transmittance at the cosine `c` of a dielectric coat of index `eta` >= 1; exact for alpha 0, the smooth
/// coat.
#[inline]
pub(super) fn transmittance(c: f32, alpha: f32, eta: f32) -> f32 {
    let smooth = 1.0 - fresnel::dielectric(c, eta);
    if alpha == 0.0 {
        return smooth;
    }
    let (k, t) = amplitude(eta);
    let at = (roughness(alpha), place(sqrt(c), COSINES));
    let table = |k: usize| COATS.get(k).map_or(0.0, |table| across(table, at.0, at.1));
    unit(smooth + STEP * lerp(table(k), table(k + 1), t))
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
    unit(smooth + STEP * across(&data::INTERNAL, amplitude(eta), roughness(alpha)))
}

#[inline]
fn amplitude(eta: f32) -> Place {
    place((eta - 1.0) / (eta + 1.0) / LAST_AMPLITUDE, AMPLITUDES)
}
