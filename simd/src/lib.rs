//! SIMD lanes, run-time levels and batch kernels.
//!
//! This crate alone has `unsafe`; `halflight-core` and `halflight` forbid it. A kernel is written once,
//! generic over a [`Simd`] token, and entered once per batch through [`Level::dispatch`]. That call holds the
//! only `#[target_feature]` functions, so that everything inlined below it is compiled for the level. The
//! lanes of a level can only be made from its token, and the token only by `dispatch`: safe code cannot
//! execute an instruction that the processor lacks.
#![no_std]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod baseline;
pub mod half;
mod lanes;
mod level;
#[cfg(any(test, feature = "scalar"))]
mod scalar;
mod stack;
#[cfg(target_arch = "x86_64")]
mod x86;

pub mod kernels;

pub use baseline::{Baseline, F8, M8, Pair};
pub use lanes::{Lanes, Mask, Simd, dot};
pub use level::{Kernel, Level, Tier};
pub use stack::{STACK, Stack, StackMemory};
