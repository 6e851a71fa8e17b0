//! Executor on threads, each with its own scratch memory.

use halflight::pages::Pages;
use halflight_core::bvh::Serial;
use halflight_core::memory::{Arena, Footprint, OutOfMemory};
use halflight_core::method::{Executor, Passed, Worker};
use halflight_core::transport::Counters;
use std::sync::Mutex;
use std::thread;

/// Threads by their scratch memory.
pub(crate) struct Threads(Vec<Pages>);

impl Threads {
    /// `count` threads with `scratch` bytes each.
    pub(crate) fn new(count: usize, scratch: Footprint) -> Result<Self, OutOfMemory> {
        Ok(Self((0..count.max(1)).map(|_| Pages::new(scratch)).collect::<Result<_, _>>()?))
    }
}

impl Executor for Threads {
    type Fork = Serial;

    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        let queue = Mutex::new(pieces.enumerate());
        let next = || queue.lock().expect("no task panics while it holds the queue").next();
        let work = |scratch: &mut Pages| {
            let mut worker = Worker::new(Arena::over(scratch), &|| false);
            let mut counters = Counters::default();
            while let Some((number, piece)) = next() {
                counters += task(number, piece, &mut worker)?;
            }
            Ok(counters)
        };
        thread::scope(|scope| {
            let threads: Vec<_> = self.0.iter_mut().map(|scratch| scope.spawn(|| work(scratch))).collect();
            let mut passed = Passed { counters: Counters::default(), is_complete: true };
            for thread in threads {
                passed.counters += thread.join().expect("tasks do not panic")?;
            }
            Ok(passed)
        })
    }

    fn is_over(&self) -> bool {
        false
    }

    fn fork(&self) -> &Serial {
        &Serial
    }
}
