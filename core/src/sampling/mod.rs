//! Sampling: Owen-scrambled Sobol' streams, hashed random numbers, mutations of primary sample space, warps
//! of the unit square, and discrete distributions in arena memory.

mod alias;
mod distribution;
mod hash;
mod numbers;
mod primary_sample;
mod sobol;
mod trigonometry;
pub mod warp;

pub use alias::{AliasEntry, AliasTable};
pub use distribution::{Cell, Distribution2d};
pub use hash::{Random, mix};
pub use numbers::Numbers;
pub use primary_sample::Mutation;
pub use sobol::Sampler;
pub use trigonometry::sin_cos_turns;

/// Float in [0, 1) from a 32-bit fraction: the upper 24 bits, so that 1 is never reached.
#[inline]
pub const fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// Largest float below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;
