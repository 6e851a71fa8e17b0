//! Tiles of a picture, and the Z-order of the pixels within a tile: any run of pixels is a compact patch with
//! coherent camera rays.
//!
//! Pixels of a block of 8 × 8 may share their samples, and then have a common error. A sharp border between
//! two blocks would be visible, so that blocks are dithered into each other: a pixel swaps places with its
//! mirror image beyond the nearest border of its block. The probability falls from a half at the border to
//! zero in the middle of the block.

use crate::sampling::mix;

/// Side of a tile in pixels.
pub const TILE: u32 = 16;

/// Pixels of a tile.
pub const PIXELS_PER_TILE: usize = (TILE * TILE) as usize;

/// Side of a block in pixels.
const BLOCK: u32 = 8;

/// Largest distance in pixels by which a pixel of a tile lies outside its square.
pub const REACH: u32 = BLOCK / 2;

/// Side in pixels of the square around a tile that contains all of its pixels.
pub const SPAN: u32 = TILE + 2 * REACH;

/// One tile of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

impl Tile {
    /// Number of tiles of a picture, including those cut by its border.
    pub const fn count(width: u32, height: u32) -> usize {
        width.div_ceil(TILE) as usize * height.div_ceil(TILE) as usize
    }

    /// Tile `index` of a picture, row by row from the upper left.
    pub const fn new(width: u32, height: u32, index: usize) -> Self {
        let across = if width == 0 { 1 } else { width.div_ceil(TILE) as usize };
        Self { left: (index % across) as u32 * TILE, top: (index / across) as u32 * TILE, width, height }
    }

    /// Indices of `count` tiles at most, 16 or fewer, that are spread over a picture: cells of the first
    /// points of a (0, 2)-sequence. All tiles of a small picture.
    pub fn spread_over(width: u32, height: u32, count: usize) -> impl Iterator<Item = usize> {
        let all = Self::count(width, height);
        let [across, down] = [width, height].map(|size| u64::from(size.div_ceil(TILE)));
        // Points of sixteen lie in the middle of their intervals.
        let cell = |bits: u32, cells: u64| (2 * u64::from(bits >> 28) + 1) * cells / 32;
        let tile = move |i: usize| match all <= count {
            true => i,
            false => {
                let [x, y] = zero_two_point(i as u32);
                (cell(y, down) * across + cell(x, across)) as usize
            }
        };
        let is_new = move |i: &usize| (0..*i).all(|earlier| tile(earlier) != tile(*i));
        (0..count.min(all)).filter(is_new).map(tile)
    }

    /// Column and row of the upper left pixel.
    #[inline]
    pub const fn corner(&self) -> [u32; 2] {
        [self.left, self.top]
    }

    /// Column and row of the `i`th place, from the upper left of its tile.
    #[inline]
    pub const fn place(i: usize) -> (u32, u32) {
        (even_bits(i as u32), even_bits(i as u32 >> 1))
    }

    /// Inverse of [`Tile::place`].
    #[inline]
    pub const fn index_of_place(x: u32, y: u32) -> usize {
        (spread(x % TILE) | spread(y % TILE) << 1) as usize
    }

    /// Column and row of the `i`th pixel of the tile, near its `i`th place; `None` outside the picture.
    #[inline]
    pub const fn pixel(&self, i: usize) -> Option<(u32, u32)> {
        let (x, y) = self.moved(i);
        if x < self.width && y < self.height { Some((x, y)) } else { None }
    }

    /// Index of the `i`th pixel in the square of [`SPAN`] × [`SPAN`] around the tile, row by row.
    #[inline]
    pub const fn index_in_square(&self, i: usize) -> usize {
        let (x, y) = self.moved(i);
        ((y + REACH - self.top) * SPAN + x + REACH - self.left) as usize
    }

    /// Column and row of the `i`th pixel, which may lie outside the picture.
    const fn moved(&self, i: usize) -> (u32, u32) {
        let (x, y) = Self::place(i);
        let (x, y) = (self.left + x, self.top + y);
        let x = dissolved(x, y, whole(self.width));
        (x, dissolved(y, !x, whole(self.height)))
    }

