//! The film of a render in progress, and the rounds that add samples to it.

use super::executor::{Executor, Passed, Worker};
use crate::film::{Dropped, Film, PIXELS_PER_TILE, Pixel, PixelWindow, Tile};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::Counters;
use core::ops::Range;

/// A part of a picture: every `count`th tile from tile `index` on, or the tiles of a window. The shards of a
/// picture are rendered apart and merged to the same bits as one render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part, from 0.
    pub index: u32,
    /// Number of parts.
    pub count: u32,
    /// The window whose tiles alone belong to the part; `None`: the picture.
    pub window: Option<PixelWindow>,
}

impl Shard {
    /// The whole picture.
    pub const WHOLE: Shard = Shard::part(0, 1);

    /// Part `index`, from 0, of `count` parts.
    pub const fn part(index: u32, count: u32) -> Shard {
        Shard { index, count, window: None }
    }

    /// The tiles of `window`.
    pub const fn of_window(window: PixelWindow) -> Shard {
        Shard { window: Some(window), ..Shard::WHOLE }
    }

    /// True if `tile` belongs to it.
    pub fn owns(&self, tile: usize) -> bool {
        tile % self.count.max(1) as usize == self.index as usize
            && self.window.is_none_or(|window| window.meets(tile))
    }
}

/// The state of a render between two rounds.
pub struct RenderState<'m> {
    /// Sums of the samples.
    pub film: Film<'m>,
    /// Samples per pixel of each tile; 0 in tiles of other shards.
    pub samples: &'m mut [u32],
    /// Rejected samples of each tile.
    pub dropped: &'m mut [Dropped],
    /// The part of the picture that is rendered.
    pub shard: Shard,
    /// Sums over all tasks.
    pub counters: Counters,
    /// Rays of the tiles among them.
    pub rays_of_tiles: u64,
    /// True if errors of distant pixels are correlated, because a structure such as a cache serves them all.
    pub is_correlated: bool,
}

impl<'m> RenderState<'m> {
    /// Bytes that [`RenderState::new`] takes.
    pub fn footprint(width: u32, height: u32) -> Footprint {
        let tiles = Tile::count(width, height);
        Film::footprint(width, height).slice::<u32>(tiles).slice::<Dropped>(tiles)
    }

    /// A render of `width` × `height` pixels before its first sample.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`RenderState::footprint`] bytes.
    pub fn new(width: u32, height: u32, shard: Shard, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let tiles = Tile::count(width, height);
        let film = Film::new(width, height, arena)?;
        let (samples, dropped) = (arena.slice(tiles)?, arena.slice(tiles)?);
        samples.fill(0);
        dropped.fill(Dropped::default());
        Ok(Self {
            film,
            samples,
            dropped,
            shard,
            counters: Counters::default(),
            rays_of_tiles: 0,
            is_correlated: false,
        })
    }

    /// Tiles of the shard.
    pub fn tiles(&self) -> usize {
        (0..self.samples.len()).filter(|&tile| self.shard.owns(tile)).count()
    }

    /// Samples per pixel of the tile of the shard that has fewest.
    pub fn spp(&self) -> u32 {
        let own = self.samples.iter().enumerate().filter(|(tile, _)| self.shard.owns(*tile));
        own.map(|(_, samples)| *samples).min().unwrap_or(0)
    }
}

/// A round of a render: it brings every pixel to the same number of samples, unless its executor ends it
/// early.
pub struct Round<'r, 'm, E> {
    /// Runs the tasks.
    pub executor: &'r mut E,
    /// The film, and the samples that it has.
    pub state: &'r mut RenderState<'m>,
    /// Samples per pixel at the end of the round.
    pub target: u32,
    /// Samples of a tile that a task takes before it asks whether the round is over.
    pub step: u32,
}

impl<E: Executor> Round<'_, '_, E> {
    /// Number of the next sample of the least sampled pixel; `None` at the end of the round. For methods that
    /// build something anew before a sample.
    pub fn next_sample(&self) -> Option<u32> {
        self.next_open_sample(|_| true)
    }

    /// As [`Round::next_sample`], of the tiles that are open.
    pub fn next_open_sample(&self, is_open: impl Fn(usize) -> bool) -> Option<u32> {
        let RenderState { samples, shard, .. } = &*self.state;
        let open = samples.iter().enumerate().filter(|(tile, _)| shard.owns(*tile) && is_open(*tile));
        let spp = open.map(|(_, samples)| *samples).min()?;
        (spp < self.target && !self.executor.is_over()).then_some(spp)
    }

