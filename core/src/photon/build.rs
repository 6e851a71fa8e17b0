//! Build of the photon map in the memory of its photons. Selection brings the photons into the order of the
//! leaves, level by level (Bentley 1975, with leaves). Its split positions leave only the last leaf partly
//! full. Each leaf is then transposed from rows to columns in place, and the boxes are computed bottom-up.

use super::PhotonMap;
use super::layout::{LEAF, Leaf, Levels, Node, WIDTH};
use super::record::Photon;
use super::space::Space;
use crate::bvh::ForkJoin;
use core::cmp::Ordering;

/// Ranges of fewer photons do not repay a second core.
const PARALLEL_MIN: usize = 8192;

/// Builds over the first `count` photons of `leaves`. `nodes` has the length that [`Levels`] gives.
pub(super) fn build<'m, J: ForkJoin>(
    leaves: &'m mut [Leaf],
    count: usize,
    nodes: &'m mut [Node],
    join: &J,
) -> PhotonMap<'m> {
    let photons: &mut [Photon] = bytemuck::cast_slice_mut(leaves);
    let offered = count.min(photons.len());
    let (kept, space) = keep_finite(&mut photons[..offered]);
    let photons = &mut photons[..kept];
    let levels = Levels::of(kept.div_ceil(LEAF));
    if let Some(top) = levels.count.checked_sub(1) {
        order(photons, top, join);
    }

    let leaves = &mut leaves[..kept.div_ceil(LEAF)];
    let nodes = &mut nodes[..levels.nodes];
    next(leaves, kept, &mut nodes[..levels.at(1, 0).min(levels.nodes)], join);
    bound(nodes, &levels);
    PhotonMap { leaves, nodes, levels, count: kept, refused: offered - kept, space, least_remaining: 0 }
}

/// Moves the photons of finite places to the front, in units of the map. Returns their number.
fn keep_finite(photons: &mut [Photon]) -> (usize, Space) {
    let (mut kept, mut largest) = (0, 0.0f32);
    for i in 0..photons.len() {
        let position = photons[i].position();
        if position.is_finite() {
            largest = largest.max(position.abs().max_element());
            photons.swap(kept, i);
            kept += 1;
        }
    }
    let space = Space::of(largest);
    for photon in &mut photons[..kept] {
        let position = photon.position;
        photon.position = space.to_map(position);
    }
    (kept, space)
}

/// Orders the photons under a node of `level`.
fn order<J: ForkJoin>(photons: &mut [Photon], level: usize, join: &J) {
    let parallel = photons.len() >= PARALLEL_MIN;
    if parallel && join.is_over() {
        return;
    }
    let child = LEAF * WIDTH.pow(level as u32);
    if photons.len() > child {
        // All children except the last are full. The left half of the children goes left.
        let children = photons.len().div_ceil(child);
        let middle = children.div_ceil(2) * child;
        match widest_axis(photons) {
            0 => halve::<0>(photons, middle),
            1 => halve::<1>(photons, middle),
            _ => halve::<2>(photons, middle),
        }
        let (left, right) = photons.split_at_mut(middle);
        if parallel {
            join.join(|| order(left, level, join), || order(right, level, join));
        } else {
            order(left, level, join);
            order(right, level, join);
        }
    } else if let Some(below) = level.checked_sub(1) {
        order(photons, below, join);
    }
}

/// Moves the `middle` photons that come first along an axis to the front. Finite coordinates need no total
/// order of floats, which is slower.
fn halve<const AXIS: usize>(photons: &mut [Photon], middle: usize) {
    photons.select_nth_unstable_by(middle, |a, b| {
        let (a, b) = (a.position[AXIS], b.position[AXIS]);
        a.partial_cmp(&b).unwrap_or(Ordering::Equal)
    });
}

/// Axis of the largest extent.
fn widest_axis(photons: &[Photon]) -> usize {
    let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for photon in photons {
        let position = photon.position;
        for axis in 0..3 {
            lo[axis] = if position[axis] < lo[axis] { position[axis] } else { lo[axis] };
            hi[axis] = if position[axis] > hi[axis] { position[axis] } else { hi[axis] };
        }
    }
    let extent = [hi[0] - lo[0], hi[1] - lo[1], hi[2] - lo[2]];
    if extent[0] >= extent[1].max(extent[2]) {
        0
    } else if extent[1] >= extent[2] {
        1
    } else {
        2
    }
}

/// Transposes the leaves of `count` photons from rows to columns and writes their boxes into `nodes`, the
/// level above.
fn next<J: ForkJoin>(leaves: &mut [Leaf], count: usize, nodes: &mut [Node], join: &J) {
    if count > PARALLEL_MIN && join.is_over() {
        return;
    }
    if count > PARALLEL_MIN && nodes.len() > 1 {
        let half = nodes.len() / 2;
        let middle = half * WIDTH;
        let (left, right) = leaves.split_at_mut(middle);
        let (above_left, above_right) = nodes.split_at_mut(half);
        join.join(
            || next(left, middle * LEAF, above_left, join),
            || next(right, count - middle * LEAF, above_right, join),
        );
        return;
    }
    nodes.fill(Node::EMPTY);
    for (i, leaf) in leaves.iter_mut().enumerate() {
        let rows: [Photon; LEAF] = bytemuck::cast(*leaf);
        leaf.set(&rows[..LEAF.min(count - i * LEAF)]);
        let column = |axis: usize| leaf.position[axis].as_flattened().iter().filter(|x| x.is_finite());
        let lo = [0, 1, 2].map(|axis| column(axis).fold(f32::INFINITY, |a, &b| a.min(b)));
        let hi = [0, 1, 2].map(|axis| column(axis).fold(f32::NEG_INFINITY, |a, &b| a.max(b)));
        put(nodes, i, lo, hi);
    }
}

/// Computes the boxes of the levels above the lowest.
fn bound(nodes: &mut [Node], levels: &Levels) {
    for level in 1..levels.count {
        let (below, here) = nodes.split_at_mut(levels.at(level, 0));
        let here = &mut here[..levels.at(level + 1, 0) - levels.at(level, 0)];
        here.fill(Node::EMPTY);
        for (i, node) in below[levels.at(level - 1, 0)..].iter().enumerate() {
            let lo = [0, 1, 2].map(|axis| node.boxes[axis].iter().fold(f32::INFINITY, |a, &b| a.min(b)));
            let hi = [3, 4, 5].map(|row| node.boxes[row].iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b)));
            put(here, i, lo, hi);
        }
    }
}

/// Writes the box of child `i` of a level.
fn put(nodes: &mut [Node], i: usize, lo: [f32; 3], hi: [f32; 3]) {
    for axis in 0..3 {
        nodes[i / WIDTH].boxes[axis][i % WIDTH] = lo[axis];
        nodes[i / WIDTH].boxes[3 + axis][i % WIDTH] = hi[axis];
    }
}
