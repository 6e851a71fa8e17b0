//! How irradiance changes when the receiver steps aside or turns: gradients and Hessian from one hemisphere.

mod cell_flux;

pub use cell_flux::CellFlux;

use super::hemisphere::Hemisphere;
use crate::Rgb;
use crate::light::luminance;
use core::ops::{Add, Mul};
use glam::Vec2;

/// Irradiance and its derivatives at a place, in the tangent frame of its normal. A derivative by a length in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    /// E, of which a hemisphere of radiance 1 makes π.
    pub irradiance: Rgb,
    /// (∂E/∂x, ∂E/∂y) per channel: E(x + dx) = E + gradient · dx.
    pub gradient: [Vec2; 3],
    /// Rotational gradient per channel: E(n') = E + rotation · (n × n'), x and y of the cross product.
    pub rotation: [Vec2; 3],
    /// Second derivatives of the luminance of E.
    pub hessian: Hessian,
    /// The same of the estimator's environment with radiance 1 everywhere: zero where that is closed, as every
    /// environment is but the triangulated one of the paper.
    pub open_hessian: Hessian,
    /// Mean of 1/t² over the strata, 1/m².
    pub mean_square_inverse_distance: f32,
    /// Harmonic mean of the distances (Ward 1988), m; infinite where nothing is seen.
    pub harmonic_mean_distance: f32,
    /// The least distance, m; infinite where nothing is seen.
    pub min_distance: f32,
}

/// A symmetric 2×2 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hessian {
    /// ∂²/∂x².
    pub xx: f32,
    /// ∂²/∂x∂y.
    pub xy: f32,
    /// ∂²/∂y².
    pub yy: f32,
}

impl Add for Hessian {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { xx: self.xx + other.xx, xy: self.xy + other.xy, yy: self.yy + other.yy }
    }
}

impl Mul<f32> for Hessian {
    type Output = Self;
    fn mul(self, by: f32) -> Self {
        Self { xx: self.xx * by, xy: self.xy * by, yy: self.yy * by }
    }
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

    /// What is known without derivatives: these are zero.
    fn still(hemisphere: &Hemisphere) -> Self {
        let distances = hemisphere.distances();
        Self {
            irradiance: hemisphere.irradiance(),
            gradient: [Vec2::ZERO; 3],
            rotation: [Vec2::ZERO; 3],
            hessian: Hessian::default(),
            open_hessian: Hessian::default(),
            mean_square_inverse_distance: distances.mean_square_inverse,
            harmonic_mean_distance: 1.0 / distances.mean_inverse,
            min_distance: 1.0 / distances.largest_inverse,
        }
    }
}
