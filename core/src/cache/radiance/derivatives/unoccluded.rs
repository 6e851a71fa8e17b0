//! Gradients of coefficients without occlusion, by differentiation of the basis and of the solid angle of
//! each sample (Křivánek et al. 2005). For comparison; they need the normals of the hits.
//!
//! Each sample is a small surface patch of normal m that stays visible. With K_k = cos Z_k and the patch at
//! inverse distance u in direction w,
//!
//!   ∇λ_k = π/N² Σ L u (4 Z_k q - ∇Z_k + q (q·∇Z_k) - Z_k m/(m·w)),   x and y only.
//!
//! (The paper was not at hand; this is our reading, with the basis on the disk.)

use super::super::strata::StrataTables;
use super::super::zernike::{COUNT_MAX, count, gradients, values};
use super::Gradients;
use crate::cache::hemisphere::Hemisphere;
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

/// Minimum of |m·w| in denominators.
pub const GRAZING: f32 = 0.02;

/// Gradients of all coefficients. `None` without normals, or if the hemisphere has another number of strata
/// than the tables.
pub fn unoccluded(tables: &StrataTables, hemisphere: &Hemisphere) -> Option<Gradients> {
    let (normals, n, degree) = (hemisphere.normals()?, hemisphere.n(), tables.degree());
    if n != tables.n() {
        return None;
    }
    let share = PI / (n * n) as f32;
    let mut found = [[[0.0; 2]; COUNT_MAX]; 3];
    let strata = hemisphere.radiance().iter().zip(hemisphere.inverse_distance());
    for ((radiance, &u), (&w, &m)) in strata.zip(hemisphere.directions().iter().zip(normals)) {
        if u == 0.0 {
            continue;
        }
        let (w, m) = (Vec3::from(w), Vec3::from(m));
        let (q, facing) = (w.truncate(), m.dot(w));
        let slant = m.truncate() / facing.abs().max(GRAZING).copysign(facing);
        let functions = values(degree, q.to_array()).into_iter().zip(gradients(degree, q.to_array()));
        for (k, (value, slope)) in functions.enumerate().take(count(degree)) {
            let slope = Vec2::from(slope);
            let change = (u * share) * (value * (4.0 * q - slant) - slope + q * q.dot(slope));
            for (gradients, light) in found.iter_mut().zip(radiance) {
                let [x, y] = gradients[k];
                gradients[k] = [x + light * change.x, y + light * change.y];
            }
        }
    }
    Some(found)
}
