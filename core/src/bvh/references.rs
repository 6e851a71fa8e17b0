//! References of the build: boxes of triangles, or of parts of large triangles (Karras, Aila 2013).

use super::layout::Child;
use crate::geometry::Bounds;
use crate::scene::Mesh;
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// Box of a triangle or of a part of it. `lo.w` holds the bits of the triangle's index, `hi.w` the priority
/// of splitting it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Reference {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl Reference {
    pub(super) fn new(bounds: Bounds, triangle: u32) -> Self {
        Self { lo: bounds.min.extend(f32::from_bits(triangle)), hi: bounds.max.extend(0.0) }
    }

    pub(super) fn triangle(&self) -> u32 {
        self.lo.w.to_bits()
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds { min: self.lo.xyz(), max: self.hi.xyz() }
    }
}

/// One part of a split triangle is allowed for every `SPLIT_SHARE` triangles.
const SPLIT_SHARE: usize = 3;

/// Largest number of references to this number of triangles.
pub(super) fn capacity(triangles: usize) -> usize {
    triangles.saturating_add(triangles / SPLIT_SHARE).min(Child::REFERENCES_MAX)
}

/// Corners of a triangle that a ray can hit: finite, and not collinear. A triangle without area has signed
/// areas of mere rounding, so that a ray might meet it anywhere.
pub(super) fn hittable(mesh: &Mesh, triangle: u32) -> Option<[Vec3; 3]> {
    let [a, b, c] = mesh.corners(triangle);
    let finite = a.is_finite() && b.is_finite() && c.is_finite();
    (finite && has_area([a, b, c])).then_some([a, b, c])
}

/// True if the corners span a plane. In f64, which is exact for coordinates of 24 bits on one grid.
fn has_area([a, b, c]: [Vec3; 3]) -> bool {
    let [p, q] = [b, c].map(|corner| core::array::from_fn(|i| f64::from(corner[i]) - f64::from(a[i])));
    let [p, q]: [[f64; 3]; 2] = [p, q];
    (0..3).any(|i| p[i] * q[(i + 1) % 3] != p[(i + 1) % 3] * q[i])
}

/// Fills `references` with the hittable triangles, and the room that is left with parts of the largest.
/// Returns their number.
///
/// The choice of triangles follows Karras, Aila 2013, "Fast Parallel Construction of High-Quality Bounding
/// Volume Hierarchies", section 4.3: those much smaller than their box that cross the planes at which the
/// hierarchy will divide space early.
pub(super) fn collect(mesh: &Mesh, references: &mut [Reference]) -> usize {
    let mut count = 0;
    let mut scene = Bounds::EMPTY;
    for triangle in 0..mesh.triangles.len() as u32 {
        if let (Some(corners), Some(slot)) = (hittable(mesh, triangle), references.get_mut(count)) {
            let bounds = Bounds::around(corners);
            scene = scene.union(bounds);
            *slot = Reference::new(bounds, triangle);
            count += 1;
        }
    }
    let spare = (count / SPLIT_SHARE).min(references.len() - count);
    count + split_large(mesh, scene, references, count, spare)
}

/// Splits the largest triangles into the `spare` references after the first `count`. Returns the number of
/// new references.
fn split_large(
    mesh: &Mesh,
    scene: Bounds,
    references: &mut [Reference],
    count: usize,
    spare: usize,
) -> usize {
    let grid = Grid::new(scene);
    let mut total = 0.0;
    for r in &mut references[..count] {
        r.hi.w = priority(mesh, &grid, r);
        total += r.hi.w;
    }
    if !(total > 0.0 && total.is_finite()) || spare == 0 {
        return 0;
    }
    // Bisection over a factor of two for the largest scale whose rounded-down shares still fit.
    let shares = |scale: f32| -> usize {
        references[..count].iter().map(|r| share(scale, r.hi.w)).fold(0, usize::saturating_add)
    };
    let (mut low, mut high) = (spare as f32 / total, 2.0 * spare as f32 / total);
    for _ in 0..4 {
        let middle = 0.5 * (low + high);
        if shares(middle) <= spare { low = middle } else { high = middle }
    }

    let mut free = count;
    for i in 0..count {
        let r = references[i];
        let cuts = share(low, r.hi.w).min(count + spare - free);
        if cuts > 0 {
            let corners = mesh.corners(r.triangle());
            free = cut(&grid, corners, r.bounds(), r.triangle(), cuts, i, free, references);
        }
    }
    free - count
}

/// Largest number of splits of one triangle.
const CUTS_MAX: usize = 31;

fn share(scale: f32, priority: f32) -> usize {
    ((scale * priority) as usize).min(CUTS_MAX)
}

