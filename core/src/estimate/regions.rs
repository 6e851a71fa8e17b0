//! Regions of a picture within which errors correlate if a method shares structures between distant pixels.
//! The error comes from independent half-films in any case; regions determine only its interval.

use super::{ErrorEstimate, TileError};
use crate::film::TILE;

/// Most regions along each side: enough to estimate the interval, and large enough that shared structures lie
/// mostly within one region.
const SIDE: usize = 8;

impl ErrorEstimate {
    /// Estimate from all `tiles` of a picture `width` pixels across; `None` if no pixel has four samples.
    /// `is_correlated`: errors of distant pixels correlate, because the method shares structures.
    pub fn of_picture(tiles: &[TileError], width: u32, is_correlated: bool) -> Option<Self> {
        match is_correlated {
            true => Self::of_regions(merged(tiles, width).into_iter()),
            false => Self::of(tiles.iter().copied()),
        }
    }
}

/// Sums of tiles over regions; regions outside the picture have no values.
fn merged(tiles: &[TileError], width: u32) -> [TileError; SIDE * SIDE] {
    let across = (width.div_ceil(TILE) as usize).max(1);
    let side = across.max(tiles.len().div_ceil(across)).div_ceil(SIDE).max(1);
    let mut regions = [TileError::default(); SIDE * SIDE];
    for (task, tile) in tiles.iter().enumerate() {
        if let Some(region) = regions.get_mut(task / across / side * SIDE + task % across / side) {
            *region += *tile;
        }
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::estimate::BrightnessClasses;
    use crate::film::{Dropped, PIXELS_PER_TILE, Pixel, Tile};
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
        let regions = merged(&tiles, 320);
        assert_eq!(regions.iter().filter(|region| **region != TileError::default()).count(), 14);
        let [alone, together] =
            [false, true].map(|shares| ErrorEstimate::of_picture(&tiles, 320, shares).unwrap());
        assert!((alone.relmse / together.relmse - 1.0).abs() < 1e-9);
        assert_eq!(merged(&tiles[..4], 64)[..4], tiles[..4]);
    }
}
