//! Photon searches per second on one thread: the k nearest photons, with and without a radius, and density
//! estimates. The build is timed on two threads as well.
//!
//! Each library is timed [`REPETITIONS`] times in turn by the wall clock, so other load of the machine
//! affects all of them; the median is reported.

mod data;
mod ours;
mod report;
#[cfg(test)]
mod tests;

pub use data::{Data, Surfel};
pub use report::{KnnReport, RivalReport, Speed};

use super::{BenchError, REPETITIONS, median};
use core::hint::black_box;
use halflight_core::Level;
use halflight_core::bvh::{ForkJoin, Serial};
use halflight_core::photon::Photons;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::Instant;

/// Size of the benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkSize {
    /// Photons in the map.
    pub photons: usize,
    /// Nearest-photon searches; density estimates are a tenth of them.
    pub queries: usize,
}

impl WorkSize {
    /// Size of published results.
    pub const FULL: WorkSize = WorkSize { photons: 1_000_000, queries: 200_000 };
}

/// Kind of searches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// The `k` nearest within a radius.
    Nearest {
        /// Number of photons.
        k: usize,
        /// Largest distance, or infinity.
        radius: f32,
    },
    /// Density estimate over a disc.
    Gather {
        /// Radius of the disc.
        radius: f32,
    },
}

/// Radius of bounded searches, which hold about fifty photons outside the caustic.
const BOUND: f32 = 0.01;

impl Task {
    /// All tasks.
    pub const ALL: [Task; 10] = {
        const fn nearest(k: usize, radius: f32) -> Task {
            Task::Nearest { k, radius }
        }
        [
            nearest(8, f32::INFINITY),
            nearest(50, f32::INFINITY),
            nearest(100, f32::INFINITY),
            nearest(200, f32::INFINITY),
            nearest(8, BOUND),
            nearest(50, BOUND),
            nearest(100, BOUND),
            nearest(200, BOUND),
            Task::Gather { radius: 0.045 },
            Task::Gather { radius: 0.075 },
        ]
    };

    /// Name in reports.
    pub fn name(self) -> String {
        match self {
            Task::Nearest { k, radius } if radius.is_finite() => format!("k{k}_within"),
            Task::Nearest { k, .. } => format!("k{k}"),
            Task::Gather { radius } => format!("gather_{radius}"),
        }
    }

    /// Queries of the task.
    pub fn queries(self, data: &Data) -> &[Surfel] {
        match self {
            Task::Nearest { .. } => &data.queries,
            Task::Gather { .. } => &data.queries[..data.queries.len() / 10],
        }
    }
}

/// Library that searches.
pub trait Searcher {
    /// Runs every query of `task`; returns the total number of photons found.
    ///
    /// # Errors
    /// [`BenchError`] without memory.
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError>;
}

/// Another library's tree over the same points.
pub trait Rival {
    /// Name and version.
    fn name(&self) -> String;
    /// New tree.
    ///
    /// # Errors
    /// [`BenchError::Rival`] if it refuses the points.
    fn build(&self) -> Result<Box<dyn Searcher + '_>, BenchError>;
}

/// Measures with the kernels of `level`.
///
/// # Errors
/// [`BenchError`] without memory.
pub fn run(size: WorkSize, level: Level) -> Result<KnnReport, BenchError> {
    Ok(run_with_rivals(&Data::new(size.photons, size.queries), level, &[])?.0)
}

/// [`run`] on `data` with rivals, measured in turn.
///
/// # Errors
/// [`BenchError`] without memory, or if a rival refuses the points.
pub fn run_with_rivals(
    data: &Data,
    level: Level,
    rivals: &[&dyn Rival],
) -> Result<(KnnReport, Vec<RivalReport>), BenchError> {
    let records = ours::records(&data.photons);
    let two = TwoThreads::new()?;
    let (mut build, mut build_on_two) = (Vec::new(), Vec::new());
    let mut rival_builds = vec![Vec::new(); rivals.len()];
    for _ in 0..REPETITIONS {
        let mut memory = Vec::new();
        build.push(seconds(|| ours::build(&records, &mut memory, &Serial).map(|map| map.len()))?.0);
        let mut memory = Vec::new();
        let time =
            two.0.install(|| seconds(|| ours::build(&records, &mut memory, &two).map(|map| map.len())));
        build_on_two.push(time?.0);
        for (rival, builds) in rivals.iter().zip(&mut rival_builds) {
            builds.push(seconds(|| rival.build())?.0);
        }
    }

    let mut memory = Vec::new();
    let map = ours::build(&records, &mut memory, &Serial)?;
    let bytes = Photons::footprint(records.len()).bytes();
    let (mut single, mut batched) = (ours::Single { map: &map, level }, ours::Batched { map: &map, level });
    let mut trees = rivals.iter().map(|rival| rival.build()).collect::<Result<Vec<_>, _>>()?;
    let mut searchers: Vec<&mut dyn Searcher> = vec![&mut single, &mut batched];
    for tree in &mut trees {
        searchers.push(tree.as_mut());
    }

    let mut speeds: Vec<Vec<Speed>> = searchers.iter().map(|_| Vec::new()).collect();
    for task in Task::ALL {
        for (speeds, speed) in speeds.iter_mut().zip(measure(&mut searchers, task, data)?) {
            speeds.push(speed);
        }
    }
    let mut speeds = speeds.into_iter();
    let (single, batched) = (speeds.next().unwrap_or_default(), speeds.next().unwrap_or_default());
    let report = KnnReport {
        level,
        size: WorkSize { photons: data.photons.len(), queries: data.queries.len() },
        build_seconds: median(build),
        build_seconds_on_two: median(build_on_two),
        bytes,
        single,
        batched,
    };
    let theirs = rivals.iter().zip(rival_builds).zip(speeds).map(|((rival, builds), speeds)| RivalReport {
        name: rival.name(),
        build_seconds: median(builds),
        speeds,
    });
    Ok((report, theirs.collect()))
}

/// Pool of two threads.
struct TwoThreads(ThreadPool);

impl TwoThreads {
    fn new() -> Result<Self, BenchError> {
        let pool = ThreadPoolBuilder::new().num_threads(2).build();
        pool.map(Self).map_err(|error| BenchError::Rival(format!("no threads: {error}")))
    }
}

impl ForkJoin for TwoThreads {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        rayon::join(a, b);
    }
}

/// Seconds and result of `work`.
fn seconds<T>(work: impl FnOnce() -> Result<T, BenchError>) -> Result<(f64, T), BenchError> {
    let start = Instant::now();
    let result = black_box(work()?);
    Ok((start.elapsed().as_secs_f64(), result))
}

/// Speeds of all searchers for a task, measured in turn.
fn measure(searchers: &mut [&mut dyn Searcher], task: Task, data: &Data) -> Result<Vec<Speed>, BenchError> {
    let mut times = vec![Vec::new(); searchers.len()];
    let mut found = vec![0; searchers.len()];
    for _ in 0..REPETITIONS {
        for ((searcher, times), found) in searchers.iter_mut().zip(&mut times).zip(&mut found) {
            let (time, count) = seconds(|| searcher.run(task, data))?;
            times.push(time);
            *found = count;
        }
    }
    let queries = task.queries(data).len() as f64;
    let speed = |(times, found): (Vec<f64>, u64)| Speed {
        task,
        queries_per_second: queries / median(times),
        photons: found as f64 / queries,
    };
    Ok(times.into_iter().zip(found).map(speed).collect())
}
