//! Photon searches per second: the k nearest photons, with and without a radius, and density estimates. The
//! build is timed on two threads as well.

mod data;
#[cfg(feature = "kiddo")]
mod kiddo;
mod measure;
#[cfg(feature = "nanoflann")]
mod nanoflann;
mod ours;
mod report;
#[cfg(test)]
mod tests;

use crate::Result;
use crate::output::Output;
use clap::Args;
use core::num::NonZero;
use data::{Data, Surfel};
use halflight_core::Level;

/// Photon searches per second
///
/// The photons lie on the surfaces of a room, three tenths of them in a caustic. The tasks are the 8, 50, 100
/// and 200 nearest photons of surface points, with and without a radius, and density estimates.
#[derive(Args)]
pub(super) struct Knn {
    /// Photons in the map
    #[arg(long, value_name = "N", default_value = "1000000")]
    photons: NonZero<usize>,
    /// Nearest-photon searches; density estimates are a tenth of them
    #[arg(long, value_name = "N", default_value = "200000")]
    queries: NonZero<usize>,
}

impl Knn {
    pub(super) fn run(&self, level: Level, output: &mut Output) -> Result<()> {
        let data = Data::new(self.photons.get(), self.queries.get());
        let report = measure::measure(&data, level)?;
        report.lines(&data, level).iter().for_each(|line| output.line(line));
        output.object(&report.object(&data, level));
        Ok(())
    }
}

/// Kind of searches.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Task {
    /// The `k` nearest within a radius, which may be infinite.
    Nearest { k: usize, radius: f32 },
    /// Density estimate over a disc.
    Gather { radius: f32 },
}

/// Radius of bounded searches, which hold about fifty photons outside the caustic.
const BOUND: f32 = 0.01;

impl Task {
    const ALL: [Task; 10] = [
        Task::Nearest { k: 8, radius: f32::INFINITY },
        Task::Nearest { k: 50, radius: f32::INFINITY },
        Task::Nearest { k: 100, radius: f32::INFINITY },
        Task::Nearest { k: 200, radius: f32::INFINITY },
        Task::Nearest { k: 8, radius: BOUND },
        Task::Nearest { k: 50, radius: BOUND },
        Task::Nearest { k: 100, radius: BOUND },
        Task::Nearest { k: 200, radius: BOUND },
        Task::Gather { radius: 0.045 },
        Task::Gather { radius: 0.075 },
    ];

    /// Name in reports.
    fn name(self) -> String {
        match self {
            Task::Nearest { k, radius } if radius.is_finite() => format!("k{k}_within"),
            Task::Nearest { k, .. } => format!("k{k}"),
            Task::Gather { radius } => format!("gather_{radius}"),
        }
    }

    /// Queries of the task.
    fn queries(self, data: &Data) -> &[Surfel] {
        match self {
            Task::Nearest { .. } => &data.queries,
            Task::Gather { .. } => &data.queries[..data.queries.len() / 10],
        }
    }
}

/// Structure that is searched.
trait Searcher {
    /// Runs every query of `task`; returns the total number of photons found.
    fn run(&mut self, task: Task, data: &Data) -> Result<u64>;
}

/// Another library.
trait Rival {
    /// Name and version.
    fn name(&self) -> String;
    /// New tree over the same points.
    fn build(&self) -> Result<Box<dyn Searcher + '_>>;
}
