//! Regions of a picture within which errors correlate if a method shares structures between distant pixels.
//! The error comes from independent half-films in any case; regions determine only its interval.

use super::{ErrorEstimate, TileError};
use crate::film::{TILE, Tile};

/// Most regions along each side: enough to estimate the interval, and large enough that shared structures lie
/// mostly within one region.
const SIDE: usize = 8;

/// Error sums of a picture: over all tiles, and over regions where errors of distant pixels correlate.
#[derive(Clone, Debug)]
pub struct ErrorSums {
    /// Tiles across the picture, and across a region.
    across: usize,
    side: usize,
    is_correlated: bool,
    all: TileError,
    /// Regions outside the picture have no values.
    regions: [TileError; SIDE * SIDE],
}

impl ErrorSums {
    /// Sums of a picture of `size` pixels before its first tile. `is_correlated`: errors of distant pixels
    /// correlate, because the method shares structures.
    pub fn new([width, height]: [u32; 2], is_correlated: bool) -> Self {
        let across = (width.div_ceil(TILE) as usize).max(1);
        let side = across.max(Tile::count(width, height).div_ceil(across)).div_ceil(SIDE).max(1);
        let regions = [TileError::default(); SIDE * SIDE];
        Self { across, side, is_correlated, all: TileError::default(), regions }
    }

    /// Adds the tile of this number.
    pub fn add(&mut self, number: usize, tile: TileError) {
        let Self { across, side, .. } = *self;
        match self.regions.get_mut(number / across / side * SIDE + number % across / side) {
            Some(region) if self.is_correlated => *region += tile,
            _ => self.all += tile,
        }
    }

    /// Estimate from all tiles; `None` if no pixel has four samples.
    pub fn estimate(&self) -> Option<ErrorEstimate> {
        match self.is_correlated {
            true => ErrorEstimate::of_regions(self.regions.into_iter()),
            false => ErrorEstimate::of(core::iter::once(self.all)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::estimate::BrightnessClasses;
    use crate::film::{Dropped, PIXELS_PER_TILE, Pixel};
    use std::vec::Vec;

    #[test]
    fn regions_cover_the_picture_and_change_the_interval_alone() {
        let tile = |task: u32| {
            let mut pixel = Pixel::default();
            for sample in 0..8u32 {
                let light = 1.0 + (task * 31 + sample * 17) as f32 % 5.0;
                pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
            }
            let pixels = [pixel; PIXELS_PER_TILE];
            let mut alike = BrightnessClasses::default();
            let tile = Tile::new(TILE, TILE, 0);
            alike.add(tile, &pixels, 3.0);
            TileError::of(tile, &pixels, 3.0, &alike.shrinkage())
        };
        // 20 x 5 tiles give 7 x 2 regions of 3 x 3.
        let tiles: Vec<_> = (0..100).map(tile).collect();
        let sums = |tiles: &[TileError], size, is_correlated| {
            let mut sums = ErrorSums::new(size, is_correlated);
            tiles.iter().enumerate().for_each(|(number, tile)| sums.add(number, *tile));
            sums
        };
        let [alone, together] = [false, true].map(|shares| sums(&tiles, [320, 80], shares));
        let regions = together.regions.iter().filter(|region| **region != TileError::default());
        assert_eq!(regions.count(), 14);
        let [alone, together] = [alone, together].map(|sums| sums.estimate().unwrap());
        assert!((alone.relmse / together.relmse - 1.0).abs() < 1e-9);
        assert_eq!(sums(&tiles[..4], [64, 16], true).regions[..4], tiles[..4]);
    }
}
