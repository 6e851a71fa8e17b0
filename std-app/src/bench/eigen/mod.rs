//! Eigen decompositions per second of symmetric matrices on one thread: 2×2, as in the radii of irradiance
//! records, and 3×3.
//!
//! [`BATCH`] random matrices and their results fit into the first-level cache and are decomposed repeatedly
//! for [`SECONDS`]. Each library does so [`REPETITIONS`] times in turn; the median is reported. Values and
//! vectors are computed and stored, ours sorted by magnitude.

use super::{REPETITIONS, median};
use core::hint::black_box;
use halflight_core::Level;
use halflight_core::sampling::{mix, unit_float};
use halflight_simd::kernels::eigen::{
    Decomposed2, Decomposed3, Matrices2, Matrices3, decompose2, decompose3,
};
use std::time::Instant;

/// Matrices per batch.
pub const BATCH: usize = 512;
/// Shortest measurement in seconds.
pub const SECONDS: f64 = 0.02;

/// Matrices per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speeds {
    /// 2×2 matrices.
    pub sym2: f64,
    /// 3×3 matrices.
    pub sym3: f64,
}

/// Result of the measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct EigenReport {
    /// Instruction set of our kernels.
    pub level: Level,
    /// Speeds of our kernels.
    pub ours: Speeds,
}

/// Library that decomposes batches.
pub trait Entry {
    /// Decomposes 2×2 matrices.
    fn sym2(&mut self, matrices: &[Matrices2]);
    /// Decomposes 3×3 matrices.
    fn sym3(&mut self, matrices: &[Matrices3]);
}

/// Measures the kernels of `level`.
pub fn run(level: Level) -> EigenReport {
    run_with_rival(level, None).0
}

/// [`run`] with a rival, measured in turn, and its speeds.
pub fn run_with_rival(level: Level, rival: Option<&mut dyn Entry>) -> (EigenReport, Option<Speeds>) {
    let numbers: Vec<f32> = numbers().take(6 * BATCH).collect();
    let (rows, _) = numbers.as_chunks::<16>();
    let (small, large): (&[Matrices2], &[Matrices3]) =
        (rows[..3 * BATCH / 16].as_chunks().0, rows.as_chunks().0);
    let mut ours = Ours::new(level);
    let mut entries: Vec<&mut dyn Entry> = vec![&mut ours];
    entries.extend(rival.map(|rival| rival as &mut dyn Entry));
    let mut speeds = vec![(Vec::new(), Vec::new()); entries.len()];
    for _ in 0..REPETITIONS {
        for (entry, speeds) in entries.iter_mut().zip(&mut speeds) {
            speeds.0.push(per_second(|| entry.sym2(black_box(small))));
            speeds.1.push(per_second(|| entry.sym3(black_box(large))));
        }
    }
    let mut measured =
        speeds.into_iter().map(|(sym2, sym3)| Speeds { sym2: median(sym2), sym3: median(sym3) });
    let ours = measured.next().unwrap_or(Speeds { sym2: f64::NAN, sym3: f64::NAN });
    (EigenReport { level, ours }, measured.next())
}

/// Random numbers in [−1, 1).
fn numbers() -> impl Iterator<Item = f32> {
    (0..).map(|i| 2.0 * unit_float((mix(i) >> 32) as u32) - 1.0)
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

impl Entry for Ours {
    fn sym2(&mut self, matrices: &[Matrices2]) {
        decompose2(self.level, matrices, &mut self.small);
        black_box(&self.small);
    }

    fn sym3(&mut self, matrices: &[Matrices3]) {
        decompose3(self.level, matrices, &mut self.large);
        black_box(&self.large);
    }
}
