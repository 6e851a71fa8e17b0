//! In which order the samples of a tile are taken, and which of them share: layer after layer, one sample of each
//! pixel, cut into groups.
//!
//! A group is every other pixel, across and down, of a block of 8 × 8: neighbours belong to different groups, so
//! that the errors that a group has in common do not show as squares.

use super::reuse::GROUP;
use crate::film::{PIXELS_PER_TILE, Tile};
use core::ops::Range;

/// Groups of one layer.
const GROUPS: u32 = (PIXELS_PER_TILE / GROUP) as u32;

/// Pixels that share, one sample of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub(super) sample: u32,
    index: u32,
}

impl Group {
    /// Another number for each group that a wave can hold.
    pub(super) fn number(self) -> u32 {
        self.sample.wrapping_mul(GROUPS) + self.index
    }
}

/// All samples of a tile that are still to be taken.
pub(super) struct Places {
    tile: Tile,
    next: Group,
    end: u32,
}

impl Places {
    pub(super) fn new(tile: Tile, samples: Range<u32>) -> Self {
        Self { tile, next: Group { sample: samples.start, index: 0 }, end: samples.end }
    }

    pub(super) fn next_group(&mut self) -> Option<Group> {
        let group = self.next;
        if group.sample >= self.end {
            return None;
        }
        self.next.index += 1;
        if self.next.index == GROUPS {
            self.next = Group { sample: group.sample + 1, index: 0 };
        }
        Some(group)
    }

    /// The pixels of a group: where the film keeps them in the tile, column and row.
    pub(super) fn pixels(&self, group: Group) -> impl Iterator<Item = (usize, u32, u32)> + use<> {
        let tile = self.tile;
        (0..GROUP).filter_map(move |member| {
            let place = (group.index as usize / 4) * 64 + member * 4 + group.index as usize % 4;
            tile.pixel(place).map(|(x, y)| (place, x, y))
        })
    }
}