/// Replaces reference `slot` by `cuts + 1` parts of the box `bounds` of a triangle. The new parts go to
/// `free` and after. Returns the next free index.
#[allow(clippy::too_many_arguments)]
fn cut(
    grid: &Grid,
    corners: [Vec3; 3],
    bounds: Bounds,
    triangle: u32,
    cuts: usize,
    slot: usize,
    free: usize,
    references: &mut [Reference],
) -> usize {
    let whole = Reference::new(bounds, triangle);
    let Some((axis, plane)) = (if cuts == 0 { None } else { grid.dividing_plane(bounds) }) else {
        references[slot] = whole;
        return free;
    };
    let (left, right) = divide(corners, bounds, axis, plane);
    if left.is_empty() || right.is_empty() {
        references[slot] = whole;
        return free;
    }
    let (wl, wr) = (left.extent().max_element(), right.extent().max_element());
    let rest = cuts - 1;
    let left_cuts = ((rest as f32 * wl / (wl + wr) + 0.5) as usize).min(rest);
    let next = cut(grid, corners, left, triangle, left_cuts, slot, free + 1, references);
    cut(grid, corners, right, triangle, rest - left_cuts, free, next, references)
}

/// Boxes of the parts of a triangle inside `bounds` on either side of a plane.
pub(super) fn divide(corners: [Vec3; 3], bounds: Bounds, axis: usize, plane: f32) -> (Bounds, Bounds) {
    let (mut left, mut right) = (Bounds::EMPTY, Bounds::EMPTY);
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        let (a, b) = (p[axis], q[axis]);
        if a <= plane {
            left = left.including(p);
        }
        if a >= plane {
            right = right.including(p);
        }
        if (a < plane && b > plane) || (a > plane && b < plane) {
            // Both directions of the edge interpolate alike, and the point lies exactly on the plane.
            let (p, q, a, b) = if a < b { (p, q, a, b) } else { (q, p, b, a) };
            let mut x = p.lerp(q, ((plane - a) / (b - a)).clamp(0.0, 1.0));
            x[axis] = plane;
            // Rounding of the weight and of the sum moves the point off the edge: the box is widened by both.
            let slack = (p.abs().max(q.abs())) * (4.0 * f32::EPSILON);
            left = left.union(Bounds { min: x - slack, max: x + slack });
            right = right.union(Bounds { min: x - slack, max: x + slack });
        }
    }
    left.max[axis] = left.max[axis].min(plane);
    right.min[axis] = right.min[axis].max(plane);
    let inside = |b: Bounds| Bounds { min: b.min.max(bounds.min), max: b.max.min(bounds.max) };
    (inside(left), inside(right))
}

/// Planes of a midpoint octree over the scene.
struct Grid {
    origin: Vec3,
    to_cells: Vec3,
    to_world: Vec3,
}

/// Levels of the octree.
const LEVELS: u32 = 20;

impl Grid {
    fn new(scene: Bounds) -> Self {
        let extent = scene.extent();
        let cells = (1u32 << LEVELS) as f32;
        let safe = Vec3::select(extent.cmpgt(Vec3::ZERO), extent, Vec3::ONE);
        Self { origin: scene.min, to_cells: cells / safe, to_world: safe / cells }
    }

    /// Axis and coordinate of the highest plane of the octree that crosses the box; among equals the one
    /// across the longest edge.
    fn dividing_plane(&self, bounds: Bounds) -> Option<(usize, f32)> {
        let (level, axis, cell) = self.crossing(bounds)?;
        let plane = self.origin[axis] + (cell >> level << level) as f32 * self.to_world[axis];
        (plane > bounds.min[axis] && plane < bounds.max[axis]).then_some((axis, plane))
    }

    /// Level of the highest plane that crosses the box (`LEVELS - 1` is the middle of the scene), its axis,
    /// and the cell of the box's maximum.
    fn crossing(&self, bounds: Bounds) -> Option<(u32, usize, u32)> {
        let lo = (bounds.min - self.origin) * self.to_cells;
        let hi = (bounds.max - self.origin) * self.to_cells;
        let extent = bounds.extent();
        let mut best: Option<(u32, usize, u32)> = None;
        for axis in 0..3 {
            let last = (1u32 << LEVELS) - 1;
            let (a, b) = ((lo[axis] as u32).min(last), (hi[axis] as u32).min(last));
            if a != b {
                let level = 31 - (a ^ b).leading_zeros();
                if best.is_none_or(|(l, k, _)| level > l || (level == l && extent[axis] > extent[k])) {
                    best = Some((level, axis, b));
                }
            }
        }
        best
    }
}

/// Priority of splitting: cube root of the superfluous area of the box, weighted by the level of the plane
/// that crosses it (Karras, Aila, equation 3).
fn priority(mesh: &Mesh, grid: &Grid, r: &Reference) -> f32 {
    let bounds = r.bounds();
    let Some((level, _, _)) = grid.crossing(bounds) else { return 0.0 };
    let [a, b, c] = mesh.corners(r.triangle());
    let cross = (b - a).cross(c - a).abs();
    // Twice the sum of the triangle's projected areas is the least area of boxes around its parts.
    let superfluous = bounds.half_area() - 0.5 * (cross.x + cross.y + cross.z);
    let weight = libm::ldexpf(superfluous.max(0.0), level as i32 - LEVELS as i32);
    libm::cbrtf(weight)
}
