//! Studies of radiance caching in rooms of known light: bases of incident radiance by the error of reflected
//! light, and derivatives of coefficients against exact ones.

mod bases;
mod gradients;
mod polygons;
mod rooms;

pub use bases::{ALPHAS, BasisError};
pub use gradients::GradientError;

use super::RenderError;

/// Errors of bases of incident radiance, by the number of coefficients.
pub fn study_bases() -> Result<Vec<BasisError>, RenderError> {
    Ok(bases::errors()?)
}

/// Errors of derivatives in every room with each number of strata along a side; calls `tell` after each.
pub fn study_gradients(strata: &[usize], tell: &mut dyn FnMut(&GradientError)) -> Result<(), RenderError> {
    for room in &gradients::ROOMS {
        for &strata in strata {
            tell(&gradients::errors(room, strata)?);
        }
    }
    Ok(())
}

/// xorshift64*.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
}
