//! Cutting of large triangles. The detail of the scene is at the origin ([`super::fit`]), and no piece is
//! much larger than its distance from the detail. Points on a piece then are as precise as their distance
//! requires.
//!
//! The planes x, y, z = ±16 · 4^k cut every triangle that crosses them. The cut of an edge depends only on
//! its ends and the plane, so neighbours agree to the bit and no gap opens.

use glam::DVec3;

/// Distance of the first planes; the size of the detail is about 1.
const NEAREST: f64 = 16.0;

/// Ratio of the distances of successive planes.
const STEP: f64 = 4.0;

/// Planes on each side; the last, at 16 · 4^15, is beyond every scene.
const PLANES: i32 = 16;

/// Most pieces of a scene; scenes of very many large triangles are not cut.
const MOST: f64 = 1e6;

/// A corner of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    pub(super) position: DVec3,
    /// Barycentric coordinates in the triangle.
    pub(super) weights: DVec3,
}

/// The planes between two coordinates.
fn planes(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let all = (0..PLANES).flat_map(|k| {
        let distance = NEAREST * STEP.powi(k);
        [-distance, distance]
    });
    all.filter(move |at| low < *at && *at < high)
}

fn extent(corners: [DVec3; 3]) -> [DVec3; 2] {
    let [p, q, r] = corners;
    [p.min(q).min(r), p.max(q).max(r)]
}

/// Upper bound of the number of pieces of a triangle; 1 if it is not cut.
pub(super) fn count(corners: [DVec3; 3]) -> f64 {
    let [low, high] = extent(corners);
    (0..3).map(|axis| 1.0 + planes(low[axis], high[axis]).count() as f64).product()
}

/// True if this many pieces of a scene are cut.
pub(super) fn is_affordable(pieces: f64) -> bool {
    pieces <= MOST
}

/// The convex pieces of a triangle, with its winding.
pub(super) fn pieces(corners: [DVec3; 3]) -> Vec<Vec<Corner>> {
    let [low, high] = extent(corners);
    let corner = |i: usize| Corner { position: corners[i], weights: DVec3::AXES[i] };
    let mut pieces = vec![vec![corner(0), corner(1), corner(2)]];
    for axis in 0..3 {
        for at in planes(low[axis], high[axis]) {
            pieces = pieces.into_iter().flat_map(|piece| cut(piece, axis, at)).collect();
        }
    }
    pieces
}

/// The parts of a convex polygon below and above a plane.
fn cut(polygon: Vec<Corner>, axis: usize, at: f64) -> Vec<Vec<Corner>> {
    let height = |corner: &Corner| corner.position[axis] - at;
    if polygon.iter().all(|corner| height(corner) <= 0.0)
        || polygon.iter().all(|corner| height(corner) >= 0.0)
    {
        return vec![polygon];
    }
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        if height(a) <= 0.0 {
            below.push(*a);
        }
        if height(a) >= 0.0 {
            above.push(*a);
        }
        if height(a) * height(b) < 0.0 {
            let crossing = crossing(a, b, axis, at);
            below.push(crossing);
            above.push(crossing);
        }
    }
    vec![below, above]
}

/// Intersection of an edge with a plane; the same in both directions of the edge.
fn crossing(a: &Corner, b: &Corner, axis: usize, at: f64) -> Corner {
    let is_first = a.position.to_array() < b.position.to_array();
    let (a, b) = if is_first { (a, b) } else { (b, a) };
    let part = (at - a.position[axis]) / (b.position[axis] - a.position[axis]);
    let mut position = a.position + part * (b.position - a.position);
    position[axis] = at;
    Corner { position, weights: a.weights + part * (b.weights - a.weights) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn area(polygon: &[Corner]) -> f64 {
        let fan = polygon.windows(2).skip(1);
        let cross =
            fan.map(|w| (w[0].position - polygon[0].position).cross(w[1].position - polygon[0].position));
        0.5 * cross.sum::<DVec3>().length()
    }

    #[test]
    fn pieces_cover_the_triangle_and_are_small_near_the_origin() {
        let corners =
            [DVec3::new(-10.0, -1.0, -3e6), DVec3::new(-5.0, 7.0, 1e7), DVec3::new(2e7, -30.0, 10.0)];
        let whole = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
        let pieces = pieces(corners);
        assert!(pieces.len() > 50 && pieces.len() as f64 <= count(corners), "{}", pieces.len());
        let sum: f64 = pieces.iter().map(|piece| area(piece)).sum();
        assert!((sum / whole - 1.0).abs() < 1e-12);
        for piece in &pieces {
            let nearest = piece.iter().map(|c| c.position.abs().max_element()).fold(f64::INFINITY, f64::min);
            let size = piece.iter().map(|c| c.position.distance(piece[0].position)).fold(0.0, f64::max);
            assert!(size < 16.0 * nearest.max(NEAREST), "{size} {nearest}");
            for corner in piece {
                let back = (0..3).map(|i| corner.weights[i] * corners[i]).sum::<DVec3>();
                assert!(back.distance(corner.position) < 1e-7);
            }
        }
        let small = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!((count(small), self::pieces(small).len()), (1.0, 1));
    }

    #[test]
    fn neighbours_have_equal_cuts() {
        let at = |x: f64, z: f64| DVec3::new(x, 0.3 * x - 0.7 * z, z);
        let [a, b, c, d] = [at(-1e7, -3e3), at(77.3, 5e6), at(3e6, -11.0), at(9e6, 8e6)];
        // Along the edge from b to c, in both directions.
        let mut sides: HashMap<[u64; 3], u32> = HashMap::new();
        for (triangle, apart) in [([a, b, c], 0), ([c, b, d], 2)] {
            for corner in pieces(triangle).into_iter().flatten().filter(|corner| corner.weights[apart] == 0.0)
            {
                let key = corner.position.to_array().map(f64::to_bits);
                *sides.entry(key).or_default() |= if apart == 0 { 1 } else { 2 };
            }
        }
        assert!(sides.len() > 15 && sides.values().all(|sides| *sides == 3), "{sides:?}");
    }
}
