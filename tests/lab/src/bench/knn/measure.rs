//! Times of builds and searches, ours and those of other libraries in turn.

use super::report::{Report, RivalReport, Speed};
use super::{Data, Rival, Searcher, Task, ours};
use crate::Result;
use crate::bench::{REPETITIONS, median};
use core::hint::black_box;
use halflight::pages::Pages;
use halflight_core::Level;
use halflight_core::bvh::{ForkJoin, Serial};
use halflight_core::photon::Photons;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::time::Instant;

/// Measures the kernels of `level` and all libraries that the program is built with.
pub(super) fn measure(data: &Data, level: Level) -> Result<Report> {
    #[cfg(any(feature = "kiddo", feature = "nanoflann"))]
    let points: Vec<[f32; 3]> = data.photons.iter().map(|surfel| surfel.position.to_array()).collect();
    let rivals: &[&dyn Rival] = &[
        #[cfg(feature = "kiddo")]
        &super::kiddo::Kiddo(&points),
        #[cfg(feature = "nanoflann")]
        &super::nanoflann::Nanoflann(&points),
    ];
    measure_beside(data, level, rivals)
}

fn measure_beside(data: &Data, level: Level, rivals: &[&dyn Rival]) -> Result<Report> {
    let records = ours::records(&data.photons);
    let two = TwoThreads::new()?;
    let (mut build, mut build_on_two) = (Vec::new(), Vec::new());
    let mut rival_builds = vec![Vec::new(); rivals.len()];
    for _ in 0..REPETITIONS {
        let mut memory = Pages::default();
        build.push(seconds(|| Ok(ours::build(&records, &mut memory, &Serial)?.len()))?.0);
        let mut memory = Pages::default();
        let on_two = || ours::build(&records, &mut memory, &two).map(|map| map.len());
        build_on_two.push(seconds(|| Ok(two.0.install(on_two)?))?.0);
        for (rival, builds) in rivals.iter().zip(&mut rival_builds) {
            builds.push(seconds(|| rival.build())?.0);
        }
    }

    let mut memory = Pages::default();
    let map = ours::build(&records, &mut memory, &Serial)?;
    let (mut single, mut batched) = (ours::Single { map: &map, level }, ours::Batched { map: &map, level });
    let mut trees = rivals.iter().map(|rival| rival.build()).collect::<Result<Vec<_>>>()?;
    let mut searchers: Vec<&mut dyn Searcher> = vec![&mut single, &mut batched];
    for tree in &mut trees {
        searchers.push(tree.as_mut());
    }
    let mut speeds: Vec<Vec<Speed>> = searchers.iter().map(|_| Vec::new()).collect();
    for task in Task::ALL {
        for (speeds, speed) in speeds.iter_mut().zip(searches(&mut searchers, task, data)?) {
            speeds.push(speed);
        }
    }
    let mut speeds = speeds.into_iter();
    let (single, batched) = (speeds.next().unwrap_or_default(), speeds.next().unwrap_or_default());
    let theirs = rivals.iter().zip(rival_builds).zip(speeds).map(|((rival, builds), speeds)| RivalReport {
        name: rival.name(),
        build_seconds: median(builds),
        speeds,
    });
    Ok(Report {
        build_seconds: median(build),
        build_seconds_on_two: median(build_on_two),
        bytes: Photons::footprint(records.len()).bytes(),
        single,
        batched,
        rivals: theirs.collect(),
    })
}

/// Pool of two threads.
struct TwoThreads(ThreadPool);

impl TwoThreads {
    fn new() -> Result<Self> {
        Ok(Self(ThreadPoolBuilder::new().num_threads(2).build()?))
    }
}

impl ForkJoin for TwoThreads {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        rayon::join(a, b);
    }
}

/// Seconds and result of `work`.
fn seconds<T>(work: impl FnOnce() -> Result<T>) -> Result<(f64, T)> {
    let start = Instant::now();
    let result = black_box(work()?);
    Ok((start.elapsed().as_secs_f64(), result))
}

/// Speeds of all searchers for a task, measured in turn.
fn searches(searchers: &mut [&mut dyn Searcher], task: Task, data: &Data) -> Result<Vec<Speed>> {
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
