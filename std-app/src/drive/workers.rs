//! The threads: each takes the next tile when it is done with one, and has working memory of its own.

use super::RenderError;
use super::canvas::Canvas;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use halflight_core::bsdf::Features;
use halflight_core::bvh::{Bvh, Join};
use halflight_core::estimate::{ErrorEstimate, TileError, TileLight};
use halflight_core::film::{Film, PIXELS_PER_TILE};
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::Mesh;
use halflight_core::transport::{Counters, PathTracer, Pilot, path::WAVE};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Mutex;
use std::time::Instant;

/// A pool of threads.
pub(super) struct Workers {
    pool: ThreadPool,
}

impl Workers {
    /// `threads` threads; as many as the machine runs at once where `None`.
    pub(super) fn new(threads: Option<usize>) -> Result<Self, RenderError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
        pool.map(|pool| Self { pool }).map_err(|error| RenderError::Threads(error.to_string()))
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Builds the hierarchy over `mesh` on all threads.
    pub(super) fn build_bvh<'m>(&self, mesh: &Mesh, arena: &mut Arena<'m>) -> Result<Bvh<'m>, OutOfMemory> {
        self.pool.install(|| Bvh::build_with(mesh, arena, &Fork))
    }

    /// What the tiles of `film` tell of its error; `None` for a black picture.
    pub(super) fn errors(&self, film: &Film) -> Option<Vec<TileError>> {
        let tiles = || film.pixels().par_chunks(PIXELS_PER_TILE);
        self.pool.install(|| {
            let mut light = TileLight::default();
            for tile in tiles().map(TileLight::of).collect::<Vec<_>>() {
                light += tile;
            }
            let mean = light.mean();
            if mean.is_nan() || mean <= 0.0 {
                return None;
            }
            Some(tiles().map(|tile| TileError::of(tile, mean)).collect())
        })
    }

    /// A look at a few tiles before the picture.
    pub(super) fn pilot<F: Features>(
        &self,
        tracer: &PathTracer<F>,
        scratch: &mut [Vec<Line>],
    ) -> Result<Pilot, OutOfMemory> {
        let tasks: Vec<usize> = tracer.pilot_tasks().collect();
        let means = self.each(&tasks, scratch, |task, arena| tracer.pilot_mean(task, WAVE, arena))?;
        let mean = means.iter().sum::<f32>() / means.len().max(1) as f32;
        let mut pilot = Pilot::default();
        for tile in self.each(&tasks, scratch, |task, arena| tracer.pilot(task, mean, WAVE, arena))? {
            pilot += tile;
        }
        Ok(pilot)
    }

    /// What `look` says of each of `tasks`, in their order.
    fn each<T: Send>(
        &self,
        tasks: &[usize],
        scratch: &mut [Vec<Line>],
        look: impl Fn(usize, &mut Arena) -> Result<T, OutOfMemory> + Sync,
    ) -> Result<Vec<T>, OutOfMemory> {
        let next = AtomicUsize::new(0);
        let work = |lines: &mut Vec<Line>| {
            let mut arena = Arena::new(bytemuck::cast_slice_mut(lines));
            let mut seen = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(&task) = tasks.get(index) else { return Ok(seen) };
                seen.push((index, look(task, &mut arena)?));
            }
        };
        let seen = || scratch.par_iter_mut().map(work).collect::<Result<Vec<_>, _>>();
        let mut seen: Vec<(usize, T)> = self.pool.install(seen)?.into_iter().flatten().collect();
        seen.sort_by_key(|(index, _)| *index);
        Ok(seen.into_iter().map(|(_, value)| value).collect())
    }

    /// The error of `film`; `None` for fewer than four samples as well.
    pub(super) fn estimate(&self, film: &Film) -> Option<ErrorEstimate> {
        ErrorEstimate::of(self.errors(film)?.into_iter())
    }

    /// One round: every tile of `canvas` is brought to its target, unless the round is cut.
    pub(super) fn run<F: Features>(
        &self,
        tracer: &PathTracer<F>,
        round: &Round,
        canvas: &mut Canvas,
        scratch: &mut [Vec<Line>],
    ) -> Result<(), OutOfMemory> {
        let shard = canvas.shard;
        let tiles = canvas.film.pixels_mut().chunks_mut(PIXELS_PER_TILE).zip(&mut canvas.taken).enumerate();
        let tiles = tiles.zip(&round.targets).map(|((task, tile), target)| (task, tile, *target));
        let open = tiles.filter(|(task, (_, taken), target)| shard.owns(*task) && **taken < *target);
        let queue = Mutex::new(scattered(open.collect()));
        let done = Mutex::new(Ok((&mut canvas.counters, &mut canvas.ledger)));
        self.pool.scope(|scope| {
            for lines in scratch {
                scope.spawn(|_| {
                    let mut arena = Arena::new(bytemuck::cast_slice_mut(lines));
                    let mut counters = Counters::default();
                    let mut dropped = Vec::new();
                    let mut result = Ok(());
                    'tiles: while let Some((task, (pixels, taken), target)) = next(&queue) {
                        while *taken < target {
                            if round.is_over() {
                                break 'tiles;
                            }
                            let end = taken.saturating_add(round.step).min(target);
                            match tracer.run(task, *taken..end, WAVE, &mut arena, pixels) {
                                Ok(more) => {
                                    counters += more;
                                    dropped.push((task, more.dropped));
                                }
                                Err(error) => {
                                    result = Err(error);
                                    break 'tiles;
                                }
                            }
                            *taken = end;
                        }
                        dropped.retain(|(_, dropped)| dropped.total() > 0);
                    }
                    let mut done = done.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                    if let Ok((total, ledger)) = &mut *done {
                        **total += counters;
                        dropped.into_iter().for_each(|(task, dropped)| ledger.add(task, dropped));
                    }
                    if let Err(error) = result {
                        *done = Err(error);
                    }
                });
            }
        });
        done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()).map(|_| ())
    }
}

