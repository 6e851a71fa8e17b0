//! Octree over the supports of records. Each record is linked from the cells that its box touches, at the
//! depth where cells are just larger than the box, or deeper if memory allows more links. A point finds all
//! records that reach it in one descent (Ward, Rubinstein and Clear 1988, section 3, with boxes in place of
//! spheres).
//!
//! Supports may shrink later but never grow: a descent then finds more records than reach a point, never
//! fewer.

use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Maximum number of points that descend together.
pub const POINTS: usize = 16;

/// Depth of the deepest level, with `1 << DEPTH` cells along a side.
const DEPTH: u32 = 16;

/// Maximum number of cells that a box no larger than a cell touches.
const CELLS: usize = 8;

/// Links of a record: from these cells, and from the cell of its centre.
const LINKS: usize = CELLS + 1;

/// Maximum number of levels that a record is linked deeper if memory allows; points then find fewer records
/// in vain.
const EXTRA_LEVELS: u32 = 2;

/// Maximum number of cells of such a record.
const MAX_CELLS: usize = 128;

/// Nodes per record. If nodes run out, records are linked higher up: they are found more often than
/// necessary, never less often.
const NODES_PER_RECORD: usize = 3;

/// Nodes for the first few records: one record makes a whole descent.
const FIRST_NODES: usize = 1 + CELLS * DEPTH as usize;

/// Column, row and layer from the lowest corner of the root.
type Cell = [u32; 3];

/// Children by octant, and the first links of two lists: of records that touch the cell, and of records with
/// their centre in it. 0 if there is none.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Node {
    children: [u32; 8],
    /// Index of a link plus one.
    first: u32,
    home: u32,
}

/// Record in a cell, and its successor in the list of that cell.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Link {
    record: u32,
    next: u32,
}

/// Action at records that several points find together.
pub(super) trait Visit {
    /// Called with a record and the bit set of points that find it.
    fn visit(&mut self, record: u32, points: u32);
}

/// Octree over the supports of records.
#[derive(Debug)]
pub(super) struct Octree<'m> {
    min: Vec3,
    /// Side of the root.
    size: f32,
    nodes: &'m mut [Node],
    used_nodes: usize,
    links: &'m mut [Link],
    used_links: usize,
}

impl<'m> Octree<'m> {
    /// Footprint of a tree of `records` records.
    pub(super) fn footprint(records: usize) -> Footprint {
        Footprint::default().slice::<Node>(nodes(records)).slice::<Link>(records.saturating_mul(LINKS))
    }

    /// Empty tree over `bounds`.
    pub(super) fn new(bounds: &Bounds, records: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let nodes = arena.slice(nodes(records))?;
        let links = arena.slice(records.saturating_mul(LINKS))?;
        let size = bounds.extent().max_element();
        let min = bounds.center() - 0.5 * size;
        let mut tree = Self { min, size, nodes, used_nodes: 1, links, used_links: 0 };
        tree.clear();
        Ok(tree)
    }

    /// Removes all records.
    pub(super) fn clear(&mut self) {
        if let Some(root) = self.nodes.first_mut() {
            *root = Node::default();
        }
        (self.used_nodes, self.used_links) = (1, 0);
    }

    /// Deepest cell of a point; for a point outside the root, the nearest cell.
    #[inline]
    fn cell(&self, point: Vec3) -> Cell {
        let scaled = (point - self.min) * ((1u32 << DEPTH) as f32 / self.size);
        // Casts turn negative floats and NaN into 0.
        scaled.to_array().map(|x| (x as u32).min((1 << DEPTH) - 1))
    }

    /// True if there is memory for the links of another record.
    pub(super) fn has_room(&self) -> bool {
        self.links.len() - self.used_links >= LINKS
    }

