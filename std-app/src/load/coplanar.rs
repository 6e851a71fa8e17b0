//! Two triangles in one plane: keys of rounded planes, and the common area.

use glam::{DVec2, DVec3};
use halflight_core::sampling::mix;
use halflight_core::scene::Triangle;

/// Relative error of a coordinate that is rounded to f32.
const ROUNDING: f64 = 0.5 * f32::EPSILON as f64;
/// Distance of a corner from the plane of another triangle, in rounding errors of the coordinates.
pub(super) const MOST_ERRORS: f64 = 2.0;
/// Smallest part of the smaller triangle that counts as an overlap. Neighbours overlap by rounding.
const LEAST_PART: f64 = 1e-3;
/// Steps of a component of a normal, and of the distance of a plane from the origin.
const STEPS: [f64; 4] = [512.0, 512.0, 512.0, 2048.0];

/// Two triangles that overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// Indices, ascending.
    pub(super) triangles: [u32; 2],
    /// Their fronts are on the same side.
    pub(super) same_front: bool,
    /// Part of each that the other covers.
    pub(super) covered: [f64; 2],
}

/// A triangle in its plane.
pub(super) struct Face {
    index: u32,
    corners: [DVec3; 3],
    normal: DVec3,
    /// Twice the area.
    area: f64,
    /// Its box, with a margin for rounding.
    low: DVec3,
    high: DVec3,
}

impl Face {
    pub(super) fn new(index: u32, triangle: &Triangle, positions: &[[f32; 3]]) -> Option<Self> {
        let corners = triangle.vertices.map(|v| DVec3::from(positions[v as usize].map(f64::from)));
        let [p, q, r] = corners;
        let area = (q - p).cross(r - p);
        let normal = area.try_normalize()?;
        let (low, high) = (p.min(q).min(r), p.max(q).max(r));
        let slack = DVec3::splat(MOST_ERRORS * ROUNDING * low.abs().max(high.abs()).max_element());
        let (low, high) = (low - slack, high + slack);
        Some(Self { index, corners, normal, area: area.length(), low, high })
    }

    /// Largest magnitude of a coordinate.
    fn coordinates(&self) -> f64 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    /// Calls `each` with the keys of the rounded plane, equal on both sides; several where rounding may
    /// decide for another.
    pub(super) fn for_each_plane(&self, mut each: impl FnMut(u64)) {
        let longest = (self.high - self.low).length();
        let tilt = 2.0 * MOST_ERRORS * ROUNDING * self.coordinates() * longest / self.area;
        let values = [self.normal.x, self.normal.y, self.normal.z, self.normal.dot(self.corners[0])];
        let shift = (tilt + MOST_ERRORS * ROUNDING) * self.coordinates();
        let (mut lower, mut upper, mut several) = ([0i64; 4], [0i64; 4], 0usize);
        for i in 0..4 {
            let error = (STEPS[i] * if i < 3 { tilt } else { shift }).min(0.5);
            (lower[i], upper[i]) =
                (rounded(STEPS[i] * values[i] - error), rounded(STEPS[i] * values[i] + error));
            several |= usize::from(lower[i] != upper[i]) << i;
        }
        for choice in (0..16).filter(|choice| choice & !several == 0) {
            let mut cell = lower;
            for i in 0..4 {
                cell[i] = if choice >> i & 1 == 0 { lower[i] } else { upper[i] };
            }
            let sign = cell.iter().find(|step| **step != 0).map_or(1, |step| step.signum());
            each(cell.iter().fold(0, |hash, step| mix(hash ^ (sign * step) as u64)));
        }
    }

    /// The pair with a triangle in the same plane that shares some of it.
    pub(super) fn overlap(&self, other: &Face) -> Option<Pair> {
        let (first, second) = if self.index < other.index { (self, other) } else { (other, self) };
        let (large, small) = if self.area >= other.area { (self, other) } else { (other, self) };
        let tolerance = MOST_ERRORS * ROUNDING * large.coordinates().max(small.coordinates());
        let height = |p: &DVec3| (*p - large.corners[0]).dot(large.normal);
        if small.corners.iter().any(|p| height(p).abs() > tolerance) {
            return None;
        }
        let common = large.common_area(small);
        let pair = Pair {
            triangles: [first.index, second.index],
            same_front: self.normal.dot(other.normal) > 0.0,
            covered: [common / first.area, common / second.area],
        };
        (common >= LEAST_PART * small.area).then_some(pair)
    }

    /// Twice the area of the intersection with a triangle in the same plane, seen along the axis in which the
    /// plane extends least, over the same of a whole (Sutherland and Hodgman 1974).
    fn common_area(&self, other: &Face) -> f64 {
        let axis = longest_axis(self.normal);
        let origin = self.corners[0];
        let flat = |p: DVec3| {
            DVec2::new(p[(axis + 1) % 3] - origin[(axis + 1) % 3], p[(axis + 2) % 3] - origin[(axis + 2) % 3])
        };
        let [corners, others] = [self.corners, other.corners].map(|corners| corners.map(flat));
        let side = self.normal[axis].signum();
        let height_of = |i: usize| {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            move |p: DVec2| side * (b - a).perp_dot(p - a)
        };
        // Neighbours lie on different sides of an edge.
        if (0..3).any(|i| others.iter().all(|p| height_of(i)(*p) <= 0.0)) {
            return 0.0;
        }
        let mut polygon = others.to_vec();
        for i in 0..3 {
            let height = height_of(i);
            let mut inside = Vec::with_capacity(polygon.len() + 1);
            for (j, &p) in polygon.iter().enumerate() {
                let q = polygon[(j + 1) % polygon.len()];
                let (at_p, at_q) = (height(p), height(q));
                if at_p >= 0.0 {
                    inside.push(p);
                }
                if (at_p < 0.0) != (at_q < 0.0) {
                    inside.push(p + (q - p) * (at_p / (at_p - at_q)));
                }
            }
            polygon = inside;
        }
        let fan =
            polygon.windows(2).skip(1).map(|pair| (pair[0] - polygon[0]).perp_dot(pair[1] - polygon[0]));
        fan.sum::<f64>().abs() / self.normal[axis].abs()
    }
}

/// The nearest whole number.
fn rounded(x: f64) -> i64 {
    (x + 0.5_f64.copysign(x)) as i64
}

/// The axis of the largest component.
pub(super) fn longest_axis(size: DVec3) -> usize {
    (0..3).fold(0, |most, i| if size[i].abs() > size[most].abs() { i } else { most })
}
