//! Stages of the BVH build in the caller's memory: references, binary tree, costs, wide tree.

use super::Bvh;
use super::binary::{self, BinaryNode, HALVING_DEPTH, nodes_of};
use super::collapse::{Costs, Emitter, Output, evaluate};
use super::fork_join::ForkJoin;
use super::instances::Entry;
use super::layout::{Child, LEAF_MAX, Node, SLACK, Tree};
use super::references::{self, Reference, capacity};
use super::top::{self, Top};
use crate::Level;
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::Mesh;
use glam::Vec4Swizzles;

/// Number of wide nodes that suffices for this number of references (see [`Emitter::frugal`]).
const fn nodes_max(references: usize) -> usize {
    references / 7 + 1
}

/// Floats that may be read beyond the last run of coordinates.
const PADDING: usize = LEAF_MAX;

pub(super) fn kept_footprint(triangles: usize) -> Footprint {
    let r = capacity(triangles);
    Footprint::default().slice::<Node>(nodes_max(r)).slice::<f32>(9 * r + PADDING).slice::<u32>(r)
}

pub(super) fn working_footprint(triangles: usize) -> Footprint {
    let r = capacity(triangles);
    Footprint::default().slice::<Reference>(r).slice::<BinaryNode>(nodes_of(r)).slice::<Costs>(nodes_of(r))
}

/// [`kept_footprint`] with the trees of prototypes and the boxes of instances.
pub(super) fn kept_footprint_of(mesh: &Mesh) -> Footprint {
    if mesh.instances.is_empty() {
        return kept_footprint(mesh.triangles.len());
    }
    let (mut nodes, mut references) = top::room(mesh).map_or((0, 0), |(nodes, _)| (nodes, 0));
    for part in parts(mesh) {
        let r = capacity(part.triangles.len());
        (nodes, references) = (nodes + nodes_max(r), references + r);
    }
    let entries = top::room(mesh).map_or(0, |(_, entries)| entries);
    let footprint = Footprint::default().slice::<Node>(nodes).slice::<f32>(9 * references + PADDING);
    footprint.slice::<u32>(references).slice::<Entry>(entries)
}

/// [`working_footprint`] of the largest tree of a mesh with instances.
pub(super) fn working_footprint_of(mesh: &Mesh) -> Footprint {
    if mesh.instances.is_empty() {
        return working_footprint(mesh.triangles.len());
    }
    let largest = parts(mesh).map(|part| part.triangles.len()).max().unwrap_or(0);
    let roots = Footprint::default().slice::<u32>(mesh.instances.prototypes.len());
    roots.and(working_footprint(largest).or(top::working_footprint(mesh)))
}

/// The mesh in world space, then the prototypes.
fn parts<'a>(mesh: &Mesh<'a>) -> impl Iterator<Item = Mesh<'a>> {
    let instances = mesh.instances;
    let prototypes = (0..instances.prototypes.len() as u32).map(move |number| instances.prototype(number));
    core::iter::once(*mesh).chain(prototypes)
}

pub(super) fn build<'m, J: ForkJoin>(
    mesh: &Mesh,
    arena: &mut Arena<'m>,
    level: Level,
    join: &J,
) -> Result<Bvh<'m>, OutOfMemory> {
    if !mesh.instances.is_empty() {
        return with_instances(mesh, arena, level, join);
    }
    let r = capacity(mesh.triangles.len());
    let nodes = arena.slice::<Node>(nodes_max(r))?;
    let coordinates = arena.slice::<f32>(9 * r + PADDING)?;
    let triangles = arena.slice::<u32>(r)?;
    let mut out = Output { nodes, coordinates, triangles, used: (0, 0) };
    let tree = tree(mesh, &mut out, HALVING_DEPTH, &mut arena.scratch(), (level, join))?;
    Ok(tree.map_or(EMPTY, |Tree { root, bounds, slack }| Bvh { root, bounds, slack, ..of_output(out) }))
}

/// A tree without triangles.
const EMPTY: Bvh = Bvh {
    nodes: &[],
    coordinates: &[],
    triangles: &[],
    entries: &[],
    root: Child::node(0),
    bounds: Bounds::EMPTY,
    slack: 0.0,
};

