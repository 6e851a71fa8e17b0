//! Film: sums of the samples of every pixel, tile after tile, in two independent half-films (half buffers,
//! Rousselle et al. 2012).

mod pixel;
mod samples;
mod splat;
mod tile;
mod window;

pub use pixel::{Dropped, Half, Pixel};
pub use samples::{CIRCLE, CIRCLES, GROUP, GROUPS};
pub use splat::{STRIPS, Splat, StripOffsets, add_strip, sort_by_strip, strip_length};
pub use tile::{PIXELS_PER_TILE, PixelSet, REACH, SPAN, TILE, Tile};
pub use window::PixelWindow;

use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};

/// Sums of all pixels. Tile `i` owns the pixels from `i * PIXELS_PER_TILE` on, so that each task writes to
/// its own slice. Pixels of border tiles outside the picture stay empty.
#[derive(Debug)]
pub struct Film<'m> {
    width: u32,
    height: u32,
    pixels: &'m mut [Pixel],
}

impl<'m> Film<'m> {
    /// Bytes that [`Film::new`] takes.
    pub fn footprint(width: u32, height: u32) -> Footprint {
        Footprint::default().slice::<Pixel>(Tile::count(width, height) * PIXELS_PER_TILE)
    }

    /// Black film.
    pub fn new(width: u32, height: u32, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let pixels = arena.slice::<Pixel>(Tile::count(width, height) * PIXELS_PER_TILE)?;
        pixels.fill(Pixel::default());
        Ok(Self { width, height, pixels })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, tile after tile.
    pub fn pixels(&self) -> &[Pixel] {
        self.pixels
    }

    /// All pixels, tile after tile: `chunks_mut(PIXELS_PER_TILE)` gives the output of each task.
    pub fn pixels_mut(&mut self) -> &mut [Pixel] {
        self.pixels
    }

    /// Pixel in column `x` and row `y` from the upper left; empty outside the picture.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> Pixel {
        if x >= self.width || y >= self.height {
            return Pixel::default();
        }
        let index = Tile::position([self.width, self.height], x, y);
        self.pixels.get(index).copied().unwrap_or_default()
    }

    /// Mean of all samples of each pixel, row by row from the top.
    pub fn rows(&self) -> impl Iterator<Item = Rgb> + '_ {
        (0..self.height).flat_map(move |y| (0..self.width).map(move |x| self.mean(x, y)))
    }

    /// Mean of all samples of a pixel; black without samples.
    pub fn mean(&self, x: u32, y: u32) -> Rgb {
        self.pixel(x, y).mean()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Line;
    use std::vec;

    #[test]
    fn footprint_is_exact() {
        let (width, height) = (33, 7);
        let bytes = Film::footprint(width, height).bytes();
        let mut lines = vec![Line([0xff; 64]); bytes / 64];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut lines);
        let film = Film::new(width, height, &mut Arena::new(bytes));
        assert!(film.is_ok_and(|film| film.mean(32, 6) == Rgb::ZERO));
        let short = bytes.len() - 1;
        assert!(Film::new(width, height, &mut Arena::new(&mut bytes[..short])).is_err());
    }

    #[test]
    fn every_pixel_has_its_own_place() {
        for (width, height) in [(35, 18), (1, 1), (3, 40), (64, 48), (17, 16)] {
            let mut seen = vec![false; Tile::count(width, height) * PIXELS_PER_TILE];
            for task in 0..Tile::count(width, height) {
                let tile = Tile::new(width, height, task);
                for i in 0..PIXELS_PER_TILE {
                    if let Some((x, y)) = tile.pixel(i) {
                        let place = Tile::position([width, height], x, y);
                        assert_eq!(place, task * PIXELS_PER_TILE + i);
                        assert!(!core::mem::replace(&mut seen[place], true));
                        let [left, top] = tile.corner();
                        let near =
                            |at: u32, first: u32| (first..first + TILE + 2 * REACH).contains(&(at + REACH));
                        assert!(near(x, left) && near(y, top));
                    }
                }
            }
            assert_eq!(seen.iter().filter(|&&s| s).count(), (width * height) as usize);
        }
    }

    #[test]
    fn blocks_dissolve_into_each_other() {
        let size = [256, 256];
        // Number of pixels of each column of blocks that lie beyond their block's borders.
        let block = |place: usize| {
            let tile = place / PIXELS_PER_TILE % 16;
            tile as u32 * 2 + Tile::place(place % PIXELS_PER_TILE).0 / 8
        };
        let mut beyond = [0; 8];
        for (x, y) in (8..248).flat_map(|x| (0..256).map(move |y| (x, y))) {
            beyond[x as usize % 8] += u32::from(block(Tile::position(size, x, y)) != x / 8);
        }
        // 30 columns of 256 pixels each; within five standard deviations.
        for (column, count) in beyond.into_iter().enumerate() {
            let share = f64::from([7, 5, 3, 1, 1, 3, 5, 7][column]) / 16.0;
            let pixels = 30.0 * 256.0;
            let deviation = (share * (1.0 - share) * pixels).sqrt();
            assert!((f64::from(count) - share * pixels).abs() < 5.0 * deviation, "{column}: {count}");
        }
    }
}
