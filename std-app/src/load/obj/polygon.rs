//! Triangulation of polygons by ear clipping (Meisters 1975; earcut), in the coordinate plane in which the
//! polygon has the largest area. Exact for simple polygons, concave ones included. All decisions are signs of
//! sums of products, so a scale by a power of two changes none.

use crate::load::notes::Notes;
use earcut::Earcut;

/// Larger polygons are cut as a fan, with a note: those that cross themselves take quadratic time.
const MOST_CORNERS: usize = 1 << 13;

/// Relative difference of areas up to which triangles cover a polygon: their sum is rounded.
const ROUNDING: f64 = 1e-9;

/// Adds the triangles of consecutive faces. `arities`: number of corners of each face; empty if all are
/// triangles.
pub(super) fn triangulate(
    positions: &[[f64; 3]],
    indices: &[u32],
    arities: &[u32],
    triangles: &mut Vec<[u32; 3]>,
    notes: &mut Notes,
) {
    if arities.is_empty() {
        return triangles.extend_from_slice(indices.as_chunks().0);
    }
    triangles.reserve(indices.len() - 2 * arities.len());
    let mut rest = indices;
    for &arity in arities {
        let (face, later) = rest.split_at(arity as usize);
        rest = later;
        match *face {
            [a, b, c] => triangles.push([a, b, c]),
            _ => polygon(positions, face, triangles, notes),
        }
    }
}

fn polygon(positions: &[[f64; 3]], face: &[u32], triangles: &mut Vec<[u32; 3]>, notes: &mut Notes) {
    let point = |v: u32| positions[v as usize];
    // Repeated corners have no area.
    let mut ring = face.to_vec();
    ring.dedup_by(|v, last| point(*v) == point(*last));
    while ring.len() > 1 && point(ring[0]) == point(ring[ring.len() - 1]) {
        ring.pop();
    }
    if ring.iter().flat_map(|&v| point(v)).any(|x| !x.is_finite()) {
        return notes.add(1, "polygon with a corner that is not finite left out");
    }
    if ring.len() < 3 {
        return notes.add(1, "polygon without area left out");
    }
    let points = flatten(&ring.iter().map(|&v| point(v)).collect::<Vec<_>>());
    let area = |[a, b, c]: [usize; 3]| signed_area(points[a], points[b], points[c]);
    // Most polygons are quads that this diagonal divides.
    if ring.len() == 4 && [[3, 0, 1], [1, 2, 3]].into_iter().all(|half| area(half) > 0.0) {
        return triangles.extend([[3, 0, 1], [1, 2, 3]].map(|half| half.map(|i| ring[i])));
    }
    if ring.len() > MOST_CORNERS {
        notes.add(1, format!("polygon of more than {MOST_CORNERS} corners is cut as a fan"));
        return triangles.extend(ring.windows(2).skip(1).map(|pair| [ring[0], pair[0], pair[1]]));
    }
    let mut cut: Vec<usize> = Vec::new();
    Earcut::new().earcut(points.iter().copied(), &[], &mut cut);
    let cut: &[[usize; 3]] = cut.as_chunks().0;
    let (covered, whole) = (cut.iter().map(|corners| area(*corners)), fan_area(&points));
    if (covered.map(f64::abs).sum::<f64>() - whole).abs() > ROUNDING * whole {
        notes.add(1, "polygon that crosses itself is cut as well as it can be");
    }
    triangles.extend(cut.iter().map(|corners| corners.map(|i| ring[i])));
}

/// Corners without the coordinate in which the area vector (Newell's formula) is largest, counter-clockwise.
fn flatten(corners: &[[f64; 3]]) -> Vec<[f64; 2]> {
    let origin = corners[0];
    let relative = |p: [f64; 3]| [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]];
    let mut area = [0.0; 3];
    for (i, &p) in corners.iter().enumerate() {
        let (p, q) = (relative(p), relative(corners[(i + 1) % corners.len()]));
        for (axis, sum) in area.iter_mut().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += p[u] * q[v] - p[v] * q[u];
        }
    }
    let larger = |a: usize, b: usize| if area[b].abs() > area[a].abs() { b } else { a };
    let axis = larger(larger(0, 1), 2);
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if area[axis] < 0.0 {
        (u, v) = (v, u);
    }
    corners.iter().map(|&p| relative(p)).map(|p| [p[u], p[v]]).collect()
}

