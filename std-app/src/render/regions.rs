//! Regions of a picture within which errors correlate if a method shares structures between distant pixels.
//! The error comes from independent half-films in any case; regions determine only its interval.

use halflight_core::estimate::{ErrorEstimate, TileError};
use halflight_core::film::TILE;

/// Most regions along each side: enough to estimate the interval, and large enough that shared structures lie
/// mostly within one region.
const SIDE: usize = 8;

/// Error of a picture `width` pixels across from all of its tiles.
pub(super) fn estimate(tiles: &[TileError], width: u32, shares: bool) -> Option<ErrorEstimate> {
    if shares {
        ErrorEstimate::of_regions(merged(tiles, width).into_iter())
    } else {
        ErrorEstimate::of(tiles.iter().copied())
    }
}

/// Sums of tiles over regions.
fn merged(tiles: &[TileError], width: u32) -> Vec<TileError> {
    let across = (width.div_ceil(TILE) as usize).max(1);
    let down = tiles.len().div_ceil(across);
    let side = across.max(down).div_ceil(SIDE).max(1);
    let columns = across.div_ceil(side);
    let mut regions = vec![TileError::default(); columns * down.div_ceil(side)];
    for (task, tile) in tiles.iter().enumerate() {
        regions[task / across / side * columns + task % across / side] += *tile;
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::Rgb;
    use halflight_core::estimate::BrightnessClasses;
    use halflight_core::film::{Dropped, PIXELS_PER_TILE, Pixel, Tile};

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
        assert_eq!(merged(&tiles, 320).len(), 14);
        let [alone, together] = [false, true].map(|shares| estimate(&tiles, 320, shares).unwrap());
        assert!((alone.relmse / together.relmse - 1.0).abs() < 1e-9);
        assert_eq!(merged(&tiles[..4], 64), &tiles[..4]);
    }
}
