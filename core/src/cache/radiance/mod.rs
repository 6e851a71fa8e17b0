//! Radiance caching (Křivánek et al. 2005): incident radiance of a point in coefficients of a basis.
//!
//! [`zernike`] is the basis, [`StrataTables`] its means over the strata of gather rays, [`Coefficients`] the
//! projection of a hemisphere, and [`derivatives`] its change with position.

mod coefficients;
pub mod derivatives;
#[cfg(test)]
mod rooms;
mod strata;
pub mod zernike;

pub use coefficients::Coefficients;
pub use strata::StrataTables;
