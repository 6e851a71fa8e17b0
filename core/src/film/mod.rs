//! The film: what the samples of every pixel add up to, tile after tile, in two independent halves.

mod pixel;
mod samples;
mod splat;
mod tile;

pub use pixel::{Dropped, Half, Pixel};
pub use samples::{CIRCLE, CIRCLES, GROUP, GROUPS};
pub use splat::{STRIPS, Splat, StripOffsets, add_strip, sort_by_strip, strip_length};
pub use tile::{PIXELS_PER_TILE, PixelSet, TILE, Tile};

use crate::Rgb;
use crate::memory::{Arena, Footprint, OutOfMemory};

/// Sums of all pixels. Tile `i` owns the pixels `i * PIXELS_PER_TILE ..`, so that tasks that own tiles write
/// to slices of their own; pixels of border tiles that lie outside of the picture stay empty.
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

    /// A black film.
    pub fn new(width: u32, height: u32, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let pixels = arena.slice::<Pixel>(Tile::count(width, height) * PIXELS_PER_TILE)?;
        pixels.fill(Pixel::default());
        Ok(Self { width, height, pixels })
    }

    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, tile after tile.
    pub fn pixels(&self) -> &[Pixel] {
        self.pixels
    }

    /// All pixels, tile after tile: `chunks_mut(PIXELS_PER_TILE)` are the outputs of the tasks.
    pub fn pixels_mut(&mut self) -> &mut [Pixel] {
        self.pixels
    }

    /// The pixel in column `x` and row `y`, counted from the upper left; empty outside of the picture.
    pub fn pixel(&self, x: u32, y: u32) -> Pixel {
        let index = Tile::position(self.width, x, y);
        let inside = x < self.width && y < self.height;
        self.pixels.get(index).copied().filter(|_| inside).unwrap_or_default()
    }

    /// The mean of all samples of a pixel; black where there are none.
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
        let (width, height) = (35, 18);
        let mut seen = vec![false; Tile::count(width, height) * PIXELS_PER_TILE];
        for task in 0..Tile::count(width, height) {
            let tile = Tile::new(width, height, task);
            for i in 0..PIXELS_PER_TILE {
                if let Some((x, y)) = tile.pixel(i) {
                    let place = Tile::position(width, x, y);
                    assert_eq!(place, task * PIXELS_PER_TILE + i);
                    assert!(!core::mem::replace(&mut seen[place], true));
                }
            }
        }
        assert_eq!(seen.iter().filter(|&&s| s).count(), (width * height) as usize);
    }
}
