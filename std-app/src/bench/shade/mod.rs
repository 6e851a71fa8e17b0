//! Nanoseconds per vertex of the shading kernels on one thread, by lanes and by their scalar references.
//!
//! [`BLOCKS`] random blocks of sixteen vertices, which fit into the second-level cache, are shaded repeatedly
//! for [`SECONDS`]. Both ways do so [`REPETITIONS`] times in turn; the medians are reported.

mod data;
mod lobes;

use super::{REPETITIONS, median};
use core::hint::black_box;
use data::Blocks;
use halflight_core::Level;
use std::time::Instant;

/// Blocks of sixteen vertices.
pub const BLOCKS: usize = 64;
/// Shortest measurement in seconds.
pub const SECONDS: f64 = 0.01;

/// Speed of one kernel.
#[derive(Clone, Debug, PartialEq)]
pub struct KernelSpeed {
    /// Name of the kernel.
    pub name: &'static str,
    /// Nanoseconds per vertex by the scalar reference.
    pub scalar: f64,
    /// Nanoseconds per vertex by lanes.
    pub lanes: f64,
}

/// Result of the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadeReport {
    /// Instruction set of the lanes.
    pub level: Level,
    /// Speeds in the order of a path.
    pub kernels: Vec<KernelSpeed>,
}

/// Measures the kernels of `level`.
pub fn run(level: Level) -> ShadeReport {
    let blocks = Blocks::new(BLOCKS);
    let kernels = data::KERNELS.iter().map(|kernel| {
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..REPETITIONS {
            for (times, level) in times.iter_mut().zip([None, Some(level)]) {
                times.push(per_vertex(|block| (kernel.run)(&blocks, block, level)));
            }
        }
        let [scalar, lanes] = times.map(median);
        KernelSpeed { name: kernel.name, scalar, lanes }
    });
    ShadeReport { level, kernels: kernels.collect() }
}

/// Nanoseconds per vertex of `shade`, which shades one block.
fn per_vertex(mut shade: impl FnMut(usize)) -> f64 {
    let start = Instant::now();
    let mut vertices = 0.0;
    loop {
        for block in 0..BLOCKS {
            shade(black_box(block));
        }
        vertices += (16 * BLOCKS) as f64;
        let seconds = start.elapsed().as_secs_f64();
        if seconds >= SECONDS {
            return 1e9 * seconds / vertices;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kernel_takes_time() {
        let report = run(Level::BASELINE);
        assert_eq!(report.kernels.len(), data::KERNELS.len());
        assert!(report.kernels.iter().all(|kernel| kernel.scalar > 0.0 && kernel.lanes > 0.0));
    }
}
