//! Execution of tasks by the caller: threads on a computer, a loop on a microcontroller.
//!
//! A method is a sequence of passes. The tasks of a pass are independent: each writes to a piece of memory of
//! its own and reads what earlier passes have left. The result has the same bits for any number of threads.

use crate::bvh::ForkJoin;
use crate::memory::{Arena, OutOfMemory};
use crate::transport::Counters;

/// The surroundings of a task while it runs.
pub struct Worker<'w> {
    /// Working memory of the thread, as large as the method's scratch. The next task uses the same bytes.
    pub scratch: Arena<'w>,
    is_over: &'w dyn Fn() -> bool,
}

impl<'w> Worker<'w> {
    /// A worker with `scratch` memory, whose executor answers `is_over`.
    pub fn new(scratch: Arena<'w>, is_over: &'w dyn Fn() -> bool) -> Self {
        Self { scratch, is_over }
    }

    /// True if the task should end at the next point where its piece is in order.
    pub fn is_over(&self) -> bool {
        (self.is_over)()
    }
}

/// The outcome of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub struct Passed {
    /// Sums over the tasks that ran.
    pub counters: Counters,
    /// True if all tasks ran. Otherwise nothing of the pass may be used.
    pub is_complete: bool,
}

/// Runs the tasks of passes. It alone knows threads, clocks and interrupts.
///
/// Threads of the standard library, without a clock, each with the memory that
/// [`RequiredMemory::scratch`](crate::RequiredMemory::scratch) states:
///
/// ```
/// use halflight_core::memory::OutOfMemory;
/// use halflight_core::parts::rays::{ForkJoin, Serial};
/// use halflight_core::{Arena, Counters, Executor, Line, Passed, Worker};
/// use std::sync::Mutex;
/// use std::sync::atomic::{AtomicBool, Ordering};
///
/// struct Threads<'t> {
///     /// Working memory of each thread.
///     scratch: Vec<Vec<Line>>,
///     /// Raised by the caller to end passes.
///     interrupt: &'t AtomicBool,
/// }
///
/// impl Executor for Threads<'_> {
///     type Fork = Serial;
///
///     fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
///     where
///         P: Iterator<Item: Send> + Send,
///         T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
///     {
///         let queue = Mutex::new(pieces.enumerate());
///         let result = Mutex::new(Ok(Passed { counters: Counters::default(), is_complete: true }));
///         let is_over = || self.interrupt.load(Ordering::Relaxed);
///         std::thread::scope(|scope| {
///             let (queue, task, result, is_over) = (&queue, &task, &result, &is_over);
///             for lines in &mut self.scratch {
///                 scope.spawn(move || {
///                     let mut worker = Worker::new(Arena::over(lines), is_over);
///                     loop {
///                         let next = queue.lock().unwrap().next();
///                         let Some((number, piece)) = next else { break };
///                         // A piece that no thread runs makes the pass incomplete.
///                         let done = (!is_over()).then(|| task(number, piece, &mut worker));
///                         let mut result = result.lock().unwrap();
///                         match (done, &mut *result) {
///                             (Some(Ok(counters)), Ok(passed)) => passed.counters += counters,
///                             (Some(Err(error)), Ok(_)) => *result = Err(error),
///                             (None, Ok(passed)) => passed.is_complete = false,
///                             (_, Err(_)) => break,
///                         }
///                     }
///                 });
///             }
///         });
///         result.into_inner().unwrap()
///     }
///
///     fn is_over(&self) -> bool {
///         self.interrupt.load(Ordering::Relaxed)
///     }
///
///     fn fork(&self) -> &Serial {
///         &Serial
///     }
/// }
///
/// let interrupt = AtomicBool::new(false);
/// let mut threads = Threads { scratch: vec![vec![Line::ZERO; 1]; 4], interrupt: &interrupt };
/// let count = |number, _, _: &mut Worker| Ok(Counters { rays: number as u64, ..Counters::default() });
/// let passed = threads.pass(0..100, count)?;
/// assert!(passed.is_complete && passed.counters.rays == 4950);
///
/// interrupt.store(true, Ordering::Relaxed);
/// assert!(!threads.pass(0..100, count)?.is_complete);
/// # Ok::<(), OutOfMemory>(())
/// ```
///
/// The pieces come from an iterator of any length: a thread takes the next one under a lock. Their results do
/// not depend on their order. [`Serial`](crate::parts::rays::Serial) builds the hierarchy on one thread; a
/// [`ForkJoin`] of the caller builds it on several.
pub trait Executor {
    /// The forks of recursive builds.
    type Fork: ForkJoin;

    /// Runs `task` once for each of `pieces`, with its number, in any order. No task starts once
    /// [`Executor::is_over`].
    ///
    /// # Errors
    /// The first [`OutOfMemory`] of a task.
    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync;

    /// As [`Executor::pass`], in an order in which the tasks that ran before an early end are spread evenly.
    /// The numbers of the tasks are those of the pieces.
    ///
    /// # Errors
    /// Those of [`Executor::pass`].
    fn pass_scattered<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        self.pass(pieces, task)
    }

    /// True if passes are to end: a deadline has passed, or the user has interrupted the render.
    fn is_over(&self) -> bool;

    /// Forks, for builds that divide themselves.
    fn fork(&self) -> &Self::Fork;

    /// Runs `work` that the picture can do without: passes in it end early, after a `fraction` (0 to 1) of
    /// the time that the picture has left. Without a clock it runs to its end.
    fn within<T>(&mut self, _fraction: f32, work: impl FnOnce(&mut Self) -> T) -> T {
        work(self)
    }

    /// Runs `work` under a name for reports of where time went.
    fn timed<T>(&mut self, _phase: &'static str, work: impl FnOnce(&mut Self) -> T) -> T {
        work(self)
    }
}

/// An executor of one thread: a loop over the tasks.
pub struct Loop<'l> {
    scratch: &'l mut [u8],
    is_over: &'l dyn Fn() -> bool,
}

impl<'l> Loop<'l> {
    /// A loop whose tasks have `scratch` bytes of working memory. It never ends early.
    pub fn new(scratch: &'l mut [u8]) -> Self {
        Self { scratch, is_over: &|| false }
    }

    /// The same, which ends once `is_over`.
    pub fn until(self, is_over: &'l dyn Fn() -> bool) -> Self {
        Self { is_over, ..self }
    }
}

impl Executor for Loop<'_> {
    type Fork = crate::bvh::Serial;

    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        let mut counters = Counters::default();
        let mut worker = Worker::new(Arena::new(self.scratch), self.is_over);
        for (number, piece) in pieces.enumerate() {
            if worker.is_over() {
                return Ok(Passed { counters, is_complete: false });
            }
            counters += task(number, piece, &mut worker)?;
        }
        Ok(Passed { counters, is_complete: true })
    }

    fn is_over(&self) -> bool {
        (self.is_over)()
    }

    fn fork(&self) -> &Self::Fork {
        &crate::bvh::Serial
    }
}
