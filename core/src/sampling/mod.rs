//! Sampling: Owen-scrambled Sobol' streams, hashed random numbers, mutations of primary sample space, warps
//! of the unit square, and discrete distributions in arena memory.

mod alias;
mod distribution;
mod hash;
mod numbers;
mod primary_sample;
mod sobol;
pub mod warp;

pub use alias::{AliasEntry, AliasTable};
pub use distribution::{Cell, Distribution2d};
pub use halflight_simd::kernels::shade::numbers::{mix, unit_float};
pub use halflight_simd::kernels::shade::warp::sin_cos_turns;
pub use hash::Random;
pub use numbers::Numbers;
pub use primary_sample::Mutation;
pub use sobol::Sampler;

use halflight_simd::kernels::shade::numbers::GOLDEN;

/// Largest float below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;
