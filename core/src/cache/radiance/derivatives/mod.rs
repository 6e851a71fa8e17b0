//! Derivatives of the coefficients of incident radiance with the position of the receiver.
//!
//! [`border_flux()`] is the default. [`unoccluded()`] and [`displaced()`] are the analytic and the numeric
//! gradient of Křivánek et al. (2005), for comparison: they do not see occlusion.

mod border_flux;
mod displaced;
#[cfg(test)]
mod tests;
mod unoccluded;

pub use border_flux::border_flux;
pub use displaced::displaced;
pub use unoccluded::{GRAZING, unoccluded};

use super::zernike::COUNT_MAX;
use crate::cache::hessian::Hessian;
use glam::Vec2;

/// Gradients (∂/∂x, ∂/∂y) of the coefficients of each channel in the tangent plane, W/m² per m.
pub type Gradients = [[[f32; 2]; COUNT_MAX]; 3];

/// First and second derivatives of all coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoefficientDerivatives {
    /// Degree of the representation; higher degrees are zero.
    pub degree: usize,
    /// Gradients of the coefficients.
    pub gradients: Gradients,
    /// Second derivatives of the luminance of the coefficients, W/m² per m².
    pub hessians: [Hessian; COUNT_MAX],
}

impl CoefficientDerivatives {
    /// Gradient of Σ w_k λ_k of a channel: of the radiance that leaves, if w are the coefficients of a lobe.
    pub fn gradient(&self, channel: usize, weights: &[f32]) -> Vec2 {
        let gradients = self.gradients.get(channel).map_or(&[][..], |gradients| gradients);
        gradients.iter().zip(weights).map(|(&gradient, &weight)| weight * Vec2::from(gradient)).sum()
    }

    /// Hessian of Σ w_k λ_k, luminance.
    pub fn hessian(&self, weights: &[f32]) -> Hessian {
        let weighted = self.hessians.iter().zip(weights);
        weighted.fold(Hessian::default(), |sum, (&hessian, &weight)| sum + hessian * weight)
    }
}
