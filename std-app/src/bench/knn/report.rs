//! Results of the measurement.

use super::{Amount, Task};
use halflight_core::Level;

/// Our numbers.
#[derive(Clone, Debug)]
pub struct KnnReport {
    /// The instruction set of our kernels.
    pub level: Level,
    /// How much was searched.
    pub amount: Amount,
    /// Seconds to put the photons into memory and build the map there.
    pub build_seconds: f64,
    /// The same on two threads.
    pub build_seconds_on_two: f64,
    /// Bytes of the map, its photons included.
    pub bytes: usize,
    /// One search after the other, one for each of [`Task::ALL`].
    pub singly: Vec<Speed>,
    /// All searches in one call.
    pub together: Vec<Speed>,
}

/// The numbers of a rival.
#[derive(Clone, Debug)]
pub struct RivalReport {
    /// Its name and version.
    pub name: String,
    /// Seconds to build its tree.
    pub build_seconds: f64,
    /// One for each of [`Task::ALL`].
    pub speeds: Vec<Speed>,
}

/// How fast a task is done.
#[derive(Clone, Copy, Debug)]
pub struct Speed {
    /// Which.
    pub task: Task,
    /// Searches; NaN where there are none.
    pub queries_per_second: f64,
    /// Photons found by a search, on average: of a density estimate, those that were weighed.
    pub found: f64,
}

impl KnnReport {
    /// Bytes of the map for each photon.
    pub fn bytes_per_photon(&self) -> f64 {
        self.bytes as f64 / self.amount.photons as f64
    }
}
