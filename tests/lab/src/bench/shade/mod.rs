//! Nanoseconds per vertex of the shading kernels, by lanes and by their scalar references.
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
/// Camera rays, surface points, random numbers, light samples and scattering, by lanes and by their scalar
/// references, in blocks of sixteen vertices.
#[derive(Args)]
pub(super) struct Shade;

/// Nanoseconds per vertex of one kernel.
struct KernelTimes {
    name: &'static str,
    scalar: f64,
    lanes: f64,
}

impl Shade {
    pub(super) fn run(&self, level: Level, output: &mut Output) -> Result<()> {
        let kernels = measure(level);
        output.line(format!(
            "{BLOCKS} blocks of 16 vertices, one thread, {}; medians of {REPETITIONS}, ns a vertex",
            level.name()
        ));
        output.line(row("", ["scalar", "lanes", "ratio"].map(String::from)));
        for KernelTimes { name, scalar, lanes } in &kernels {
            let cells = [format!("{scalar:.2}"), format!("{lanes:.2}"), format!("{:.1}", scalar / lanes)];
            output.line(row(name, cells));
        }
        let by_name = |time: fn(&KernelTimes) -> f64| -> Value {
            kernels.iter().map(|kernel| (kernel.name.to_owned(), json!(time(kernel)))).collect()
        };
        output.object(&json!({
            "level": level.name(),
            "ns_per_vertex": { "scalar": by_name(|k| k.scalar), "lanes": by_name(|k| k.lanes) },
            "blocks": BLOCKS,
            "repetitions": REPETITIONS,
        }));
        Ok(())
    }
}

/// Times of the kernels of `level`, in the order of a path.
fn measure(level: Level) -> Vec<KernelTimes> {
    let blocks = Blocks::new(BLOCKS);
    let kernels = data::KERNELS.iter().map(|kernel| {
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..REPETITIONS {
            for (times, level) in times.iter_mut().zip([None, Some(level)]) {
                times.push(per_vertex(|block| (kernel.run)(&blocks, block, level)));
            }
        }
        let [scalar, lanes] = times.map(median);
        KernelTimes { name: kernel.name, scalar, lanes }
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
        assert!(kernels.iter().all(|kernel| kernel.scalar > 0.0 && kernel.lanes > 0.0));
    }
}
