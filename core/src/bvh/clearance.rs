//! Clearance query: the surroundings of a point on a surface in one traversal. The query finds whether
//! anything rises above the tangent plane or overhangs the point, and where the surface continues. Rays
//! answer the same questions (`transport/photon_mapping/density.rs`) at ten times the cost.
//!
//! The answer is conservative: "nothing rises", "nothing overhangs" and "the surface continues" are certain;
//! the opposite answers are not, and rays may refute them.

use super::Bvh;
use super::layout::{Child, Node, WIDTH};
use super::leaf::corners_of;
use crate::geometry::Frame;
use glam::Vec3;

/// Number of points at which the query searches for the surface.
pub const POINTS: usize = 8;

/// Size of the traversal stack. If it overflows, the surroundings count as closed.
const STACK_SIZE: usize = 64;

/// An overhang has a plane at least `MIN_OVERHANG_HEIGHT` times the reach above the point, and the cosine of
/// its slope is at least `MIN_OVERHANG_COSINE`: at most sixty degrees. The planes of a surface that bends
/// upwards pass below.
const MIN_OVERHANG_HEIGHT: f32 = 0.01;
const MIN_OVERHANG_COSINE: f32 = 0.5;

/// Region and points of a clearance query.
#[derive(Clone, Copy, Debug)]
pub struct ClearanceQuery {
    /// Centre.
    pub place: Vec3,
    /// Frame whose z axis is the normal.
    pub frame: Frame,
    /// Half the edge of the axis-aligned cube that is searched.
    pub reach: f32,
    /// Points in the tangent plane relative to the centre, along the two tangents of the frame.
    pub points: [[f32; POINTS]; 2],
    /// Largest distance of the surface from the plane at a point, within the cube.
    pub depth: f32,
}

/// Result of a clearance query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clearance {
    /// True if something may rise above the plane.
    pub has_wall: bool,
    /// True if something may overhang the place. The query then ends early, and the other results are
    /// incomplete.
    pub has_overhang: bool,
    /// Bit i: the surface continues at point i.
    pub surface: u32,
}

impl Clearance {
    /// Nothing rises, and the surface continues at all points.
    pub const OPEN: Clearance =
        Clearance { has_wall: false, has_overhang: false, surface: (1 << POINTS) - 1 };
}

/// Visitor of the triangles in a box.
pub(crate) trait BoxVisitor {
    /// True if the triangles in a node, whose box is from the first to the second of its `corners`, matter.
    #[inline]
    fn enters(&self, _corners: &impl Fn() -> [Vec3; 2]) -> bool {
        true
    }

    /// Visits a triangle. Returns whether others are still of interest.
    fn visit(&mut self, corners: [Vec3; 3]) -> bool;
}

/// Visitor of a clearance query.
struct Surroundings<'q> {
    query: &'q ClearanceQuery,
    clearance: &'q mut Clearance,
}

impl BoxVisitor for Surroundings<'_> {
    #[inline]
    fn visit(&mut self, corners: [Vec3; 3]) -> bool {
        self.query.meet(corners, self.clearance);
        !self.clearance.has_overhang
    }
}

impl Bvh<'_> {
    /// Clearance around `query`.
    pub fn clearance(&self, query: &ClearanceQuery) -> Clearance {
        let (lo, hi) = (query.place - Vec3::splat(query.reach), query.place + Vec3::splat(query.reach));
        let mut clearance = Clearance { has_wall: false, has_overhang: false, surface: 0 };
        let mut surroundings = Surroundings { query, clearance: &mut clearance };
        if !self.overlapping(lo, hi, &mut surroundings) {
            (clearance.has_wall, clearance.has_overhang) = (true, true);
        }
        clearance
    }

    /// Passes the triangles of leaves that overlap the box from `lo` to `hi` to `visitor`. Returns `false` if
    /// the stack overflows, so that triangles are missing.
    #[inline(always)]
    pub(crate) fn overlapping(&self, lo: Vec3, hi: Vec3, visitor: &mut impl BoxVisitor) -> bool {
        let mut search = Search { bvh: self, visitor, goes_on: true, is_whole: true };
        search.below(self.root, [lo, hi]);
        search.is_whole
    }
}

/// Search of the triangles in a box.
struct Search<'s, 'm, V> {
    bvh: &'s Bvh<'m>,
    visitor: &'s mut V,
    /// False once no triangle is of interest.
    goes_on: bool,
    /// False once the stack has overflowed.
    is_whole: bool,
}

