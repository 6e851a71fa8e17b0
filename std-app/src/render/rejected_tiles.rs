//! Rejected samples by tile and cause.

use halflight_core::film::{Dropped, Film, TILE, Tile};

/// A tile with rejected samples, smaller at the borders of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RejectedTile {
    /// Column of its upper left pixel.
    pub x: u32,
    /// Row of its upper left pixel.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Number of rejected samples by cause.
    pub dropped: Dropped,
}

/// The tiles of a picture that have rejected samples, those with the most first.
pub(super) fn rejected_tiles(dropped: &[Dropped], width: u32, height: u32) -> Vec<RejectedTile> {
    let of_tile = |(task, &dropped): (usize, &Dropped)| {
        let [x, y] = Tile::new(width, height, task).corner();
        Some(RejectedTile { x, y, width: TILE.min(width - x), height: TILE.min(height - y), dropped })
    };
    let some = dropped.iter().enumerate().filter(|(_, dropped)| dropped.total() > 0);
    let mut tiles: Vec<RejectedTile> = some.filter_map(of_tile).collect();
    tiles.sort_by_key(|tile| core::cmp::Reverse(tile.dropped.total()));
    tiles
}

/// Pixels of the tiles in `tasks` without samples, because all were rejected.
pub(super) fn empty_pixels(film: &Film, tasks: impl Fn(usize) -> bool) -> u64 {
    let inside = |task: usize, i: usize| Tile::new(film.width(), film.height(), task).pixel(i).is_some();
    let tiles = film.pixels().chunks(halflight_core::film::PIXELS_PER_TILE).enumerate();
    let empty = |(task, pixels): (usize, &[halflight_core::film::Pixel])| {
        pixels.iter().enumerate().filter(|(i, pixel)| pixel.count() == 0 && inside(task, *i)).count() as u64
    };
    tiles.filter(|(task, _)| tasks(*task)).map(empty).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_tiles_and_the_worst_come_first() {
        let nan = |count| Dropped { nan: count, ..Dropped::default() };
        let dropped = [0, 6, 0, 0, 0, 3].map(nan);
        // 40 x 20 pixels are 3 x 2 tiles.
        let tiles = rejected_tiles(&dropped, 40, 20);
        assert_eq!(tiles.len(), 2);
        assert_eq!(tiles[0], RejectedTile { x: 16, y: 0, width: 16, height: 16, dropped: nan(6) });
        assert_eq!(tiles[1], RejectedTile { x: 32, y: 16, width: 8, height: 4, dropped: nan(3) });
    }
}