/// The used part of `out`.
fn of_output(out: Output) -> Bvh {
    let (nodes_used, triangles_used) = out.used;
    Bvh {
        nodes: &out.nodes[..nodes_used],
        coordinates: &out.coordinates[..9 * triangles_used + PADDING],
        triangles: &out.triangles[..triangles_used],
        ..EMPTY
    }
}

/// Builds the tree of `mesh` without its instances after the used part of `out`; `None` without triangles
/// that a ray can hit.
fn tree<J: ForkJoin>(
    mesh: &Mesh,
    out: &mut Output,
    halving_depth: usize,
    working: &mut Arena,
    (level, join): (Level, &J),
) -> Result<Option<Tree>, OutOfMemory> {
    let r = capacity(mesh.triangles.len());
    let references = working.slice::<Reference>(r)?;
    let count = references::collect(mesh, references);
    let references = &mut references[..count];
    let binary = &mut working.slice::<BinaryNode>(nodes_of(r))?[..nodes_of(count)];
    let costs = &mut working.slice::<Costs>(nodes_of(r))?[..nodes_of(count)];
    if count == 0 {
        return Ok(None);
    }

    binary::build(level, references, binary, halving_depth, join);
    evaluate(binary, costs);
    let bounds = Bounds { min: binary[0].lo.xyz(), max: binary[0].hi.xyz() };
    let slack = bounds.min.abs().max(bounds.max.abs()).max_element() * SLACK;
    let mut emitter = Emitter { mesh: *mesh, references, binary, costs, slack, frugal: false };
    // Nodes that later trees need are not for this one.
    let end = (out.used.0 + nodes_max(r)).min(out.nodes.len());
    let Output { nodes, coordinates, triangles, used } = out;
    let mut own = Output { nodes: &mut nodes[..end], coordinates, triangles, used: *used };
    let mut root = emitter.emit(&mut own);
    if root.is_none() {
        emitter.frugal = true;
        root = emitter.emit(&mut own);
    }
    *used = own.used;
    Ok(root.map(|root| Tree { root, bounds, slack }))
}

/// Ranges are halved from this depth on, so that both levels of the tree fit on the stack.
const HALVING_DEPTH_OF_PARTS: usize = HALVING_DEPTH / 2;

/// Trees of the mesh and of the prototypes, and that over the instances.
fn with_instances<'m, J: ForkJoin>(
    mesh: &Mesh,
    arena: &mut Arena<'m>,
    level: Level,
    join: &J,
) -> Result<Bvh<'m>, OutOfMemory> {
    let available = arena.available();
    let (of_top, entries) = top::room(mesh).ok_or(OutOfMemory { needed: usize::MAX, available })?;
    let (mut nodes, mut references) = (of_top, 0);
    for part in parts(mesh) {
        let r = capacity(part.triangles.len());
        (nodes, references) = (nodes + nodes_max(r), references + r);
    }
    if references > Child::REFERENCES_MAX {
        return Err(OutOfMemory { needed: usize::MAX, available });
    }
    let nodes = arena.slice::<Node>(nodes)?;
    let coordinates = arena.slice::<f32>(9 * references + PADDING)?;
    let triangles = arena.slice::<u32>(references)?;
    let entries = arena.slice::<Entry>(entries)?;
    let mut out = Output { nodes, coordinates, triangles, used: (0, 0) };
    let mut working = arena.scratch();
    let roots = working.slice::<u32>(mesh.instances.prototypes.len())?;
    let (mut world, mut slack) = (None, 0f32);
    for (number, part) in parts(mesh).enumerate() {
        let scratch = &mut working.scratch();
        let built = tree(&part, &mut out, HALVING_DEPTH_OF_PARTS, scratch, (level, join))?;
        slack = built.as_ref().map_or(slack, |tree| slack.max(tree.slack));
        match number.checked_sub(1).and_then(|prototype| roots.get_mut(prototype)) {
            Some(root) => *root = built.map_or(Child::NONE, |tree| tree.root).0,
            None => world = built,
        }
    }
    let top = Top { mesh, roots, world: world.as_ref() };
    let Some((root, bounds, used)) = top.build(&mut out, entries, &mut working, (level, join))? else {
        return Ok(EMPTY);
    };
    Ok(Bvh { entries: &entries[..used], root, bounds, slack, ..of_output(out) })
}
