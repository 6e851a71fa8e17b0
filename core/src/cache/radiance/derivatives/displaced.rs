//! Gradients of coefficients without occlusion, by finite displacement (Křivánek et al. 2005): the receiver
//! moves along each axis, the hits stay, and each sample gets its new direction and solid angle A |m·w|/r².
//! For comparison; it needs the normals of the hits.

use super::super::strata::StrataTables;
use super::super::zernike::{COUNT_MAX, count, values};
use super::{GRAZING, Gradients};
use crate::cache::hemisphere::Hemisphere;
use core::f32::consts::PI;
use glam::Vec3;

/// Gradients of all coefficients by central differences over `step` m to each side. `None` without normals,
/// if `step` is not above 0, or if the hemisphere has another number of strata than the tables.
pub fn displaced(tables: &StrataTables, hemisphere: &Hemisphere, step: f32) -> Option<Gradients> {
    let (normals, n, degree) = (hemisphere.normals()?, hemisphere.n(), tables.degree());
    if n != tables.n() || step.is_nan() || step <= 0.0 {
        return None;
    }
    let share = PI / (n * n) as f32 / (2.0 * step);
    let mut found = [[[0.0; 2]; COUNT_MAX]; 3];
    let strata = hemisphere.radiance().iter().zip(hemisphere.inverse_distance());
    for ((radiance, &u), (&w, &m)) in strata.zip(hemisphere.directions().iter().zip(normals)) {
        let (w, m) = (Vec3::from(w), Vec3::from(m));
        if u == 0.0 || m.dot(w).abs() < GRAZING {
            continue;
        }
        for (axis, along) in [Vec3::X, Vec3::Y].into_iter().enumerate() {
            for (side, sign) in [(step, 1.0), (-step, -1.0)] {
                // In units of the distance: the hit is at w.
                let to_hit = w - (u * side) * along;
                let squared = to_hit.length_squared();
                let moved = to_hit / libm::sqrtf(squared);
                // Cosine and solid angle over those of the sample.
                let weight = sign * share * moved.z * m.dot(moved) / (w.z * m.dot(w) * squared);
                let functions = values(degree, moved.truncate().to_array());
                for (k, value) in functions.into_iter().enumerate().take(count(degree)) {
                    for (gradients, light) in found.iter_mut().zip(radiance) {
                        gradients[k][axis] += light * weight * value;
                    }
                }
            }
        }
    }
    Some(found)
}
