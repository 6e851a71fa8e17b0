//! Derivatives of irradiance for translation and rotation of the receiver: gradients and Hessian from one
//! hemisphere.
//!
//! [`CellFlux`] is the default. [`mod@triangulated`], [`mod@closed_mesh`], [`mod@ward_heckbert`] and
//! [`mod@unoccluded`] are alternatives for comparison; each names its paper.

mod cell_flux;
mod closed_mesh;
mod triangulated;
mod unoccluded;
mod ward_heckbert;

pub use cell_flux::CellFlux;
pub use closed_mesh::closed_mesh;
pub use triangulated::triangulated;
pub use unoccluded::{GRAZING, Unoccluded, unoccluded};
pub use ward_heckbert::ward_heckbert;

pub use crate::cache::hessian::Hessian;

use crate::Rgb;
use crate::cache::hemisphere::Hemisphere;
use crate::light::luminance;
use core::f32::consts::PI;
use glam::Vec2;
use halflight_simd::kernels::jumps::Sums;

/// Irradiance and its derivatives at a point, in the tangent frame of its normal. Lengths are in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    /// E; a hemisphere of radiance 1 has E = π.
    pub irradiance: Rgb,
    /// (∂E/∂x, ∂E/∂y) per channel: E(x + dx) = E + gradient · dx.
    pub gradient: [Vec2; 3],
    /// Rotational gradient per channel: E(n') = E + rotation · (n × n'), x and y of the cross product.
    pub rotation: [Vec2; 3],
    /// Second derivatives of the luminance of E.
    pub hessian: Hessian,
    /// Hessian of the estimator's environment with radiance 1 everywhere: zero if the environment is closed,
    /// as in all estimators except the triangulation of the paper.
    pub open_hessian: Hessian,
    /// Mean of 1/t² over the strata, 1/m².
    pub mean_square_inverse_distance: f32,
    /// Harmonic mean of the distances (Ward 1988), m; infinite without hits.
    pub harmonic_mean_distance: f32,
    /// Minimum distance, m; infinite without hits.
    pub min_distance: f32,
}

impl Derivatives {
    /// Luminance of the irradiance.
    pub fn luminance(&self) -> f32 {
        luminance(self.irradiance)
    }

    /// Gradient of the luminance.
    pub fn luminance_gradient(&self) -> Vec2 {
        let of = |axis: usize| luminance(Rgb::from_array(self.gradient.map(|gradient| gradient[axis])));
        Vec2::new(of(0), of(1))
    }

    /// Derivatives from the hemisphere and the sums over the edges of its environment.
    fn of(hemisphere: &Hemisphere, sums: &Sums) -> Self {
        let distances = hemisphere.distances();
        Self {
            irradiance: hemisphere.irradiance(),
            gradient: sums.gradient.map(Vec2::from),
            rotation: sums.rotation.map(Vec2::from),
            hessian: Hessian { xx: sums.hessian[0], xy: sums.hessian[1], yy: sums.hessian[2] },
            open_hessian: Hessian::default(),
            mean_square_inverse_distance: distances.mean_square_inverse,
            harmonic_mean_distance: 1.0 / distances.mean_inverse,
            min_distance: 1.0 / distances.largest_inverse,
        }
    }
}

/// Rotational gradient by samples (Ward, Heckbert 1992): π/N² Σ L (n × w)/cos. The cosine is at least 0.05,
/// since the term is unbounded near the horizon.
fn rotation_by_samples(hemisphere: &Hemisphere) -> [Vec2; 3] {
    const LOW: f32 = 0.05;
    let share = PI / (hemisphere.n() * hemisphere.n()) as f32;
    let mut rotation = [Vec2::ZERO; 3];
    for (radiance, &[x, y, z]) in hemisphere.radiance().iter().zip(hemisphere.directions()) {
        for (sum, radiance) in rotation.iter_mut().zip(radiance) {
            *sum += *radiance * share / z.max(LOW) * Vec2::new(-y, x);
        }
    }
    rotation
}

#[cfg(test)]
mod tests;
