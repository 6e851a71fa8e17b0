//! A window of a picture, of which only the tiles with its pixels are rendered.

use super::tile::{REACH, TILE, Tile};

/// Rectangle of pixels within a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelWindow {
    /// Width and height of the picture.
    frame: [u32; 2],
    /// Column and row of the upper left pixel.
    corner: [u32; 2],
    /// Width and height, at least 1.
    size: [u32; 2],
}

impl PixelWindow {
    /// The window of `size` at `corner` of a picture of `frame` pixels; `None` unless it lies in the picture
    /// and has a pixel.
    pub fn new(frame: [u32; 2], corner: [u32; 2], size: [u32; 2]) -> Option<Self> {
        let fits =
            |i: usize| size[i] > 0 && corner[i].checked_add(size[i]).is_some_and(|end| end <= frame[i]);
        (fits(0) && fits(1)).then_some(Self { frame, corner, size })
    }

    /// Width and height of the picture.
    pub fn frame(&self) -> [u32; 2] {
        self.frame
    }

    /// Column and row of the upper left pixel.
    pub fn corner(&self) -> [u32; 2] {
        self.corner
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// True if pixels of `tile` may lie in the window.
    pub fn meets(&self, tile: usize) -> bool {
        let corner = Tile::new(self.frame[0], self.frame[1], tile).corner();
        let overlaps = |i: usize| {
            corner[i] < self.corner[i] + self.size[i] + REACH && self.corner[i] < corner[i] + TILE + REACH
        };
        overlaps(0) && overlaps(1)
    }

    /// True for the pixel in column `x` and row `y`.
    pub fn contains(&self, [x, y]: [u32; 2]) -> bool {
        let is_in = |at: u32, i: usize| at.checked_sub(self.corner[i]).is_some_and(|at| at < self.size[i]);
        is_in(x, 0) && is_in(y, 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PIXELS_PER_TILE;

    #[test]
    fn every_pixel_of_a_window_lies_in_its_tiles_and_few_others_do() {
        let frame = [150, 90];
        for (corner, size) in [([0, 0], [1, 1]), ([37, 41], [20, 3]), ([100, 60], [50, 30]), ([0, 0], frame)]
        {
            let window = PixelWindow::new(frame, corner, size).unwrap();
            let mut inside = 0;
            for (x, y) in (0..frame[1]).flat_map(|y| (0..frame[0]).map(move |x| (x, y))) {
                if window.contains([x, y]) {
                    inside += 1;
                    assert!(window.meets(Tile::position(frame, x, y) / PIXELS_PER_TILE), "{x} {y}");
                }
            }
            assert_eq!(inside, size[0] * size[1]);
            let tiles =
                (0..Tile::count(frame[0], frame[1])).filter(|tile| window.meets(*tile)).count() as u32;
            let most = |size: u32| (size + 2 * REACH).div_ceil(TILE) + 1;
            assert!(tiles <= most(size[0]) * most(size[1]), "{tiles} tiles");
        }
    }

    #[test]
    fn windows_beyond_the_picture_do_not_exist() {
        for (corner, size) in [([0, 0], [0, 5]), ([9, 0], [2, 1]), ([0, 10], [1, 1]), ([u32::MAX, 0], [2, 1])]
        {
            assert_eq!(PixelWindow::new([10, 10], corner, size), None);
        }
    }
}
