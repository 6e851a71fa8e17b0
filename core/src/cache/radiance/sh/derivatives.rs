//! Gradients of coefficients of spherical harmonics, the analytic and the numeric one of Křivánek et al.
//! (2005). Both need the normals of the hits, and neither sees occlusion.
//!
//! Each sample is a small surface patch of normal m in the direction w at the inverse distance u, which stays
//! visible. If the receiver moves along the tangent f, the direction changes by -u (f - (f·w) w), and the
//! solid angle Ω by the factor u (3 w·f - (m·f)/(m·w)). The derivative of basis and solid angle is thus
//!
//!   ∂_f λ_k = Σ L Ω u (Y_k (3 w·f - (m·f)/(m·w)) - f·∇Y_k),
//!
//! ∇ on the sphere. Ω is that of the stratum. (The paper was not at hand; this is our reading.)

use super::{COUNT_MAX, Recurrence, ShTables, count, values};
use crate::cache::hemisphere::Hemisphere;
use crate::cache::radiance::derivatives::GRAZING;
use glam::{Vec2, Vec3};

/// Gradients (∂/∂x, ∂/∂y) of the coefficients of each channel in the tangent plane, W/m² per m.
pub type ShGradients = [[[f32; 2]; COUNT_MAX]; 3];

/// Patch that a gather ray hits.
struct Patch {
    radiance: [f32; 3],
    inverse_distance: f32,
    direction: Vec3,
    normal: Vec3,
    solid_angle: f32,
}

/// Patches that gather rays hit. `None` without normals, or if the hemisphere has another number of strata
/// than the tables.
fn patches<'h>(tables: &ShTables<'h>, hemisphere: &Hemisphere<'h>) -> Option<impl Iterator<Item = Patch>> {
    let normals = hemisphere.normals()?;
    if hemisphere.n() != tables.n() {
        return None;
    }
    let light = hemisphere.radiance().iter().zip(hemisphere.inverse_distance());
    let hits = hemisphere.directions().iter().zip(normals);
    let strata = light.zip(hits).zip(tables.solid_angles());
    Some(strata.filter(|(((_, u), _), _)| **u > 0.0).map(
        |(((&radiance, &inverse_distance), (&w, &m)), solid_angle)| Patch {
            radiance,
            inverse_distance,
            direction: w.into(),
            normal: m.into(),
            solid_angle,
        },
    ))
}

/// Gradients of all coefficients by the derivatives of basis and solid angle. `None` without normals, or if
/// the hemisphere has another number of strata than the tables.
pub fn unoccluded(tables: &ShTables, hemisphere: &Hemisphere) -> Option<ShGradients> {
    let recurrence = Recurrence::new();
    let mut found = [[[0.0; 2]; COUNT_MAX]; 3];
    for Patch { radiance, inverse_distance, direction: w, normal: m, solid_angle } in
        patches(tables, hemisphere)?
    {
        let facing = m.dot(w);
        let slant = m.truncate() / facing.abs().max(GRAZING).copysign(facing);
        let (widening, factor) = (3.0 * w.truncate() - slant, solid_angle * inverse_distance);
        let functions = recurrence.gradients(tables.order(), w.to_array());
        for (k, [x, y, _, value]) in functions.into_iter().enumerate().take(count(tables.order())) {
            let change = factor * (value * widening - Vec2::new(x, y));
            for (gradients, light) in found.iter_mut().zip(radiance) {
                let [x, y] = gradients[k];
                gradients[k] = [x + light * change.x, y + light * change.y];
            }
        }
    }
    Some(found)
}

/// Gradients of all coefficients by finite displacement, as central differences over `step` m to each side:
/// hits stay, and each has its new direction and solid angle. `None` without normals, if `step` is not above
/// 0, or if the hemisphere has another number of strata than the tables.
pub fn displaced(tables: &ShTables, hemisphere: &Hemisphere, step: f32) -> Option<ShGradients> {
    if step.is_nan() || step <= 0.0 {
        return None;
    }
    let mut found = [[[0.0; 2]; COUNT_MAX]; 3];
    for Patch { radiance, inverse_distance, direction: w, normal: m, solid_angle } in
        patches(tables, hemisphere)?.filter(|patch| patch.normal.dot(patch.direction).abs() >= GRAZING)
    {
        for (axis, along) in [Vec3::X, Vec3::Y].into_iter().enumerate() {
            for (side, sign) in [(step, 1.0), (-step, -1.0)] {
                // In units of the distance: the hit is at w.
                let to_hit = w - (inverse_distance * side) * along;
                let squared = to_hit.length_squared();
                let moved = to_hit / libm::sqrtf(squared);
                let turned = m.dot(moved) / m.dot(w);
                let weight = sign / (2.0 * step) * solid_angle * turned / squared;
                let functions = values(tables.order(), moved.to_array());
                for (k, value) in functions.into_iter().enumerate().take(count(tables.order())) {
                    for (gradients, light) in found.iter_mut().zip(radiance) {
                        gradients[k][axis] += light * weight * value;
                    }
                }
            }
        }
    }
    Some(found)
}
