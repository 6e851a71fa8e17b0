//! Searches per second of the photon map on one thread: the k nearest, with and without a radius, and the density
//! estimate.
//!
//! The build is timed on two threads as well.
//!
//! Everything is timed [`REPETITIONS`] times by the wall clock, and the median counts; ours and the rivals'
//! repetitions alternate, so that other load of the machine slows all.

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

/// How much is searched, and how often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Amount {
    /// Photons in the map.
    pub photons: usize,
    /// Searches for the nearest; a tenth of it for gathering.
    pub queries: usize,
}

impl Amount {
    /// What results are told of.
    pub const FULL: Amount = Amount { photons: 1_000_000, queries: 200_000 };
}

/// What is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// The `k` nearest within a radius.
    Nearest {
        /// How many.
        k: usize,
        /// Infinite where there is none.
        radius: f32,
    },
    /// All within a radius: the density estimate.
    Gather {
        /// Of the disc.
        radius: f32,
    },
}

/// Radius of bounded searches: about what holds fifty photons away from the focus.
const WITHIN: f32 = 0.01;

impl Task {
    /// Everything that is measured.
    pub const ALL: [Task; 10] = {
        const fn nearest(k: usize, radius: f32) -> Task {
            Task::Nearest { k, radius }
        }
        [
            nearest(8, f32::INFINITY),
            nearest(50, f32::INFINITY),
            nearest(100, f32::INFINITY),
            nearest(200, f32::INFINITY),
            nearest(8, WITHIN),
            nearest(50, WITHIN),
            nearest(100, WITHIN),
            nearest(200, WITHIN),
            Task::Gather { radius: 0.045 },
            Task::Gather { radius: 0.075 },
        ]
    };

    /// Its name in reports.
    pub fn name(self) -> String {
        match self {
            Task::Nearest { k, radius } if radius.is_finite() => format!("k{k}_within"),
            Task::Nearest { k, .. } => format!("k{k}"),
            Task::Gather { radius } => format!("gather_{radius}"),
        }
    }

    /// The queries that it takes of the data.
    pub fn queries(self, data: &Data) -> &[Surfel] {
        match self {
            Task::Nearest { .. } => &data.queries,
            Task::Gather { .. } => &data.queries[..data.queries.len() / 10],
        }
    }
}

/// One way of searching.
pub trait Searcher {
    /// Runs every query of `task`; returns the number of photons found in all.
    ///
    /// # Errors
    /// [`BenchError`] where memory is missing.
    fn run(&mut self, task: Task, data: &Data) -> Result<u64, BenchError>;
}

/// Another library's tree over the same points.
pub trait Rival {
    /// Its name and version.
    fn name(&self) -> String;
    /// A tree, built anew.
    ///
    /// # Errors
    /// [`BenchError::Rival`] if it does not take the points.
    fn build(&self) -> Result<Box<dyn Searcher + '_>, BenchError>;
}

/// Measures with the kernels of `level`.
///
/// # Errors
/// [`BenchError`] where memory is missing.
pub fn run(amount: Amount, level: Level) -> Result<KnnReport, BenchError> {
    Ok(run_beside(&Data::new(amount.photons, amount.queries), level, &[])?.0)
}

/// [`run`] on `data` with rivals whose repetitions alternate with ours.
///
/// # Errors
/// [`BenchError`] where memory is missing or a rival refuses.
pub fn run_beside(
    data: &Data,
    level: Level,
    rivals: &[&dyn Rival],
) -> Result<(KnnReport, Vec<RivalReport>), BenchError> {
    let records = ours::records(&data.photons);
    let two = Two::new()?;
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
    let (mut singly, mut together) = (ours::Singly { map: &map, level }, ours::Together { map: &map, level });
    let mut trees = rivals.iter().map(|rival| rival.build()).collect::<Result<Vec<_>, _>>()?;
    let mut searchers: Vec<&mut dyn Searcher> = vec![&mut singly, &mut together];
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
    let (singly, together) = (speeds.next().unwrap_or_default(), speeds.next().unwrap_or_default());
    let report = KnnReport {
        level,
        amount: Amount { photons: data.photons.len(), queries: data.queries.len() },
        build_seconds: median(build),
        build_seconds_on_two: median(build_on_two),
        bytes,
        singly,
        together,
    };
    let theirs = rivals.iter().zip(rival_builds).zip(speeds).map(|((rival, builds), speeds)| RivalReport {
        name: rival.name(),
        build_seconds: median(builds),
        speeds,
    });
    Ok((report, theirs.collect()))
}

/// Two threads.
struct Two(ThreadPool);

impl Two {
    fn new() -> Result<Self, BenchError> {
        let pool = ThreadPoolBuilder::new().num_threads(2).build();
        pool.map(Self).map_err(|error| BenchError::Rival(format!("no threads: {error}")))
    }
}

impl ForkJoin for Two {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        rayon::join(a, b);
    }
}

/// What `work` gives, and how long it takes.
fn seconds<T>(work: impl FnOnce() -> Result<T, BenchError>) -> Result<(f64, T), BenchError> {
    let start = Instant::now();
    let result = black_box(work()?);
    Ok((start.elapsed().as_secs_f64(), result))
}

/// Runs a task by each searcher in turn, again and again.
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
        found: found as f64 / queries,
    };
    Ok(times.into_iter().zip(found).map(speed).collect())
}
