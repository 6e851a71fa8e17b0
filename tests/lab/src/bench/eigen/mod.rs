//! Eigen decompositions per second of symmetric matrices: 2×2, as in the radii of irradiance records, and
//! 3×3.
//!
//! [`BATCH`] random matrices and their results fit into the first-level cache and are decomposed repeatedly
//! for [`SECONDS`]. Values and vectors are computed and stored, ours sorted by magnitude.

#[cfg(feature = "nalgebra")]
mod nalgebra;

use super::{REPETITIONS, median, row};
use crate::Result;
use crate::output::Output;
use clap::Args;
use core::hint::black_box;
use halflight_core::Level;
use halflight_core::sampling::{mix, unit_float};
use halflight_simd::kernels::eigen::{
    Decomposed2, Decomposed3, Matrices2, Matrices3, decompose2, decompose3,
};
use serde_json::{Value, json};
use std::time::Instant;

/// Matrices per batch.
const BATCH: usize = 512;
/// Shortest measurement in seconds.
const SECONDS: f64 = 0.02;

/// Eigen decompositions of small symmetric matrices per second
///
/// Values and vectors of random 2×2 matrices, as in the radii of irradiance records, and of 3×3 matrices, in
/// batches that fit into the first-level cache.
#[derive(Args)]
pub(super) struct Eigen;

/// Library that decomposes batches.
trait Decomposer {
    fn name(&self) -> &'static str;
    fn sym2(&mut self, matrices: &[Matrices2]);
    fn sym3(&mut self, matrices: &[Matrices3]);
}

/// 2×2 and 3×3 matrices per second of a library.
struct Speeds {
    library: &'static str,
    per_second: [f64; 2],
}

impl Eigen {
    pub(super) fn run(&self, level: Level, output: &mut Output) -> Result<()> {
        let speeds = measure(level);
        output.line(format!(
            "symmetric matrices in batches of {BATCH}, one thread, {}; medians of {REPETITIONS}, M/s",
            level.name()
        ));
        output.line(row("", ["2x2", "3x3"].map(String::from)));
        for Speeds { library, per_second } in &speeds {
            output.line(row(library, per_second.map(|speed| format!("{:.1}", 1e-6 * speed))));
        }
        let [ours, rivals @ ..] = &speeds[..] else { return Ok(()) };
        for rival in rivals {
            let ratio = |i: usize| format!("{:.1}", ours.per_second[i] / rival.per_second[i]);
            output.line(row(&format!("over {}", rival.library), [ratio(0), ratio(1)]));
        }
        let object = |speeds: &Speeds| json!({ "sym2": speeds.per_second[0], "sym3": speeds.per_second[1] });
        let of_rivals = rivals.iter().map(|rival| (rival.library.to_owned(), object(rival)));
        output.object(&json!({
            "level": level.name(),
            "matrices_per_second": object(ours),
            "rivals": of_rivals.collect::<Value>(),
            "batch": BATCH,
            "repetitions": REPETITIONS,
        }));
        Ok(())
    }
}

/// Speeds of the kernels of `level`, then those of other libraries.
fn measure(level: Level) -> Vec<Speeds> {
    let numbers: Vec<f32> =
        (0..6 * BATCH as u64).map(|i| 2.0 * unit_float((mix(i) >> 32) as u32) - 1.0).collect();
    let (rows, _) = numbers.as_chunks::<16>();
    let (small, large): (&[Matrices2], &[Matrices3]) =
        (rows[..3 * BATCH / 16].as_chunks().0, rows.as_chunks().0);
    let mut libraries: Vec<Box<dyn Decomposer>> = vec![
        Box::new(Ours::new(level)),
        #[cfg(feature = "nalgebra")]
        Box::new(nalgebra::Nalgebra::default()),
    ];
    let mut times = vec![[Vec::new(), Vec::new()]; libraries.len()];
    for _ in 0..REPETITIONS {
        for (library, [sym2, sym3]) in libraries.iter_mut().zip(&mut times) {
            sym2.push(per_second(|| library.sym2(black_box(small))));
            sym3.push(per_second(|| library.sym3(black_box(large))));
        }
    }
    let speeds = libraries.iter().zip(times);
    speeds.map(|(library, times)| Speeds { library: library.name(), per_second: times.map(median) }).collect()
}

/// Matrices per second of `batch`, which decomposes one batch.
fn per_second(mut batch: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut batches = 0.0;
    loop {
        for _ in 0..64 {
            batch();
        }
        batches += 64.0;
        let seconds = start.elapsed().as_secs_f64();
        if seconds >= SECONDS {
            return batches * BATCH as f64 / seconds;
        }
    }
}

struct Ours {
    level: Level,
    small: Vec<Decomposed2>,
    large: Vec<Decomposed3>,
}

impl Ours {
    fn new(level: Level) -> Self {
        Self { level, small: vec![[[0.0; 16]; 4]; BATCH / 16], large: vec![[[0.0; 16]; 12]; BATCH / 16] }
    }
}

impl Decomposer for Ours {
    fn name(&self) -> &'static str {
        "halflight"
    }

    fn sym2(&mut self, matrices: &[Matrices2]) {
        decompose2(self.level, matrices, &mut self.small);
        black_box(&self.small);
    }

    fn sym3(&mut self, matrices: &[Matrices3]) {
        decompose3(self.level, matrices, &mut self.large);
        black_box(&self.large);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_is_measured() {
        for level in Level::detect().and_below() {
            let speeds = measure(level);
            assert_eq!(speeds.len(), 1 + usize::from(cfg!(feature = "nalgebra")));
            assert!(speeds.iter().flat_map(|speeds| speeds.per_second).all(|speed| speed > 0.0));
        }
    }
}
