//! Results of the photon benchmark.

use super::{Task, WorkSize};
use halflight_core::Level;

/// Result of our photon map.
#[derive(Clone, Debug)]
pub struct KnnReport {
    /// Instruction set of our kernels.
    pub level: Level,
    /// Size of the benchmark.
    pub size: WorkSize,
    /// Seconds to copy the photons and build the map.
    pub build_seconds: f64,
    /// Seconds of the same on two threads.
    pub build_seconds_on_two: f64,
    /// Bytes of the map with its photons.
    pub bytes: usize,
    /// Speeds with one query per call, for each of [`Task::ALL`].
    pub single: Vec<Speed>,
    /// Speeds with all queries in one call, for each of [`Task::ALL`].
    pub batched: Vec<Speed>,
}

/// Result of a rival.
#[derive(Clone, Debug)]
pub struct RivalReport {
    /// Name and version.
    pub name: String,
    /// Seconds to build the tree.
    pub build_seconds: f64,
    /// Speeds for each of [`Task::ALL`].
    pub speeds: Vec<Speed>,
}

/// Speed of a task.
#[derive(Clone, Copy, Debug)]
pub struct Speed {
    /// Task.
    pub task: Task,
    /// Queries per second, NaN without queries.
    pub queries_per_second: f64,
    /// Mean number of photons found by a query.
    pub photons: f64,
}

impl KnnReport {
    /// Bytes of the map per photon.
    pub fn bytes_per_photon(&self) -> f64 {
        self.bytes as f64 / self.size.photons as f64
    }
}