    /// Links `record`, whose support lies within `extent` of `center`, from all cells that it touches. The
    /// cells are larger than the box, or up to [`EXTRA_LEVELS`] levels deeper if links for `others` more
    /// records remain.
    pub(super) fn insert(&mut self, record: u32, center: Vec3, extent: Vec3, others: usize) {
        let (low, high) = (self.cell(center - extent), self.cell(center + extent));
        // Deepest level at which the box touches at most two cells along each side.
        let mut level = DEPTH;
        let touches = |level: u32, i: usize| (high[i] >> (DEPTH - level)) - (low[i] >> (DEPTH - level));
        while level > 0 && (0..3).any(|i| touches(level, i) > 1) {
            level -= 1;
        }
        let taken = self.used_links.saturating_add(others.saturating_mul(LINKS)).saturating_add(1);
        let spare = self.links.len().saturating_sub(taken);
        for finer in (level + 1..=DEPTH.min(level + EXTRA_LEVELS)).rev() {
            let cells = (0..3).map(|i| touches(finer, i) as usize + 1).product::<usize>();
            // Per level, the descent has at most as many nodes as there are cells.
            if cells <= spare.min(MAX_CELLS)
                && self.used_nodes + CELLS * level as usize + 2 * cells <= self.nodes.len()
            {
                level = finer;
                break;
            }
        }
        // If nodes may run out on the descent, use one link: two links on one descent would count twice.
        if self.used_nodes + CELLS * level as usize > self.nodes.len() {
            while level > 0 && (0..3).any(|i| touches(level, i) > 0) {
                level -= 1;
            }
        }
        let [first, home] = [low, self.cell(center)].map(|cell| cell.map(|i| i >> (DEPTH - level)));
        self.insert_at(record, home, level, |node| &mut node.home);
        for z in 0..=touches(level, 2) {
            for y in 0..=touches(level, 1) {
                for x in 0..=touches(level, 0) {
                    let cell = [first[0] + x, first[1] + y, first[2] + z];
                    self.insert_at(record, cell, level, |node| &mut node.first);
                }
            }
        }
    }

    fn insert_at(&mut self, record: u32, cell: Cell, level: u32, list: impl Fn(&mut Node) -> &mut u32) {
        let mut at = 0;
        for depth in (0..level).rev() {
            let Some(child) = self.nodes.get(at).and_then(|node| node.children.get(octant(cell, depth)))
            else {
                return;
            };
            let mut child = *child as usize;
            if child == 0 {
                let Some(node) = self.nodes.get_mut(self.used_nodes) else { break };
                *node = Node::default();
                child = self.used_nodes;
                self.used_nodes += 1;
                if let Some(slot) =
                    self.nodes.get_mut(at).and_then(|n| n.children.get_mut(octant(cell, depth)))
                {
                    *slot = child as u32;
                }
            }
            at = child;
        }
        let Some(node) = self.nodes.get_mut(at) else { return };
        if let Some(link) = self.links.get_mut(self.used_links) {
            let first = list(node);
            self.used_links += 1;
            *link = Link { record, next: *first };
            *first = self.used_links as u32;
        }
    }

    /// Calls `visit` once with each record whose box touches the cell of `point`, until it returns false.
    #[inline]
    pub(super) fn at(&self, point: Vec3, mut visit: impl FnMut(u32) -> bool) {
        let cell = self.cell(point);
        let mut node = self.nodes.first();
        let mut depth = DEPTH;
        while let Some(here) = node {
            let mut link = here.first;
            while let Some(entry) = (link as usize).checked_sub(1).and_then(|link| self.links.get(link)) {
                if !visit(entry.record) {
                    return;
                }
                link = entry.next;
            }
            if depth == 0 {
                return;
            }
            depth -= 1;
            let child = here.children.get(octant(cell, depth)).copied().unwrap_or(0);
            node = if child == 0 { None } else { self.nodes.get(child as usize) };
        }
    }

