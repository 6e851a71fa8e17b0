//! Memory layout of the photon map: leaves of 32 photons in columns, and above them levels of nodes of 16
//! boxes. Every leaf and node except the last of its level is full, so that no child needs a pointer: node
//! `i` of a level has the children `16 i` to `16 i + 15` of the level below.

use super::record::Photon;
use bytemuck::{Pod, Zeroable};
use halflight_simd::kernels::points::Boxes16;

/// Photons in a leaf.
pub(super) const LEAF: usize = 32;

/// Halves of a leaf; each column of a half fills one register.
pub(super) const HALVES: usize = LEAF / 16;

/// Children of a node.
pub(super) const WIDTH: usize = 16;

/// Largest number of levels: enough for all photons that a u32 can index.
pub(super) const LEVELS: usize = 7;

const _: () = assert!((LEAF as u64) * (WIDTH as u64).pow(LEVELS as u32) >= 1 << 32);

/// Columns of a leaf, each in halves: the bytes of 32 [`Photon`]s in another order, eleven cache lines.
/// Unused lanes have infinite positions.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Leaf {
    /// Coordinates, in units of the map.
    pub position: [[[f32; 16]; HALVES]; 3],
    pub light: [[u32; 16]; HALVES],
    pub power: [[u32; 16]; HALVES],
    pub normal: [[[u8; 16]; HALVES]; 2],
}

const _: () = assert!(size_of::<Leaf>() == LEAF * size_of::<Photon>());

impl Leaf {
    /// Coordinates of a half, axis by axis.
    #[inline(always)]
    pub(super) fn half(&self, half: usize) -> [&[f32; 16]; 3] {
        let [x, y, z] = &self.position;
        [&x[half & 1], &y[half & 1], &z[half & 1]]
    }

    /// Photon `i`, below [`LEAF`], with its position in units of the map.
    #[inline(always)]
    pub(super) fn photon(&self, i: usize) -> Photon {
        let (half, lane) = (i / 16 % HALVES, i % 16);
        Photon {
            position: [0, 1, 2].map(|axis: usize| self.position[axis][half][lane]),
            light: self.light[half][lane],
            power: self.power[half][lane],
            normal: [self.normal[0][half][lane], self.normal[1][half][lane]],
        }
    }

    /// Fills the leaf with at most [`LEAF`] photons.
    pub(super) fn set(&mut self, photons: &[Photon]) {
        *self = Leaf { position: [[[f32::INFINITY; 16]; HALVES]; 3], ..Leaf::zeroed() };
        for (i, photon) in photons.iter().take(LEAF).enumerate() {
            let (half, lane) = (i / 16, i % 16);
            let position = photon.position;
            for (column, coordinate) in self.position.iter_mut().zip(position) {
                column[half][lane] = coordinate;
            }
            self.light[half][lane] = photon.light;
            self.power[half][lane] = photon.power;
            [self.normal[0][half][lane], self.normal[1][half][lane]] = photon.normal;
        }
    }
}

/// Boxes of sixteen children. The box of a missing child is empty and infinitely far.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub boxes: Boxes16,
}

impl Node {
    pub(super) const EMPTY: Node = {
        let (lo, hi) = ([f32::INFINITY; 16], [f32::NEG_INFINITY; 16]);
        Node { boxes: [lo, lo, lo, hi, hi, hi] }
    };
}

/// Number of nodes on each level, and start of each level in the slice of nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    /// Number of levels, at most [`LEVELS`]; zero without leaves.
    pub count: usize,
    starts: [u32; LEVELS + 1],
    /// Nodes of all levels.
    pub nodes: usize,
}

impl Levels {
    pub(super) const fn of(leaves: usize) -> Self {
        let mut levels = Levels { count: 0, starts: [0; LEVELS + 1], nodes: 0 };
        let mut below = leaves;
        while levels.count < LEVELS && below > 0 && (levels.count == 0 || below > 1) {
            below = below.div_ceil(WIDTH);
            levels.nodes += below;
            levels.count += 1;
            levels.starts[levels.count] = levels.nodes as u32;
        }
        levels
    }

    /// Position of node `i` of a level in the slice of nodes. Level 0 is above the leaves. Node 0 of the
    /// level after the last marks the end of the slice.
    #[inline(always)]
    pub(super) fn at(&self, level: usize, i: usize) -> usize {
        self.starts.get(level).map_or(usize::MAX, |&start| start as usize + i)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_hold_all_leaves() {
        let nodes = |leaves| (Levels::of(leaves).count, Levels::of(leaves).nodes);
        assert_eq!(nodes(0), (0, 0));
        assert_eq!(nodes(1), (1, 1));
        assert_eq!(nodes(16), (1, 1));
        assert_eq!(nodes(17), (2, 3));
        assert_eq!(nodes(257), (3, 17 + 2 + 1));
        assert_eq!(nodes(1 << 27).0, LEVELS);
    }
}
