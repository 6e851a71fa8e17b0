//! Where samples were dropped: by tile, and by cause in each.

use halflight_core::film::{Dropped, Film, TILE, Tile};
use std::collections::BTreeMap;

/// Samples that did not reach the picture, of all tiles that have such. At most 40 bytes for a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Ledger(BTreeMap<u32, Dropped>);

/// A part of the picture in which samples were dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Column of its upper left pixel.
    pub x: u32,
    /// Row of its upper left pixel.
    pub y: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// How many, by cause.
    pub dropped: Dropped,
}

impl Ledger {
    /// Adds what tile `task` has dropped.
    pub(super) fn add(&mut self, task: usize, dropped: Dropped) {
        if dropped.total() > 0 {
            *self.0.entry(task as u32).or_default() += dropped;
        }
    }

    /// Adds all of another.
    pub(super) fn merge(&mut self, other: &Ledger) {
        other.0.iter().for_each(|(task, dropped)| self.add(*task as usize, *dropped));
    }

    /// Tiles and what they dropped, in their order.
    pub(super) fn tiles(&self) -> impl Iterator<Item = (u32, Dropped)> {
        self.0.iter().map(|(task, dropped)| (*task, *dropped))
    }

    /// The places in a picture, those with the most first.
    pub(super) fn places(&self, width: u32, height: u32) -> Vec<Place> {
        let mut places: Vec<Place> = self
            .tiles()
            .filter_map(|(task, dropped)| {
                let (x, y) = Tile::new(width, height, task as usize).pixel(0)?;
                Some(Place { x, y, width: TILE.min(width - x), height: TILE.min(height - y), dropped })
            })
            .collect();
        places.sort_by_key(|place| core::cmp::Reverse(place.dropped.total()));
        places
    }
}

/// Pixels of the tiles in `tasks` without a single sample: all of theirs were dropped.
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
        let mut ledger = Ledger::default();
        let nan = |count| Dropped { nan: count, ..Dropped::default() };
        for (task, count) in [(1, 2), (5, 3), (1, 4), (0, 0)] {
            ledger.add(task, nan(count));
        }
        // 40 x 20 pixels are 3 x 2 tiles.
        let places = ledger.places(40, 20);
        assert_eq!(places.len(), 2);
        assert_eq!(places[0], Place { x: 16, y: 0, width: 16, height: 16, dropped: nan(6) });
        assert_eq!(places[1], Place { x: 32, y: 16, width: 8, height: 4, dropped: nan(3) });
    }
}
