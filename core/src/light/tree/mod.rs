//! Light tree (Conty Estevez and Kulla 2018): chooses one of many lights by its importance at a point, in as
//! many steps as the tree is deep. Three levels of a binary tree make a node, so that eight groups are
//! evaluated at once.

mod build;
mod importance;

pub(super) use build::Item;

use crate::Level;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use halflight_simd::kernels::shade::choice::{ChoiceBlock, Choices, choose, ends};
use halflight_simd::kernels::shade::{self, BLOCK, Row, Row3};
use halflight_simd::{Kernel, Simd};
use importance::{GROUPS, LightBounds, LightBounds8};

/// Three levels of a binary tree: up to eight lights or nodes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Node {
    groups: LightBounds8,
    /// Index of each group's node, or [`LEAF`] and the light.
    links: [u32; GROUPS],
}

const LEAF: u32 = 1 << 31;

/// Levels of the binary tree in a node.
const LEVELS: u32 = GROUPS.trailing_zeros();

/// Largest number of nodes on the stack of a visit to all. A path has at most 21 nodes, by the bits of a
/// trail.
const STACK_SIZE: usize = 1 + (u64::BITS / LEVELS) as usize * (GROUPS - 1);

/// Tree over lights, built from [`Item`]s and indexed by their `light`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tree<'m> {
    level: Level,
    /// Bounds of all lights.
    whole: LightBounds,
    /// Empty if there is only one light.
    nodes: &'m [Node],
    /// Groups on the path from the first node to each light, [`LEVELS`] bits for each, the first one lowest.
    trails: &'m [u64],
}

impl<'m> Tree<'m> {
    pub(super) fn footprint(lights: usize) -> Footprint {
        Footprint::default().slice::<Node>(most_nodes(lights)).slice::<u64>(lights)
    }

    /// Slices that [`Tree::build`] fills.
    pub(super) fn memory(lights: usize, arena: &mut Arena<'m>) -> Result<Memory<'m>, OutOfMemory> {
        Ok((arena.slice(most_nodes(lights))?, arena.slice(lights)?))
    }

    /// Tree that chooses with the instructions of `level`.
    pub(super) fn with_level(self, level: Level) -> Self {
        Self { level, ..self }
    }

    /// Importance of all lights together.
    #[inline]
    pub(super) fn importance(&self, point: Vec3, normal: Vec3) -> f32 {
        self.whole.importance(point, normal)
    }

    /// Samples a light. Returns the light, its probability, and the remainder of `u` rescaled to [0, 1).
    /// `None` if no light can reach the point.
    #[inline]
    pub(super) fn sample(&self, point: Vec3, normal: Vec3, u: f32) -> Option<(u32, f32, f32)> {
        match self.trails.len() {
            0 => None,
            1 => Some((0, 1.0, u)),
            _ => self.level.dispatch(SampleKernel { nodes: self.nodes, point, normal, u }),
        }
    }

    /// [`Tree::sample`] for the vertices of a block in `active`.
    pub(super) fn sample_block(
        &self,
        (points, normals): (&Row3, &Row3),
        u: &Row,
        active: u32,
    ) -> ChosenBlock {
        match self.trails.len() {
            0 => ChosenBlock::NONE,
            1 => ChosenBlock { exists: active, probabilities: [1.0; BLOCK], ..ChosenBlock::NONE },
            _ => self.level.dispatch(BlockKernel { nodes: self.nodes, points, normals, u, active }),
        }
    }

    /// Probability that [`Tree::sample`] chooses `light`.
    #[inline]
    pub(super) fn pdf(&self, point: Vec3, normal: Vec3, light: u32) -> f32 {
        match self.trails.get(light as usize) {
            None => 0.0,
            Some(_) if self.nodes.is_empty() => 1.0,
            Some(&trail) => self.level.dispatch(PdfKernel { nodes: self.nodes, point, normal, trail }),
        }
    }

    /// Calls `each` with every light, without groups that `meets` rejects by the centre and the radius of
    /// their bounding sphere.
    pub(super) fn visit(&self, meets: impl Fn(Vec3, f32) -> bool, mut each: impl FnMut(u32)) {
        let (center, radius) = self.whole.sphere();
        if self.trails.is_empty() || !meets(center, radius) {
            return;
        }
        if self.nodes.is_empty() {
            return each(0);
        }
        let mut stack = [0u32; STACK_SIZE];
        let mut waiting = 1;
        while let Some(next) = usize::checked_sub(waiting, 1) {
            waiting = next;
            let Some(node) = stack.get(next).and_then(|node| self.nodes.get(*node as usize)) else { return };
            for (i, &link) in node.links.iter().enumerate() {
                if !node.groups.sphere(i).is_some_and(|(center, radius)| meets(center, radius)) {
                    continue;
                }
                if link & LEAF != 0 {
                    each(link & !LEAF);
                } else if let Some(slot) = stack.get_mut(waiting) {
                    *slot = link;
                    waiting += 1;
                }
            }
        }
    }
}

/// Largest number of nodes of a tree. A node with c nodes below it has b of the n - 1 branchings: at least 1
/// if c is 0, 3 if it is 2, and 4, 6 and 7 if it is 4, 6 and 8, so that 4 b >= 4 + 3 c. All w nodes except
/// the first are below another, so that the sum over all nodes is 4 (n - 1) >= 4 w + 3 (w - 1).
fn most_nodes(lights: usize) -> usize {
    lights.checked_sub(1).map_or(0, |branchings| (branchings.saturating_mul(4).saturating_add(3)) / 7)
}

/// Kernel of [`Tree::sample`].
struct SampleKernel<'t> {
    nodes: &'t [Node],
    point: Vec3,
    normal: Vec3,
    u: f32,
}

