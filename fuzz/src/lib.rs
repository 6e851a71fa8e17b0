//! Fuzz targets as plain functions of bytes, so that libFuzzer and the stable driver call the same code.
//! A target panics where something is wrong, and returns otherwise.
#![forbid(unsafe_code)]

pub mod bvh;
mod numbers;

/// Every target by name.
pub const TARGETS: &[(&str, fn(&[u8]))] = &[("bvh", bvh::run)];
