//! Executor of the program: a thread pool that ends at deadlines and interrupts.

use super::deadline::Deadline;
use super::workers::{Fork, Workers};
use halflight_core::bvh::ForkJoin;
use halflight_core::memory::{Line, OutOfMemory};
use halflight_core::method::{Executor, Passed, RenderState, Round, Worker};
use halflight_core::transport::Counters;
use std::sync::Mutex;
use std::time::Instant;

/// End of a pass.
#[derive(Clone, Copy)]
pub(super) enum End {
    /// Prepasses: some seconds after the end of the render.
    Prepass,
    /// First round: some seconds later still, so that every pixel has a sample.
    FirstRound(Option<Instant>),
    /// Samples of tiles in it, from their start on: they have some time of their own. Where they are cut,
    /// every tile has its chance, and gaps are filled (`gaps.rs`).
    FirstSamples(Option<Instant>, Instant),
    /// Every other round: at its deadline and when the user interrupts.
    Round(Option<Instant>),
    /// A sketch after the end of the render: at a time.
    Sketch(Instant),
}

impl End {
    fn is_over(self, render: &Deadline) -> bool {
        let is_past = |deadline: Option<Instant>| deadline.is_some_and(|deadline| Instant::now() >= deadline);
        match self {
            End::Prepass => render.is_over(),
            End::FirstRound(deadline) => render.is_late() || is_past(deadline),
            End::FirstSamples(deadline, start) => {
                render.is_late() || is_past(deadline) || render.ends_samples_since(start)
            }
            End::Round(deadline) => render.is_interrupted() || is_past(deadline),
            End::Sketch(end) => is_past(Some(end)),
        }
    }

    fn deadline(self) -> Option<Instant> {
        match self {
            End::Prepass => None,
            End::FirstRound(deadline) | End::FirstSamples(deadline, _) | End::Round(deadline) => deadline,
            End::Sketch(end) => Some(end),
        }
    }
}

/// Forks of builds, which end as passes do.
pub(super) struct Branches<'t> {
    fork: &'t Fork,
    deadline: &'t Deadline<'t>,
    end: End,
}

impl ForkJoin for Branches<'_> {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        self.fork.join(a, b);
    }

    fn is_over(&self) -> bool {
        self.end.is_over(self.deadline)
    }
}

/// Runs passes on all threads, each with its own scratch memory.
pub(super) struct Threads<'t> {
    workers: &'t Workers<'t>,
    scratch: &'t mut [Vec<Line>],
    branches: Branches<'t>,
}

impl<'t> Threads<'t> {
    /// For passes before or beside the picture.
    pub(super) fn new(workers: &'t Workers<'t>, scratch: &'t mut [Vec<Line>]) -> Self {
        let branches = Branches { fork: &workers.fork, deadline: &workers.deadline, end: End::Prepass };
        Self { workers, scratch, branches }
    }

    /// For passes that end at `end`.
    pub(super) fn until(self, end: End) -> Self {
        Self { branches: Branches { end, ..self.branches }, ..self }
    }

    /// Runs tasks from `queue` on all threads until the queue is empty or the end has come.
    fn run<P: Send>(
        &mut self,
        queue: impl Iterator<Item = (usize, P)> + Send,
        task: impl Fn(usize, P, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    ) -> Result<Passed, OutOfMemory> {
        let Self { workers, scratch, branches } = self;
        let branches = &*branches;
        let queue = Mutex::new(queue);
        let next = || queue.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).next();
        let passed = workers.on_all(scratch, |arena| {
            let is_over = || branches.is_over();
            let mut worker = Worker::new(arena.scratch(), &is_over);
            let mut counters = Counters::default();
            while let Some((number, piece)) = next() {
                if worker.is_over() {
                    return Ok(Passed { counters, is_complete: false });
                }
                counters += task(number, piece, &mut worker)?;
            }
            Ok(Passed { counters, is_complete: true })
        })?;
        let mut all = Passed { counters: Counters::default(), is_complete: true };
        for Passed { counters, is_complete } in passed {
            all.counters += counters;
            all.is_complete &= is_complete;
        }
        Ok(all)
    }
}

impl<'t> Executor for Threads<'t> {
    type Fork = Branches<'t>;

    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        self.run(pieces.enumerate(), task)
    }

    fn pass_scattered<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        // The rest of the round ends with them.
        if let End::FirstRound(deadline) = self.branches.end {
            self.branches.end = End::FirstSamples(deadline, Instant::now());
        }
        self.run(scattered(pieces.enumerate().collect()).into_iter(), task)
    }

    fn is_over(&self) -> bool {
        self.branches.is_over()
    }

    fn fork(&self) -> &Branches<'t> {
        &self.branches
    }

    fn within<T>(&mut self, fraction: f32, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.branches.end;
        let deadlines = [self.workers.deadline.after(fraction), before.deadline()];
        self.branches.end = End::Round(deadlines.into_iter().flatten().min());
        let done = work(self);
        self.branches.end = before;
        done
    }

    fn timed<T>(&mut self, phase: &'static str, work: impl FnOnce(&mut Self) -> T) -> T {
        let start = Instant::now();
        let done = work(self);
        self.workers.spent(phase, start.elapsed().as_secs_f64());
        done
    }
}

