//! Conservative rasterisation of charts (Hasselgren et al. 2005), in f64: the texels that a bilinear fetch
//! inside a chart reads, each with the triangle at its centre or nearest to it.

use super::charts::{ChartTriangle, Charts};
use glam::DVec2;

/// No triangle.
pub(super) const EMPTY: u32 = u32::MAX;

/// Half the side of the square around the centre of a texel in which a bilinear fetch reads it.
const REACH: f64 = 1.0;

/// Texels between two calls of a watch.
const WATCHED: u32 = 1 << 16;

/// Function of the fraction of the work that is done; false ends it.
pub type Watch<'w> = &'w mut dyn FnMut(f64) -> bool;

/// Distance of the owner of a texel that is known to overlap.
const COUNTED: f64 = -1.0;

/// Bytes of a texel while a map is rasterised.
pub(super) const BYTES_OF_TEXEL: usize = size_of::<u32>() + size_of::<f64>() + 1;

/// Charts in texels.
pub(super) struct Raster<'a> {
    charts: &'a Charts,
    size: [usize; 2],
}

/// The triangles of all texels.
pub(super) struct Owners {
    /// Index of the triangle of each texel in [`Charts::triangles`], or [`EMPTY`].
    pub(super) triangles: Vec<u32>,
    /// Texels that fetches inside two charts read.
    pub(super) shared: usize,
    /// Texels whose centre lies in two triangles, and the first of these.
    pub(super) overlaps: Option<(usize, [usize; 2])>,
}

impl<'a> Raster<'a> {
    pub(super) fn new(charts: &'a Charts, size: [u32; 2]) -> Self {
        Self { charts, size: size.map(|side| side as usize) }
    }

    /// The triangle at or nearest to the point at `offset` (0 to 1) in each texel, among the triangles of
    /// charts that `may_own(texel, chart)`. `watch` is called now and then with the fraction of the triangles
    /// that are done; `None` if it returns false.
    pub(super) fn owners(
        &self,
        offset: DVec2,
        may_own: impl Fn(usize, u32) -> bool,
        watch: Watch,
    ) -> Option<Owners> {
        let [width, height] = self.size;
        let triangles = &self.charts.triangles;
        let mut owners = vec![EMPTY; width * height];
        let mut distances = vec![f64::INFINITY; width * height];
        let mut is_shared = vec![false; width * height];
        let mut overlaps: Option<(usize, [usize; 2])> = None;
        let mut unwatched = WATCHED;
        for (number, triangle) in (0..).zip(triangles) {
            let mut is_wanted = true;
            self.for_texels(triangle, |[x, y]| {
                unwatched -= 1;
                if unwatched == 0 {
                    unwatched = WATCHED;
                    is_wanted = is_wanted && watch(f64::from(number) / triangles.len() as f64);
                }
                if !is_wanted {
                    return;
                }
                let texel = y * width + x;
                if !may_own(texel, triangle.chart) {
                    return;
                }
                let point = DVec2::new(x as f64, y as f64) + offset;
                let distance = distance(triangle, point);
                let owner = owners[texel];
                if owner != EMPTY {
                    is_shared[texel] |= triangles[owner as usize].chart != triangle.chart;
                    if distance == 0.0 && distances[texel] == 0.0 {
                        overlaps.get_or_insert((0, [x, y])).0 += 1;
                        distances[texel] = COUNTED;
                    }
                }
                if distance < distances[texel] {
                    (owners[texel], distances[texel]) = (number, distance);
                }
            });
            if !is_wanted {
                return None;
            }
        }
        let shared = is_shared.into_iter().filter(|is_shared| *is_shared).count();
        Some(Owners { triangles: owners, shared, overlaps })
    }

