//! Derivatives without occlusion (Jarosz et al. 2012): each sample is a small surface patch that stays
//! visible. For comparison; they need the normals of the hits.
//!
//! Irradiance is ∫ L K dA with K = -(n·d)(m·d)/|d|⁴, d from the receiver to a patch of normal m. With w =
//! d/r,
//!
//!   grad K = K (4 w - m/(m·w))/r,   Hess K = K (24 w wᵀ - 4 I - 4 (w mᵀ + m wᵀ)/(m·w))/r²   (x and y only),
//!
//! so that with strata of equal irradiance each derivative is π/N² Σ L times a bracket. At a grazing hit
//! 1/(m·w) is unbounded, so that |m·w| is at least [`GRAZING`]. With L = 1 the second sum is zero in any
//! closed room. The geometric Hessian is therefore the sum of magnitudes, |H| with the absolute eigenvalues
//! of each patch: a bound for all radiances between 0 and 1. (The paper was not at hand; this is our
//! reading.)

use super::Hessian;
use crate::cache::hemisphere::Hemisphere;
use crate::light::luminance;
use core::f32::consts::PI;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::eigen::{Eigen2, symmetric2};

/// Minimum of |m·w| in denominators.
pub const GRAZING: f32 = 0.05;

/// Derivatives without occlusion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unoccluded {
    /// Gradient of the irradiance, per channel.
    pub gradient: [Vec2; 3],
    /// Hessian of the luminance.
    pub radiometric: Hessian,
    /// Sum of the magnitudes of the Hessians of all patches, for radiance 1: irradiance π.
    pub geometric: Hessian,
}

/// Gradient and both Hessians; `None` without normals.
pub fn unoccluded(hemisphere: &Hemisphere) -> Option<Unoccluded> {
    let (normals, n) = (hemisphere.normals()?, hemisphere.n());
    let share = PI / (n * n) as f32;
    let mut found = Unoccluded::default();
    let strata = hemisphere.radiance().iter().zip(hemisphere.inverse_distance());
    for ((radiance, &u), (&w, &m)) in strata.zip(hemisphere.directions().iter().zip(normals)) {
        if u == 0.0 {
            continue;
        }
        let (w, m) = (Vec3::from(w), Vec3::from(m));
        let facing = m.dot(w);
        let slant = m * (1.0 / facing.abs().max(GRAZING).copysign(facing));
        let gradient = (4.0 * w - slant).truncate() * (u * share);
        for (sum, radiance) in found.gradient.iter_mut().zip(radiance) {
            *sum += *radiance * gradient;
        }
        let scale = u * u * share;
        let hessian = Hessian {
            xx: 24.0 * w.x * w.x - 4.0 - 8.0 * w.x * slant.x,
            xy: 24.0 * w.x * w.y - 4.0 * (w.x * slant.y + w.y * slant.x),
            yy: 24.0 * w.y * w.y - 4.0 - 8.0 * w.y * slant.y,
        } * scale;
        found.radiometric = found.radiometric + hessian * luminance((*radiance).into());
        found.geometric = found.geometric + magnitude(hessian);
    }
    Some(found)
}

/// Matrix with equal axes and the absolute eigenvalues.
fn magnitude(hessian: Hessian) -> Hessian {
    let Eigen2 { values: [large, small], axis: [x, y] } =
        symmetric2(|x| x, [hessian.xx, hessian.xy, hessian.yy]);
    let (large, small) = (large.abs(), small.abs());
    Hessian {
        xx: large * x * x + small * y * y,
        xy: (large - small) * x * y,
        yy: large * y * y + small * x * x,
    }
}