/// Twice the signed area of a triangle; positive if counter-clockwise.
fn signed_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Twice the signed area of a polygon.
fn fan_area(points: &[[f64; 2]]) -> f64 {
    points.windows(2).skip(1).map(|pair| signed_area(points[0], pair[0], pair[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles_of(
        positions: &[[f64; 3]],
        indices: &[u32],
        arities: &[u32],
        notes: &mut Notes,
    ) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        triangulate(positions, indices, arities, &mut triangles, notes);
        triangles
    }

    fn cut(corners: &[[f64; 3]]) -> (Vec<[u32; 3]>, f64, Vec<String>) {
        let mut notes = Notes::default();
        let indices: Vec<u32> = (0..corners.len() as u32).collect();
        let triangles = triangles_of(corners, &indices, &[corners.len() as u32], &mut notes);
        let flat = flatten(corners);
        let areas = triangles
            .iter()
            .map(|t| signed_area(flat[t[0] as usize], flat[t[1] as usize], flat[t[2] as usize]));
        let areas: Vec<f64> = areas.collect();
        assert!(areas.iter().all(|&a| a >= 0.0), "reversed triangle: {areas:?}");
        (triangles, areas.iter().sum::<f64>() / 2.0, notes.sentences())
    }

    #[test]
    fn convex_and_concave_quads_are_exact() {
        let square = [[0., 0., 5.], [1., 0., 5.], [1., 1., 5.], [0., 1., 5.]];
        let (triangles, area, notes) = cut(&square);
        assert_eq!((triangles.len(), area, notes.len()), (2, 1.0, 0));
        for reflex in 0..4 {
            // Arrowhead with reflex corner `reflex`.
            let mut arrow = [[0., 0., 0.], [4., 1., 0.], [0., 2., 0.], [1., 1., 0.]];
            arrow.rotate_right((reflex + 1) % 4);
            let (triangles, area, notes) = cut(&arrow);
            assert_eq!((triangles.len(), area, notes.len()), (2, 3.0, 0));
        }
    }

    #[test]
    fn comb_is_exact_in_any_plane() {
        // Area 2 n + n of a comb with n teeth.
        let teeth = 20;
        let mut comb = Vec::new();
        comb.push([2.0 * teeth as f64, 0.0]);
        for i in (0..teeth).rev() {
            comb.extend([[2. * i as f64 + 1.0, 2.0], [2. * i as f64, 0.5]]);
        }
        comb.push([0.0, -1.0]);
        comb.push([2.0 * teeth as f64, -1.0]);
        let expected = {
            let shoelace = |i: usize| {
                comb[i][0] * comb[(i + 1) % comb.len()][1] - comb[i][1] * comb[(i + 1) % comb.len()][0]
            };
            (0..comb.len()).map(shoelace).sum::<f64>() / 2.0
        };
        for axis in 0..3 {
            let embed = |p: &[f64; 2]| {
                let mut q = [3.0; 3];
                (q[(axis + 1) % 3], q[(axis + 2) % 3]) = (p[0], p[1]);
                q
            };
            let mut corners: Vec<_> = comb.iter().map(embed).collect();
            assert_eq!(cut(&corners).1, expected);
            corners.reverse();
            assert_eq!(cut(&corners).1, expected);
        }
    }

    #[test]
    fn degenerate_polygons_terminate() {
        let twice = [[0., 0., 0.], [0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [1., 1., 0.], [0., 0., 0.]];
        assert_eq!(cut(&twice).0.len(), 1);
        let line = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [3., 0., 0.]];
        cut(&line);
        let point = [[1.; 3]; 5];
        assert_eq!(cut(&point).2, ["polygon without area left out"]);
        let mut notes = Notes::default();
        let bad = [[0., 0., 0.], [f64::NAN, 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        assert!(triangles_of(&bad, &[0, 1, 2, 3], &[4], &mut notes).is_empty());
        let bow = [[0., 0., 0.], [1., 1., 0.], [1., 0., 0.], [0., 1., 0.]];
        triangles_of(&bow, &[0, 1, 2, 3], &[4], &mut notes);
    }

    #[test]
    fn polygons_with_many_corners_are_exact_or_noted() {
        let count = MOST_CORNERS;
        let circle = |i: usize, radius: f64| {
            let angle = i as f64 / count as f64 * core::f64::consts::TAU;
            [radius * angle.cos(), radius * angle.sin(), 1.0]
        };
        let gear: Vec<_> = (0..count).map(|i| circle(i, 1.0 + (i / 4 % 2) as f64)).collect();
        let (triangles, area, notes) = cut(&gear);
        let exact = fan_area(&flatten(&gear)) / 2.0;
        assert!((area - exact).abs() < ROUNDING * exact && notes.is_empty(), "{area} of {exact}");
        assert!(triangles.len() <= count - 2);
        // Every edge crosses nearly all others.
        let star: Vec<_> = (0..count - 1).map(|i| circle(i * (count / 2 - 1) % (count - 1), 1.0)).collect();
        let mut notes = Notes::default();
        let corners: Vec<u32> = (0..count as u32 - 1).collect();
        triangles_of(&star, &corners, &[count as u32 - 1], &mut notes);
        assert_eq!(notes.sentences(), ["polygon that crosses itself is cut as well as it can be"]);
        let wild: Vec<_> = (0..count).map(|i| circle(i * i * 7919 % count, (i % 97) as f64)).collect();
        triangles_of(&wild, &(0..count as u32).collect::<Vec<_>>(), &[count as u32], &mut notes);
    }
}