    /// Calls `visit` with the texels that a fetch inside `triangle` reads, row by row.
    fn for_texels(&self, triangle: &ChartTriangle, mut visit: impl FnMut([usize; 2])) {
        let [a, b, c] = triangle.corners;
        for y in reached([a.min(b).min(c).y, a.max(b).max(c).y], self.size[1]) {
            let centre = y as f64 + 0.5;
            for x in reached(extent(&triangle.corners, [centre - REACH, centre + REACH]), self.size[0]) {
                visit([x, y]);
            }
        }
    }
}

/// The texels of a side whose centres are nearer than [`REACH`] to an interval.
fn reached([low, high]: [f64; 2], side: usize) -> core::ops::Range<usize> {
    let first = (low - 0.5 - REACH).floor() + 1.0;
    let end = (high - 0.5 + REACH).ceil();
    // Casts of numbers below 0 give 0.
    first as usize..(end as usize).min(side)
}

/// Lowest and highest x of a triangle between two rows.
fn extent(corners: &[DVec2; 3], [low, high]: [f64; 2]) -> [f64; 2] {
    let mut extent = [f64::INFINITY, f64::NEG_INFINITY];
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let [start, end] = match a.y == b.y {
            true if (low..=high).contains(&a.y) => [0.0, 1.0],
            true => continue,
            false => [low, high].map(|y| (y - a.y) / (b.y - a.y)),
        };
        let (start, end) = (start.min(end).max(0.0), start.max(end).min(1.0));
        for part in [start, end].into_iter().filter(|_| start <= end) {
            let x = a.x + part * (b.x - a.x);
            extent = [extent[0].min(x), extent[1].max(x)];
        }
    }
    extent
}

/// Square of the distance from a point to a triangle; 0 inside.
fn distance(triangle: &ChartTriangle, point: DVec2) -> f64 {
    match is_inside(triangle, point) {
        true => 0.0,
        // A point on a border that is not its own is outside.
        false => nearest_on_border(&triangle.corners, point).distance_squared(point).max(f64::MIN_POSITIVE),
    }
}

/// True if a point is in a triangle. On a common edge it is in one of the triangles alone.
fn is_inside(triangle: &ChartTriangle, point: DVec2) -> bool {
    let [a, b, c] = triangle.corners;
    let edges = if triangle.area() > 0.0 { [(a, b), (b, c), (c, a)] } else { [(a, c), (c, b), (b, a)] };
    edges.into_iter().all(|edge| is_left(edge, point))
}

/// True if a point is to the left of an edge. Both directions of an edge give opposite results, also on it.
fn is_left((a, b): (DVec2, DVec2), point: DVec2) -> bool {
    let is_ascending = a.to_array() < b.to_array();
    let (low, high) = if is_ascending { (a, b) } else { (b, a) };
    ((high - low).perp_dot(point - low) >= 0.0) == is_ascending
}

/// Weights of the second and third corner at the point of a triangle that is nearest to `point`, which is
/// kept off the border, where other surfaces begin.
pub(super) fn weights(triangle: &ChartTriangle, point: DVec2) -> [f32; 2] {
    let [a, b, c] = triangle.corners;
    let nearest = match is_inside(triangle, point) {
        true => point,
        false => nearest_on_border(&triangle.corners, point),
    };
    let part = |from: DVec2, to: DVec2| (from - nearest).perp_dot(to - nearest) / triangle.area();
    let weights = [part(b, c), part(c, a), part(a, b)].map(|weight| weight.max(LEAST_WEIGHT));
    let sum: f64 = weights.iter().sum();
    [weights[1], weights[2]].map(|weight| (weight / sum) as f32)
}

/// Least weight of a corner at a point of a triangle.
const LEAST_WEIGHT: f64 = 1e-4;

