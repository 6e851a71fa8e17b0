//! SIMD lanes, run-time levels and batch kernels.
//!
//! The only crate of the project with `unsafe`: everything above it forbids it. A kernel is written
//! once, generic over lanes, and entered once per batch through [`Level::dispatch`].
#![no_std]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod level;

pub use level::Level;