    /// Finds the records of [`Octree::at`] for the `wanted` ones (bit set) of sixteen points, in equal order;
    /// points in the same cells descend together.
    #[inline(always)]
    pub(super) fn at_all<V: Visit>(&self, points: &[[f32; POINTS]; 3], wanted: u32, visitor: &mut V) {
        let [x, y, z] = points;
        let mut cells = [[0; 3]; POINTS];
        for (cell, ((&x, &y), &z)) in cells.iter_mut().zip(x.iter().zip(y).zip(z)) {
            *cell = self.cell(Vec3::new(x, y, z));
        }
        // Disjoint groups of points, each with its node and depth.
        let mut open = [(0u32, DEPTH, 0u32); POINTS];
        open[0].2 = wanted;
        let mut count = usize::from(wanted != 0);
        while count > 0 {
            count -= 1;
            let Some(&(mut node, mut depth, group)) = open.get(count) else { return };
            let first = cells[group.trailing_zeros() as usize % POINTS];
            // Down to this depth the points are in the same cells.
            let mut different = 0;
            for (i, cell) in cells.iter().enumerate() {
                let here = (cell[0] ^ first[0]) | (cell[1] ^ first[1]) | (cell[2] ^ first[2]);
                different |= if group >> i & 1 == 1 { here } else { 0 };
            }
            let together = u32::BITS - different.leading_zeros();
            while let Some(here) = self.nodes.get(node as usize) {
                let mut link = here.first;
                while let Some(entry) = (link as usize).checked_sub(1).and_then(|link| self.links.get(link)) {
                    visitor.visit(entry.record, group);
                    link = entry.next;
                }
                if depth == 0 {
                    break;
                }
                depth -= 1;
                if depth >= together {
                    node = here.children.get(octant(first, depth)).copied().unwrap_or(0);
                    if node == 0 {
                        break;
                    }
                    continue;
                }
                let mut groups = [0u32; 8];
                for (i, &cell) in cells.iter().enumerate() {
                    groups[octant(cell, depth) & 7] |= group & 1 << i;
                }
                for (&child, group) in here.children.iter().zip(groups) {
                    if child != 0
                        && group != 0
                        && let Some(slot) = open.get_mut(count)
                    {
                        *slot = (child, depth, group);
                        count += 1;
                    }
                }
                break;
            }
        }
    }

    /// Calls `visit` once with each record whose centre lies in the box around `center`, and with some
    /// others.
    pub(super) fn around(&self, center: Vec3, extent: f32, mut visit: impl FnMut(u32)) {
        let (low, high) = (self.cell(center - extent), self.cell(center + extent));
        // Stack of nodes: index, level, cell. A level leaves at most seven.
        let mut open = [(0u32, 0u32, [0u32; 3]); 7 * DEPTH as usize + 1];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let Some(&(index, level, cell)) = open.get(count) else { return };
            let Some(node) = self.nodes.get(index as usize) else { continue };
            let mut link = node.home;
            while let Some(entry) = (link as usize).checked_sub(1).and_then(|link| self.links.get(link)) {
                visit(entry.record);
                link = entry.next;
            }
            if level == DEPTH {
                continue;
            }
            let shift = DEPTH - level - 1;
            for (i, &child) in node.children.iter().enumerate() {
                let far = corner(i as u32);
                let cell = [0, 1, 2].map(|i| 2 * cell[i] + far[i]);
                let touched = (0..3).all(|i| (low[i] >> shift..=high[i] >> shift).contains(&cell[i]));
                if child != 0
                    && touched
                    && let Some(slot) = open.get_mut(count)
                {
                    *slot = (child, level + 1, cell);
                    count += 1;
                }
            }
        }
    }
}

/// Number of nodes for `records` records.
fn nodes(records: usize) -> usize {
    if records == 0 { 0 } else { records.saturating_mul(NODES_PER_RECORD).saturating_add(FIRST_NODES) }
}

/// Octant of `cell` in its ancestor `depth` + 1 levels up.
#[inline]
fn octant([x, y, z]: Cell, depth: u32) -> usize {
    ((x >> depth & 1) | (y >> depth & 1) << 1 | (z >> depth & 1) << 2) as usize
}