fn nearest_on_border(corners: &[DVec2; 3], point: DVec2) -> DVec2 {
    let on_edge = |i: usize| {
        let (a, along) = (corners[i], corners[(i + 1) % 3] - corners[i]);
        a + ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0) * along
    };
    let [first, second, third] = [0, 1, 2].map(on_edge);
    let nearer = |a: DVec2, b: DVec2| {
        if b.distance_squared(point) < a.distance_squared(point) { b } else { a }
    };
    nearer(nearer(first, second), third)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of a lattice over a square of 24 texels, whose inner vertices are moved.
    fn lattice(is_mirrored: bool) -> Charts {
        let vertex = |x: u32, y: u32| {
            let hash = |i: u32| f64::from((x * 7 + y * 13 + i).wrapping_mul(2_654_435_769) >> 16) / 65536.0;
            let is_inner = (1..12).contains(&x) && (1..12).contains(&y);
            let moved = if is_inner { DVec2::new(hash(0), hash(5)) - 0.5 } else { DVec2::ZERO };
            2.0 * (DVec2::new(f64::from(x), f64::from(y)) + 0.4 * moved)
        };
        let mut triangles = Vec::new();
        for (x, y) in (0..144).map(|i| (i % 12, i / 12)) {
            let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x + 1, y + 1), vertex(x, y + 1)];
            for corners in [[a, b, c], [a, c, d]] {
                let corners = if is_mirrored { [corners[0], corners[2], corners[1]] } else { corners };
                triangles.push(ChartTriangle { triangle: 0, chart: 0, corners });
            }
        }
        Charts { triangles, count: 1, flat: 0 }
    }

    #[test]
    fn points_of_a_mesh_are_in_one_triangle_each() {
        for is_mirrored in [false, true] {
            let charts = lattice(is_mirrored);
            for offset in [DVec2::ZERO, DVec2::splat(0.5)] {
                let owners =
                    Raster::new(&charts, [24, 24]).owners(offset, |_, _| true, &mut |_| true).unwrap();
                assert_eq!((owners.overlaps, owners.shared), (None, 0));
                let is_inside = |texel: usize| {
                    let point = DVec2::new((texel % 24) as f64, (texel / 24) as f64) + offset;
                    is_inside(&charts.triangles[owners.triangles[texel] as usize], point)
                };
                let inner = (0..576).filter(|texel| texel % 24 > 0 && texel / 24 > 0);
                assert!(inner.into_iter().all(is_inside));
            }
        }
    }

    #[test]
    fn a_watch_ends_the_work_within_a_triangle() {
        let corners = [DVec2::ZERO, DVec2::new(1024.0, 0.0), DVec2::new(0.0, 1024.0)];
        let charts =
            Charts { triangles: vec![ChartTriangle { triangle: 0, chart: 0, corners }], count: 1, flat: 0 };
        let mut calls = 0;
        let mut watch = |_| {
            calls += 1;
            calls < 3
        };
        assert!(Raster::new(&charts, [1024; 2]).owners(DVec2::ZERO, |_, _| true, &mut watch).is_none());
        assert_eq!(calls, 3);
    }

    #[test]
    fn texels_in_several_triangles_are_counted_once() {
        let mut charts = lattice(false);
        let copies = [charts.triangles.clone(), charts.triangles.clone()].concat();
        charts.triangles.extend(copies);
        let owners =
            Raster::new(&charts, [24, 24]).owners(DVec2::splat(0.5), |_, _| true, &mut |_| true).unwrap();
        assert_eq!(owners.overlaps, Some((576, [0, 0])));
    }

    #[test]
    fn weights_are_those_of_the_nearest_point_off_the_border() {
        let corners = [DVec2::ZERO, DVec2::new(8.0, 0.0), DVec2::new(0.0, 4.0)];
        let triangle = ChartTriangle { triangle: 0, chart: 0, corners };
        let cases = [([2.0, 1.0], [0.25, 0.25]), ([4.0, -3.0], [0.5, 0.0]), ([-2.0, 9.0], [0.0, 1.0])];
        for (point, [u, v]) in cases {
            let [found_u, found_v] = weights(&triangle, point.into());
            assert!((found_u - u).abs() < 3e-4 && (found_v - v).abs() < 3e-4, "{point:?}");
            assert!(found_u.min(found_v).min(1.0 - found_u - found_v) > 0.5 * LEAST_WEIGHT as f32);
        }
    }
}
