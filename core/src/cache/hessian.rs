//! Second derivatives on the tangent plane.

use core::ops::{Add, Mul};

/// Symmetric 2×2 matrix.
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
