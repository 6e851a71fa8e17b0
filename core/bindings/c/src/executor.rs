//! Threads of a C program, and the end of a step.

use crate::status::HalflightStatus;
use core::cell::UnsafeCell;
use core::ffi::c_void;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use halflight_core::memory::{ALIGNMENT, Arena, Footprint, OutOfMemory};
use halflight_core::parts::rays::Serial;
use halflight_core::{Counters, Executor, Passed, RequiredMemory, Worker};

/// Threads of the program at work on a picture or on points. Zeros, or a null pointer, are the calling
/// thread.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct HalflightExecutor {
    /// Argument of the functions.
    pub user: *mut c_void,
    /// Number of threads, which have working memory of their own each; 0: one.
    pub threads: usize,
    /// Calls `work(job)` once on each of `threads` threads, in parallel or one after the other, and returns
    /// when all have returned. Null: the calling thread alone works.
    pub run: Option<
        unsafe extern "C" fn(
            user: *mut c_void,
            threads: usize,
            work: unsafe extern "C" fn(job: *mut c_void),
            job: *mut c_void,
        ),
    >,
    /// Returns true where the step is to end. All threads call it many times in a second. Null: never.
    pub is_over: Option<unsafe extern "C" fn(user: *mut c_void) -> bool>,
    /// The calling thread calls it after each pass of a step, with the number of paths that the step has
    /// traced so far. Null: it is not called.
    pub progress: Option<unsafe extern "C" fn(user: *mut c_void, paths: u64)>,
}

impl HalflightExecutor {
    /// The calling thread alone.
    const ALONE: Self =
        Self { user: core::ptr::null_mut(), threads: 1, run: None, is_over: None, progress: None };

    /// The executor at `pointer`; null: the calling thread alone.
    ///
    /// # Safety
    /// `pointer` is null or an executor.
    pub(crate) unsafe fn at(pointer: *const Self) -> Self {
        // SAFETY: by the caller.
        let given = unsafe { pointer.as_ref() }.copied().unwrap_or(Self::ALONE);
        let threads = if given.run.is_none() { 1 } else { given.threads.max(1) };
        Self { threads, ..given }
    }
}

/// Working memory of threads.
pub(crate) struct Scratch {
    bytes: &'static mut [u8],
    each: usize,
}

impl Scratch {
    /// Bytes of the structures of `memory` and of the working memory of `threads` threads.
    pub(crate) fn footprint(memory: RequiredMemory, threads: usize) -> Footprint {
        let threads = threads.max(1);
        let padding = threads.saturating_mul(ALIGNMENT);
        Footprint::default().slice::<u8>(memory.with_workers(threads).saturating_add(padding))
    }

    /// Working memory of `threads` threads, `each` bytes of each.
    pub(crate) fn new(
        threads: usize,
        each: usize,
        arena: &mut Arena<'static>,
    ) -> Result<Self, HalflightStatus> {
        let each = each.next_multiple_of(ALIGNMENT);
        Ok(Self { bytes: arena.slice(threads.saturating_mul(each))?, each })
    }

    /// The executor of `given`, whose threads have this memory: as many as it has memory for.
    pub(crate) fn executor(&mut self, given: HalflightExecutor) -> CallersThreads<'_> {
        CallersThreads { given, scratch: self, paths: 0 }
    }
}

/// Threads of the program with working memory.
pub(crate) struct CallersThreads<'s> {
    given: HalflightExecutor,
    scratch: &'s mut Scratch,
    /// Paths of the passes so far.
    paths: u64,
}

impl CallersThreads<'_> {
    fn is_over(given: &HalflightExecutor) -> bool {
        // SAFETY: the program provides a function that all threads may call.
        given.is_over.is_some_and(|is_over| unsafe { is_over(given.user) })
    }
}

