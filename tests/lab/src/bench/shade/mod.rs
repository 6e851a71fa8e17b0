//! Nanoseconds per vertex of the shading kernels.
//!
//! [`BLOCKS`] random blocks of sixteen vertices, which fit into the second-level cache, are shaded repeatedly
//! for [`SECONDS`].

mod data;
mod lobes;

use super::{REPETITIONS, median, row};
use crate::Result;
use crate::output::Output;
use clap::Args;
use core::hint::black_box;
use data::Blocks;
use halflight_core::Level;
use serde_json::{Value, json};
use std::time::Instant;

/// Blocks of sixteen vertices.
const BLOCKS: usize = 64;
/// Shortest measurement in seconds.
const SECONDS: f64 = 0.01;

/// Nanoseconds per vertex of the shading kernels
///
/// Camera rays, surface points, random numbers, light samples and scattering in blocks of sixteen vertices.
#[derive(Args)]
pub(super) struct Shade;

impl Shade {
    pub(super) fn run(&self, level: Level, output: &mut Output) -> Result<()> {
        let kernels = measure(level);
        output.line(format!(
            "{BLOCKS} blocks of 16 vertices, one thread, {}; medians of {REPETITIONS}, ns a vertex",
            level.name()
        ));
        for (name, time) in &kernels {
            output.line(row(name, [format!("{time:.2}")]));
        }
        let by_name: Value = kernels.iter().map(|(name, time)| ((*name).to_owned(), json!(time))).collect();
        output.object(&json!({
            "level": level.name(),
            "ns_per_vertex": by_name,
            "blocks": BLOCKS,
            "repetitions": REPETITIONS,
        }));
        Ok(())
    }
}

/// Times of the kernels of `level` by name, in the order of a path.
fn measure(level: Level) -> Vec<(&'static str, f64)> {
    let blocks = Blocks::new(BLOCKS);
    let kernels = data::KERNELS.iter().map(|kernel| {
        let time = |_| per_vertex(|block| (kernel.run)(&blocks, block, level));
        (kernel.name, median((0..REPETITIONS).map(time).collect()))
    });
    kernels.collect()
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
        let kernels = measure(Level::BASELINE);
        assert_eq!(kernels.len(), data::KERNELS.len());
        assert!(kernels.iter().all(|(_, time)| *time > 0.0));
    }
}