impl<V: BoxVisitor> Search<'_, '_, V> {
    /// Searches the tree below a node in world space.
    #[inline(always)]
    fn below(&mut self, root: Child, [lo, hi]: [Vec3; 2]) {
        let mut waiting = [0u32; STACK_SIZE];
        waiting[0] = root.0;
        let mut count = 1usize;
        while let Some(&index) = count.checked_sub(1).and_then(|last| waiting.get(last)) {
            count -= 1;
            let Some(node) = self.bvh.nodes.get(index as usize) else {
                self.below_entry(Child(index), [lo, hi]);
                if self.goes_on && self.is_whole { continue } else { break }
            };
            let mut met = overlapping(node, lo, hi);
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                let child = node.child(lane);
                met &= met - 1;
                if !self.visitor.enters(&|| node.corners(lane)) {
                    continue;
                }
                if child.is_leaf() {
                    self.leaf(child, |corners| corners.map(Vec3::from));
                } else if let Some(slot) = waiting.get_mut(count) {
                    *slot = child.0;
                    count += 1;
                } else {
                    self.is_whole = false;
                }
            }
            if !(self.goes_on && self.is_whole) {
                break;
            }
        }
    }

    /// Searches an instance. Its nodes are compared in the space of the prototype with a box around the box.
    #[inline(never)]
    fn below_entry(&mut self, entry: Child, [lo, hi]: [Vec3; 2]) {
        let Some(entry) = self.bvh.entry_of(entry) else { return };
        let (lo, hi) = entry.local_box(lo, hi);
        let mut waiting = [0u32; STACK_SIZE];
        waiting[0] = entry.root().0;
        let mut count = 1usize;
        while let Some(&index) = count.checked_sub(1).and_then(|last| waiting.get(last)) {
            count -= 1;
            let Some(node) = self.bvh.nodes.get(index as usize) else {
                if Child(index).is_leaf() {
                    self.leaf(Child(index), |corners| entry.corners(corners));
                }
                continue;
            };
            let mut met = overlapping(node, lo, hi);
            while met != 0 {
                let child = node.child(met.trailing_zeros() as usize);
                met &= met - 1;
                match waiting.get_mut(count) {
                    Some(slot) => {
                        *slot = child.0;
                        count += 1;
                    }
                    None => self.is_whole = false,
                }
            }
            if !(self.goes_on && self.is_whole) {
                break;
            }
        }
    }

    /// Visits the triangles of a leaf, whose corners `placed` brings into world space.
    #[inline(always)]
    fn leaf(&mut self, leaf: Child, placed: impl Fn([[f32; 3]; 3]) -> [Vec3; 3]) {
        let (first, of) = leaf.triangles();
        let runs = self.bvh.coordinates.get(9 * first..9 * (first + of)).unwrap_or(&[]);
        for i in 0..of {
            self.goes_on &= self.visitor.visit(placed(corners_of(runs, of, i)));
        }
    }
}

/// Mask of the children of a node that overlap the box from `lo` to `hi`.
#[inline]
fn overlapping(node: &Node, lo: Vec3, hi: Vec3) -> u32 {
    let mut inside = [1; WIDTH];
    for (axis, (lo, hi)) in lo.to_array().into_iter().zip(hi.to_array()).enumerate() {
        let (from, to) = (&node.rows[2 * axis], &node.rows[2 * axis + 1]);
        for ((inside, from), to) in inside.iter_mut().zip(from).zip(to) {
            *inside &= u32::from((*from <= hi) & (*to >= lo));
        }
    }
    bits(inside)
}

#[inline]
fn bits(lanes: [u32; 8]) -> u32 {
    lanes.iter().rev().fold(0, |bits, lane| bits << 1 | lane)
}

impl ClearanceQuery {
    /// Adds one triangle to the result.
    #[inline]
    fn meet(&self, corners: [Vec3; 3], clearance: &mut Clearance) {
        let [a, b, c] = corners;
        let from = a.min(b).min(c) - self.place;
        let to = a.max(b).max(c) - self.place;
        if from.max_element() > self.reach || to.min_element() < -self.reach {
            return;
        }
        let [a, b, c] = corners.map(|corner| self.frame.to_local(corner - self.place));
        // A NaN coordinate counts as rising.
        let is_low = |corner: Vec3| corner.z <= 0.0;
        if !(is_low(a) && is_low(b) && is_low(c)) {
            clearance.has_wall = true;
            let normal = (b - a).cross(c - a);
            let is_steep = normal.z.abs() < MIN_OVERHANG_COSINE * normal.length();
            let passes_below = normal.dot(a) / normal.z <= MIN_OVERHANG_HEIGHT * self.reach;
            clearance.has_overhang |= !(is_steep || passes_below);
            return;
        }
        // Twice the signed areas of a point with the sides, as linear functions of the point. They weight the
        // heights of the corners.
        let side = |from: Vec3, to: Vec3| [from.x * to.y - from.y * to.x, from.y - to.y, to.x - from.x];
        let sides = [side(b, c), side(c, a), side(a, b)];
        let mut surface = [0; POINTS];
        for ((surface, x), y) in surface.iter_mut().zip(&self.points[0]).zip(&self.points[1]) {
            let [u, v, w] = sides.map(|[at, along_x, along_y]| at + along_x * x + along_y * y);
            let inside = (u > 0.0) & (v > 0.0) & (w > 0.0) | (u < 0.0) & (v < 0.0) & (w < 0.0);
            let height = (u * a.z + v * b.z + w * c.z).abs();
            *surface = u32::from(inside & (height <= self.depth * (u + v + w).abs()));
        }
        clearance.surface |= bits(surface);
    }
}