/// Samples and end of a round.
pub(super) struct RoundLimits {
    /// Samples per pixel at the end of the round.
    pub(super) target: u32,
    /// Samples of a tile between checks of the clock and the interrupt flag.
    pub(super) step: u32,
    /// End of a round that is cut.
    pub(super) deadline: Option<Instant>,
    /// Whether it is the first, which an interruption ends later than others.
    pub(super) is_first: bool,
}

/// A round on all threads, and the film that it adds to.
pub(super) struct ThreadedRound<'r, 'm> {
    pub(super) workers: &'r Workers<'r>,
    pub(super) limits: &'r RoundLimits,
    pub(super) state: &'r mut RenderState<'m>,
}

impl ThreadedRound<'_, '_> {
    /// Runs `work` on this round with `scratch` memory for each thread.
    pub(super) fn run<T>(
        &mut self,
        scratch: &mut [Vec<Line>],
        work: impl FnOnce(&mut Round<Threads>) -> Result<T, OutOfMemory>,
    ) -> Result<T, OutOfMemory> {
        let Self { workers, limits, state } = self;
        let end =
            if limits.is_first { End::FirstRound(limits.deadline) } else { End::Round(limits.deadline) };
        let mut executor = Threads::new(workers, scratch).until(end);
        work(&mut Round { executor: &mut executor, state, target: limits.target, step: limits.step })
    }
}

/// The items in steps of the golden ratio, so that successive items are far apart.
fn scattered<T>(items: Vec<T>) -> Vec<T> {
    let count = items.len();
    let mut step = (count as f64 * 0.618_034) as usize;
    while step > 1 && greatest_common_divisor(step, count) > 1 {
        step -= 1;
    }
    let step = step.max(1);
    let mut items: Vec<Option<T>> = items.into_iter().map(Some).collect();
    (0..count).filter_map(|i| items[(i as u64 * step as u64 % count as u64) as usize].take()).collect()
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::{AtomicBool, Ordering};
    use glam::Vec3;
    use halflight_core::Rgb;
    use halflight_core::memory::Arena;
    use halflight_core::method::PhotonMapStore;
    use halflight_core::photon::Photon;

    #[test]
    fn scattering_keeps_every_item() {
        for count in [0, 1, 2, 3, 12, 1000] {
            let mut items = scattered((0..count).collect::<Vec<u32>>());
            items.sort_unstable();
            assert_eq!(items, (0..count).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn a_pass_writes_every_piece_once_and_counts() {
        for threads in [1, 3] {
            let workers = Workers::new(Some(threads)).unwrap();
            let mut scratch = vec![vec![]; threads];
            let mut executor = Threads::new(&workers, &mut scratch);
            let mut out = [0; 23];
            let passed = executor.pass(out.chunks_mut(5), |number, out, _| {
                out.iter_mut().for_each(|value| *value += 100 * number + 1);
                Ok(Counters { rays: out.len() as u64, ..Counters::default() })
            });
            let Passed { counters, is_complete } = passed.unwrap();
            assert!(is_complete && counters.rays == 23);
            assert!(out.iter().enumerate().all(|(i, value)| *value == 100 * (i / 5) + 1));
        }
    }

    #[test]
    fn an_interrupt_ends_a_pass_and_a_fraction_of_no_time_ends_its_work_alone() {
        let flag = AtomicBool::new(false);
        let workers = Workers::new(Some(2)).unwrap().ending_at(Deadline::until(&flag).within(Some(3600.0)));
        let mut scratch = vec![vec![]; 2];
        let mut executor = Threads::new(&workers, &mut scratch).until(End::Round(None));
        let is_complete = |executor: &mut Threads| {
            executor.pass(0..9, |_, _, _| Ok(Counters::default())).unwrap().is_complete
        };
        assert!(!executor.within(0.0, is_complete) && executor.within(0.5, is_complete));
        assert!(is_complete(&mut executor));
        flag.store(true, Ordering::Relaxed);
        assert!(!is_complete(&mut executor) && executor.is_over());
    }

    #[test]
    fn an_interrupt_ends_the_build_of_a_photon_map() {
        let flag = AtomicBool::new(false);
        let workers = Workers::new(Some(2)).unwrap().ending_at(Deadline::until(&flag));
        let mut scratch = vec![vec![]; 2];
        let mut executor = Threads::new(&workers, &mut scratch).until(End::Round(None));
        let (count, piece) = (1 << 15, 1 << 10);
        let mut lines = vec![Line([0; 64]); PhotonMapStore::footprint(count).bytes() / 64];
        let mut store = PhotonMapStore::over(Arena::over(&mut lines));
        for interrupted_by in [None, Some(count / piece - 1)] {
            let passed = store.fill(&mut executor, (count, piece), |number, _, photons| {
                photons.fill(Photon::new(Vec3::splat(number as f32), Vec3::Z, Vec3::Z, Rgb::ONE));
                if interrupted_by == Some(number) {
                    flag.store(true, Ordering::Relaxed);
                }
                Ok(Counters::default())
            });
            let is_complete = interrupted_by.is_none();
            assert_eq!(passed.unwrap().is_complete, is_complete);
            assert_eq!(store.map().unwrap().is_some(), is_complete);
        }
    }
}
