//! Upper level of the hierarchy: a tree over the boxes of instances and of the mesh in world space, each of
//! which is a leaf (Wald, Benthin, Slusallek 2003, "Distributed Interactive Ray Tracing of Dynamic Scenes").

use super::Bvh;
use super::binary::{self, BinaryNode, left_child, nodes_of, right_child};
use super::collapse::Output;
use super::fork_join::ForkJoin;
use super::instances::{ENTRIES_MAX, Entry, entry};
use super::layout::{Child, Node, SLACK, Tree, WIDTH};
use super::references::Reference;
use crate::Level;
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::{Instance, Mesh};
use glam::{Vec3, Vec4Swizzles};
use halflight_simd::kernels::shade::surface::ERROR_UNITS;

/// Ranges are halved from this depth on.
const HALVING_DEPTH: usize = 8;

/// Levels of a prototype's tree whose boxes bound an instance.
const LEVELS: usize = 2;

/// Numbers of nodes and entries that suffice; `None` if there are too many instances.
pub(super) fn room(mesh: &Mesh) -> Option<(usize, usize)> {
    let entries = mesh.instances.placed.len();
    (entries < ENTRIES_MAX).then_some((entries + 1, entries))
}

/// Working memory of the build.
pub(super) fn working_footprint(mesh: &Mesh) -> Footprint {
    let n = room(mesh).map_or(0, |(_, entries)| entries + 1);
    Footprint::default().slice::<Reference>(n).slice::<BinaryNode>(nodes_of(n))
}

/// Parts of the upper level.
pub(super) struct Top<'a, 'm> {
    pub mesh: &'a Mesh<'m>,
    /// Bits of the root of each prototype's tree.
    pub roots: &'a [u32],
    /// Tree of the mesh in world space.
    pub world: Option<&'a Tree>,
}

impl Top<'_, '_> {
    /// Builds the upper level after the used part of `out`. Returns its root, the bounds of all, and the
    /// number of entries used; `None` if there is nothing to hit.
    pub(super) fn build<J: ForkJoin>(
        &self,
        out: &mut Output,
        entries: &mut [Entry],
        working: &mut Arena,
        (level, join): (Level, &J),
    ) -> Result<Option<(Child, Bounds, usize)>, OutOfMemory> {
        let n = entries.len() + 1;
        let references = working.slice::<Reference>(n)?;
        let binary = working.slice::<BinaryNode>(nodes_of(n))?;
        let mut count = 0;
        for instance in self.mesh.instances.placed {
            let root = self.roots.get(instance.prototype() as usize).map_or(Child::NONE, |&bits| Child(bits));
            let Some(node) = out.nodes.get(root.0 as usize) else { continue };
            let bounds = bounds_of(out.nodes, node, instance, LEVELS);
            if let (Some(slot), Some(reference)) = (entries.get_mut(count), references.get_mut(count)) {
                *slot = Entry::new(instance, root);
                *reference = Reference::new(bounds, entry(count as u32).0);
                count += 1;
            }
        }
        let used = count;
        if let (Some(world), Some(reference)) = (self.world, references.get_mut(count)) {
            *reference = Reference::new(world.bounds, world.root.0);
            count += 1;
        }
        let (references, binary) = (&mut references[..count], &mut binary[..nodes_of(count)]);
        binary::build(level, references, binary, HALVING_DEPTH, join);
        let Some(all) = binary.first() else { return Ok(None) };
        let bounds = Bounds { min: all.lo.xyz(), max: all.hi.xyz() };
        let slack = bounds.min.abs().max(bounds.max.abs()).max_element() * SLACK;
        let root = Emitter { references, binary, slack }.node(0, 0, out);
        Ok(root.map(|root| (Child::node(root), bounds, used)))
    }
}

/// Bounds in world space of the boxes `levels` below `node`, wider by the error of the transforms.
fn bounds_of(nodes: &[Node], node: &Node, instance: &Instance, levels: usize) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for i in 0..WIDTH {
        let child = node.child(i);
        match nodes.get(child.0 as usize) {
            _ if child == Child::NONE => {}
            Some(below) if levels > 1 => {
                bounds = bounds.union(bounds_of(nodes, below, instance, levels - 1));
            }
            _ => bounds = bounds.union(placed_box(node.corners(i), instance)),
        }
    }
    bounds
}

/// Bounds of a placed box, wider by the error of the transforms.
fn placed_box(ends: [Vec3; 2], instance: &Instance) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for corner in 0..8usize {
        let local = [0, 1, 2].map(|axis| ends[corner >> axis & 1][axis]);
        let position = instance.position(local);
        let margin = instance.error([local; 3]) + ERROR_UNITS * position.abs().max_element();
        let margin = Vec3::splat(2.0 * margin);
        bounds = bounds.including(position - margin).including(position + margin);
    }
    bounds
}

/// Collapse of the binary tree into nodes of eight children, largest boxes first.
struct Emitter<'a> {
    references: &'a [Reference],
    binary: &'a [BinaryNode],
    slack: f32,
}

impl Emitter<'_> {
    /// Writes the node of binary node `index`, whose first reference is `first`, and its subtree.
    fn node(&self, index: usize, first: usize, out: &mut Output) -> Option<u32> {
        let at = out.used.0;
        *out.nodes.get_mut(at)? = Node::EMPTY;
        out.used.0 += 1;
        let (chosen, count) = self.children(index, first);
        for (slot, &(index, first)) in chosen.iter().take(count).enumerate() {
            let binary = self.binary.get(index)?;
            let child = match binary.count() {
                1 => Child(self.references.get(first)?.triangle()),
                _ => Child::node(self.node(index, first, out)?),
            };
            let (lo, hi) = (binary.lo.xyz() - self.slack, binary.hi.xyz() + self.slack);
            out.nodes.get_mut(at)?.set(slot, lo.to_array(), hi.to_array(), child);
        }
        out.nodes.get_mut(at)?.order();
        Some(at as u32)
    }

    /// Binary nodes that become children, with the index of their first reference, and their number.
    fn children(&self, index: usize, first: usize) -> ([(usize, usize); WIDTH], usize) {
        let (mut chosen, mut count) = ([(index, first); WIDTH], 1);
        while count < WIDTH {
            let area = |i: &usize| self.binary[chosen[*i].0].half_area();
            let divisible = (0..count).filter(|&i| self.binary[chosen[i].0].count() > 1);
            let Some(slot) = divisible.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            let (node, first) = chosen[slot];
            let left = left_child(node);
            chosen[slot] = (left, first);
            chosen[count] = (right_child(self.binary, node), first + self.binary[left].count());
            count += 1;
        }
        (chosen, count)
    }
}

impl Bvh<'_> {
    /// True if rays may enter instances.
    pub fn has_instances(&self) -> bool {
        !self.entries.is_empty()
    }
}
