//! Fresnel equations of a dielectric boundary and Schlick's approximation, over lanes.

use super::vector::{add, scale, sub};
use crate::lanes::Lanes;

/// Fresnel reflectance of a boundary of relative index `eta` at the cosine `c`; 1 at total reflection (Cook
/// and Torrance 1982, eq. 16).
#[inline(always)]
pub(super) fn fresnel<L: Lanes>(c: L, eta: L) -> L {
    let (zero, one) = (c.all(0.0), c.all(1.0));
    let g2 = (eta - one) * (eta + one) + c * c;
    between(c, g2.sqrt(), eta).select(zero.lt(g2), one)
}

/// [`fresnel`] for known g = eta cos θ_t.
#[inline(always)]
pub(super) fn between<L: Lanes>(c: L, g: L, eta: L) -> L {
    let r_s = (c - g) / (c + g);
    let eta2_c = eta * eta * c;
    let r_p = (eta2_c - g) / (eta2_c + g);
    c.all(0.5) * (r_s * r_s + r_p * r_p)
}

/// Probability of reflection, in proportion to the energy of each side.
#[inline(always)]
pub(super) fn reflection_probability<L: Lanes>(reflectance: L, [r, g, b]: [L; 3]) -> L {
    let (zero, one) = (r.all(0.0), r.all(1.0));
    let transmitted = (one - reflectance) * (r + g + b) * zero.all(1.0 / 3.0);
    let sum = reflectance + transmitted;
    (reflectance / sum).select(zero.lt(sum), one)
}

/// (1 - c)^5.
#[inline(always)]
pub(super) fn schlick_weight<L: Lanes>(c: L) -> L {
    let m = (c.all(1.0) - c).max(c.all(0.0)).min(c.all(1.0));
    let m2 = m * m;
    m2 * m2 * m
}

/// Schlick 1994, eq. 24: `f0` at normal incidence, white at grazing incidence.
#[inline(always)]
pub(super) fn schlick<L: Lanes>(f0: [L; 3], c: L) -> [L; 3] {
    add(f0, scale(sub([c.all(1.0); 3], f0), schlick_weight(c)))
}
