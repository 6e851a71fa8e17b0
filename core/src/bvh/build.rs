//! Stages of the BVH build in the caller's memory: references, binary tree, costs, wide tree.

use super::Bvh;
use super::binary::{self, BinaryNode, nodes_of};
use super::collapse::{Costs, Emitter, Output, evaluate};
use super::fork_join::ForkJoin;
use super::layout::{LEAF_MAX, Node};
use super::references::{self, Reference, capacity};
use crate::Level;
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::Mesh;
use glam::Vec4Swizzles;

/// Number of wide nodes that suffices for this number of references (see [`Emitter::frugal`]).
const fn nodes_max(references: usize) -> usize {
    references / 7 + 1
}

/// Margin of the boxes in units of the largest coordinate: two units in its last place. A ray in the plane of
/// a face is then inside the box, and a part of a triangle is inside its box despite rounding.
const SLACK: f32 = 2.0 * f32::EPSILON;

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

pub(super) fn build<'m, J: ForkJoin>(
    mesh: &Mesh,
    arena: &mut Arena<'m>,
    level: Level,
    join: &J,
) -> Result<Bvh<'m>, OutOfMemory> {
    let r = capacity(mesh.triangles.len());
    let nodes = arena.slice::<Node>(nodes_max(r))?;
    let coordinates = arena.slice::<f32>(9 * r + PADDING)?;
    let triangles = arena.slice::<u32>(r)?;

    let mut working = arena.scratch();
    let references = working.slice::<Reference>(r)?;
    let count = references::collect(mesh, references);
    let references = &mut references[..count];
    let binary = &mut working.slice::<BinaryNode>(nodes_of(r))?[..nodes_of(count)];
    let costs = &mut working.slice::<Costs>(nodes_of(r))?[..nodes_of(count)];
    if count == 0 {
        return Ok(Bvh { nodes: &[], coordinates: &[], triangles: &[], bounds: Bounds::EMPTY, slack: 0.0 });
    }

    binary::build(level, references, binary, join);
    evaluate(binary, costs);
    let bounds = Bounds { min: binary[0].lo.xyz(), max: binary[0].hi.xyz() };
    let mut out = Output { nodes, coordinates, triangles, used: (0, 0) };
    let slack = bounds.min.abs().max(bounds.max.abs()).max_element() * SLACK;
    let mut emitter = Emitter { mesh: *mesh, references, binary, costs, slack, frugal: false };
    if !emitter.emit(&mut out) {
        emitter.frugal = true;
        emitter.emit(&mut out);
    }
    let (nodes_used, triangles_used) = out.used;
    Ok(Bvh {
        nodes: &out.nodes[..nodes_used],
        coordinates: &out.coordinates[..9 * triangles_used + PADDING],
        triangles: &out.triangles[..triangles_used],
        bounds,
        slack,
    })
}
