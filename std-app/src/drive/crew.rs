//! What a method does a round with: passes over its structures, tiles of the picture. Tasks run on all threads, each
//! writes to a slice of its own, and what they have found is committed in their order: the same bits on any number of
//! threads.

use super::watch::Watch;
use super::workers::Workers;
use core::ops::Range;
use halflight_core::film::{PIXELS_PER_TILE, Pixel};
use halflight_core::memory::{Arena, Line, OutOfMemory};
use halflight_core::method::RenderState;
use halflight_core::transport::Counters;
use std::sync::Mutex;
use std::time::Instant;

/// What one round does.
pub(super) struct Round<'a> {
    /// Samples that each pixel has in the end.
    pub(super) target: u32,
    /// Samples after which a thread looks at the clock, and at the flag.
    pub(super) step: u32,
    /// When it is cut.
    pub(super) deadline: Option<Instant>,
    /// Cuts it when the render is interrupted; the first when the watch is late.
    pub(super) watch: &'a Watch<'a>,
    pub(super) is_first: bool,
}

impl Round<'_> {
    fn is_over(&self) -> bool {
        let is_ended = if self.is_first { self.watch.is_late() } else { self.watch.is_interrupted() };
        is_ended || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// A task of a pass: its number, working memory, what it writes to.
pub(super) type Task<'t, T> =
    dyn Fn(usize, &mut Arena, &mut [T]) -> Result<Counters, OutOfMemory> + Sync + 't;

/// A task on a tile: its number, samples, working memory, pixels.
pub(super) type TileTask<'t> =
    dyn Fn(usize, Range<u32>, &mut Arena, &mut [Pixel]) -> Result<Counters, OutOfMemory> + Sync + 't;

/// The threads, and the round that they are in.
pub(super) struct Crew<'r, 'm> {
    pub(super) workers: &'r Workers<'r>,
    pub(super) round: &'r Round<'r>,
    pub(super) canvas: &'r mut RenderState<'m>,
}

impl Crew<'_, '_> {
    /// The first sample that a pixel lacks; `None` where all have theirs, or the round is over. For methods that need
    /// something new for every sample, before its tiles.
    pub(super) fn next_sample(&self) -> Option<u32> {
        let spp = self.canvas.spp();
        (spp < self.round.target && !self.round.is_over()).then_some(spp)
    }

    /// A pass: task `i` writes to the `i`th piece of `size` values of `out`, and what they count is the round's. Returns
    /// whether all of them ran: if not, the round is over, and nothing of it may be committed.
    pub(super) fn pass<T: Send>(
        &mut self,
        out: &mut [T],
        size: usize,
        scratch: &mut [Vec<Line>],
        task: &Task<T>,
    ) -> Result<bool, OutOfMemory> {
        let is_over = || self.round.is_over();
        let (counters, all) = self.workers.pass(out, size, scratch, &is_over, task)?;
        self.canvas.counters += counters;
        Ok(all)
    }

    /// Brings every tile to its target, or to `end` samples where that is less, unless the round is cut.
    pub(super) fn tiles(
        &mut self,
        end: u32,
        scratch: &mut [Vec<Line>],
        task: &TileTask,
    ) -> Result<(), OutOfMemory> {
        let Self { workers, round, canvas } = self;
        let (shard, end) = (canvas.shard, end.min(round.target));
        let tiles =
            canvas.film.pixels_mut().chunks_mut(PIXELS_PER_TILE).zip(canvas.samples.iter_mut()).enumerate();
        let own = tiles.filter(|(task, _)| shard.owns(*task));
        let open = own.filter_map(|(task, (pixels, taken))| (*taken < end).then_some((task, pixels, taken)));
        let queue = Mutex::new(scattered(open.collect()));
        let next = || queue.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).pop();
        let counted = workers.on_all(scratch, |arena| {
            let mut counters = Counters::default();
            let mut dropped = Vec::new();
            while let Some((index, pixels, taken)) = next() {
                while *taken < end {
                    if round.is_over() {
                        return Ok((counters, dropped));
                    }
                    // Parts of about the same size.
                    let left = end - *taken;
                    let samples = *taken..*taken + left.div_ceil(left.div_ceil(round.step.max(1)));
                    let more = task(index, samples.clone(), arena, pixels)?;
                    counters += more;
                    if more.dropped.total() > 0 {
                        dropped.push((index, more.dropped));
                    }
                    *taken = samples.end;
                }
            }
            Ok((counters, dropped))
        })?;
        for (counters, dropped) in counted {
            canvas.counters += counters;
            dropped.into_iter().for_each(|(task, dropped)| canvas.dropped[task] += dropped);
        }
        Ok(())
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use core::sync::atomic::AtomicBool;
    use halflight_core::Rgb;
    use halflight_core::film::Dropped;
    use halflight_core::method::Shard;

    /// Runs `work` with a crew of `threads` on a film of 40 x 40 pixels, 9 tiles, that gets `target` samples.
    fn crew<T>(
        threads: usize,
        target: u32,
        cut: bool,
        work: impl FnOnce(&mut Crew, &mut [Vec<Line>]) -> T,
    ) -> T {
        let workers = Workers::new(Some(threads)).unwrap();
        let mut lines = vec![Line([0; 64]); RenderState::footprint(40, 40).bytes() / 64];
        let mut arena = Arena::new(bytemuck::cast_slice_mut(&mut lines));
        let mut canvas = RenderState::new(40, 40, Shard::WHOLE, &mut arena).unwrap();
        let interrupt = AtomicBool::new(cut);
        let round =
            Round { target, step: 2, deadline: None, watch: &Watch::until(&interrupt), is_first: false };
        let mut scratch = vec![vec![Line([0; 64]); 1]; threads];
        work(&mut Crew { workers: &workers, round: &round, canvas: &mut canvas }, &mut scratch)
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
    fn a_pass_writes_every_piece_once_and_counts() {
        let task = |index: usize, _: &mut Arena, out: &mut [usize]| {
            out.iter_mut().for_each(|value| *value += 100 * index + 1);
            Ok(Counters { rays: out.len() as u64, ..Counters::default() })
        };
        for threads in [1, 3] {
            crew(threads, 1, false, |crew, scratch| {
                let mut out = vec![0; 23];
                assert_eq!(crew.pass(&mut out, 5, scratch, &task), Ok(true));
                assert!(out.iter().enumerate().all(|(i, value)| *value == 100 * (i / 5) + 1));
                assert_eq!(crew.canvas.counters.rays, 23);
                assert_eq!(crew.pass(&mut [], 5, scratch, &task), Ok(true));
            });
        }
    }

    #[test]
    fn a_pass_that_is_cut_says_so() {
        let task = |_: usize, _: &mut Arena, _: &mut [u8]| Ok(Counters::default());
        crew(2, 1, true, |crew, scratch| assert_eq!(crew.pass(&mut [0; 9], 2, scratch, &task), Ok(false)));
    }

    #[test]
    fn sample_after_sample_or_all_at_once_the_film_is_the_same() {
        let tile = |task: usize, samples: Range<u32>, _: &mut Arena, pixels: &mut [Pixel]| {
            for (i, pixel) in pixels.iter_mut().enumerate() {
                for sample in samples.clone() {
                    let light = (task * 7 + i) as f32 / (1.0 + sample as f32);
                    pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
                }
            }
            Ok(Counters { paths: samples.len() as u64, ..Counters::default() })
        };
        let at_once = crew(3, 7, false, |crew, scratch| {
            crew.tiles(u32::MAX, scratch, &tile).unwrap();
            assert_eq!((crew.next_sample(), crew.canvas.counters.paths), (None, 9 * 7));
            crew.canvas.film.pixels().to_vec()
        });
        let one_by_one = crew(2, 7, false, |crew, scratch| {
            let mut seen = Vec::new();
            while let Some(sample) = crew.next_sample() {
                seen.push(sample);
                crew.tiles(sample + 1, scratch, &tile).unwrap();
            }
            assert_eq!(seen, [0, 1, 2, 3, 4, 5, 6]);
            crew.canvas.film.pixels().to_vec()
        });
        assert_eq!(at_once, one_by_one);
    }

    #[test]
    fn a_task_without_memory_ends_the_round() {
        let short = OutOfMemory { needed: 2, available: 1 };
        let tile = |task: usize, _: Range<u32>, _: &mut Arena, _: &mut [Pixel]| {
            if task == 4 { Err(short) } else { Ok(Counters::default()) }
        };
        crew(2, 7, false, |crew, scratch| assert_eq!(crew.tiles(1, scratch, &tile), Err(short)));
    }
}
