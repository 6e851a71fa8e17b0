//! Which samples of a tile are taken: of its groups, the smallest parts of a picture that can have numbers of their own.

use super::tile::{PIXELS_PER_TILE, Tile};
use core::ops::Range;

/// Pixels of a group, whose paths may share what they find: every other pixel, across and down, of a block of 8 × 8.
/// Neighbours belong to different groups, so that the errors that a group has in common do not show as squares.
pub const GROUP: usize = 16;

/// Groups of a tile.
pub const GROUPS: usize = PIXELS_PER_TILE / GROUP;

impl Tile {
    /// The group of the `i`th pixel.
    #[inline]
    pub const fn group(i: usize) -> usize {
        i / 64 * 4 + i % 4
    }

    /// Which pixel of the tile is the one with number `member` of a group.
    #[inline]
    pub const fn member(group: usize, member: usize) -> usize {
        group / 4 * 64 + member * 4 + group % 4
    }
}

/// Samples of a tile: of each pixel of a group, from one number to before another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Samples {
    /// The first of each group.
    pub from: [u32; GROUPS],
    /// Where each group ends.
    pub to: [u32; GROUPS],
}

impl Samples {
    /// How many there are, over all groups.
    pub fn count(&self) -> u64 {
        let groups = self.to.iter().zip(&self.from);
        groups.map(|(to, from)| u64::from(to.saturating_sub(*from))).sum()
    }

    /// The first of so many `parts` of about the same size, one at least: all groups are through together.
    pub fn first(&self, parts: u64) -> Self {
        let mut first = *self;
        for (to, from) in first.to.iter_mut().zip(&self.from) {
            let count = u64::from(to.saturating_sub(*from)).div_ceil(parts.max(1));
            *to = from.saturating_add(count as u32);
        }
        first
    }

    /// How many samples the pixels of each group have with these.
    pub fn ends(&self) -> [u32; GROUPS] {
        core::array::from_fn(|group| self.to[group].max(self.from[group]))
    }
}

/// The same of all pixels.
impl From<Range<u32>> for Samples {
    fn from(range: Range<u32>) -> Self {
        Self { from: [range.start; GROUPS], to: [range.end; GROUPS] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_cover_a_tile() {
        for i in 0..PIXELS_PER_TILE {
            let group = Tile::group(i);
            assert_eq!((0..GROUP).filter(|member| Tile::member(group, *member) == i).count(), 1);
        }
    }

    #[test]
    fn parts_end_together() {
        let mut samples = Samples::from(4..20);
        samples.to[3] = 7;
        samples.from[5] = 30;
        assert_eq!(samples.count(), 14 * 16 + 3);
        let (mut parts, mut sum) = (4, 0);
        while samples.count() > 0 {
            let first = samples.first(parts);
            sum += first.count();
            samples.from = first.ends();
            parts -= 1;
        }
        assert_eq!((parts, sum), (0, 14 * 16 + 3));
    }
}