    /// A pass whose work counts as the picture's. Returns whether it is complete.
    ///
    /// # Errors
    /// Those of [`Executor::pass`].
    pub fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<bool, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        let passed = self.executor.pass(pieces, task)?;
        Ok(self.count(passed))
    }

    /// Counts the work of a pass as the picture's. Returns whether the pass is complete.
    pub fn count(&mut self, passed: Passed) -> bool {
        self.state.counters += passed.counters;
        passed.is_complete
    }

    /// Brings every tile of the shard to `end` samples per pixel, or to the round's target if that is less.
    /// `sample` adds a range of samples to the pixels of the tile of that number.
    ///
    /// # Errors
    /// The first [`OutOfMemory`] of `sample`.
    pub fn tiles(
        &mut self,
        end: u32,
        sample: impl Fn(usize, Range<u32>, &mut Arena, &mut [Pixel]) -> Result<Counters, OutOfMemory> + Sync,
    ) -> Result<(), OutOfMemory> {
        self.open_tiles(end, |_| true, sample)
    }

    /// As [`Round::tiles`], for the tiles that are open.
    ///
    /// # Errors
    /// Those of [`Round::tiles`].
    pub fn open_tiles(
        &mut self,
        end: u32,
        is_open: impl Fn(usize) -> bool + Send,
        sample: impl Fn(usize, Range<u32>, &mut Arena, &mut [Pixel]) -> Result<Counters, OutOfMemory> + Sync,
    ) -> Result<(), OutOfMemory> {
        let (end, step) = (end.min(self.target), self.step.max(1));
        let RenderState { film, samples, dropped, shard, .. } = &mut *self.state;
        let pixels = film.pixels_mut().chunks_mut(PIXELS_PER_TILE);
        let tiles = pixels.zip(samples.iter_mut()).zip(dropped.iter_mut()).enumerate();
        let shard = *shard;
        let open =
            tiles.filter(move |(tile, ((_, taken), _))| shard.owns(*tile) && **taken < end && is_open(*tile));
        let passed =
            self.executor.pass_scattered(open, |_, (tile, ((pixels, taken), dropped)), worker| {
                let mut counters = Counters::default();
                while *taken < end && !worker.is_over() {
                    // Parts of about the same size.
                    let left = end - *taken;
                    let samples = *taken..*taken + left.div_ceil(left.div_ceil(step));
                    let more = sample(tile, samples.clone(), &mut worker.scratch, pixels)?;
                    counters += more;
                    *dropped += more.dropped;
                    *taken = samples.end;
                }
                Ok(counters)
            })?;
        self.state.rays_of_tiles += passed.counters.all_rays();
        self.count(passed);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::memory::Line;
    use crate::method::executor::Loop;
    use core::sync::atomic::{AtomicU32, Ordering};
    use std::vec;

    /// Runs `work` on a round of 40 × 40 pixels, 9 tiles, to `target` samples, whose executor ends after
    /// `most` questions.
    fn round(target: u32, most: u32, work: impl FnOnce(&mut Round<Loop>)) {
        let mut lines = vec![Line([0; 64]); RenderState::footprint(40, 40).bytes() / 64];
        let mut arena = Arena::over(&mut lines);
        let mut state = RenderState::new(40, 40, Shard::WHOLE, &mut arena).unwrap();
        let asked = AtomicU32::new(0);
        let is_over = || asked.fetch_add(1, Ordering::Relaxed) >= most;
        let mut executor = Loop::new(&mut []).until(&is_over);
        work(&mut Round { executor: &mut executor, state: &mut state, target, step: 2 });
    }

    fn add(
        tile: usize,
        samples: Range<u32>,
        _: &mut Arena,
        pixels: &mut [Pixel],
    ) -> Result<Counters, OutOfMemory> {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            for sample in samples.clone() {
                let light = (tile * 7 + i) as f32 / (1.0 + sample as f32);
                pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
            }
        }
        Ok(Counters { paths: samples.len() as u64, ..Counters::default() })
    }

    #[test]
    fn samples_one_by_one_or_together_give_the_same_film() {
        let mut together = vec![];
        round(7, u32::MAX, |round| {
            round.tiles(u32::MAX, add).unwrap();
            assert_eq!((round.next_sample(), round.state.counters.paths), (None, 9 * 7));
            together = round.state.film.pixels().to_vec();
        });
        round(7, u32::MAX, |round| {
            let mut numbers = vec![];
            while let Some(sample) = round.next_sample() {
                numbers.push(sample);
                round.tiles(sample + 1, add).unwrap();
            }
            assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 6]);
            assert!(together == round.state.film.pixels());
        });
    }

    #[test]
    fn a_round_that_is_over_leaves_every_tile_in_order() {
        round(7, 5, |round| {
            round.tiles(u32::MAX, add).unwrap();
            let taken: u32 = round.state.samples.iter().sum();
            assert!((1..63).contains(&taken) && round.state.spp() == 0);
            let pixels = round.state.film.pixels().chunks(PIXELS_PER_TILE);
            let counts = pixels.zip(&*round.state.samples);
            assert!(counts.into_iter().all(|(pixels, samples)| pixels[0].count() == *samples));
        });
    }

    #[test]
    fn a_task_without_memory_ends_the_round() {
        let short = OutOfMemory { needed: 2, available: 1 };
        round(7, u32::MAX, |round| {
            let result =
                round.tiles(1, |tile, _, _, _| if tile == 4 { Err(short) } else { Ok(Counters::default()) });
            assert_eq!(result, Err(short));
        });
    }
}
