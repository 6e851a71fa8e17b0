//! The threads: each takes the next tile when it is done with one, and has working memory of its own.

use super::RenderError;
use core::ops::Range;
use core::sync::atomic::{AtomicBool, Ordering};
use halflight_core::bsdf::Features;
use halflight_core::bvh::{Bvh, Join};
use halflight_core::estimate::{ErrorEstimate, TileError, TileLight};
use halflight_core::film::{Film, PIXELS_PER_TILE};
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::scene::Mesh;
use halflight_core::transport::{Counters, PathTracer, path::WAVE};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Mutex;

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

    /// What `film` tells of its own error; `None` for fewer than four samples, and for a black picture.
    pub(super) fn estimate(&self, film: &Film) -> Option<ErrorEstimate> {
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
            let errors: Vec<_> = tiles().map(|tile| TileError::of(tile, mean)).collect();
            ErrorEstimate::of(errors.into_iter())
        })
    }

    /// One round: `samples` of every pixel. When `interrupt` is raised, tiles not yet begun are left out.
    pub(super) fn run<F: Features>(
        &self,
        tracer: &PathTracer<F>,
        samples: Range<u32>,
        film: &mut Film,
        scratch: &mut [Vec<Line>],
        interrupt: &AtomicBool,
    ) -> Result<Counters, OutOfMemory> {
        let tiles = Mutex::new(film.pixels_mut().chunks_mut(PIXELS_PER_TILE).enumerate());
        let total = Mutex::new(Ok(Counters::default()));
        self.pool.scope(|scope| {
            for lines in scratch {
                scope.spawn(|_| {
                    let mut arena = Arena::new(bytemuck::cast_slice_mut(lines));
                    let mut counters = Counters::default();
                    while !interrupt.load(Ordering::Relaxed) {
                        let next = tiles.lock().ok().and_then(|mut tiles| tiles.next());
                        let Some((task, pixels)) = next else { break };
                        match tracer.run(task, samples.clone(), WAVE, &mut arena, pixels) {
                            Ok(done) => counters += done,
                            Err(error) => {
                                store(&total, |total| *total = Err(error));
                                return;
                            }
                        }
                    }
                    store(&total, |total| {
                        if let Ok(total) = total {
                            *total += counters;
                        }
                    });
                });
            }
        });
        total.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Forks on the pool that runs it.
struct Fork;

impl Join for Fork {
    fn join(&self, a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
        rayon::join(a, b);
    }
}

type Total = Result<Counters, OutOfMemory>;

fn store(total: &Mutex<Total>, change: impl FnOnce(&mut Total)) {
    change(&mut total.lock().unwrap_or_else(|poisoned| poisoned.into_inner()));
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
    fn any_number_of_threads_builds_the_same_bytes() {
        let one = built(150, 1);
        assert!(one.len() > 45_000 * 36);
        for threads in [2, 5] {
            assert!(built(150, threads) == one, "{threads} threads");
        }
    }
}
