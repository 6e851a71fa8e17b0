//! Binary tree in preorder, the first stage of the wide tree: its leaves are single references.
//!
//! A range of `n` references makes a subtree of exactly `2 n - 1` nodes: the node, its left subtree, its
//! right subtree. The slice of nodes of every subtree is therefore known before it is built, and two subtrees
//! can be built in parallel.

use super::fork_join::ForkJoin;
use super::layout::DEPTH_MAX;
use super::references::Reference;
use super::split::{Box4, Extent, divide, halve};
use crate::Level;
use bytemuck::{Pod, Zeroable};
use glam::Vec4;

/// Box with the number of references below it (bits of `hi.w`).
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct BinaryNode {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl BinaryNode {
    fn new(boxes: &Box4, count: usize) -> Self {
        let mut node = Self { lo: boxes.lo, hi: boxes.hi };
        node.hi.w = f32::from_bits(count as u32);
        node
    }

    /// Number of references below this node.
    #[inline(always)]
    pub(super) fn count(&self) -> usize {
        self.hi.w.to_bits() as usize
    }

    #[inline(always)]
    pub(super) fn half_area(&self) -> f32 {
        let e = self.hi - self.lo;
        e.x * (e.y + e.z) + e.y * e.z
    }
}

/// Index of the left child of node `index`. For the right child see [`right_child`].
#[inline(always)]
pub(super) fn left_child(index: usize) -> usize {
    index + 1
}

/// Index of the right child.
#[inline(always)]
pub(super) fn right_child(nodes: &[BinaryNode], index: usize) -> usize {
    index + 2 * nodes[index + 1].count()
}

/// Number of nodes of a tree over this number of references.
pub(super) const fn nodes_of(references: usize) -> usize {
    if references == 0 { 0 } else { 2 * references - 1 }
}

/// Ranges of fewer references do not repay a second core.
const PARALLEL_MIN: usize = 4096;

/// Depth from which ranges are halved by count, which ends within 28 more levels.
pub(super) const HALVING_DEPTH: usize = DEPTH_MAX - 32;

/// Sorts `references` and fills `nodes`, which has the length of [`nodes_of`]. Ranges are halved from
/// `halving_depth` on, usually [`HALVING_DEPTH`].
pub(super) fn build<J: ForkJoin>(
    level: Level,
    references: &mut [Reference],
    nodes: &mut [BinaryNode],
    halving_depth: usize,
    join: &J,
) {
    let extent = Extent::of(references);
    Division { level, halving_depth, join }.subtree(references, nodes, &extent, 0);
}

/// Recursive division of ranges.
struct Division<'j, J> {
    level: Level,
    halving_depth: usize,
    join: &'j J,
}

impl<J: ForkJoin> Division<'_, J> {
    fn subtree(&self, references: &mut [Reference], nodes: &mut [BinaryNode], extent: &Extent, depth: usize) {
        let n = references.len();
        let Some((node, below)) = nodes.split_first_mut() else { return };
        *node = BinaryNode::new(&extent.boxes, n);
        if n < 2 {
            return;
        }
        let (mid, left, right) = if depth < self.halving_depth {
            divide(self.level, references, extent)
        } else {
            halve(references)
        };
        let (left_references, right_references) = references.split_at_mut(mid);
        let (left_nodes, right_nodes) = below.split_at_mut(nodes_of(mid).min(below.len()));
        let mut on_the_left = || self.subtree(left_references, left_nodes, &left, depth + 1);
        let mut on_the_right = || self.subtree(right_references, right_nodes, &right, depth + 1);
        if n < PARALLEL_MIN {
            on_the_left();
            on_the_right();
        } else {
            self.join.join(on_the_left, on_the_right);
        }
    }
}