impl Executor for CallersThreads<'_> {
    type Fork = Serial;

    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        let given = AnyThread(self.given);
        let is_over = || Self::is_over(&given.get());
        let each = self.scratch.each.max(1);
        let job = Job {
            pieces: Locked::new(pieces.enumerate()),
            task: &task,
            scratch: self.scratch.bytes.as_mut_ptr(),
            each: self.scratch.each,
            // Without scratch one thread works.
            threads: (self.scratch.bytes.len() / each).max(1),
            next_thread: AtomicUsize::new(0),
            is_over: &is_over,
            passed: Locked::new(Ok(Passed { counters: Counters::default(), is_complete: true })),
        };
        let pointer = (&raw const job).cast_mut().cast::<c_void>();
        let HalflightExecutor { user, threads, run, progress, .. } = self.given;
        match run {
            // SAFETY: the function returns after all calls of `work`, so that the job outlives them.
            Some(run) => unsafe { run(user, threads.min(job.threads), work::<P, T>, pointer) },
            // SAFETY: the job is that of these types, and lives.
            None => unsafe { work::<P, T>(pointer) },
        }
        let passed = job.passed.into_inner()?;
        self.paths += passed.counters.paths;
        if let Some(progress) = progress {
            // SAFETY: the program provides a function of this type.
            unsafe { progress(user, self.paths) };
        }
        // Pieces are left where the program has called no `work`.
        let is_complete = passed.is_complete && job.pieces.into_inner().next().is_none();
        Ok(Passed { is_complete, ..passed })
    }

    fn is_over(&self) -> bool {
        Self::is_over(&self.given)
    }

    fn fork(&self) -> &Serial {
        &Serial
    }
}

/// One pass: its pieces, its task and the memory of its threads.
struct Job<'j, P, T> {
    pieces: Locked<core::iter::Enumerate<P>>,
    task: &'j T,
    scratch: *mut u8,
    /// Bytes of a thread.
    each: usize,
    threads: usize,
    /// Number of the next thread that asks for memory.
    next_thread: AtomicUsize,
    is_over: &'j (dyn Fn() -> bool + Sync),
    passed: Locked<Result<Passed, OutOfMemory>>,
}

/// Takes pieces of the job until there are none.
///
/// # Safety
/// `job` is a live [`Job`] of these types. Threads share it: its parts are atomic, locked or read-only.
unsafe extern "C" fn work<P, T>(job: *mut c_void)
where
    P: Iterator<Item: Send> + Send,
    T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
{
    // SAFETY: by the caller.
    let job = unsafe { &*job.cast::<Job<P, T>>() };
    let thread = job.next_thread.fetch_add(1, Ordering::Relaxed);
    if thread >= job.threads {
        return;
    }
    // SAFETY: each thread has a number of its own below `threads`, and so has its part of the memory.
    let bytes = unsafe { core::slice::from_raw_parts_mut(job.scratch.add(thread * job.each), job.each) };
    let is_over = || (job.is_over)();
    let mut worker = Worker::new(Arena::new(bytes), &is_over);
    let mut done = Passed { counters: Counters::default(), is_complete: true };
    let result = loop {
        let Some((number, piece)) = job.pieces.with(Iterator::next) else { break Ok(done) };
        if worker.is_over() {
            break Ok(Passed { is_complete: false, ..done });
        }
        match (job.task)(number, piece, &mut worker) {
            Ok(counters) => done.counters += counters,
            Err(error) => break Err(error),
        }
    };
    job.passed.with(|all| match (&mut *all, result) {
        (Ok(all), Ok(done)) => {
            all.counters += done.counters;
            all.is_complete &= done.is_complete;
        }
        (Ok(_), Err(error)) => *all = Err(error),
        (Err(_), _) => {}
    });
}

/// The executor of the program, whose functions all threads may call.
struct AnyThread(HalflightExecutor);

// SAFETY: the program promises that `is_over` may be called by all threads with its `user`.
unsafe impl Sync for AnyThread {}

impl AnyThread {
    fn get(&self) -> HalflightExecutor {
        self.0
    }
}

/// A value that one thread uses at a time. Threads hold it for the time of one step of an iterator.
struct Locked<T> {
    is_taken: AtomicBool,
    value: UnsafeCell<T>,
}

// SAFETY: `with` lets one thread in at a time.
unsafe impl<T: Send> Sync for Locked<T> {}

impl<T> Locked<T> {
    fn new(value: T) -> Self {
        Self { is_taken: AtomicBool::new(false), value: UnsafeCell::new(value) }
    }

    fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        while self.is_taken.compare_exchange_weak(false, true, Ordering::Acquire, Ordering::Relaxed).is_err()
        {
            core::hint::spin_loop();
        }
        // SAFETY: the flag was false: no other thread has the value.
        let result = work(unsafe { &mut *self.value.get() });
        self.is_taken.store(false, Ordering::Release);
        result
    }

    fn into_inner(self) -> T {
        self.value.into_inner()
    }
}
