//! Triangulation of polygons by ear clipping (Meisters 1975), in the coordinate plane in which the polygon
//! has the largest area. Exact for simple polygons, concave ones included. All decisions are signs of sums of
//! products, so a scale by a power of two changes none.

use crate::load::notes::Notes;

/// Larger polygons are cut as a fan, with a note: ear clipping takes quadratic time.
const MOST_CORNERS: usize = 4096;

/// Cuts without an ear before the rest of a polygon that crosses itself is cut as a fan.
const MOST_GUESSES: usize = 16;

/// Triangles of consecutive faces. `arities`: number of corners of each face; empty if all are triangles.
pub(super) fn triangulate(
    positions: &[[f64; 3]],
    indices: &[u32],
    arities: &[u32],
    notes: &mut Notes,
) -> Vec<[u32; 3]> {
    if arities.is_empty() {
        return indices.as_chunks().0.to_vec();
    }
    let mut triangles = Vec::with_capacity(indices.len() - 2 * arities.len());
    let mut rest = indices;
    for &arity in arities {
        let (face, later) = rest.split_at(arity as usize);
        rest = later;
        match *face {
            [a, b, c] => triangles.push([a, b, c]),
            _ => polygon(positions, face, &mut triangles, notes),
        }
    }
    triangles
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
    if ring.len() > MOST_CORNERS {
        notes.add(1, format!("polygon of more than {MOST_CORNERS} corners is cut as a fan"));
        return fan(&ring, triangles);
    }
    if !clip_ears(&ring, &points, triangles) {
        notes.add(1, "polygon that crosses itself is cut as well as it can be");
    }
}

fn fan(ring: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend(ring.windows(2).skip(1).map(|pair| [ring[0], pair[0], pair[1]]));
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

/// Cuts ears off until a triangle is left. `false` if the polygon is not simple and a corner without an ear
/// was cut.
fn clip_ears(ring: &[u32], points: &[[f64; 2]], triangles: &mut Vec<[u32; 3]>) -> bool {
    let mut left: Vec<usize> = (0..ring.len()).collect();
    let mut guesses = 0;
    let mut at = 0; // the corner to try next
    let mut tried = 0;
    while left.len() > 3 {
        let count = left.len();
        let (a, b, c) = (left[(at + count - 1) % count], left[at % count], left[(at + 1) % count]);
        let flat = signed_area(points[a], points[b], points[c]) == 0.0;
        let guess = tried >= count;
        if guess || is_ear(points, &left, [a, b, c]) {
            guesses += usize::from(guess);
            if guesses > MOST_GUESSES {
                fan(&left.iter().map(|&i| ring[i]).collect::<Vec<_>>(), triangles);
                return false;
            }
            if !flat || guess {
                triangles.push([ring[a], ring[b], ring[c]]);
            }
            left.remove(at % count);
            at = (at + count - 1) % count % (count - 1);
            tried = 0;
        } else {
            at = (at + 1) % count;
            tried += 1;
        }
    }
    if let [a, b, c] = left[..] {
        triangles.push([ring[a], ring[b], ring[c]]);
    }
    guesses == 0
}

/// True if corner `b` is convex and the triangle with its neighbours contains no other corner.
fn is_ear(points: &[[f64; 2]], left: &[usize], [a, b, c]: [usize; 3]) -> bool {
    let (pa, pb, pc) = (points[a], points[b], points[c]);
    if signed_area(pa, pb, pc) <= 0.0 {
        return false;
    }
    let inside = |p: [f64; 2]| {
        signed_area(pa, pb, p) >= 0.0 && signed_area(pb, pc, p) >= 0.0 && signed_area(pc, pa, p) >= 0.0
    };
    let corner = |p: [f64; 2]| p == pa || p == pb || p == pc;
    !left.iter().any(|&i| i != a && i != b && i != c && !corner(points[i]) && inside(points[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(corners: &[[f64; 3]]) -> (Vec<[u32; 3]>, f64, Vec<String>) {
        let mut notes = Notes::default();
        let indices: Vec<u32> = (0..corners.len() as u32).collect();
        let triangles = triangulate(corners, &indices, &[corners.len() as u32], &mut notes);
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
        assert!(triangulate(&bad, &[0, 1, 2, 3], &[4], &mut notes).is_empty());
        let bow = [[0., 0., 0.], [1., 1., 0.], [1., 0., 0.], [0., 1., 0.]];
        triangulate(&bow, &[0, 1, 2, 3], &[4], &mut notes);
    }
}
