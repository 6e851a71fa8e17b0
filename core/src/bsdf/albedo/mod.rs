//! How much a GGX coat reflects in all and lets through: integrals without closed form, as small tables.
//!
//! What is stored is the difference of a rough coat to the smooth one, which has a closed form, in steps of
//! [`STEP`], over sqrt(cos θ), sqrt(alpha) and the amplitude r = (η - 1)/(η + 1). `derive.rs` integrates it
//! all again in f64: its tests hold the tables to the integrals and print them anew.

mod data;
#[cfg(test)]
mod derive;

use super::range::unit;
use super::{fresnel, sqrt};

/// The unit of the tables.
const STEP: f32 = 1e-4;
/// Nodes over sqrt(cos θ), 0 … 1.
const COSINES: usize = 16;
/// Nodes over sqrt(alpha), 0 … 1.
const ROUGHNESSES: usize = 12;
/// Nodes over r, 0 … [`LAST_AMPLITUDE`].
const AMPLITUDES: usize = 9;
/// η = 9; coats beyond take its difference.
const LAST_AMPLITUDE: f32 = 0.8;

/// Along one axis of a table: the node below, and how far to the next.
type Place = (usize, f32);

/// `x` in 0 … 1 among `nodes` nodes.
#[inline]
fn place(x: f32, nodes: usize) -> Place {
    let at = unit(x) * (nodes - 1) as f32;
    let below = (at as usize).min(nodes - 2);
    (below, at - below as f32)
}

/// Where `alpha` lies among the roughnesses. The differences begin with alpha², the fourth power of the
/// axis: so does the way from the smooth coat to the first node.
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

/// In units of [`STEP`].
#[inline]
fn along<const N: usize>(row: &[i16; N], (i, t): Place) -> f32 {
    let at = |i: usize| row.get(i).copied().map_or(0.0, f32::from);
    lerp(at(i), at(i + 1), t)
}

/// In units of [`STEP`].
#[inline]
fn across<const N: usize, const M: usize>(table: &[[i16; N]; M], (j, s): Place, place: Place) -> f32 {
    let at = |j: usize| table.get(j).map_or(0.0, |row| along(row, place));
    lerp(at(j), at(j + 1), s)
}

/// What a coat of Schlick's reflectance reflects of light from a direction: `white` where F is 1, `edge`
/// where F is (1 - c)^5; hence F0 · (white - edge) + edge for any F0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SchlickAlbedo {
    pub(super) white: f32,
    pub(super) edge: f32,
}

impl SchlickAlbedo {
    /// From the cosine `c` at a coat of GGX `alpha`; exact for the smooth coat, alpha 0.
    #[inline]
    pub(super) fn directional(c: f32, alpha: f32) -> Self {
        let smooth = fresnel::schlick_weight(c);
        if alpha == 0.0 {
            return Self { white: 1.0, edge: smooth };
        }
        let at = (roughness(alpha), place(sqrt(c), COSINES));
        Self {
            white: unit(1.0 + STEP * across(&data::WHITE, at.0, at.1)),
            edge: unit(smooth + STEP * across(&data::EDGE, at.0, at.1)),
        }
    }

    /// Mean over the hemisphere, weighted by the cosine.
    #[inline]
    pub(super) fn mean(alpha: f32) -> Self {
        /// Of (1 - c)^5.
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

    /// Of a coat that reflects `f0` at normal incidence.
    #[inline]
    pub(super) fn of(&self, f0: crate::Rgb) -> crate::Rgb {
        f0 * (self.white - self.edge) + crate::Rgb::splat(self.edge)
    }
}

/// The share of light from the cosine `c` that passes a dielectric coat of index `eta` >= 1; exact for the
/// smooth one, alpha 0.
#[inline]
pub(super) fn transmittance(c: f32, alpha: f32, eta: f32) -> f32 {
    let smooth = 1.0 - fresnel::dielectric(c, eta);
    if alpha == 0.0 {
        return smooth;
    }
    let (k, t) = amplitude(eta);
    let at = (roughness(alpha), place(sqrt(c), COSINES));
    let table = |k: usize| data::TRANSMITTANCE.get(k).map_or(0.0, |table| across(table, at.0, at.1));
    unit(smooth + STEP * lerp(table(k), table(k + 1), t))
}

/// The share of light evenly incident from inside that a dielectric coat sends back. For rough coats it is
/// the one-bounce reflectance, averaged over 64 cosines as Mitsuba's `roughplastic` does (1.6 % below the
/// integral), so that pictures agree; it errs to the dark side.
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