    /// Position in a film of `width` × `height` of the pixel in column `x` and row `y`.
    #[inline]
    pub const fn position([width, height]: [u32; 2], x: u32, y: u32) -> usize {
        let y = dissolved(y, !x, whole(height));
        let x = dissolved(x, y, whole(width));
        let tile = (y / TILE) as usize * width.div_ceil(TILE) as usize + (x / TILE) as usize;
        tile * PIXELS_PER_TILE + Self::index_of_place(x, y)
    }
}

/// Point `i` of the (0, 2)-sequence of van der Corput and Sobol', in units of 2⁻³².
fn zero_two_point(i: u32) -> [u32; 2] {
    let bits = (0..32).filter(|bit| i >> bit & 1 == 1);
    // Column k of Sobol's matrix is that of Pascal's triangle modulo two.
    let column = |bit| (0..bit).fold(1u32 << 31, |column, _| column ^ column >> 1);
    [i.reverse_bits(), bits.map(column).fold(0, |sum, column| sum ^ column)]
}

/// Size in pixels of the tiles that cover `size` pixels.
#[inline]
const fn whole(size: u32) -> u32 {
    size.div_ceil(TILE) * TILE
}

/// Coordinate that swaps places with `at` along `line`, or `at` itself. The function is its own inverse.
/// `size` is a multiple of the side of a block.
#[inline]
const fn dissolved(at: u32, line: u32, size: u32) -> u32 {
    let border = (at + REACH) / BLOCK * BLOCK;
    if border == 0 || border >= size {
        return at;
    }
    let mirrored = 2 * border - 1 - at;
    let first = if at < border { at } else { mirrored };
    // From 0 next to the border to REACH - 1.
    let distance = border - 1 - first;
    let lot = (mix((first as u64) << 32 | line as u64) >> 32) as u32 % (4 * REACH);
    if lot < 2 * (REACH - distance) - 1 { mirrored } else { at }
}

/// Bits 0, 2, 4, 6 of `i`, compacted.
#[inline]
const fn even_bits(i: u32) -> u32 {
    let i = i & 0x55;
    let i = (i | i >> 1) & 0x33;
    (i | i >> 2) & 0x0f
}

/// Inverse of [`even_bits`].
#[inline]
const fn spread(x: u32) -> u32 {
    let x = (x | x << 2) & 0x33;
    (x | x << 1) & 0x55
}

/// Set of pixels of a tile, one bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelSet([u64; PIXELS_PER_TILE / 64]);

impl PixelSet {
    /// True if the set contains the `i`th pixel of the tile.
    #[inline]
    pub fn contains(&self, i: usize) -> bool {
        self.0.get(i / 64).is_some_and(|word| word >> (i % 64) & 1 == 1)
    }

    /// Adds the `i`th pixel of the tile.
    pub fn insert(&mut self, i: usize) {
        if let Some(word) = self.0.get_mut(i / 64) {
            *word |= 1 << (i % 64);
        }
    }

    /// Number of pixels in the set.
    pub fn len(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    /// True if the set is empty.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::vec::Vec;

    #[test]
    fn tiles_are_spread_over_rows_and_columns() {
        for [width, height] in [[128u32, 128u32], [512, 512], [1024, 320], [64, 2000]] {
            let across = width.div_ceil(TILE) as usize;
            let down = height.div_ceil(TILE) as usize;
            for (count, parts) in [(4, 2), (16, 4)] {
                let tiles: Vec<_> = Tile::spread_over(width, height, count).collect();
                // Each part of the picture has one, unless its parts are narrower than tiles.
                let part = |tile: &usize| (tile % across * parts / across, tile / across * parts / down);
                let seen: BTreeSet<_> = tiles.iter().map(part).collect();
                assert_eq!((tiles.len(), seen.len()), (count, count), "{width} x {height}: {tiles:?}");
                assert!(tiles.iter().all(|tile| *tile < Tile::count(width, height)));
            }
        }
    }

    #[test]
    fn all_tiles_of_a_small_picture_are_taken_once() {
        for [width, height] in [[16, 16], [64, 64], [300, 5], [90, 70], [32, 1000]] {
            let tiles: Vec<_> = Tile::spread_over(width, height, 16).collect();
            let different: BTreeSet<_> = tiles.iter().collect();
            assert_eq!(different.len(), tiles.len());
            assert!(tiles.len() >= Tile::count(width, height).min(12), "{width} x {height}: {tiles:?}");
        }
    }
}