/// Position of a child in its parent.
#[inline]
fn corner(child: u32) -> Cell {
    [child & 1, child >> 1 & 1, child >> 2 & 1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Line;
    use crate::sampling::Random;
    use std::vec;
    use std::vec::Vec;

    fn random_point(random: &Random, i: u32) -> Vec3 {
        Vec3::new(random.single(3 * i), random.single(3 * i + 1), random.single(3 * i + 2))
    }

    /// Boxes of very different sizes, some partly outside the root.
    fn boxes(count: u32) -> Vec<(Vec3, Vec3)> {
        let random = Random::new(1, 2);
        let size = |i| 0.7 * libm::powf(random.single(7_000_000 + i), 6.0);
        let extent = |i| (0.1 + random_point(&random, 1_000_000 + i)) * size(i);
        (0..count).map(|i| (random_point(&random, i), extent(i))).collect()
    }

    fn holds((center, extent): (Vec3, Vec3), point: Vec3) -> bool {
        (point - center).abs().cmple(extent).all()
    }

    /// Tree with memory for `capacity` records that receives all of `boxes`.
    fn with_tree(boxes: &[(Vec3, Vec3)], capacity: usize, nodes: usize, check: impl Fn(&Octree)) {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 0.9, 0.5) };
        let mut lines = vec![Line([0xff; 64]); Octree::footprint(capacity).bytes() / 64];
        let mut arena = Arena::over(&mut lines);
        let mut tree = Octree::new(&bounds, capacity, &mut arena).unwrap();
        assert_eq!(arena.available(), 0);
        let nodes = nodes.min(tree.nodes.len());
        tree.nodes = &mut core::mem::take(&mut tree.nodes)[..nodes];
        for (i, &(center, extent)) in boxes.iter().enumerate() {
            tree.insert(i as u32, center, extent, capacity - 1 - i);
        }
        check(&tree);
    }

    #[test]
    fn a_point_finds_every_box_that_holds_it_once_also_where_nodes_run_out() {
        let boxes = boxes(400);
        for nodes in [usize::MAX, 300, 9, 1] {
            with_tree(&boxes, 400, nodes, |tree| {
                let random = Random::new(3, 4);
                for i in 0..2000 {
                    let point = random_point(&random, i) * 1.2 - 0.1;
                    let mut found = Vec::new();
                    tree.at(point, |record| {
                        found.push(record);
                        true
                    });
                    let (length, mut once) = (found.len(), found.clone());
                    once.sort_unstable();
                    once.dedup();
                    assert_eq!(once.len(), length);
                    let wanted = (0..400).filter(|&i| holds(boxes[i as usize], point));
                    assert!(wanted.into_iter().all(|i| once.contains(&i)), "{point} with {nodes} nodes");
                }
            });
        }
    }

    #[test]
    fn a_region_finds_every_center_in_it_and_none_twice() {
        let boxes = boxes(400);
        for nodes in [usize::MAX, 300, 9, 1] {
            with_tree(&boxes, 400, nodes, |tree| {
                let random = Random::new(5, 6);
                for i in 0..500 {
                    let (center, extent) = (random_point(&random, i), 0.2 * random.single(9_000_000 + i));
                    let mut found = vec![0; 400];
                    tree.around(center, extent, |record| found[record as usize] += 1);
                    for (other, &(c, _)) in boxes.iter().enumerate() {
                        let lies = (c - center).abs().cmple(Vec3::splat(extent)).all();
                        assert!(found[other] <= 1 && (found[other] == 1 || !lies), "{other} at {center}");
                    }
                }
            });
        }
    }

    #[test]
    fn a_tree_without_records_or_extent_is_harmless() {
        with_tree(&[], 0, usize::MAX, |tree| tree.at(Vec3::splat(0.3), |_| panic!("nothing is there")));
        let mut lines = vec![Line([0; 64]); Octree::footprint(1).bytes() / 64];
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::ZERO };
        let mut tree = Octree::new(&bounds, 1, &mut Arena::over(&mut lines)).unwrap();
        tree.insert(0, Vec3::ZERO, Vec3::NAN, 0);
        let mut found = 0;
        tree.at(Vec3::NAN, |_| {
            found += 1;
            true
        });
        assert_eq!(found, 1);
    }
}
