//! In which order the samples of a tile are taken, and which of them share: layer after layer, one sample of each
//! pixel of each group that is to have any more.

use super::outline::Outlined;
use crate::film::{GROUP, GROUPS, Samples, Tile};

/// Pixels that share, one sample of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub(super) sample: u32,
    index: usize,
}

impl Group {
    /// Another number for each group that a wave can hold.
    pub(super) fn number(self) -> u32 {
        self.sample.wrapping_mul(GROUPS as u32) + self.index as u32
    }
}

/// All samples of a tile that are still to be taken.
pub(super) struct Places {
    tile: Tile,
    left: Samples,
    index: usize,
    /// Pixels whose paths leave the lamp that they see to others.
    pub(super) outlined: Outlined,
}

impl Places {
    pub(super) fn new(tile: Tile, samples: Samples) -> Self {
        Self { tile, left: samples, index: 0, outlined: Outlined::default() }
    }

    pub(super) fn next_group(&mut self) -> Option<Group> {
        for _ in 0..GROUPS {
            let index = self.index;
            self.index = (index + 1) % GROUPS;
            let (next, end) = (self.left.from.get_mut(index)?, *self.left.to.get(index)?);
            if *next < end {
                let sample = *next;
                *next += 1;
                return Some(Group { sample, index });
            }
        }
        None
    }

    /// The pixels of a group: where the film keeps them in the tile, column and row.
    pub(super) fn pixels(&self, group: Group) -> impl Iterator<Item = (usize, u32, u32)> + use<> {
        let tile = self.tile;
        (0..GROUP).filter_map(move |member| {
            let place = Tile::member(group.index, member);
            tile.pixel(place).map(|(x, y)| (place, x, y))
        })
    }
}
