//! Irradiance caching: a [`Hemisphere`] is what one place sees, [`derivatives`] what its irradiance does when the
//! place moves or turns.

pub mod derivatives;
mod hemisphere;

pub use derivatives::{CellFlux, Derivatives, Hessian};
pub use hemisphere::{Hemisphere, SIDE_MAX};
