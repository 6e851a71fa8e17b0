//! The light tree: groups of lights in a binary tree, so that one of very many is chosen by what it can do
//! for a point, in as many steps as the tree is deep (Conty Estevez and Kulla 2018).

use super::bounds::{Cone, Group};
use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::ONE_MINUS_EPSILON;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bins of the split search, for each axis.
const BINS: usize = 12;

/// From this depth on nodes are halved by count, so that no path is longer than the bits of a trail.
const DEPTH_OF_HALVING: u32 = 30;

/// A leaf or the parent of two neighbours.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Node {
    group: Group,
    /// The first child, or [`LEAF`] and the light.
    link: u32,
}

const LEAF: u32 = 1 << 31;

/// A light that is to go into a tree: scratch memory of the build.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Item {
    min: [f32; 3],
    max: [f32; 3],
    cone: Cone,
    power: f32,
    light: u32,
}

impl Item {
    pub(super) fn new(bounds: &Bounds, cone: Cone, power: f32, light: u32) -> Self {
        Self { min: bounds.min.to_array(), max: bounds.max.to_array(), cone, power, light }
    }

    fn bounds(&self) -> Bounds {
        Bounds { min: self.min.into(), max: self.max.into() }
    }
}

/// A binary tree over lights. Built from [`Item`]s; a light is its `light` number there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tree<'m> {
    nodes: &'m [Node],
    /// For each light the turns from the root to its leaf, the first one lowest.
    trails: &'m [u64],
}

impl<'m> Tree<'m> {
    pub(super) fn footprint(lights: usize) -> Footprint {
        Footprint::default().slice::<Node>((2 * lights).saturating_sub(1)).slice::<u64>(lights)
    }

    /// Over `items`, whose order changes. Their `light`s are 0 … `items.len()` - 1, each once.
    pub(super) fn build(items: &mut [Item], nodes: &'m mut [Node], trails: &'m mut [u64]) -> Self {
        let mut stack = [Work::default(); 64];
        let mut waiting = 1;
        let mut free = 1;
        stack[0] = Work { end: items.len(), ..Work::default() };
        while waiting > 0 && !items.is_empty() {
            waiting -= 1;
            let work = stack[waiting];
            let part = &mut items[work.start..work.end];
            let whole = part.iter().fold(Sum::NONE, |sum, item| sum.and(Sum::of(item)));
            let group = Group::new(&whole.bounds, whole.cone(part), whole.power);
            if let [item] = part {
                nodes[work.node] = Node { group, link: LEAF | item.light };
                trails[item.light as usize] = work.trail;
                continue;
            }
            let middle = work.start + split(part, &whole, work.depth);
            nodes[work.node] = Node { group, link: free as u32 };
            let child = |start, end, right: usize| Work {
                start,
                end,
                node: free + right,
                depth: work.depth + 1,
                trail: work.trail | (right as u64) << work.depth,
            };
            stack[waiting] = child(middle, work.end, 1);
            stack[waiting + 1] = child(work.start, middle, 0);
            waiting += 2;
            free += 2;
        }
        Self { nodes, trails }
    }

    /// The slices that [`Tree::build`] fills.
    pub(super) fn memory(lights: usize, arena: &mut Arena<'m>) -> Result<Memory<'m>, OutOfMemory> {
        Ok((arena.slice((2 * lights).saturating_sub(1))?, arena.slice(lights)?))
    }

    /// The estimate of what all lights together can do.
    #[inline]
    pub(super) fn importance(&self, point: Vec3, normal: Vec3) -> f32 {
        self.nodes.first().map_or(0.0, |root| root.group.importance(point, normal))
    }

    /// A light, its probability, and what is left of `u`, a number in [0, 1) again. `None` where no light
    /// can reach the point.
    #[inline]
    pub(super) fn sample(&self, point: Vec3, normal: Vec3, mut u: f32) -> Option<(u32, f32, f32)> {
        let mut node = self.nodes.first()?;
        let mut probability = 1.0;
        while node.link & LEAF == 0 {
            let (left, right, share) = self.children(node, point, normal)?;
            if u < share {
                u /= share;
                probability *= share;
                node = left;
            } else {
                u = (u - share) / (1.0 - share);
                probability *= 1.0 - share;
                node = right;
            }
            u = u.min(ONE_MINUS_EPSILON);
        }
        Some((node.link & !LEAF, probability, u))
    }

    /// The probability with which [`Tree::sample`] finds `light`.
    #[inline]
    pub(super) fn pdf(&self, point: Vec3, normal: Vec3, light: u32) -> f32 {
        let (Some(mut node), Some(&trail)) = (self.nodes.first(), self.trails.get(light as usize)) else {
            return 0.0;
        };
        let mut trail = trail;
        let mut probability = 1.0;
        while node.link & LEAF == 0 {
            let Some((left, right, share)) = self.children(node, point, normal) else { return 0.0 };
            if trail & 1 == 0 {
                probability *= share;
                node = left;
            } else {
                probability *= 1.0 - share;
                node = right;
            }
            trail >>= 1;
        }
        probability
    }

    /// Every light of a group that `meets` does not rule out, by the centre and the radius of a sphere around it.
    pub(super) fn visit(&self, meets: impl Fn(Vec3, f32) -> bool, mut each: impl FnMut(u32)) {
        // As deep as the tree, as both children of a node are taken at once.
        let mut stack = [0; 65];
        let mut waiting = usize::from(!self.nodes.is_empty());
        while let Some(next) = waiting.checked_sub(1) {
            waiting = next;
            let Some(node) = stack.get(next).and_then(|node| self.nodes.get(*node)) else { return };
            let (center, radius) = node.group.sphere();
            if !meets(center, radius) {
                continue;
            }
            if node.link & LEAF != 0 {
                each(node.link & !LEAF);
            } else if let Some(free) = stack.get_mut(next..next + 2) {
                free.copy_from_slice(&[node.link as usize, node.link as usize + 1]);
                waiting += 2;
            }
        }
    }

    /// Both children of an inner node, and the probability of the left one. `None` where neither can reach.
    #[inline]
    fn children(&self, node: &Node, point: Vec3, normal: Vec3) -> Option<(&'m Node, &'m Node, f32)> {
        let first = node.link as usize;
        let [left, right] = self.nodes.get(first..first + 2)? else { return None };
        let (l, r) = (left.group.importance(point, normal), right.group.importance(point, normal));
        if l + r > 0.0 { Some((left, right, l / (l + r))) } else { None }
    }
}

/// Nodes and trails of a tree that is about to be built.
pub(super) type Memory<'m> = (&'m mut [Node], &'m mut [u64]);

/// A range of items that waits for its node.
#[derive(Clone, Copy, Default)]
struct Work {
    start: usize,
    end: usize,
    node: usize,
    depth: u32,
    trail: u64,
}

/// Some items together.
#[derive(Clone, Copy)]
struct Sum {
    bounds: Bounds,
    /// Axes times powers; a light that shines everywhere adds nothing.
    axis: Vec3,
    power: f32,
    count: usize,
}

impl Sum {
    const NONE: Sum = Sum { bounds: Bounds::EMPTY, axis: Vec3::ZERO, power: 0.0, count: 0 };

