//! Regions of a picture within which errors correlate if a method shares structures between distant pixels.
//! The error comes from independent half-films in any case; regions determine only its interval.

use super::{BrightnessClasses, ErrorEstimate, TileError, TileLight};
use crate::film::{Film, PIXELS_PER_TILE, TILE, Tile};

/// Most regions along each side: enough to estimate the interval, and large enough that shared structures lie
/// mostly within one region.
const SIDE: usize = 8;

impl ErrorEstimate {
    /// Estimate from all `tiles` of a picture `width` pixels across; `None` if no pixel has four samples.
    /// `is_correlated`: errors of distant pixels correlate, because the method shares structures.
    pub fn of_picture(tiles: &[TileError], width: u32, is_correlated: bool) -> Option<Self> {
        match is_correlated {
            true => {
                let regions = merged(tiles.iter().copied(), tiles.len(), width);
                Self::of_regions(regions.into_iter())
            }
            false => Self::of(tiles.iter().copied()),
        }
    }

    /// Estimate of `film`; `None` if no pixel has four samples, and for a black picture. `is_correlated`: as
    /// above.
    pub fn of_film(film: &Film, is_correlated: bool) -> Option<Self> {
        let (width, height) = (film.width(), film.height());
        let count = Tile::count(width, height);
        let tiles = || {
            film.pixels()
                .chunks(PIXELS_PER_TILE)
                .enumerate()
                .map(|(i, pixels)| (Tile::new(width, height, i), pixels))
        };
        let mean = film.mean_radiance()?;
        let mut classes = BrightnessClasses::default();
        let learned = tiles().enumerate().filter(|(i, _)| BrightnessClasses::uses_tile(*i, count));
        learned.for_each(|(_, (tile, pixels))| classes.add(tile, pixels, mean));
        let shrinkage = classes.shrinkage();
        let errors = tiles().map(|(tile, pixels)| TileError::of(tile, pixels, mean, &shrinkage));
        match is_correlated {
            true => Self::of_regions(merged(errors, count, width).into_iter()),
            false => Self::of(errors),
        }
    }
}

impl Film<'_> {
    /// Mean over pixels and channels; `None` of a black picture.
    pub fn mean_radiance(&self) -> Option<f64> {
        let mut light = TileLight::default();
        self.pixels().chunks(PIXELS_PER_TILE).for_each(|pixels| light += TileLight::of(pixels));
        Some(light.mean()).filter(|mean| *mean > 0.0)
    }
}

/// Sums of `count` tiles over regions; regions outside the picture have no values.
fn merged(tiles: impl Iterator<Item = TileError>, count: usize, width: u32) -> [TileError; SIDE * SIDE] {
    let across = (width.div_ceil(TILE) as usize).max(1);
    let side = across.max(count.div_ceil(across)).div_ceil(SIDE).max(1);
    let mut regions = [TileError::default(); SIDE * SIDE];
    for (task, tile) in tiles.enumerate() {
        if let Some(region) = regions.get_mut(task / across / side * SIDE + task % across / side) {
            *region += tile;
        }
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rgb;
    use crate::film::{Dropped, Pixel};
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
        let all = |tiles: &[TileError]| merged(tiles.iter().copied(), tiles.len(), 320);
        let regions = all(&tiles);
        assert_eq!(regions.iter().filter(|region| **region != TileError::default()).count(), 14);
        let [alone, together] =
            [false, true].map(|shares| ErrorEstimate::of_picture(&tiles, 320, shares).unwrap());
        assert!((alone.relmse / together.relmse - 1.0).abs() < 1e-9);
        assert_eq!(merged(tiles[..4].iter().copied(), 4, 64)[..4], tiles[..4]);
    }
}