impl Kernel for SampleKernel<'_> {
    type Out = Option<(u32, f32, f32)>;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Out {
        let Self { nodes, point, normal, mut u } = self;
        let mut node = nodes.first()?;
        let mut probability = 1.0;
        loop {
            let (link, share, rest) = step(simd, node, point, normal, u)?;
            (u, probability) = (rest, probability * share);
            if link & LEAF != 0 {
                return Some((link & !LEAF, probability, u));
            }
            node = nodes.get(link as usize)?;
        }
    }
}

/// Chooses a group of `node` by `u`. Returns its link, its probability, and the remainder of `u` rescaled to
/// [0, 1).
#[inline(always)]
fn step<S: Simd>(simd: S, node: &Node, point: Vec3, normal: Vec3, u: f32) -> Option<(u32, f32, f32)> {
    let chosen = choose(node.groups.importance(simd, point, normal), u);
    chosen.exists.then(|| (node.links[chosen.group as usize % GROUPS], chosen.probability, chosen.rest))
}

/// Lights chosen for a block of vertices.
pub(crate) struct ChosenBlock {
    pub(super) lights: [u32; BLOCK],
    pub(super) probabilities: Row,
    /// Bit `i`: a light may reach vertex `i`.
    pub(crate) exists: u32,
}

impl ChosenBlock {
    const NONE: Self = Self { lights: [0; BLOCK], probabilities: [0.0; BLOCK], exists: 0 };
}

/// Kernel of [`Tree::sample_block`]. All vertices descend level by level, so that the latencies of their
/// steps overlap: groups are weighed vertex by vertex, and chosen for all vertices together.
struct BlockKernel<'t> {
    nodes: &'t [Node],
    points: &'t Row3,
    normals: &'t Row3,
    u: &'t Row,
    active: u32,
}

impl Kernel for BlockKernel<'_> {
    type Out = ChosenBlock;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> ChosenBlock {
        let Self { nodes, points, normals, u, active } = self;
        let mut at = [0u32; BLOCK];
        let mut weights = [[0.0; GROUPS]; BLOCK];
        let mut step = ChoiceBlock { rest: *u, ..ChoiceBlock::EMPTY };
        let mut chosen = ChosenBlock { probabilities: [1.0; BLOCK], ..ChosenBlock::NONE };
        let mut descending = active;
        while descending != 0 {
            let mut left = descending;
            while left != 0 {
                let i = left.trailing_zeros() as usize % BLOCK;
                left &= left - 1;
                let (point, normal) = (shade::at(points, i).into(), shade::at(normals, i).into());
                let Some(node) = nodes.get(at[i] as usize) else {
                    descending &= !(1 << i);
                    continue;
                };
                weights[i] = node.groups.importance(simd, point, normal);
            }
            let u = step.rest;
            Choices { weights: &weights, u: &u }.in_lanes(simd, &mut step);
            descending &= step.exists;
            let mut left = descending;
            while left != 0 {
                let i = left.trailing_zeros() as usize % BLOCK;
                left &= left - 1;
                let Some(node) = nodes.get(at[i] as usize) else { continue };
                let link = node.links[step.group[i] as usize % GROUPS];
                at[i] = link;
                chosen.probabilities[i] *= step.probability[i];
                if link & LEAF != 0 {
                    chosen.lights[i] = link & !LEAF;
                    chosen.exists |= 1 << i;
                    descending &= !(1 << i);
                }
            }
        }
        chosen
    }
}

/// Kernel of [`Tree::pdf`].
struct PdfKernel<'t> {
    nodes: &'t [Node],
    point: Vec3,
    normal: Vec3,
    trail: u64,
}

impl Kernel for PdfKernel<'_> {
    type Out = f32;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Out {
        let Self { nodes, point, normal, mut trail } = self;
        let (mut node, mut probability) = (nodes.first(), 1.0);
        while let Some(Node { groups, links }) = node {
            let weights = groups.importance(simd, point, normal);
            let i = trail as usize % GROUPS;
            if weights[i] <= 0.0 {
                return 0.0;
            }
            probability *= weights[i] / ends(weights)[GROUPS - 1];
            if links[i] & LEAF != 0 {
                return probability;
            }
            node = nodes.get(links[i] as usize);
            trail >>= LEVELS;
        }
        0.0
    }
}

/// Nodes and trails for a tree to be built.
pub(super) type Memory<'m> = (&'m mut [Node], &'m mut [u64]);

#[cfg(test)]
mod tests;
