//! Thread pool: each thread takes the next task when it is free, and has its own working memory.

use super::RenderError;
use super::deadline::Deadline;
use halflight_core::Level;
use halflight_core::bvh::{Bvh, ForkJoin};
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::Mesh;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Mutex;

/// A pool of threads.
pub(super) struct Workers<'w> {
    /// End of its passes.
    pub(super) deadline: Deadline<'w>,
    /// Pool, and fork-join on it.
    pub(super) fork: Fork,
    /// Seconds of each phase of the render.
    phases: Mutex<Vec<(&'static str, f64)>>,
}

impl<'w> Workers<'w> {
    /// A pool of `threads` threads; `None`: all of the machine.
    pub(super) fn new(threads: Option<usize>) -> Result<Self, RenderError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
        let phases = Mutex::default();
        pool.map(|pool| Self { fork: Fork(pool), deadline: Deadline::default(), phases })
            .map_err(|error| RenderError::Threads(error.to_string()))
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
        self.fork.0.current_num_threads()
    }

    /// Runs `work` on the pool, whose threads take the parts of its parallel iterators.
    pub(super) fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.fork.0.install(work)
    }

    /// Builds the BVH of `mesh` on all threads.
    pub(super) fn build_bvh<'m>(
        &self,
        mesh: &Mesh,
        level: Level,
        arena: &mut Arena<'m>,
    ) -> Result<Bvh<'m>, OutOfMemory> {
        self.install(|| Bvh::build_with(mesh, arena, level, &self.fork))
    }

    /// Runs `work` once on every thread, each with its own working memory.
    pub(super) fn on_all<T: Send>(
        &self,
        scratch: &mut [Vec<Line>],
        work: impl Fn(&mut Arena) -> Result<T, OutOfMemory> + Sync,
    ) -> Result<Vec<T>, OutOfMemory> {
        let one = |lines: &mut Vec<Line>| work(&mut Arena::over(lines));
        self.install(|| scratch.par_iter_mut().with_max_len(1).map(one).collect())
    }
}

/// Forks on the threads of a pool.
pub(super) struct Fork(ThreadPool);

impl ForkJoin for Fork {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        self.0.join(a, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::scene::Triangle;

    /// Bytes of the BVH of a wavy sheet of 2 * `side`² triangles.
    fn built(side: u32, threads: usize) -> Vec<u8> {
        let places = (0..=side).flat_map(|y| (0..=side).map(move |x| (x as f32, y as f32)));
        let positions: Vec<[f32; 3]> = places.map(|(x, y)| [x, y, (0.1 * x).sin() * y.sqrt()]).collect();
        let corners = (0..side * side).map(|cell| cell / side * (side + 1) + cell % side);
        let halves = corners.flat_map(|a| [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]);
        let triangles: Vec<Triangle> = halves.map(|vertices| Triangle { vertices, material: 0 }).collect();
        let mesh = Mesh { positions: &positions, normals: &[], texcoords: &[], triangles: &triangles };

        let mut lines = vec![Line([0; 64]); Bvh::footprint(triangles.len()).bytes() / 64];
        let mut arena = Arena::over(&mut lines);
        let bvh = Workers::new(Some(threads)).unwrap().build_bvh(&mesh, Level::detect(), &mut arena).unwrap();
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