/// What one round does.
pub(super) struct Round<'a> {
    /// Samples that each pixel of a tile has in the end.
    pub(super) targets: Vec<u32>,
    /// Samples after which a thread looks at the clock, and at the flag.
    pub(super) step: u32,
    /// When it is cut.
    pub(super) deadline: Option<Instant>,
    /// Cuts it when raised.
    pub(super) interrupt: Option<&'a AtomicBool>,
}

impl Round<'_> {
    fn is_over(&self) -> bool {
        self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed))
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

fn next<T>(queue: &Mutex<Vec<T>>) -> Option<T> {
    queue.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).pop()
}

/// The items in an order that jumps about by the golden ratio, so that tiles that a cut round has reached lie all over
/// the picture.
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

/// Forks on the pool that runs it.
struct Fork;

impl Join for Fork {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        rayon::join(a, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::scene::Triangle;

    /// The bytes of the hierarchy over a wavy sheet of 2 * `side`² triangles.
    fn built(side: u32, threads: usize) -> Vec<u8> {
        let places = (0..=side).flat_map(|y| (0..=side).map(move |x| (x as f32, y as f32)));
        let positions: Vec<[f32; 3]> = places.map(|(x, y)| [x, y, (0.1 * x).sin() * y.sqrt()]).collect();
        let corners = (0..side * side).map(|cell| cell / side * (side + 1) + cell % side);
        let halves = corners.flat_map(|a| [[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]);
        let triangles: Vec<Triangle> = halves.map(|vertices| Triangle { vertices, material: 0 }).collect();
        let mesh = Mesh { positions: &positions, normals: &[], texcoords: &[], triangles: &triangles };

        let mut lines = vec![Line([0; 64]); Bvh::footprint(triangles.len()).bytes() / 64];
        let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
        let bvh = Workers::new(Some(threads)).unwrap().build_bvh(&mesh, &mut arena).unwrap();
        let mut kept = vec![Line([0; 64]); bvh.used().bytes() / 64];
        bvh.copied(&mut Arena::new(bytemuck::cast_slice_mut(&mut kept))).unwrap();
        bytemuck::cast_slice(&kept).to_vec()
    }

    #[test]
    fn scattering_keeps_every_item() {
        for count in [0, 1, 2, 3, 12, 1000] {
            let mut items = scattered((0..count).collect::<Vec<u32>>());
            items.sort_unstable();
            assert_eq!(items, (0..count).collect::<Vec<u32>>());
        }
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
