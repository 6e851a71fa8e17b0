//! Groups of the pixels of a tile, and circles within groups: the pixels that share their paths (path reuse,
//! Bekaert et al. 2002).

use super::tile::{PIXELS_PER_TILE, Tile};
use crate::sampling::mix;

/// Pixels of a group: two random ones of each 2 × 2 of a block of 8 × 8.
pub const GROUP: usize = 32;

/// Groups of a tile.
pub const GROUPS: usize = PIXELS_PER_TILE / GROUP;

/// Pixels of a circle, which share their paths: half of a group, one random pixel of each 2 × 2. The choice
/// changes with the circle and whenever the number of samples has doubled, so that no pattern is visible.
pub const CIRCLE: usize = GROUP / 2;

/// Circles of a tile.
pub const CIRCLES: usize = PIXELS_PER_TILE / CIRCLE;

/// Pixels of a block, which has its own groups.
const BLOCK: usize = 64;

/// Groups of a block.
const IN_BLOCK: usize = BLOCK / GROUP;

/// Samples of each half that use the first choice. Fewer would break up the low-discrepancy nets of the
/// pixels.
const FIRST_CHOICE_SAMPLES: u32 = 16;

/// The pixels of each group in Z-order, and the group of each pixel.
const GROUP_TABLES: ([[u8; GROUP]; GROUPS], [u8; PIXELS_PER_TILE]) = {
    let (mut members, mut groups) = ([[0; GROUP]; GROUPS], [0; PIXELS_PER_TILE]);
    let mut quad = 0;
    while quad < PIXELS_PER_TILE / 4 {
        // The pixel that joins the first pixel's group, and that group.
        let lot = mix(quad as u64 + 1) >> 8;
        let (partner, first) = (1 + (lot >> 1) % 3, lot & 1);
        let (mut i, mut counts) = (0, [0, 0]);
        while i < 4 {
            let half = if i == 0 || i == partner { first } else { 1 - first } as usize;
            let (pixel, group) = (4 * quad + i as usize, quad / (BLOCK / 4) * IN_BLOCK + half);
            groups[pixel] = group as u8;
            members[group][quad % (BLOCK / 4) * 2 + counts[half]] = pixel as u8;
            counts[half] += 1;
            i += 1;
        }
        quad += 1;
    }
    (members, groups)
};

impl Tile {
    /// Group of the `i`th pixel.
    #[inline]
    pub const fn group(i: usize) -> usize {
        GROUP_TABLES.1[i % PIXELS_PER_TILE] as usize
    }

    /// The pixels of a circle that share `sample`, in Z-order. `seed` is the seed of the picture.
    #[inline]
    pub fn circle(&self, circle: usize, seed: u32, sample: u32) -> [usize; CIRCLE] {
        let (group, half) = (circle / 2 % GROUPS, circle % 2);
        let round =
            u32::BITS - (sample >> 1).checked_div(FIRST_CHOICE_SAMPLES).unwrap_or_default().leading_zeros();
        let [x, y] = self.corner();
        let place = u64::from(seed) << 32 | u64::from(x ^ y.rotate_left(16));
        let lots = mix(mix(place) ^ (u64::from(round) << 8 | group as u64));
        core::array::from_fn(|i| GROUP_TABLES.0[group][(2 * i + (lots >> i & 1) as usize) ^ half] as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_cover_a_tile_and_stay_in_their_group() {
        let tile = Tile::new(64, 64, 5);
        for sample in [0, 31, 32, 1000, u32::MAX] {
            let mut seen = [0; PIXELS_PER_TILE];
            for circle in 0..CIRCLES {
                let members = tile.circle(circle, 7, sample);
                assert!(members.is_sorted());
                // One of each 2 × 2 of a block.
                assert!(members.iter().enumerate().all(|(i, member)| member / 4 % 16 == i));
                for member in members {
                    seen[member] += 1;
                    assert_eq!(Tile::group(member), circle / 2);
                }
            }
            assert_eq!(seen, [1; PIXELS_PER_TILE]);
        }
    }

    #[test]
    fn circles_change_when_samples_have_doubled_and_from_tile_to_tile() {
        let circles = |task, sample| -> [_; CIRCLES] {
            core::array::from_fn(|i| Tile::new(64, 64, task).circle(i, 0, sample))
        };
        let first = circles(0, 0);
        assert_eq!(circles(0, 2 * FIRST_CHOICE_SAMPLES - 1), first);
        let later = [2, 4, 8, 16].map(|n| circles(0, n * FIRST_CHOICE_SAMPLES));
        assert!(later.iter().all(|later| *later != first) && later[0] != later[1]);
        assert_ne!(circles(1, 0), first);
    }
}
