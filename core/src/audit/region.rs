//! Regions of a picture, each with a deviation of its own.

use crate::estimate::Deviation;

/// Fewest audited pixels of a region, enough for a mean deviation with a standard error.
const PIXELS_PER_REGION: usize = 12;

/// Most regions along each side.
const MAX_REGIONS_PER_SIDE: u32 = 8;

/// Most regions of a picture.
const MAX_REGIONS: usize = (MAX_REGIONS_PER_SIDE * MAX_REGIONS_PER_SIDE) as usize;

/// Audited pixels that suffice for all regions.
pub(super) const SUFFICIENT_PIXELS: usize = PIXELS_PER_REGION * MAX_REGIONS;

/// A part of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Region {
    /// Column of its upper left pixel.
    pub x: u32,
    /// Row of its upper left pixel.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Relative excess of its brightness.
    pub deviation: Deviation,
    /// True if the deviation is significant, at 2.5 % for all regions and the whole picture together.
    pub is_biased: bool,
}

/// Regions of a picture, row by row: a slice of 64 at most.
#[derive(Clone, Copy, PartialEq)]
pub struct Regions {
    regions: [Region; MAX_REGIONS],
    count: usize,
}

impl Regions {
    /// Regions by their numbers in `grid`.
    pub(super) fn of(grid: Grid, region: impl Fn(usize) -> Region) -> Self {
        let count = grid.count().min(MAX_REGIONS);
        let regions =
            core::array::from_fn(|number| if number < count { region(number) } else { Region::default() });
        Self { regions, count }
    }
}

impl core::ops::Deref for Regions {
    type Target = [Region];

    fn deref(&self) -> &[Region] {
        &self.regions[..self.count]
    }
}

impl<'r> IntoIterator for &'r Regions {
    type Item = &'r Region;
    type IntoIter = core::slice::Iter<'r, Region>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl core::fmt::Debug for Regions {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_list().entries(self).finish()
    }
}

/// Regions of a picture: a grid of `side` x `side`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    size: [u32; 2],
    side: u32,
}

impl Grid {
    /// The grid for `pixels` audited pixels.
    pub(super) fn new(size: [u32; 2], pixels: usize) -> Self {
        let side = ((pixels / PIXELS_PER_REGION).isqrt() as u32)
            .clamp(1, MAX_REGIONS_PER_SIDE)
            .min(size[0])
            .min(size[1]);
        Self { size, side }
    }

    /// Number of its regions.
    pub(super) fn count(&self) -> usize {
        (self.side * self.side) as usize
    }

    /// Region of a pixel, row by row from the upper left.
    pub(super) fn region(&self, pixel: [u32; 2]) -> usize {
        let [column, row] = [0, 1]
            .map(|i| (u64::from(pixel[i]) * u64::from(self.side) / u64::from(self.size[i].max(1))) as usize);
        row * self.side as usize + column
    }

    /// Column range and row range of a region, each with its end excluded.
    pub(super) fn bounds(&self, region: usize) -> [[u32; 2]; 2] {
        let side = self.side.max(1);
        let cell = [region as u32 % side, region as u32 / side];
        let border =
            |i: usize, n: u32| (u64::from(n) * u64::from(self.size[i])).div_ceil(u64::from(side)) as u32;
        [0, 1].map(|i| [border(i, cell[i]), border(i, cell[i] + 1)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_tile_the_picture() {
        let grid = Grid::new([37, 21], 256);
        let mut area = 0;
        for region in 0..grid.count() {
            let [columns, rows] = grid.bounds(region);
            for y in rows[0]..rows[1] {
                for x in columns[0]..columns[1] {
                    assert_eq!(grid.region([x, y]), region);
                    area += 1;
                }
            }
        }
        assert_eq!((grid.side, area), (4, 37 * 21));
    }

    #[test]
    fn many_pixels_have_64_regions_and_one_pixel_has_one() {
        let count = |size, pixels| {
            let grid = Grid::new(size, pixels);
            Regions::of(grid, |x| Region { x: x as u32, ..Region::default() }).len()
        };
        assert_eq!((count([400, 300], 8192), count([400, 300], 1), count([1, 300], 8192)), (64, 1, 1));
    }
}
