//! Build of the light tree: splits by the surface area orientation heuristic (SAOH), three binary levels to a
//! node.

use super::importance::{GROUPS, LightBounds};
use super::{LEAF, LEVELS, Node, STACK_SIZE, Tree};
use crate::Level;
use crate::geometry::{Bounds, Cone};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bins of the split search on each axis.
const BINS: usize = 12;

/// Depth from which nodes are halved by count, so that no path exceeds the bits of a trail.
const DEPTH_OF_HALVING: u32 = 30;

/// Light to be put into a tree: working memory of the build.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(in crate::light) struct Item {
    min: [f32; 3],
    max: [f32; 3],
    cone: Cone,
    power: f32,
    light: u32,
}

impl Item {
    pub(in crate::light) fn new(bounds: &Bounds, cone: Cone, power: f32, light: u32) -> Self {
        Self { min: bounds.min.to_array(), max: bounds.max.to_array(), cone, power, light }
    }

    fn bounds(&self) -> Bounds {
        Bounds { min: self.min.into(), max: self.max.into() }
    }
}

impl<'m> Tree<'m> {
    /// Tree over `items`, which are reordered. Their `light`s are 0 … `items.len()` - 1, each once.
    pub(in crate::light) fn build(items: &mut [Item], nodes: &'m mut [Node], trails: &'m mut [u64]) -> Self {
        let whole = items.iter().fold(Sum::NONE, |sum, item| sum.and(Sum::of(item)));
        let whole = if items.is_empty() { LightBounds::default() } else { whole.group(items) };
        let mut stack = [Work::default(); STACK_SIZE];
        let mut waiting = usize::from(items.len() > 1);
        let mut free = waiting;
        stack[0] = Work { end: items.len(), ..Work::default() };
        while waiting > 0 {
            waiting -= 1;
            let work = stack[waiting];
            // Memory may be left over from an earlier use: groups without lights have no power.
            nodes[work.node] = Node::zeroed();
            for (lane, (start, end)) in work.parts(items).into_iter().enumerate() {
                let part = &items[start..end];
                if part.is_empty() {
                    continue;
                }
                let sum = part.iter().fold(Sum::NONE, |sum, item| sum.and(Sum::of(item)));
                let node = &mut nodes[work.node];
                node.groups.set(lane, &sum.group(part));
                let trail = work.trail | (lane as u64) << work.depth;
                if let [item] = part {
                    node.links[lane] = LEAF | item.light;
                    trails[item.light as usize] = trail;
                } else {
                    node.links[lane] = free as u32;
                    stack[waiting] = Work { start, end, node: free, depth: work.depth + LEVELS, trail };
                    waiting += 1;
                    free += 1;
                }
            }
        }
        Self { level: Level::BASELINE, whole, nodes, trails }
    }
}

/// Range of items that waits for its node.
#[derive(Clone, Copy, Default)]
struct Work {
    start: usize,
    end: usize,
    node: usize,
    /// Depth in the binary tree, which is the number of bits of the trail.
    depth: u32,
    trail: u64,
}

impl Work {
    /// Ranges after [`LEVELS`] binary splits. Bit i of a range's number is its side of split i.
    fn parts(&self, items: &mut [Item]) -> [(usize, usize); GROUPS] {
        let mut parts = [(0, 0); GROUPS];
        parts[0] = (self.start, self.end);
        for level in 0..LEVELS {
            let side = 1 << level;
            for i in 0..side {
                let (start, end) = parts[i];
                if end - start > 1 {
                    let part = &mut items[start..end];
                    let whole = part.iter().fold(Sum::NONE, |sum, item| sum.and(Sum::of(item)));
                    let middle = start + split(part, &whole, self.depth + level);
                    (parts[i], parts[i + side]) = ((start, middle), (middle, end));
                }
            }
        }
        parts
    }
}

/// Sum over some items.
#[derive(Clone, Copy)]
struct Sum {
    bounds: Bounds,
    /// Sum of axes times powers; a light that emits in all directions adds nothing.
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

    /// Light bounds of `items`, whose sum this is.
    fn group(&self, items: &[Item]) -> LightBounds {
        LightBounds::new(&self.bounds, self.cone(items), self.power)
    }

    /// Cone around the mean axis that contains the cones of all `items`.
    fn cone(&self, items: &[Item]) -> Cone {
        if let [item] = items {
            return item.cone;
        }
        let Some(axis) = (self.axis / self.power).try_normalize() else { return Cone::ALL };
        let cos = items.iter().fold(1f32, |cos, item| cos.min(item.cone.cos_around(axis)));
        // A margin for the rounding of axes.
        Cone { axis: axis.to_array(), cos: (cos - 1e-5).max(-1.0) }
    }

    /// Power times the measures of directions and space (M_Ω and M_A of eq. 1).
    fn cost(&self, unit: f32) -> f32 {
        // The mean of unit axes has length (1 + cos θ) / 2 if they fill a cone of half-angle θ.
        let cos = 2.0 * (self.axis.length() / self.power) - 1.0;
        // M_Ω of lights that emit into half-spaces: a quadratic through π, 2π + π²/2 and 4π at cosines of 1,
        // 0 and -1.
        let directions = 11.218 - (4.712 + 3.365 * cos) * cos;
        let e = self.bounds.extent() / unit;
        // Lights on a line or at a point have no area, but extent.
        let area = e.x * (e.y + e.z) + e.y * e.z + 1e-3 * e.length_squared();
        self.power * directions * area
    }
}

/// Partitions `items` and returns the size of the first part: the best of [`BINS`] planes on each axis by the
/// surface area orientation heuristic (SAOH, eq. 2 of the paper), or halves if no plane divides them.
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

/// Moves the items of which `first` holds to the front; returns their number.
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
