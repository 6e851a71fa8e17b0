//! Memory layout of the BVH: nodes of eight boxes, and leaves of up to eight triangles. The coordinates of a
//! leaf lie in runs, so that one load fills a register and no lane is padded.

use crate::geometry::Bounds;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_simd::kernels::boxes::Boxes8;

/// Largest number of triangles in a leaf: one register.
pub(super) const LEAF_MAX: usize = 8;

/// Children per node.
pub(super) const WIDTH: usize = 8;

/// Greatest depth of the tree. The build halves ranges by count before it reaches this depth.
pub(super) const DEPTH_MAX: usize = 96;

pub(super) use halflight_simd::STACK;

const _: () = assert!(STACK >= (WIDTH - 1) * DEPTH_MAX + 2 * WIDTH);

/// Margin of the boxes in units of the largest coordinate: two units in its last place. A ray in the plane of
/// a face is then inside the box, and a part of a triangle is inside its box despite rounding.
pub(super) const SLACK: f32 = 2.0 * f32::EPSILON;

/// Tree of one mesh.
pub(super) struct Tree {
    pub root: Child,
    pub bounds: Bounds,
    /// Margin of its boxes.
    pub slack: f32,
}

/// Eight boxes (rows 0 … 5), the bits of their [`Child`]ren (row 6), and for each octant of directions their
/// order from far to near (row 7, four bits each). Four cache lines.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub rows: Boxes8,
}

impl Node {
    /// A node without children: no ray meets an empty box.
    pub(super) const EMPTY: Node = {
        let (lo, hi) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Node { rows: [lo, hi, lo, hi, lo, hi, [f32::from_bits(Child::NONE.0); 8], [0.0; 8]] }
    };

    pub(super) fn set(&mut self, i: usize, lo: [f32; 3], hi: [f32; 3], child: Child) {
        for axis in 0..3 {
            self.rows[2 * axis][i] = lo[axis];
            self.rows[2 * axis + 1][i] = hi[axis];
        }
        self.rows[6][i] = f32::from_bits(child.0);
    }

    /// Fills row 7. The box with the farthest centre along the diagonal of an octant comes first.
    pub(super) fn order(&mut self) {
        let mut twice = [[0.0; WIDTH]; 3];
        for (axis, twice) in twice.iter_mut().enumerate() {
            for (lane, twice) in twice.iter_mut().enumerate() {
                *twice = self.rows[2 * axis][lane] + self.rows[2 * axis + 1][lane];
            }
        }
        for octant in 0..8 {
            let mut along = [0.0; WIDTH];
            for (axis, twice) in twice.iter().enumerate() {
                let sign = if octant >> axis & 1 == 1 { -1.0 } else { 1.0 };
                for (along, twice) in along.iter_mut().zip(twice) {
                    *along += sign * twice;
                }
            }
            let mut packed = 0;
            for (lane, rank) in ranks(along).into_iter().enumerate() {
                packed |= (lane as u32) << (4 * rank);
            }
            self.rows[7][octant] = f32::from_bits(packed);
        }
    }

    /// Least and greatest corner of a child's box.
    #[inline(always)]
    pub(super) fn corners(&self, i: usize) -> [Vec3; 2] {
        [0, 1].map(|end| Vec3::from([0, 2, 4].map(|axis| self.rows[axis + end][i & 7])))
    }

    #[inline(always)]
    pub(super) fn order_of(&self, octant: usize) -> u32 {
        self.rows[7][octant & 7].to_bits()
    }

    #[inline(always)]
    pub(super) fn child(&self, i: usize) -> Child {
        Child(self.rows[6][i & 7].to_bits())
    }
}

/// Rank of each key in descending order; among equal keys the first comes first. NaN counts as infinite.
pub(super) fn ranks(mut keys: [f32; WIDTH]) -> [u32; WIDTH] {
    for key in &mut keys {
        *key = if key.is_nan() { f32::INFINITY } else { *key };
    }
    let mut ranks = [0; WIDTH];
    for (j, other) in keys.iter().enumerate() {
        for (i, (rank, key)) in ranks.iter_mut().zip(&keys).enumerate() {
            *rank += ((other > key) | ((other == key) & (j < i))) as u32;
        }
    }
    ranks
}

/// Content of a box: a node by its index, or a leaf by its first reference and their number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    /// Largest number of references, by the 28 bits of a leaf.
    pub(super) const REFERENCES_MAX: usize = 1 << 28;

    /// A leaf out of range, for empty boxes and the bottom of a stack.
    pub(super) const NONE: Child = Child(u32::MAX);

    pub(super) const fn node(index: u32) -> Self {
        Child(index)
    }

    pub(super) fn leaf(first: u32, count: u32) -> Self {
        Child(Self::LEAF | (count - 1) << 28 | first)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// First reference and number of references (1 … 8) of a leaf.
    #[inline(always)]
    pub(super) fn triangles(self) -> (usize, usize) {
        ((self.0 & 0x0fff_ffff) as usize, (self.0 >> 28 & 7) as usize + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_put_the_largest_first_and_never_two_at_one_place() {
        assert_eq!(ranks([1.0, 3.0, 2.0, 3.0, -1.0, 0.0, -0.0, f32::NEG_INFINITY]), [3, 0, 2, 1, 6, 4, 5, 7]);
        let odd = [f32::NAN, f32::INFINITY, 1.0, -f32::NAN, 1.0, f32::NEG_INFINITY, f32::NAN, 2.0];
        assert_eq!(ranks(odd), [0, 1, 5, 2, 6, 7, 3, 4]);
    }
}