    fn of(item: &Item) -> Self {
        let axis = if item.cone.cos > -1.0 { Vec3::from(item.cone.axis) * item.power } else { Vec3::ZERO };
        Self { bounds: item.bounds(), axis, power: item.power, count: 1 }
    }

    fn and(self, other: Sum) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            axis: self.axis + other.axis,
            power: self.power + other.power,
            count: self.count + other.count,
        }
    }

    /// A cone around the mean axis that holds those of all `items`.
    fn cone(&self, items: &[Item]) -> Cone {
        if let [item] = items {
            return item.cone;
        }
        let Some(axis) = (self.axis / self.power).try_normalize() else { return Cone::ALL };
        let cos = items.iter().fold(1f32, |cos, item| cos.min(item.cone.cos_around(axis)));
        // A little wider, against the rounding of axes.
        Cone { axis: axis.to_array(), cos: (cos - 1e-5).max(-1.0) }
    }

    /// Power times the measures of directions and space (M_Ω and M_A of eq. 1).
    fn cost(&self, unit: f32) -> f32 {
        // The mean of unit axes has the length (1 + cos θ) / 2 where they fill a cone of half-angle θ.
        let cos = 2.0 * (self.axis.length() / self.power) - 1.0;
        // M_Ω for lights that shine into half-spaces: a quadratic through π, 2π + π²/2 and 4π at cosines
        // of 1, 0 and -1.
        let directions = 11.218 - (4.712 + 3.365 * cos) * cos;
        let e = self.bounds.extent() / unit;
        // Lines and points of lights have no area and still a size.
        let area = e.x * (e.y + e.z) + e.y * e.z + 1e-3 * e.length_squared();
        self.power * directions * area
    }
}

/// Orders `items` into two parts and returns the size of the first: the best of [`BINS`] planes for each
/// axis by the surface area orientation heuristic (SAOH, eq. 2 of the paper), or halves where none divides.
fn split(items: &mut [Item], whole: &Sum, depth: u32) -> usize {
    let half = items.len() / 2;
    let extent = whole.bounds.extent();
    let longest = extent.max_element();
    if depth < DEPTH_OF_HALVING && longest > 0.0 {
        let mut best = (f32::INFINITY, 0, 0);
        for axis in 0..3 {
            if extent[axis] <= 0.0 {
                continue;
            }
            let mut bins = [Sum::NONE; BINS];
            for item in items.iter() {
                let bin = &mut bins[bin_of(item, &whole.bounds, axis)];
                *bin = bin.and(Sum::of(item));
            }
            let mut above = [Sum::NONE; BINS];
            for i in (0..BINS - 1).rev() {
                above[i] = above[i + 1].and(bins[i + 1]);
            }
            let mut below = Sum::NONE;
            for i in 0..BINS - 1 {
                below = below.and(bins[i]);
                if below.count > 0 && above[i].count > 0 {
                    let cost = (below.cost(longest) + above[i].cost(longest)) * (longest / extent[axis]);
                    if cost < best.0 {
                        best = (cost, axis, i);
                    }
                }
            }
        }
        if best.0 < f32::INFINITY {
            let middle = partition(items, |item| bin_of(item, &whole.bounds, best.1) <= best.2);
            if middle > 0 && middle < items.len() {
                return middle;
            }
        }
    }
    let axis = (0..3).fold(0, |best, axis| if extent[axis] > extent[best] { axis } else { best });
    items.select_nth_unstable_by(half, |a, b| {
        let center = |item: &Item| item.min[axis] + item.max[axis];
        center(a).total_cmp(&center(b)).then(a.light.cmp(&b.light))
    });
    half
}

fn bin_of(item: &Item, bounds: &Bounds, axis: usize) -> usize {
    let center = 0.5 * (item.min[axis] + item.max[axis]);
    let place = (center - bounds.min[axis]) / (bounds.max[axis] - bounds.min[axis]);
    ((place * BINS as f32) as usize).min(BINS - 1)
}

/// Those of which `first` holds to the front; how many they are.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}
