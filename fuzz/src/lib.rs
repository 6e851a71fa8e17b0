//! Fuzz targets as plain functions of bytes, so that libFuzzer and the stable driver call the same code.
//! A target panics where something is wrong, and returns otherwise.
#![forbid(unsafe_code)]

pub mod bvh;
mod numbers;

/// What is fuzzed: a name and its function.
pub struct Target {
    /// As on the command line.
    pub name: &'static str,
    /// Runs one input.
    pub run: fn(&[u8]),
}

/// Every target.
pub const TARGETS: &[Target] = &[Target { name: "bvh", run: bvh::run }];
