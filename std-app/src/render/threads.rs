//! Threads of the program: a pool whose threads take the next task when they are free, each with its own
//! working memory, and the executor on it, which ends passes at deadlines and interrupts.

use super::RenderError;
use super::deadline::{Deadline, End};
use crate::pool;
use halflight_core::Level;
use halflight_core::bvh::{Bvh, ForkJoin};
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::method::{Executor, Passed, RenderState, Round, Worker};
use halflight_core::scene::Mesh;
use halflight_core::transport::Counters;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::sync::Mutex;
use std::time::Instant;

/// A pool of threads; `None`: that of the calling thread.
pub(crate) struct Pool(Option<ThreadPool>);

impl Pool {
    /// The pool of this thread if it has at most `threads` threads, otherwise a new one; `None`: all of the
    /// machine.
    pub(crate) fn new(threads: Option<usize>) -> Result<Self, RenderError> {
        let is_here = rayon::current_thread_index().is_some()
            && threads.is_none_or(|most| rayon::current_num_threads() <= most);
        if is_here { Ok(Self(None)) } else { Self::start(threads) }
    }

    /// A new pool, which any thread may use.
    pub(crate) fn start(threads: Option<usize>) -> Result<Self, RenderError> {
        let pool = pool::start(threads).map_err(|error| RenderError::Threads(error.to_string()))?;
        Ok(Self(Some(pool)))
    }

    pub(super) fn count(&self) -> usize {
        self.0.as_ref().map_or_else(rayon::current_num_threads, ThreadPool::current_num_threads)
    }

    /// Runs `work` on the pool.
    pub(crate) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.0 {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Builds the BVH of `mesh` on all threads.
    pub(super) fn build_bvh<'m>(
        &self,
        mesh: &Mesh,
        level: Level,
        arena: &mut Arena<'m>,
    ) -> Result<Bvh<'m>, OutOfMemory> {
        self.install(|| Bvh::build_with(mesh, arena, level, self))
    }
}

impl ForkJoin for Pool {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        match &self.0 {
            Some(pool) => pool.join(a, b),
            None => rayon::join(a, b),
        };
    }
}

/// The threads of a pool at work on one picture.
pub(super) struct Workers<'w> {
    /// End of their passes.
    pub(super) deadline: Deadline<'w>,
    /// Pool, and fork-join on it.
    pub(super) pool: &'w Pool,
    /// Seconds of each phase of the render.
    phases: Mutex<Vec<(&'static str, f64)>>,
}

impl<'w> Workers<'w> {
    /// The threads of `pool`.
    pub(super) fn new(pool: &'w Pool) -> Self {
        Self { pool, deadline: Deadline::default(), phases: Mutex::default() }
    }

    /// A pool whose passes end at `deadline`.
    pub(super) fn ending_at(self, deadline: Deadline<'w>) -> Self {
        Self { deadline, ..self }
    }

    /// Adds `seconds` to a phase.
    pub(super) fn spent(&self, phase: &'static str, seconds: f64) {
        let mut phases = self.phases.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        match phases.iter_mut().find(|(other, _)| *other == phase) {
            Some((_, sum)) => *sum += seconds,
            None => phases.push((phase, seconds)),
        }
    }

    /// Seconds of a phase so far.
    pub(super) fn seconds_of(&self, phase: &str) -> f64 {
        let phases = self.phases.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        phases.iter().find(|(other, _)| *other == phase).map_or(0.0, |(_, seconds)| *seconds)
    }

    /// Number of threads.
    pub(super) fn count(&self) -> usize {
        self.pool.count()
    }

    /// Runs `work` on the pool, whose threads take the parts of its parallel iterators.
    pub(super) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Runs `work` with an executor of estimates of the error, which have no working memory.
    pub(super) fn estimating<T>(&self, work: impl FnOnce(&mut Threads) -> T) -> T {
        let mut scratch = vec![Vec::new(); self.count()];
        work(&mut Threads::new(self, &mut scratch).until(End::Never))
    }

    /// Runs `work` once on every thread, each with its own working memory. The parallel iterator is compiled
    /// once, since passes hand it a trait object.
    fn on_all(
        &self,
        scratch: &mut [Vec<Line>],
        work: &(dyn Fn(&mut Arena) -> Result<Passed, OutOfMemory> + Sync),
    ) -> Result<Passed, OutOfMemory> {
        let one = |lines: &mut Vec<Line>| work(&mut Arena::over(lines));
        let passed = self.install(|| scratch.par_iter_mut().with_max_len(1).map(one).collect::<Vec<_>>());
        let mut all = Passed { counters: Counters::default(), is_complete: true };
        for passed in passed {
            let Passed { counters, is_complete } = passed?;
            all.counters += counters;
            all.is_complete &= is_complete;
        }
        Ok(all)
    }
}

/// Forks of builds, which end as passes do.
pub(super) struct Branches<'t> {
    fork: &'t Pool,
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
        let branches = Branches { fork: workers.pool, deadline: &workers.deadline, end: End::Prepass };
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
        workers.on_all(scratch, &|arena| {
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
        })
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
    /// True if it is the first, which an interruption ends later than others.
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
    use halflight_core::method::PhotonMapStore;
    use halflight_core::photon::Photon;
    use halflight_core::scene::Triangle;

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
            let pool = Pool::new(Some(threads)).unwrap();
            let workers = Workers::new(&pool);
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
        let pool = Pool::new(Some(2)).unwrap();
        let workers = Workers::new(&pool).ending_at(Deadline::until(&flag).within(Some(3600.0)));
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
        let pool = Pool::new(Some(2)).unwrap();
        let workers = Workers::new(&pool).ending_at(Deadline::until(&flag));
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

    /// Bytes of the BVH of a wavy sheet of 2 * `side`² triangles.
    fn built(side: u32, threads: usize) -> Vec<u8> {
        let places = (0..=side).flat_map(|y| (0..=side).map(move |x| (x as f32, y as f32)));
        let positions: Vec<[f32; 3]> = places.map(|(x, y)| [x, y, (0.1 * x).sin() * y.sqrt()]).collect();
        let corners = (0..side * side).map(|cell| cell / side * (side + 1) + cell % side);
        let halves = corners.flat_map(|a| [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]);
        let triangles: Vec<Triangle> = halves.map(|vertices| Triangle { vertices, material: 0 }).collect();
        let mesh = Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() };

        let mut lines = vec![Line([0; 64]); Bvh::footprint(triangles.len()).bytes() / 64];
        let mut arena = Arena::over(&mut lines);
        let bvh = Pool::new(Some(threads)).unwrap().build_bvh(&mesh, Level::detect(), &mut arena).unwrap();
        let mut kept = vec![Line([0; 64]); bvh.used().bytes() / 64];
        bvh.copied(&mut Arena::over(&mut kept)).unwrap();
        bytemuck::cast_slice(&kept).to_vec()
    }

    #[test]
    fn any_number_of_threads_builds_the_same_bytes() {
        let one = built(150, 1);
        assert!(one.len() > 45_000 * 36);
        for threads in [2, 5] {
            assert!(built(150, threads) == one, "{threads} threads");
        }
    }
}
